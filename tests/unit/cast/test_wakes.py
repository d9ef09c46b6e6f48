"""Wakes: behind ships that move, level on the water, and as long as the ship lets them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sumo3dviz_pt.cast.fleet import build_fleet
from sumo3dviz_pt.job.settings import VehicleSettings
from sumo3dviz_pt.library.vehicles.wake import wake, wake_name
from sumo3dviz_pt.model.traffic import VehicleType
from sumo3dviz_pt.model.trajectory import Motion, Trajectory


class Straight:
    """A ship that heads east."""

    begin, end = 0.0, 9.0

    def __init__(self, speed):
        self.speed = speed

    def sample(self, times):
        flat = np.zeros(len(times))
        places = np.column_stack([self.speed * times, flat, flat - 0.4])
        alive = np.ones(len(times), dtype=np.bool_)
        return Motion(alive, places, flat, flat, flat + self.speed, self.speed * times)

    def trail(self, times, distances):
        x = self.speed * times[:, None] - distances
        return np.stack([x, 0.0 * x, 0.0 * x - 0.4], axis=-1)


def shown(speed, vclass="ship", *, wet=True):
    kind = VehicleType("s", vclass, 30.0, 6.0, 5.0)
    ship = Trajectory("s", "vehicle", "s", (Straight(speed),))
    fleet = build_fleet([ship], {"s": kind}, VehicleSettings(), seed=1)
    fleet = fleet.with_wakes() if wet else fleet
    present = fleet.presence.at(4.0)
    (whole,) = fleet.wholes(present, np.arange(1))
    return fleet, list(fleet.parts(present, 0, whole, level="near", ridden=False))


def test_only_ships_that_move_have_a_wake():
    fleet, parts = shown(4.0)
    (foam,) = [part for part in parts if part.part == "wake"]
    assert foam.prototype in fleet.prototypes and foam.prototype in fleet.drawn(0).near
    assert foam.world_from_body.matrix[:3, 3] == pytest.approx([16.0, 0.0, -0.4])
    assert np.linalg.norm(foam.world_from_body.matrix[:3, :3], axis=0) == pytest.approx(1.0)
    assert "wake" not in {part.part for part in shown(0.1)[1]}
    dry, parts = shown(4.0, wet=False)
    assert "wake" not in {part.part for part in parts} and "wake" not in str(dry.drawn(0).near)
    assert not any("wake" in name for name in shown(9.0, "truck")[0].prototypes)


@given(st.floats(5.0, 250.0), st.floats(1.5, 40.0))
def test_foam_is_level_behind_the_bow_and_beside_the_hull(length, width):
    made = wake(length, width)
    points = made.parts[0].mesh.vertices
    assert made.name == wake_name(length, width)
    assert np.isfinite(points).all() and (points[:, 2] > 0.0).all() and points[:, 2].max() < 0.3
    assert -length - 2.3 * 40.0 < points[:, 0].min() and points[:, 0].max() < 0.5
