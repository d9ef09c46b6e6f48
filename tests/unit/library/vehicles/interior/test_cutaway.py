"""Opening bodies."""

import numpy as np
import pytest

from sumo3dviz_pt.library.vehicles.interior.cutaway import clip, cutaway
from sumo3dviz_pt.model.geometry import Mesh
from sumo3dviz_pt.model.scene import Part, Prototype

EYE = np.array([-2.1, 0.37, 1.2])


def box(length=4.0, width=1.8, height=1.5):
    corners = np.array([(x, y, z) for x in (-1, 0) for y in (-0.5, 0.5) for z in (0, 1)])
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = [tri for a, b, c, d in quads for tri in ((a, b, c), (a, c, d))]
    return Mesh(corners * (length, width, height), np.array(faces), uvs=corners[:, :2])


def area(mesh):
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    return np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2


@pytest.mark.parametrize("height", [-1.0, 0.0, 0.3, 0.7, 1.5, 2.0])
def test_clip_keeps_what_lies_below(height):
    mesh = box()
    rest, source = clip(mesh, mesh.vertices[:, 2] - height)
    share = np.clip(height / 1.5, 0, 1)
    sides, floor, roof = 2 * (4 + 1.8) * 1.5, 4 * 1.8, 4 * 1.8
    expected = sides * share + floor * (height >= 0) + roof * (height >= 1.5)
    assert area(rest) == pytest.approx(expected)
    assert len(source) == len(rest.faces)
    if len(rest.faces):
        assert rest.vertices[:, 2].max() <= height + 1e-12
        normals = [np.cross(m[:, 1] - m[:, 0], m[:, 2] - m[:, 0]) for m in _corners(mesh, rest)]
        assert (np.sum(normals[0][source] * normals[1], axis=1) > 0).all()
        np.testing.assert_allclose(rest.uvs[:, 0] * 4, rest.vertices[:, 0])


def _corners(*meshes):
    return [mesh.vertices[mesh.faces] for mesh in meshes]


def test_cutaway_leaves_bonnet_low_body_and_dashboard():
    mesh = box()
    tints = np.linspace(0, 0.5, len(mesh.faces) * 3).reshape(-1, 3)
    whole = Prototype("car", (Part(mesh, "paint", tints),), (Part(mesh, "paint"),))
    opened = cutaway(whole, cowl=-1.0, belt=0.95, eye=EYE)
    assert opened.name == "car~cockpit"
    paint = [part for part in opened.parts if part.material == "paint"]
    for part in paint:
        high = part.mesh.vertices[part.mesh.vertices[:, 2] > 0.55 * 1.5 + 1e-9]
        assert (high[:, 0] >= -1.0 - 1e-9).all()
        assert len(part.tint) == len(part.mesh.faces)
    assert 0.95 < max(part.mesh.vertices[:, 2].max() for part in paint) <= 1.01
    assert min(part.mesh.vertices[:, 0].min() for part in paint) == pytest.approx(-4.0)
    dashboard = next(part for part in opened.parts if part.material == "dash_pad")
    # It begins at the bonnet's edge; the hood stands before the driver, not the passenger.
    low, high = dashboard.mesh.bounds
    assert -1.6 < low[0] < high[0] == pytest.approx(-0.97)
    hood = [part for part in opened.parts if part.material == "dash_pad"][1].mesh.vertices
    assert hood[:, 1].mean() == pytest.approx(EYE[1], abs=0.02)
    assert hood[:, 2].max() < EYE[2] - 0.12
    assert {lamp.role for lamp in opened.lamps} == {"dials", "screen"}
    wheel = [part for part in opened.parts if part.material == "leather_rim"]
    assert wheel and all(part.mesh.bounds[1, 2] < EYE[2] - 0.1 for part in wheel)
    assert opened.far
    panes = [part.mesh for part in opened.parts if part.material == "mirror"]
    sides = sorted(pane.vertices[:, 1].mean() for pane in panes)
    # One within and one beyond either flank; those of the whole body are not kept.
    assert sides[0] < -0.9 < sides[1] < 0.9 < sides[2] and len(panes) == 3


def test_narrow_bodies_have_no_dashboard():
    whole = Prototype("bicycle", (Part(box(1.6, 0.6, 1.7), "paint"),), ())
    assert {part.material for part in cutaway(whole, cowl=0.0, belt=1.0, eye=EYE).parts} == {
        "paint"
    }
