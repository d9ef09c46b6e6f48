"""Mirrors that a driver looks into: where they look, and that nothing is before them."""

from __future__ import annotations

import numpy as np
import pytest

from sumo3dviz_pt.library.vehicles.interior.mirrors import aimed, inner_mirror, outer_mirrors
from sumo3dviz_pt.model.geometry import area_vectors, unit

KINDS = {
    # flank, windscreen's foot and belt, the driver's eye
    "car": (0.92, -1.2, 0.95, (-2.12, 0.37, 1.2)),
    "van": (1.01, -0.72, 1.25, (-1.75, 0.42, 1.75)),
    "lorry": (1.275, -0.12, 1.35, (-0.95, 0.55, 2.45)),
    "bus": (1.275, -0.1, 1.15, (-0.95, 0.55, 1.95)),
}


def made(kind, side=1.0):
    """Pieces at both sides, and the eye."""
    flank, front, belt, eye = KINDS[kind]
    seen = np.array(eye) * [1.0, side, 1.0]
    return list(outer_mirrors(flank, front=front, belt=belt, eye=seen)), seen


def panes_of(pieces):
    return [mesh for material, mesh in pieces if material == "mirror"]


def shown(mesh, eye):
    """Where each vertex of a pane lets an eye look, unit, (n, 3)."""
    way = unit(mesh.vertices - eye)
    return way - 2.0 * (way * mesh.normals).sum(axis=1, keepdims=True) * mesh.normals


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("kind", KINDS)
def test_outer_mirrors_show_the_road_behind_and_the_flank(kind, side):
    pieces, eye = made(kind, side)
    panes = panes_of(pieces)
    assert len(panes) == (2 if kind == "car" else 4)
    first = [panes[0], panes[len(panes) // 2]]
    for pane, at in zip(first, (1.0, -1.0), strict=True):
        assert np.sign(pane.vertices[:, 1].mean()) == at
        way = shown(pane, eye)
        assert (way[:, 0] < -0.7).all(), "back"
        outwards = np.degrees(np.arctan2(at * way[:, 1], -way[:, 0]))
        upwards = np.degrees(np.arcsin(way[:, 2]))
        # The inner edge shows the vehicle's own side, the outer one the next lane.
        assert -14.0 < outwards.min() < -2.0 and 12.0 < outwards.max() < 32.0
        assert upwards.min() < -5.0 and 1.0 < upwards.max() < 20.0, "road and horizon"


@pytest.mark.parametrize("kind", ["van", "lorry", "bus"])
def test_wide_angle_panes_show_more(kind):
    pieces, eye = made(kind)
    main, wide = (np.ptp(shown(pane, eye)[:, 1]) for pane in panes_of(pieces)[:2])
    assert wide > 1.4 * main


@pytest.mark.parametrize("kind", KINDS)
def test_the_driver_need_not_look_too_far_aside(kind):
    pieces, eye = made(kind)
    way = panes_of(pieces)[0].vertices.mean(axis=0) - eye
    assert np.degrees(np.arctan2(way[1], way[0])) < 55.0


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("kind", KINDS)
def test_nothing_of_a_mirror_hides_its_panes(kind, side):
    pieces, eye = made(kind, side)
    others = [mesh for material, mesh in pieces if material != "mirror"]
    a, b, c = np.concatenate([mesh.vertices[mesh.faces] for mesh in others]).transpose(1, 0, 2)
    for pane in panes_of(pieces):
        middle = pane.vertices.mean(axis=0)
        for point in middle + 0.96 * (pane.vertices[::7] - middle):
            assert not hides(a, b, c, eye, point - eye)


def hides(a, b, c, eye, way):
    """Whether any triangle cuts the way from an eye (Moeller and Trumbore)."""
    across = np.cross(way, c - a)
    scale = ((b - a) * across).sum(axis=1)
    scale = np.where(np.abs(scale) > 1e-12, scale, np.inf)
    u = ((eye - a) * across).sum(axis=1) / scale
    normal = np.cross(eye - a, b - a)
    v = normal @ way / scale
    t = ((c - a) * normal).sum(axis=1) / scale
    return bool(((u >= 0) & (v >= 0) & (u + v <= 1) & (t > 1e-3) & (t < 0.999)).any())


def test_the_inner_mirror_is_plane_and_lies_in_a_usual_picture():
    eye = np.array(KINDS["car"][3])
    (pane,) = panes_of(inner_mirror(eye))
    assert np.ptp(pane.normals, axis=0).max() < 1e-6
    way = shown(pane, eye)
    np.testing.assert_allclose(way.mean(axis=0), [-1.0, 0.0, 0.0], atol=0.03)
    seen = pane.vertices - eye
    aside = np.degrees(np.arctan2(seen[:, 1], seen[:, 0]))
    up = np.degrees(np.arctan2(seen[:, 2], seen[:, 0]))
    assert np.abs(aside).max() < 30.0, "60 degrees wide"
    assert up.max() < 16.0, "and 9/16 as high, looking down by 2 degrees"


def test_panes_have_the_normals_of_their_faces():
    pieces, _ = made("lorry")
    for pane in panes_of(pieces):
        faces = unit(area_vectors(pane.vertices, pane.faces))
        mean = unit(pane.normals[pane.faces].mean(axis=1))
        assert (faces * mean).sum(axis=1).min() > 0.999
        np.testing.assert_allclose(np.linalg.norm(pane.normals, axis=1), 1.0)


def test_a_mirror_is_aimed_exactly():
    place, eye, towards = (
        np.array([1.0, 2.0, 0.3]),
        np.array([-0.5, 0.1, 0.8]),
        unit(np.array([-1.0, 0.2, -0.1])),
    )
    facing = -aimed(place, eye, towards).matrix[:3, 0]
    way = unit(place - eye)
    np.testing.assert_allclose(way - 2.0 * (way @ facing) * facing, towards, atol=1e-12)
