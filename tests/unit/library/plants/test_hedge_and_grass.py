"""Hedges are closed boxes full of leaves; blades of grass stand where they are laid."""

import numpy as np
import pytest
import trimesh

from sumo3dviz_pt.library.plants.greenery import (
    LEAVES_PER_METRE,
    PATCH,
    PATCH_BLADES,
    HedgeSize,
    blades_mesh,
    grass_patch,
    hedge,
    laid,
)

LINE = np.array([(0.0, 0.0, 1.0), (4.0, 0.0, 1.0), (8.0, 3.0, 1.5)])


def areas_of(mesh):
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    return np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2


def grown(level, seed=1):
    return hedge(LINE, HedgeSize(), level=level, rng=np.random.default_rng(seed))


def test_the_core_is_closed_and_faces_outwards():
    core = grown(0)[0].mesh
    solid = trimesh.Trimesh(core.vertices, core.faces, process=False)
    assert solid.is_watertight and 8.0 < solid.volume < 10.0


@pytest.mark.parametrize("level", range(4))
def test_leaves_cover_the_hedge_at_every_level(level):
    core, leaves = grown(level)
    assert len(leaves.mesh.faces) == pytest.approx(9.0 * LEAVES_PER_METRE[level], rel=0.01)
    near = areas_of(grown(0)[1].mesh).sum()
    assert areas_of(leaves.mesh).sum() == pytest.approx(near, rel=0.15)
    assert areas_of(leaves.mesh).min() > 1e-8
    assert len(leaves.tint) == len(leaves.mesh.faces)
    # The hedge rises with the ground below it.
    assert core.mesh.bounds[1, 2] == pytest.approx(1.5 + 1.35, abs=0.1)


def test_another_seed_moves_the_leaves_only():
    one, other = grown(1, seed=1), grown(1, seed=2)
    assert np.array_equal(one[0].mesh.vertices, other[0].mesh.vertices)
    assert not np.array_equal(one[1].mesh.vertices, other[1].mesh.vertices)


@pytest.mark.parametrize("fine", [True, False])
def test_blades_are_upright_triangles_over_their_feet(fine):
    patch = grass_patch(1)
    blades = laid(patch, 500, place=np.array([100.0, 50.0]), quarter=1, coarse=1.0)
    mesh, tint = blades_mesh(blades, fine=fine)
    assert len(mesh.faces) == 500 * (3 if fine else 1) == len(tint)
    assert areas_of(mesh).min() > 1e-7
    assert (np.abs(blades.feet[:, :2] - [100.0, 50.0]) <= 0.5 * PATCH + 1e-9).all()
    assert -0.02 < mesh.vertices[:, 2].min() < 0.0 < mesh.vertices[:, 2].max() < 0.4
    assert mesh.normals[:, 2].min() > 0.7


def test_thinned_patches_are_spread_over_the_whole_patch():
    feet = grass_patch(0).feet[: PATCH_BLADES // 10, :2]
    counts, *_ = np.histogram2d(*feet.T, bins=4, range=[[-1, 1], [-1, 1]])
    assert counts.min() > 4


def test_quarter_turns_turn_the_patch():
    patch = grass_patch(2)
    one, other = (laid(patch, 9, place=np.zeros(2), quarter=q, coarse=1.0) for q in (0, 1))
    turned = one.feet[:, :2] @ np.array([[0.0, 1.0], [-1.0, 0.0]])
    assert other.feet[:, :2] == pytest.approx(turned)
