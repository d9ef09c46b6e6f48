"""The land beyond: hills close the horizon, woods stand free, far networks work as near ones."""

import numpy as np
import pytest
import shapely

from sumo3dviz_pt.model.camera import CameraPath
from sumo3dviz_pt.world.land.horizon import (
    MOST,
    TEXTURED,
    Room,
    far_tints,
    land_around,
    land_mesh,
    split_far,
    woods,
)

GRASS = np.array([0.086, 0.118, 0.036])
CORNERS = np.array([(0.0, 0.0), (1500.0, 0.0), (1500.0, 300.0), (0.0, 300.0)])


def land(horizon="auto", surface="ground_grass", *, seed=7, offset=(0.0, 0.0)):
    return land_around(CORNERS + offset, horizon=horizon, surface=surface, seed=seed)


def skyline(mesh, eye):
    """Highest elevation of vertices in each of 36 directions [deg]."""
    towards = mesh.vertices - eye
    away = np.hypot(*towards[:, :2].T)
    far = away > 1.0
    angle = np.degrees(np.arctan2(towards[far, 2], away[far]))
    sector = ((np.arctan2(towards[far, 1], towards[far, 0]) + np.pi) / (2 * np.pi) * 36).astype(int)
    return np.array([angle[sector % 36 == k].max() for k in range(36)])


@pytest.mark.parametrize("seed", [1, 7, 23])
@pytest.mark.parametrize("eye", [(0, 0, 1.2), (750, 150, 12.0), (1500, 300, 1.2)])
def test_hills_close_the_horizon_all_round(seed, eye):
    mesh = land_mesh(land(seed=seed), 0.0)
    assert skyline(mesh, np.array(eye)).min() > 0.3
    assert len(mesh.faces) < 15_000


@pytest.mark.parametrize("horizon", ["flat", "trees"])
def test_flat_land_is_flat(horizon):
    mesh = land_mesh(land(horizon), 2.0)
    assert mesh.vertices[:, 2] == pytest.approx(2.0)
    assert land(horizon).plain == (horizon == "flat")


def test_chess_boards_go_on_to_the_horizon():
    assert land(surface="ground_chess").plain
    assert not land(surface="ground_sand").plain


@pytest.mark.parametrize("offset", [(0.0, 0.0), (700_000.0, 5_800_000.0)])
def test_the_ground_is_level_within_the_network_and_faces_up(offset):
    some = land(offset=offset)
    mesh = land_mesh(some, 0.0)
    away = some.away(mesh.vertices)
    assert mesh.vertices[away < 400.0, 2] == pytest.approx(0.0, abs=1e-9)
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    assert (normals[:, 2] > 1e-3).all()
    assert (mesh.bounds[1] - mesh.bounds[0])[:2].min() > 40_000


def test_near_and_far_ground_share_their_border_and_colour():
    some = land()
    mesh = land_mesh(some, 0.0)
    near, far = split_far(mesh, some)
    assert len(near.faces) + len(far.faces) == len(mesh.faces)
    assert some.away(far.vertices).min() > TEXTURED - 1.5
    tint = far_tints(far, some, GRASS)
    middles = some.away(far.vertices[far.faces].mean(axis=1))
    first = tint[middles < TEXTURED + 30.0]
    assert len(first) and first == pytest.approx(np.tile(GRASS, (len(first), 1)), rel=0.15)
    assert tint.min() > 0 and tint.max() <= 0.8


def grown(room, some=None):
    some = some or land()
    parts = woods(some, height_at=some.heights, room=room)
    return np.concatenate([part.mesh.vertices for part in parts] or [np.zeros((0, 3))]), parts


def test_woods_stand_outside_away_from_what_is_there():
    taken = np.array([(750.0, 700.0), (1200.0, 650.0)])
    points, parts = grown(Room(taken))
    assert sum(len(part.mesh.faces) for part in parts) <= 2 * MOST
    assert shapely.distance(land().hull, shapely.points(points[:, :2])).min() > 150.0
    for spot in taken:
        assert np.hypot(*(points[:, :2] - spot).T).min() > 20.0


def test_no_far_tree_stands_close_to_a_camera_or_out_of_sight():
    eye = np.array([[750.0, 640.0, 1.5]])
    camera_path = CameraPath(eye, np.array([[0.0, 1.0, 0.0]]), np.array([0.6]))
    points, _ = grown(Room(eye[:, :2], camera_path))
    away = points[:, :2] - eye[0, :2]
    assert len(points) and np.hypot(*away.T).min() > 200.0
    assert away[:, 1].min() > -60.0


@pytest.mark.parametrize("surface", ["ground_sand", "ground_stone"])
def test_nothing_grows_on_sand_and_stone(surface):
    assert grown(Room(np.zeros((0, 2))), land(surface=surface))[1] == ()


def test_no_far_face_is_empty_and_seeds_repeat():
    one, other = (grown(Room(np.zeros((0, 2))))[1] for _ in range(2))
    for part, same in zip(one, other, strict=True):
        a, b, c = (part.mesh.vertices[part.mesh.faces[:, k]] for k in range(3))
        assert np.linalg.norm(np.cross(b - a, c - a), axis=1).min() > 1e-6
        assert np.array_equal(part.mesh.vertices, same.mesh.vertices)
