"""Trains stand on rails above ballast; everyone else stays where the log says."""

from __future__ import annotations

import numpy as np
import pytest

from sumo3dviz_pt.model.geometry import Transform
from sumo3dviz_pt.model.scene import Mover
from sumo3dviz_pt.shot.tracks import on_tracks

GREY = (0.3, 0.3, 0.3)


def carriages() -> list[Mover]:
    places = [(0.0, 0.0, 1.0), (-25.0, 0.0, 1.0)]
    return [
        Mover("vehicle:r", "carriage", Transform.from_pose(place, yaw=0.4), GREY, part=f"unit{k}")
        for k, place in enumerate(places)
    ]


def slope(places):
    return np.where(places[:, 0] < -10.0, 0.14, 0.0)


def test_each_carriage_stands_on_the_rails_below_it():
    first, second = on_tracks(carriages(), "rail", slope)
    assert first.world_from_body.position == pytest.approx([0.0, 0.0, 1.0])
    assert second.world_from_body.position == pytest.approx([-25.0, 0.0, 1.14])
    turned = second.world_from_body.matrix[:3, :3]
    assert turned == pytest.approx(carriages()[1].world_from_body.matrix[:3, :3])


@pytest.mark.parametrize(
    ("vclass", "rise"), [("tram", slope), ("passenger", slope), ("rail", None)]
)
def test_others_and_flush_tracks_are_left_alone(vclass, rise):
    parts = carriages()
    assert list(on_tracks(parts, vclass, rise)) == parts
