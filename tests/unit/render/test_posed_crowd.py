"""Bodies merged into one mesh: every one in its place, its pose and its colour."""

import numpy as np
import pytest
from builders import cube, diffuse, mover, scene_of

from sumo3dviz_pt.errors import RenderError
from sumo3dviz_pt.library.vehicles.plates import letter
from sumo3dviz_pt.model.geometry import Mesh, Transform
from sumo3dviz_pt.model.scene import Mover, Part, Poses, Prototype, Slots
from sumo3dviz_pt.render.crowd import Crowd

FLOOR = -50.0
PHASES = 4
TINTED = {"type": "principled", "base_color": {"type": "tint"}, "roughness": 0.5}
MATERIALS = {"matt_tint": TINTED, "grey": diffuse(0.3), "plate_ink": diffuse(0.05)}
ORIGIN = np.zeros(3)


def walker(seed=7, corners=60):
    """A heap of triangles whose every pose is drawn by chance."""
    rng = np.random.default_rng(seed)
    vertices = rng.normal(size=(1 + PHASES, corners, 3))
    normals = rng.normal(size=(1 + PHASES, corners, 3))
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    faces = np.arange(corners).reshape(-1, 3)
    part = Part(Mesh(vertices[0], faces, normals[0]), "matt_tint")
    return Prototype("walker", (part,), (part,), poses=Poses(vertices, normals))


def crowd_of(prototype, count=1, *, far=False):
    scene = scene_of(
        [], MATERIALS, prototypes=[prototype], slots=Slots(deforming={prototype.name: count})
    )
    return Crowd("crowd", scene, {prototype.name: count}, far=far, floor=FLOOR)


def deforming(phase, effort, *, place=None, colour=(0.2, 0.3, 0.4)):
    return Mover(
        "person:a", "walker", place or Transform(np.eye(4)), colour, phase=phase, effort=effort
    )


def shown(phase, effort, seed=7):
    held = crowd_of(walker(seed)).arrays([deforming(phase, effort)], ORIGIN)
    vertices, normals = held.vertices, held.normals
    return vertices, normals


def test_at_rest_the_first_pose_is_shown():
    vertices, _ = shown(0.37, 0.0)
    np.testing.assert_allclose(vertices, walker().poses.vertices[0])


@pytest.mark.parametrize("number", range(PHASES))
def test_at_a_phase_its_pose_is_shown(number):
    vertices, _ = shown(number / PHASES, 1.0)
    np.testing.assert_allclose(vertices, walker().poses.vertices[1 + number], atol=1e-12)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("phase", [0.06, 0.31, 0.5, 0.77, 0.93, 1.31])
@pytest.mark.parametrize("effort", [0.35, 1.0])
def test_between_phases_a_blend_of_two_is_shown(phase, effort, seed):
    """Least squares over all poses finds the two neighbours' weights and nothing else."""
    vertices, _ = shown(phase, effort, seed)
    poses = walker(seed).poses.vertices
    weights, residual, _, _ = np.linalg.lstsq(
        poses.reshape(1 + PHASES, -1).T, vertices.ravel(), rcond=None
    )
    expected = np.zeros(1 + PHASES)
    place = (phase % 1.0) * PHASES
    first, share = int(place), place - int(place)
    expected[0] = 1.0 - effort
    expected[1 + first] += effort * (1.0 - share)
    expected[1 + (first + 1) % PHASES] += effort * share
    np.testing.assert_allclose(weights, expected, atol=1e-9)
    assert residual.sum() < 1e-18


def test_the_cycle_closes():
    late, early = shown(1.0 - 1e-9, 1.0)[0], shown(0.0, 1.0)[0]
    np.testing.assert_allclose(late, early, atol=1e-7)


def test_normals_follow_the_pose_and_stay_unit():
    _, normals = shown(1.0 / PHASES, 1.0)
    np.testing.assert_allclose(normals, walker().poses.normals[2], atol=1e-12)
    _, between = shown(0.31, 0.6)
    np.testing.assert_allclose(np.linalg.norm(between, axis=1), 1.0)


def test_places_are_relative_to_the_origin_and_normals_square_to_stretched_faces():
    tilted = Prototype(
        "walker",
        (Part(Mesh(np.eye(3), np.array([[0, 1, 2]]), np.full((3, 3), 3.0**-0.5)), "matt_tint"),),
        (),
    )
    place = Transform.from_pose((300.0, 40.0, 5.0), yaw=0.7) @ Transform(
        np.diag([2.0, 1.0, 0.5, 1.0])
    )
    origin = np.array([250.0, 0.0, 0.0])
    held = crowd_of(tilted).arrays([deforming(0.0, 0.0, place=place)], origin)
    vertices, normals = held.vertices, held.normals
    np.testing.assert_allclose(vertices, place.points(np.eye(3)) - origin)
    edges = vertices[1:] - vertices[0]
    np.testing.assert_allclose(normals @ edges.T, 0.0, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0)


def test_free_slots_wait_under_the_ground_and_colours_are_their_owners():
    crowd = crowd_of(walker(), 3)
    first, second = (0.8, 0.1, 0.1), (0.1, 0.1, 0.8)
    movers = [deforming(0.0, 0.0, colour=first), deforming(0.5, 1.0, colour=second)]
    held = crowd.arrays(movers, ORIGIN)
    vertices, tints = held.vertices, held.tints
    assert (vertices[120:] == (0.0, 0.0, FLOOR)).all()
    assert not (vertices[:120, 2] == FLOOR).any()
    np.testing.assert_allclose(tints[:20], np.tile(first, (20, 1)))
    np.testing.assert_allclose(tints[20:40], np.tile(second, (20, 1)))
    assert (tints[40:] == 0.0).all()


def test_own_colours_of_faces_stay():
    body = cube()
    own = np.full((12, 3), 0.11)
    body = Prototype("cube", (*body.parts, Part(body.parts[0].mesh, "matt_tint", own)), ())
    tints = crowd_of(body).arrays([mover("a", (0, 0, 0), (0.5, 0.6, 0.7))], ORIGIN).tints
    np.testing.assert_allclose(tints[:12], np.tile((0.5, 0.6, 0.7), (12, 1)))
    np.testing.assert_allclose(tints[12:], own)


def test_one_too_many_is_an_error():
    crowd = crowd_of(walker(), 1)
    with pytest.raises(RenderError, match="no slot is free for person:a"):
        crowd.arrays([deforming(0.0, 0.0), deforming(0.5, 0.0)], ORIGIN)
    with pytest.raises(RenderError, match="no slot"):
        crowd.arrays([mover("x", (0, 0, 0), (0.5,) * 3, prototype="stranger")], ORIGIN)


def test_letters_of_plates_move_as_rigid_bodies_do():
    """What each mover keeps one pose of is followed from frame to frame like a car's body."""
    assert crowd_of(letter(), 2).is_rigid(letter().name)
    assert not crowd_of(walker()).is_rigid("walker")
