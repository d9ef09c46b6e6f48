"""Bodies of other lengths, and wheels that stay round."""

from __future__ import annotations

import numpy as np
import pytest

from sumo3dviz_pt.library.vehicles.recipe import WheelPlace
from sumo3dviz_pt.library.vehicles.stretching import BodyStretch, round_wheels, stretched
from sumo3dviz_pt.model.geometry import Mesh
from sumo3dviz_pt.model.scene import Part, Prototype, VehicleLamp

TURN = np.linspace(0, 2 * np.pi, 12, endpoint=False)


def ring(x, y, radius=0.4):
    """A wheel's points as a fan."""
    points = np.column_stack(
        [x + radius * np.cos(TURN), np.full(12, y), radius + radius * np.sin(TURN)]
    )
    faces = np.column_stack([np.zeros(10, int), np.arange(1, 11), np.arange(2, 12)])
    return Mesh(points, faces)


def body():
    marks = np.array([[-d, 0.0, 1.0] for d in (0.0, 1.0, 3.0, 4.0, 7.0, 8.0, 10.0)])
    plain = Mesh(marks, np.array([[0, 1, 2], [3, 4, 5]]))
    parts = (Part(plain, "paint"), Part(ring(-1.5, 0.9), "rubber"), Part(ring(-8.5, -0.9), "rim"))
    lamps = (VehicleLamp("tail", (-10.0, 0.5, 0.8), (0.1, 0.1), np.pi),)
    return Prototype("truck", parts, parts, lamps)


@pytest.mark.parametrize("extra", [-2.0, 0.0, 1.5])
def test_only_the_stretch_gives(extra):
    made = stretched(body(), BodyStretch.to_length((3.0, 7.0), extra=extra), name="other")
    d = -made.parts[0].mesh.vertices[:, 0]
    share = (4.0 + extra) / 4.0
    np.testing.assert_allclose(
        d, [0, 1, 3, 3 + share, 7 + extra, 8 + extra, 10 + extra], atol=1e-12
    )
    assert made.lamps[0].at[0] == pytest.approx(-10.0 - extra)
    for k, shift in ((1, 0.0), (2, extra)):
        moved = made.parts[k].mesh.vertices - body().parts[k].mesh.vertices
        np.testing.assert_allclose(moved, np.broadcast_to([-shift, 0, 0], moved.shape), atol=1e-12)
    assert made.name == "other"
    assert len(made.far) == 3


def test_a_stretch_keeps_some_of_its_length():
    stretch = BodyStretch.to_length((3.0, 7.0), extra=-10.0)
    assert stretch.factor == 0.35
    assert stretch.gain == pytest.approx(-2.6)


@pytest.mark.parametrize("ratio", [0.8, 1.2])
def test_wheels_stay_round(ratio):
    wheels = (WheelPlace((-1.5, 0.9, 0.4), 0.4), WheelPlace((-8.5, -0.9, 0.4), 0.4))
    made = round_wheels(body(), wheels, ratio=ratio, name="x")
    for k, (x, _) in ((1, (-1.5, 0.9)), (2, (-8.5, -0.9))):
        drawn = made.parts[k].mesh.vertices * [ratio, 1.0, 1.0]
        away = np.hypot(drawn[:, 0] - ratio * x, drawn[:, 2] - 0.4)
        np.testing.assert_allclose(away, 0.4, rtol=1e-9)
    np.testing.assert_array_equal(made.parts[0].mesh.vertices, body().parts[0].mesh.vertices)
