"""Leaves that no eye sees become clumps: area, colour and opacity of the crown stay."""

import numpy as np
import pytest

from sumo3dviz_pt.job.settings import ObjectSettings
from sumo3dviz_pt.library.plants.greenery import CORE_FACES, FarTrees, far_trees
from sumo3dviz_pt.library.plants.leaves import (
    HIDDEN,
    PAIRS,
    STEPS,
    Clumping,
    Direction,
    clumped,
    directions,
    seen_shares,
)
from sumo3dviz_pt.library.plants.tree import LEVELS
from sumo3dviz_pt.model.geometry import Mesh, areas, merge_meshes
from sumo3dviz_pt.world.objects.kinds import KINDS, Plant, body_of, seen_body

EYE = Direction(STEPS // 12, 1)
MODELS = ("maple", "spruce", "hazel")


def sheet(x, *, count=12, size=0.5):
    """Right triangles in pairs that cover a square upright in the plane of an x."""
    corners = []
    for j in range(count):
        for k in range(count):
            y, z = size * j, size * k
            corners += [[(x, y, z), (x, y + size, z), (x, y, z + size)]]
            corners += [[(x, y + size, z + size), (x, y, z + size), (x, y + size, z)]]
    points = np.array(corners).reshape(-1, 3)
    normals = np.tile([1.0, 0.0, 0.0], (len(points), 1))
    return Mesh(points, np.arange(len(points)).reshape(-1, 3), normals)


def unit_vector(direction):
    a, b = 2.0 * np.pi / STEPS * np.array(direction)
    return np.array([np.cos(a) * np.cos(b), np.sin(a) * np.cos(b), np.sin(b)])


def first_hits(mesh, direction, *, rays=400, seed=3, bounds=None):
    """Depth of the nearest leaf on parallel rays from a direction, inf for none, (rays,)."""
    towards = unit_vector(direction)
    side = np.cross([0.0, 0.0, 1.0], towards)
    side /= np.linalg.norm(side)
    frame = np.stack([side, np.cross(towards, side), towards], axis=1)
    tri = (mesh.vertices @ frame)[mesh.faces]
    low, high = bounds if bounds is not None else (tri.min((0, 1)), tri.max((0, 1)))
    points = np.random.default_rng(seed).uniform(low[:2], high[:2], (rays, 2))
    a, b, c = tri[:, 0], tri[:, 1], tri[:, 2]
    e, f = (b - a)[:, :2], (c - a)[:, :2]
    det = e[:, 0] * f[:, 1] - e[:, 1] * f[:, 0]
    flat = np.abs(det) < 1e-12
    det = np.where(flat, 1.0, det)
    off = points[:, None] - a[None, :, :2]
    u = (off[..., 0] * f[:, 1] - off[..., 1] * f[:, 0]) / det
    v = (off[..., 1] * e[:, 0] - off[..., 0] * e[:, 1]) / det
    hit = (u >= 0) & (v >= 0) & (u + v <= 1) & ~flat
    depth = a[:, 2] + u * (b - a)[:, 2] + v * (c - a)[:, 2]
    return np.where(hit, -depth, np.inf).min(axis=1), (low, high)


def plant_of(model, level):
    kind = next(kind for kind in KINDS if model in kind.models)
    return Plant(kind, ObjectSettings(model=(model,)), 7, "one", level)


def crowns(model, level):
    """The leaves of a whole plant, and those that it has where an eye is known."""
    plant = plant_of(model, level)
    whole = body_of(plant)[1]
    seen, clumps = seen_body(plant, [EYE])
    parts = [*seen[1:], *clumps]
    mesh = merge_meshes([part.mesh for part in parts])
    return whole, mesh, np.concatenate([part.tint for part in parts])


def area(mesh):
    return areas(mesh.vertices, mesh.faces)


def test_leaves_behind_a_sheet_are_hidden_and_those_before_it_seen():
    front, back = sheet(1.0), sheet(0.0)
    both = merge_meshes([front, back])
    count = len(front.faces)
    shares = seen_shares(both, Direction(0, 0))
    assert shares[:count].min() == 1.0
    assert shares[count:].max() == 0.0
    turned = seen_shares(both, Direction(STEPS // 2, 0))
    assert turned[:count].max() == 0.0
    assert turned[count:].min() == 1.0


def test_directions_are_steps_of_a_circle_each_once():
    towards = [[3.0, 0.0, 0.0], [1.0, 0.0, 1.0], [-2.0, 0.0, 0.0], [-5.0, 0.01, 0.0]]
    found = directions(np.array(towards))
    assert found == [Direction(0, 0), Direction(0, STEPS // 8), Direction(STEPS // 2, 0)]


@pytest.mark.parametrize("way", [PAIRS, HIDDEN[2], Clumping(7, 0.6)])
def test_clumps_keep_area_and_colour(way):
    leaves = body_of(plant_of("maple", 2))[1]
    mesh, tint = clumped(leaves.mesh, leaves.tint, way)
    assert len(mesh.faces) == len(tint) == -(-len(leaves.mesh.faces) // way.each)
    assert area(mesh).sum() == pytest.approx(area(leaves.mesh).sum(), rel=1e-9)
    before, after = ((area(m) @ t) for m, t in ((leaves.mesh, leaves.tint), (mesh, tint)))
    assert after == pytest.approx(before, rel=1e-9)
    assert np.allclose(np.linalg.norm(mesh.normals, axis=1), 1.0)


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("level", range(1, LEVELS))
def test_a_seen_crown_keeps_area_and_colour_with_far_fewer_leaves(model, level):
    whole, mesh, tint = crowns(model, level)
    assert len(mesh.faces) < 0.75 * len(whole.mesh.faces)
    assert area(mesh).sum() == pytest.approx(area(whole.mesh).sum(), rel=1e-6)
    mean = (area(whole.mesh) @ whole.tint) / area(whole.mesh).sum()
    assert (area(mesh) @ tint) / area(mesh).sum() == pytest.approx(mean, rel=1e-6)


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("level", [2, 4])
def test_the_eye_sees_the_same_crown(model, level):
    whole, mesh, _ = crowns(model, level)
    before, bounds = first_hits(whole.mesh, EYE)
    after, _ = first_hits(mesh, EYE, bounds=bounds)
    solid, still = np.isfinite(before), np.isfinite(after)
    assert still.mean() == pytest.approx(solid.mean(), abs=0.04)
    assert (solid == still).mean() > 0.88
    both = solid & still
    assert (np.abs(before[both] - after[both]) < 1e-6).mean() > 0.6


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("level", [2, 3])
@pytest.mark.parametrize("aside", [18, 36])
def test_the_sun_meets_about_as_much_from_other_sides(model, level, aside):
    other = Direction((EYE.around + aside) % STEPS, 8)
    whole, mesh, _ = crowns(model, level)
    before, bounds = first_hits(whole.mesh, other)
    after, _ = first_hits(mesh, other, bounds=bounds)
    assert np.isfinite(after).mean() == pytest.approx(np.isfinite(before).mean(), abs=0.08)


def test_a_crown_that_nobody_sees_is_all_clumps():
    seen, clumps = seen_body(plant_of("lime", 3), [])
    assert [part.material for part in seen] == ["bark"]
    assert sum(len(part.mesh.faces) for part in clumps) < 0.15 * 1750


def test_far_trees_lose_only_tufts_that_look_away():
    rng = np.random.default_rng(5)
    feet = np.column_stack([rng.uniform(-50, 50, (9, 2)), np.zeros(9)])
    ones = np.ones(9)
    trees = FarTrees(feet, 9 * ones, 12 * ones, 0 * ones, np.full((9, 3), 0.1))
    whole, tint = far_trees(trees, tufts=40, rng=np.random.default_rng(1))
    eye = np.array([[900.0, 0.0, 5.0]])
    some, fewer = far_trees(trees, tufts=40, rng=np.random.default_rng(1), eyes=eye)
    assert len(some.faces) == len(fewer)
    assert 9 * CORE_FACES + 0.4 * 360 < len(some.faces) < 9 * CORE_FACES + 0.8 * 360
    corners = {tuple(row) for row in some.vertices[some.faces].reshape(-1, 9)}
    lost = [
        k
        for k, row in enumerate(whole.vertices[whole.faces].reshape(-1, 9))
        if tuple(row) not in corners
    ]
    out = whole.normals[whole.faces[lost, 0]]
    assert (out[:, 0] < -0.2).all()
    assert len(tint) == len(whole.faces)
