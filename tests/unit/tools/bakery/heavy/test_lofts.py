"""Rounded bodies, skins and wings of vehicles that are no boxes."""

from __future__ import annotations

import numpy as np
import pytest
from bakery.heavy.lofts import far_foil, far_loft, foil, loft, skin
from bakery.heavy.recipe import Fitting

BARREL = ((0.0, 0.0, 2.0, 1.5, 1.0, 2.0), (10.0, 0.0, 2.0, 1.5, 1.0, 2.0))
CIGAR = (
    *((0.0, 0.0, 2.0, 0.0, 0.0, 2.0), (1.0, 0.0, 2.0, 1.0, 1.0, 2.0)),
    *((8.0, 0.0, 2.0, 1.0, 1.0, 2.0), (9.0, 0.0, 2.0, 0.0, 0.0, 2.0)),
)
WING = ((1.0, 0.5, 1.0, 2.0, 0.12), (2.0, 6.0, 1.3, 1.0, 0.12))
FIN = ((1.0, 0.0, 1.0, 2.0, 0.12), (2.0, 0.0, 6.0, 1.0, 0.12))


def volume(mesh) -> float:
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    return float((a * np.cross(b, c)).sum() / 6.0)


def open_edges(mesh) -> int:
    """Edges that only one face has, of vertices at equal places."""
    _, number = np.unique(mesh.vertices.round(6), axis=0, return_inverse=True)
    faces = number.reshape(-1)[mesh.faces]
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    return int((np.unique(edges, axis=0, return_counts=True)[1] != 2).sum())


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("outline", [BARREL, CIGAR])
@pytest.mark.parametrize("build", [loft, far_loft])
def test_a_loft_is_closed_and_looks_outward(build, outline, turned):
    mesh = build(Fitting("loft", outline=outline[::-1] if turned else outline))
    assert open_edges(mesh) == 0
    exact = np.pi * (15.0 if outline is BARREL else 7.0 + 2.0 / 3.0)
    assert 0.85 * exact < volume(mesh) < 1.001 * exact
    low, high = mesh.bounds
    assert low[1] == pytest.approx(-high[1], abs=1e-5)


def test_exponents_make_boxes():
    square = [(d, y, z, half, up, 40.0) for d, y, z, half, up, _ in BARREL]
    assert volume(loft(Fitting("loft", outline=tuple(square)))) == pytest.approx(60.0, rel=0.03)


@pytest.mark.parametrize(("outline", "axis"), [(WING, 1), (FIN, 2)])
@pytest.mark.parametrize("build", [foil, far_foil])
def test_a_foil_is_closed_and_as_thick_as_it_says(build, outline, axis):
    mesh = build(Fitting("foil", outline=outline))
    assert open_edges(mesh) == 0
    assert volume(mesh) > 0.0
    root = mesh.vertices[np.abs(mesh.vertices[:, axis] - outline[0][axis]) < 0.02]
    assert np.ptp(root[:, 0]) == pytest.approx(2.0, abs=1e-5)
    assert 0.2 < np.ptp(root[:, 3 - axis]) < 0.25


def test_a_skin_lies_before_its_loft_and_looks_outward():
    piece = Fitting("skin", outline=BARREL, low=(2.0, 60.0, 0.01), high=(4.0, 100.0, 0.0))
    mesh = skin(piece)
    y, z = mesh.vertices[:, 1], mesh.vertices[:, 2] - 2.0
    np.testing.assert_allclose((y / 1.51) ** 2 + (z / 1.01) ** 2, 1.0, atol=1e-5)
    assert mesh.vertices[:, 0].min() == 2.0
    assert mesh.vertices[:, 0].max() == 4.0
    assert y.min() > 1.2
    assert (mesh.normals[:, 1] > 0.5).all()
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    assert (np.cross(b - a, c - a)[:, 1] > 0.0).all()
