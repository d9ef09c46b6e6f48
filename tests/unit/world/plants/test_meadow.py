"""Blades of grass: never on what is paved, only near low cameras, within the budget."""

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from searching import tries

from sumo3dviz_pt.model.camera import CameraPath
from sumo3dviz_pt.model.network import Location, Network
from sumo3dviz_pt.world.placement.surroundings import surroundings
from sumo3dviz_pt.world.plants.near import (
    BLADES_REACH,
    BUDGET,
    HIGHEST,
    KEEP_OFF,
    Lawn,
    build_meadow,
)

MEAN = np.array([0.09, 0.12, 0.04])
ROAD = shapely.box(-100.0, -4.0, 100.0, 4.0)


def around(*eyes, seed=1, camera_path=None):
    empty = Network({}, {}, (), Location())
    return surroundings(
        empty, seed=seed, viewpoints=np.array(eyes, dtype=float), camera_path=camera_path
    )


def meadow(*eyes, paved=(ROAD,), stems=(), seed=1, surface="ground_grass", **kw):
    lawn = Lawn(surface, MEAN, paved, np.array(stems, dtype=float).reshape(-1, 2))
    return build_meadow(lawn, around=around(*eyes, seed=seed), **kw)


def triangles(found):
    return sum(len(part.part.mesh.faces) for part in found.static)


def feet(found):
    """Feet of blades: the first vertex of each is beside its foot."""
    points = [
        part.part.mesh.vertices[:: 5 if part.id.endswith("near") else 3] for part in found.static
    ]
    return np.concatenate(points)


@settings(max_examples=tries(6), deadline=None)
@given(
    st.floats(-40, 40),
    st.floats(-20, 20),
    st.lists(st.tuples(st.floats(-30, 30), st.floats(-30, 30), st.floats(2, 9)), max_size=3),
)
def test_no_blade_stands_on_what_is_paved(x, y, discs):
    paved = [ROAD, *(shapely.Point(a, b).buffer(r) for a, b, r in discs)]
    found = meadow((x, y, 1.5), paved=paved, budget=9000)
    if not found.static:
        return
    spots = shapely.points(feet(found)[:, :2])
    for area in paved:
        # A foot's corner lies half a blade's width beside its middle.
        assert shapely.distance(area, spots).min() > KEEP_OFF - 0.04


def test_blades_stay_near_the_camera_and_in_the_budget():
    found = meadow((0, 10, 1.2))
    assert 0.5 * BUDGET < triangles(found) <= BUDGET
    away = np.hypot(*(feet(found)[:, :2] - [0, 10]).T)
    assert away.max() < BLADES_REACH + 4.0
    assert (away < 10).mean() > 0.3
    assert triangles(meadow((0, 10, 1.2), budget=20_000)) <= 20_000


def test_only_low_cameras_over_grass_see_blades_and_the_scene_says_why():
    high = meadow((0, 10, HIGHEST + 1))
    stone = meadow((0, 10, 1.2), surface="ground_stone")
    for found, why in ((high, "no camera comes near"), (stone, "no meadow")):
        assert not found.static
        assert why in found.left_out[0].why


def test_the_same_place_grows_the_same_grass():
    one, same, other = (meadow((0, 10, 1.2), seed=seed) for seed in (1, 1, 2))
    for a, b in zip(one.static, same.static, strict=True):
        assert np.array_equal(a.part.mesh.vertices, b.part.mesh.vertices)
    assert not np.array_equal(feet(one)[:50], feet(other)[:50])


def test_grass_is_taller_along_edges_and_around_stems():
    found = meadow((0, 12, 1.2), stems=[(3.0, 14.0)])
    near = next(part for part in found.static if part.id.endswith("near")).part.mesh
    tips = near.vertices[4::5]
    stem = np.hypot(*(tips[:, :2] - [3.0, 14.0]).T) < 0.35
    assert np.median(tips[stem, 2]) > 1.4 * np.median(tips[~stem, 2])


def test_what_no_camera_looks_at_grows_no_blades():
    camera_path = CameraPath(
        np.array([[0.0, 10.0, 1.2]]), np.array([[1.0, 0.0, 0.0]]), np.array([0.5])
    )
    lawn = Lawn("ground_grass", MEAN, (), np.zeros((0, 2)))
    found = build_meadow(lawn, around=around((0, 10, 1.2), camera_path=camera_path))
    assert feet(found)[:, 0].min() > -5.0


def test_the_lawn_as_a_whole_has_the_ground_s_hue():
    found = meadow((0, 10, 1.2))
    tint = np.concatenate([part.part.tint for part in found.static]).mean(axis=0)
    assert tint / tint[1] == pytest.approx(MEAN / MEAN[1], rel=0.1)
