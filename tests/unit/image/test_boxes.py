"""Boxes around pixels and bodies."""

import numpy as np
import pytest
from builders import view_at

from sumo3dviz_pt.image.layers import (
    Box2d,
    box_3d,
    boxes_2d,
    kitti_calibration,
    kitti_line,
    truncated,
)
from sumo3dviz_pt.model.geometry import Transform

BOUNDS = np.array([[-4.0, -1.0, 0.3], [0.0, 1.0, 1.5]])


def test_a_box_goes_around_all_pixels_of_a_name():
    owner = np.zeros((6, 8), np.int64)
    owner[1, 2] = owner[3, 5] = 2
    owner[5, 7] = 1
    assert boxes_2d(owner, ("", "one", "two", "none")) == (
        Box2d("one", 7, 5, 8, 6, 1),
        Box2d("two", 2, 1, 6, 4, 2),
    )


def test_a_body_stands_on_the_road_in_its_box():
    placed = Transform.from_pose((10, 20, 3), yaw=0.5, scale=(2, 1, 1))
    box = box_3d("a", "", BOUNDS, placed)
    assert box.size == pytest.approx((8.0, 2.0, 1.5))
    rotation = box.world_from_box.matrix[:3, :3]
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-12)
    ends = np.array([[x, y, z] for x in (-4, 0) for y in (-1, 1) for z in (0, 1.5)], float)
    np.testing.assert_allclose(box.corners, placed.points(ends), atol=1e-9)


def test_kittis_line_says_where_a_car_is_that_drives_ahead():
    # North of the camera by 10 m and 2 m to the right, and heading north.
    placed = Transform.from_pose((2.0, 12.0, 0.0), yaw=np.pi / 2)
    box = box_3d("a", "", BOUNDS, placed)
    view = view_at((0, 0, 1.5), heading=0)
    line = kitti_line(box, Box2d("a", 3, 4, 9, 8, 10), "car", view, (640, 360)).split()
    assert line[:3] == ["Car", "0.00", "3"]
    assert [float(word) for word in line[4:8]] == [3.0, 4.0, 8.0, 7.0]
    numbers = [float(word) for word in line[8:]]
    assert numbers == pytest.approx([1.5, 2.0, 4.0, 2.0, 1.5, 10.0, -np.pi / 2], abs=1e-4)
    assert float(line[3]) == pytest.approx(-np.pi / 2 - np.arctan2(2.0, 10.0), abs=1e-4)


@pytest.mark.parametrize(("x", "share"), [(0.0, (0.0, 0.0)), (5.9, (0.3, 0.7)), (99.0, (1.0, 1.0))])
def test_boxes_beside_the_picture_are_truncated(x, share):
    box = box_3d("a", "", BOUNDS, Transform.from_pose((x, 12.0, 0.0), yaw=np.pi / 2))
    found = truncated(box, view_at((0, 0, 1), heading=0, fov=60), (640, 360))
    assert share[0] <= found <= share[1]


def test_kittis_calibration_has_all_lines_in_order_and_projects_points():
    """Readers find lines by their place or their name; points are as laser scanners give them."""
    text = kitti_calibration(500.0, (319.5, 179.5))
    lines = [line.split(":", 1) for line in text.splitlines()]
    names = ["P0", "P1", "P2", "P3", "R0_rect", "Tr_velo_to_cam", "Tr_imu_to_velo"]
    assert [name for name, _ in lines] == names
    found = {name: np.array(values.split(), float) for name, values in lines}
    assert found["R0_rect"].size == 9
    assert all(found[name].size == 12 for name in names if name != "R0_rect")
    velodyne = np.array([10.0, 2.0, -1.0, 1.0])  # 10 m ahead, 2 m to the left, 1 m down
    camera = found["R0_rect"].reshape(3, 3) @ found["Tr_velo_to_cam"].reshape(3, 4) @ velodyne
    column, row, depth = found["P2"].reshape(3, 4) @ [*camera, 1.0]
    assert (column / depth, row / depth) == pytest.approx((219.5, 229.5))
    assert depth == 10.0
