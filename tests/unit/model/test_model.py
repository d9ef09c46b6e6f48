"""Values that cross stages check and freeze themselves."""

import numpy as np
import pytest
from builders import box, view_at
from hypothesis import given
from hypothesis import strategies as st

from sumo3dviz_pt.model.geometry import (
    GRID,
    Mesh,
    Transform,
    frozen,
    merge_meshes,
    on_faces,
    product,
    settled,
    turned,
)
from sumo3dviz_pt.model.scene import FrameState, Part, Sky
from sumo3dviz_pt.model.traffic import SignalPhases
from sumo3dviz_pt.render.convert import sensor_matrix

ANGLE = st.floats(-7, 7)
TRIANGLE = np.eye(3), [[0, 1, 2]]


def test_meshes_are_frozen_and_checked():
    mesh = Mesh(*TRIANGLE)
    assert not mesh.vertices.flags.writeable and mesh.faces.dtype == np.int64
    with pytest.raises(ValueError, match="vertex that does not exist"):
        Mesh(np.eye(3), [[0, 1, 3]])
    with pytest.raises(ValueError, match="2 normals for 3 vertices"):
        Mesh(*TRIANGLE, normals=np.eye(3)[:2])
    with pytest.raises(ValueError, match="1 uvs"):
        Mesh(*TRIANGLE, uvs=[[0, 0]])
    with pytest.raises(ValueError, match="2 tints for 1 faces"):
        Part(mesh, "a", np.zeros((2, 3)))


def test_only_what_somebody_may_write_is_copied():
    mesh = Mesh(*TRIANGLE)
    again = Mesh(mesh.vertices, mesh.faces)
    assert np.shares_memory(mesh.vertices, again.vertices)
    assert np.shares_memory(mesh.faces, again.faces)
    read = np.frombuffer(memoryview(bytes(24 * 9))[72:144], np.float64)
    assert frozen(read) is read
    own = np.zeros(9)
    looks = own.view()
    looks.setflags(write=False)
    unaligned = np.frombuffer(bytes(73), np.uint8)[1:].view(np.float64)
    borrowed = np.frombuffer(memoryview(bytearray(72)).toreadonly(), np.float64)
    columns = frozen(np.zeros((3, 4))).T
    for values in (own, looks, unaligned, borrowed, columns, mesh.faces):
        kept = frozen(values)
        assert not np.shares_memory(kept, values) and not kept.flags.writeable


def test_merging_keeps_what_all_have():
    plain, full = Mesh(*TRIANGLE), Mesh(*TRIANGLE, normals=np.eye(3), uvs=np.zeros((3, 2)))
    both = merge_meshes([full, full])
    assert both.normals.shape == (6, 3) and both.uvs.shape == (6, 2)
    np.testing.assert_array_equal(both.faces, [[0, 1, 2], [3, 4, 5]])
    assert merge_meshes([plain, full]).normals is None
    assert merge_meshes([]).vertices.shape == (0, 3)


@given(ANGLE, ANGLE, ANGLE)
def test_placements_are_rigid(yaw, pitch, roll):
    matrix = Transform.from_pose([1, 2, 3], yaw=yaw, pitch=pitch, roll=roll).matrix
    turn = matrix[:3, :3]
    np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(turn) == pytest.approx(1)


@pytest.mark.parametrize(
    ("angles", "axis", "expected"),
    [
        ({"yaw": np.pi / 2}, 0, [0, 1, 0]),  # north
        ({"yaw": np.pi / 2}, 1, [-1, 0, 0]),  # the left side looks west
        ({"pitch": np.pi / 2}, 0, [0, 0, 1]),  # nose up
        ({"roll": np.pi / 2}, 1, [0, 0, 1]),  # right side down, left side up
    ],
)
def test_signs_of_angles(angles, axis, expected):
    matrix = Transform.from_pose([0, 0, 0], **angles).matrix
    np.testing.assert_allclose(matrix[:3, axis], expected, atol=1e-12)


def test_transforms_carry_meshes_and_chain():
    placed = Transform.from_pose([10, 0, 0], yaw=np.pi / 2, scale=[2, 1, 1])
    mesh = placed.mesh(Mesh(np.eye(3), [[0, 1, 2]], normals=np.eye(3)))
    np.testing.assert_allclose(mesh.vertices, [[10, 2, 0], [9, 0, 0], [10, 0, 1]], atol=1e-12)
    np.testing.assert_allclose(mesh.normals, [[0, 1, 0], [-1, 0, 0], [0, 0, 1]], atol=1e-12)
    np.testing.assert_allclose(placed.directions(np.eye(3))[0], [0, 2, 0], atol=1e-12)
    twice = placed @ placed
    np.testing.assert_allclose(
        twice.points(np.zeros((1, 3))), placed.points(placed.points(np.zeros((1, 3))))
    )
    np.testing.assert_array_equal(box((0, 0, 0), (1, 2, 3)).bounds, [[0, 0, 0], [1, 2, 3]])


def test_normals_go_by_the_inverse_transpose():
    rng = np.random.default_rng(5)
    for _ in range(20):
        matrix = np.eye(4)
        matrix[:3, :3] = rng.normal(size=(3, 3))
        normals = rng.normal(size=(3, 3))
        found = Transform(matrix).mesh(Mesh(*TRIANGLE, normals=normals)).normals
        exact = normals @ np.linalg.inv(matrix[:3, :3])
        exact /= np.linalg.norm(exact, axis=1, keepdims=True)
        np.testing.assert_allclose(found, exact, atol=1e-9)


def test_products_are_those_of_matrices():
    rng = np.random.default_rng(6)
    one, other = rng.normal(size=(2, 7, 4, 4))
    np.testing.assert_allclose(product(one, other), one @ other, atol=1e-12)
    vectors, turn = rng.normal(size=(3, 2, 3)), rng.normal(size=(3, 3))
    np.testing.assert_allclose(turned(vectors, turn), vectors @ turn.T, atol=1e-12)


@pytest.mark.parametrize("share", [0, 1 / 4, 1 / 3, 1 / 2, 2 / 3, 3 / 4])
@pytest.mark.parametrize("steps", [0, 1, -1, 12345, -987654])
def test_last_bits_do_not_move_what_is_settled(share, steps):
    exact = (steps + share) * GRID
    noisy = exact * (1.0 + np.arange(-8, 9) * 2.0**-52)
    found = settled(noisy)
    assert len(np.unique(found)) == 1
    assert np.abs(found - exact).max() <= 0.62 * GRID
    np.testing.assert_array_equal(settled(found), found)


def test_states_begin_at_their_time():
    phases = SignalPhases("a", (0.0, 5.0), ("G", "r"))
    assert [phases.state_at(t) for t in (-1, 0, 4.999, 5 - 1e-12, 5, 99)] == [
        None, "G", "G", "r", "r", "r",
    ]  # fmt: skip


def test_the_sun_is_a_unit_vector():
    np.testing.assert_allclose(Sky([0, 3, 4]).sun_direction, [0, 0.6, 0.8])


@given(st.floats(-5e6, 5e6), st.floats(-5e6, 5e6))
def test_the_origin_is_near_and_on_the_grid(x, y):
    frame = FrameState(0.0, view_at([x, y, 7.0]), ())
    assert np.abs(frame.origin - [x, y, 7.0]).max() <= 125 + 1e-6
    np.testing.assert_array_equal(frame.origin % 250, 0)


def test_places_on_triangles_are_weighted_corners():
    corners = np.array([[0, 0], [1, 0], [0, 1], [0.25, 0.5]])
    places = on_faces(2 * np.eye(3), np.array([[2, 0, 1]] * 4), corners)
    np.testing.assert_allclose(places, [[0, 0, 2], [2, 0, 0], [0, 2, 0], [0.5, 1, 0.5]])


def test_mitsubas_sensor_looks_forward():
    """Mitsuba's camera: +x left, +y up, +z forward."""
    view = view_at([500, 0, 3], heading=0)
    matrix = sensor_matrix(view, np.array([500.0, 0, 0]))
    np.testing.assert_allclose(matrix[:3, 2], [0, 1, 0], atol=1e-12)
    np.testing.assert_allclose(matrix[:3, 0], [-1, 0, 0], atol=1e-12)
    np.testing.assert_allclose(matrix[:3, 1], [0, 0, 1], atol=1e-12)
    np.testing.assert_allclose(matrix[:3, 3], [0, 0, 3], atol=1e-12)


@pytest.mark.parametrize("heading", [0, 90, 200])
def test_directions_of_a_view(heading):
    view = view_at([1, 2, 3], heading=heading, pitch=-20, fov=80)
    rays = view.directions((5, 3))
    np.testing.assert_allclose(rays[1, 2], view.forward, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(rays, axis=-1), 1)
    left, up = view.world_from_camera.matrix[:3, 1], view.world_from_camera.matrix[:3, 2]
    assert rays[1, 0] @ left > 0 > rays[1, 4] @ left
    assert rays[0, 2] @ up > 0 > rays[2, 2] @ up
    edge = np.tan(np.radians(40)) * 4 / 5
    assert (rays[1, 0] @ left) / (rays[1, 0] @ view.forward) == pytest.approx(edge)
    assert view.directions((1, 1)).shape == (1, 1, 3)
