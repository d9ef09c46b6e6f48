"""Plants in wind: rooted, bounded, the farther the more it blows, and always the same at a time."""

from __future__ import annotations

import numpy as np
import pytest

from sumo3dviz_pt.library.plants.tree import tree
from sumo3dviz_pt.model.geometry import Mesh, merge_meshes
from sumo3dviz_pt.model.swaying import FARTHEST, Sway, Swaying
from sumo3dviz_pt.model.weather import Wind

FEET = np.array([[1000.0, 2000.0, 5.0], [1012.0, 2003.0, 5.5]])
TIMES = np.arange(0.0, 20.0, 0.37)
HEIGHT = 9.0


def mesh_of(part: int) -> Mesh:
    """Bark (0) or leaves (1) of a maple, once at each foot."""
    mesh = tree("maple", seed=3, level=3, height=HEIGHT)[part].mesh
    placed = [Mesh(mesh.vertices + foot, mesh.faces, mesh.normals) for foot in FEET]
    return merge_meshes(placed)


def swaying(mesh: Mesh, *, leaves: bool, seed: int = 5, share: float = 1.0) -> Sway:
    half = len(mesh.vertices) // 2
    plants = Swaying(
        FEET,
        np.full(2, HEIGHT),
        np.array([seed, seed + 1]),
        np.array([1.0, share]),
        np.array([half, half]),
        leaves=leaves,
    )
    return Sway(mesh, plants)


def moved(sway: Sway, speed: float) -> np.ndarray:
    """How far each vertex is from its place at rest, at all times, (t, n) [m]."""
    wind = Wind(0.6 * speed, -0.8 * speed)
    places = np.stack([sway.at(time, wind)[0] for time in TIMES])
    return np.linalg.norm(places - sway.mesh.vertices, axis=-1)


@pytest.fixture(scope="module", params=[False, True], ids=["bark", "leaves"])
def plants(request: pytest.FixtureRequest) -> Sway:
    return swaying(mesh_of(int(request.param)), leaves=request.param)


def test_without_wind_all_is_as_it_was(plants: Sway) -> None:
    for wind in (None, Wind(0.0, 0.0)):
        vertices, normals = plants.at(3.7, wind)
        np.testing.assert_array_equal(vertices, plants.mesh.vertices)
        np.testing.assert_array_equal(normals, plants.mesh.normals)


def test_more_wind_moves_farther_but_never_too_far(plants: Sway) -> None:
    far = np.array([moved(plants, speed).max() for speed in (0.5, 2.0, 5.0, 8.0, 12.0, 20.0, 40.0)])
    assert np.isfinite(far).all()
    assert (np.diff(far[:-1]) > 0.0).all()
    assert far[-1] == far[-2] < FARTHEST * HEIGHT
    # Small branches move from 5.5 m/s on, and small trees sway in 8 m/s (Beaufort).
    assert 0.02 < far[2] < far[3] < 0.4


def test_it_moves_to_and_fro(plants: Sway) -> None:
    wind = Wind(6.0, 0.0)
    places = np.stack([plants.at(time, wind)[0] for time in TIMES])
    assert places.std(axis=0).max() > 0.02
    mean = (places - plants.mesh.vertices).mean(axis=(0, 1))
    assert mean[0] > 0.01 > abs(mean[1]), "it leans with the wind"


def test_a_moment_is_the_same_whatever_was_asked_before(plants: Sway) -> None:
    wind = Wind(3.0, 4.0)
    alone = plants.at(12.34, wind)
    plants.at(5.0, Wind(-8.0, 1.0))
    for one, other in zip(alone, plants.at(12.34, wind), strict=True):
        np.testing.assert_array_equal(one, other)


def test_from_frame_to_frame_nothing_jumps(plants: Sway) -> None:
    wind = Wind(8.0, 0.0)
    places = np.stack([plants.at(7.0 + k / 25.0, wind)[0] for k in range(26)])
    steps = np.linalg.norm(np.diff(places, axis=0), axis=-1)
    assert 0.001 < steps.max() < 0.08
    # Wind that turns and dies down does so smoothly, too.
    winds = [Wind(0.04 * k, 2.0 - 0.04 * k) for k in range(51)]
    places = np.stack([plants.at(7.0 + k / 25.0, wind)[0] for k, wind in enumerate(winds)])
    assert np.linalg.norm(np.diff(places, axis=0), axis=-1).max() < 0.03


def test_stems_stay_rooted() -> None:
    bark = swaying(mesh_of(0), leaves=False)
    low = bark.mesh.vertices[:, 2] < np.repeat(FEET[:, 2], len(bark.mesh.vertices) // 2) + 0.1
    assert low.any()
    assert moved(bark, 20.0)[:, low].max() < 0.002


def test_leaves_keep_their_shape_and_go_where_their_twigs_go() -> None:
    leaves = swaying(mesh_of(1), leaves=True)
    vertices, normals = leaves.at(4.2, Wind(9.0, 3.0))
    assert normals is not None
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0, atol=1e-12)

    def sides(points: np.ndarray) -> np.ndarray:
        a, b, c = np.moveaxis(points[leaves.mesh.faces], 1, 0)
        return np.linalg.norm(np.stack([b - a, c - b, a - c]), axis=-1)

    np.testing.assert_allclose(sides(vertices) / sides(leaves.mesh.vertices), 1.0, atol=0.06)
    # A twig at a leaf's stalk moves as the stalk does.
    stalks = leaves.mesh.faces[:, 0]
    twig = Mesh(leaves.mesh.vertices[stalks], np.zeros((0, 3)))
    half = len(stalks) // 2
    same = Swaying(FEET, np.full(2, HEIGHT), np.array([5, 6]), np.ones(2), np.full(2, half), False)
    there, _ = Sway(twig, same).at(4.2, Wind(9.0, 3.0))
    np.testing.assert_allclose(vertices[stalks], there, atol=1e-9)


def test_plants_move_each_in_its_own_way() -> None:
    mesh = mesh_of(0)
    half = len(mesh.vertices) // 2
    vertices, _ = swaying(mesh, leaves=False).at(4.2, Wind(9.0, 3.0))
    shifts = vertices - mesh.vertices
    assert np.abs(shifts[:half] - shifts[half:]).max() > 0.02
    others, _ = swaying(mesh, leaves=False, seed=70).at(4.2, Wind(9.0, 3.0))
    assert np.abs(others - vertices).max() > 0.02


def test_plants_may_move_less() -> None:
    for part, leaves in ((0, False), (1, True)):
        mesh = mesh_of(part)
        half = len(mesh.vertices) // 2
        some = moved(swaying(mesh, leaves=leaves, share=0.5), 6.0)
        all_of_it = moved(swaying(mesh, leaves=leaves), 6.0)
        np.testing.assert_array_equal(some[:, :half], all_of_it[:, :half])
        np.testing.assert_allclose(some[:, half:], 0.5 * all_of_it[:, half:], rtol=1e-6, atol=1e-9)
