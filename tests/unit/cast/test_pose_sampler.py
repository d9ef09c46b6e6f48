"""How road users of a fleet stand: wheels, springs, joints, lamps, and who rides in them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from analytic_motion import PathPiece

from sumo3dviz_pt.cast.fleet import build_fleet
from sumo3dviz_pt.cast.poses import SPRINGS, sway_at
from sumo3dviz_pt.job.settings import LagrangianCamera, VehicleSettings
from sumo3dviz_pt.model.traffic import VehicleType
from sumo3dviz_pt.model.trajectory import Trajectory
from sumo3dviz_pt.shot.cameras.riding import build_ride

TYPES = {
    kind.id: kind
    for kind in (
        VehicleType("car", "passenger", 4.6, 1.8, 1.47),
        VehicleType("bus", "bus", 18.0, 2.55, 3.05, "bus/flexible"),
        VehicleType("tram", "tram", 32.0, 2.4, 3.35),
        VehicleType("bike", "bicycle", 1.7, 0.65, 1.7),
        VehicleType("ped", "pedestrian", 0.215, 0.478, 1.719),
    )
}
BRAKING = PathPiece(speed=40.0, gain=-2.0, end=18.0)
BEND = PathPiece(speed=6.0, curvature=1 / 15.0, start=100.0)


def fleet_of(type_id, piece, *, suspension=True):
    kind = "person" if type_id == "ped" else "vehicle"
    users = [Trajectory("a", kind, type_id, (piece,))]
    return replace(build_fleet(users, TYPES, VehicleSettings(), seed=0), suspension=suspension)


def stance_of(fleet, *, full=True, ridden=False):
    return fleet.pose_sampler.stance(0, 9.0, full=full, ridden=ridden)


def parts_of(fleet, *, level="near", time=9.0):
    present = fleet.presence.at(time)
    (whole,) = fleet.wholes(present, np.array([0]))
    return list(fleet.parts(present, 0, whole, level=level, ridden=False))


def test_only_full_detail_has_wheels_that_turn_and_springs():
    fleet = fleet_of("car", BRAKING)
    full, plain, own = (stance_of(fleet, full=h, ridden=r) for h, r in ((1, 0), (0, 0), (0, 1)))
    assert full.wheels.shape == (4, 2) and full.sway.shape == (1, 4, 4)
    assert plain.wheels is None and plain.sway is None
    assert own.wheels is None and own.sway is not None
    stiff = stance_of(fleet_of("car", BRAKING, suspension=False))
    assert stiff.sway is None and stiff.wheels is not None


def test_buses_bend_at_every_level():
    fleet = fleet_of("bus", PathPiece(speed=6.0, curvature=1 / 15.0, start=100.0, length=18.0))
    headings = [
        [np.arctan2(*m.world_from_body.matrix[[1, 0], 0]) for m in parts_of(fleet, level=level)]
        for level in ("near", "far")
    ]
    np.testing.assert_allclose(headings[0], headings[1])
    front, rear = headings[0][:2]
    assert (front - rear + np.pi) % (2 * np.pi) - np.pi > 0.4
    full = stance_of(fleet)
    assert full.wheels.shape == (6, 2)
    np.testing.assert_array_equal(full.wheels[2:, 1], 0.0)
    assert (full.wheels[:2, 1] > 0.05).all()
    # Parts that are joined roll as one.
    np.testing.assert_array_equal(full.sway[0], full.sway[1])


def test_rails_and_people_have_no_springs():
    assert stance_of(fleet_of("tram", BEND), full=False, ridden=True).sway is None
    assert stance_of(fleet_of("ped", BEND), full=False, ridden=True).sway is None


def test_cyclists_lean_near_by_and_only_if_wanted():
    def roll(fleet, level):
        (body, *_) = parts_of(fleet, level=level)
        up = body.world_from_body.matrix[:3, 2]
        return float(np.arccos(up[2] / np.linalg.norm(up)))

    lean = np.arctan(36.0 / 15.0 / 9.81)
    fleet = fleet_of("bike", BEND)
    assert roll(fleet, "near") == pytest.approx(lean, abs=0.01)
    assert roll(fleet, "far") == 0.0
    assert roll(fleet_of("bike", BEND, suspension=False), "near") == 0.0


def test_feet_do_not_slide():
    piece = PathPiece(speed=1.3, curvature=0.1)
    fleet = fleet_of("ped", piece)
    stride = fleet.bodies[0].stride
    times = np.arange(3.0, 8.0, 0.04)
    phases = np.array([fleet.movers_at(t)[0].phase for t in times])
    steps = np.mod(np.diff(phases), 1.0) * stride
    np.testing.assert_allclose(steps, 1.3 * 0.04, atol=1e-9)
    assert fleet.movers_at(4.0)[0].effort == 1.0
    standing = fleet_of("ped", PathPiece(speed=0.0))
    assert {m.phase for t in (1.0, 9.0) for m in standing.movers_at(t)} == {
        standing.movers_at(5.0)[0].phase
    }
    assert standing.movers_at(5.0)[0].effort == 0.0


def test_the_drivers_view_nods_and_never_rolls():
    def view(piece, suspension):
        fleet = fleet_of("car", piece, suspension=suspension)
        camera = LagrangianCamera(mode="lagrangian", vehicle="a", view="driver")
        return build_ride(camera, fleet=fleet, left_hand=False).view_at(9.0).world_from_camera

    nod = sway_at(BRAKING, 9.0, springs=SPRINGS["car"]).pitch
    soft, stiff = view(BRAKING, True), view(BRAKING, False)
    pitch = [np.arcsin(each.matrix[2, 0]) for each in (soft, stiff)]
    assert pitch[0] - pitch[1] == pytest.approx(nod, abs=1e-4)
    assert nod < -0.005
    bent, rigid = view(BEND, True), view(BEND, False)
    assert abs(bent.matrix[2, 1]) < 1e-9, "the horizon stays level"
    assert 0.005 < np.linalg.norm(bent.position - rigid.position) < 0.1


def test_the_driver_of_a_bus_looks_where_the_front_goes():
    piece = PathPiece(speed=6.0, curvature=1 / 15.0, start=100.0, length=18.0)
    fleet = fleet_of("bus", piece)
    camera = LagrangianCamera(mode="lagrangian", vehicle="a", view="driver")
    view = build_ride(camera, fleet=fleet, left_hand=False).view_at(9.0)
    front = parts_of(fleet)[0].world_from_body.matrix[:2, 0]
    assert view.forward[:2] @ front / np.hypot(*front) > 0.98


def test_trams_show_no_turn_and_cars_do():
    class Corner(PathPiece):
        def point(self, ways):
            bend = np.clip(np.asarray(ways) / 8.0, 0.0, np.pi / 2)
            rest = np.maximum(np.asarray(ways) - 4.0 * np.pi, 0.0)
            x = 8.0 * np.sin(bend) + np.minimum(ways, 0.0)
            return np.stack([x, 8.0 * (1.0 - np.cos(bend)) + rest, 0.0 * x], axis=-1)

    piece = Corner(speed=5.0, start=-40.0)
    assert "left" in fleet_of("car", piece).pose_sampler.derived(0).spans
    assert "left" not in fleet_of("tram", piece).pose_sampler.derived(0).spans
