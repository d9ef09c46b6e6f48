"""Where boxes and lines lie in a picture, against places worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest
from builders import view_at

from sumo3dviz_pt.overlays.facts import box_corners, frame_around, place_of, segment

SIZE = (201, 101)
VIEW = view_at((0.0, 0.0, 1.0), heading=90.0, fov=90.0)  # at the origin, looking east
FOCAL = 201 / 2.0  # px per unit of slope at 90 degrees


def test_a_box_reaches_back_from_its_front_and_up_from_the_ground():
    pose = np.array([10.0, 2.0, 0.5, np.pi / 2, 0.0, 0.0])
    corners = box_corners(pose, np.array([4.0, 2.0, 1.5]))
    assert corners.min(axis=0) == pytest.approx([9.0, -2.0, 0.5])
    assert corners.max(axis=0) == pytest.approx([11.0, 2.0, 2.0])
    assert corners[0] == pytest.approx([11.0, 2.0, 0.5])  # right, front, ground


def test_a_box_that_pitches_lifts_its_nose_above_its_rear():
    pose = np.array([0.0, 0.0, 0.0, 0.0, 0.1, 0.0])
    corners = box_corners(pose, np.array([4.0, 2.0, 1.5]))
    assert corners[2, 2] == pytest.approx(-4.0 * np.sin(0.1))


def test_a_point_lies_where_its_slopes_say():
    row, column = place_of(VIEW, np.array([10.0, -2.0, 3.0]), SIZE)
    assert column == pytest.approx(100 + FOCAL * 0.2)
    assert row == pytest.approx(50 - FOCAL * 0.2)


@pytest.mark.parametrize("point", [(-5.0, 0.0, 1.0), (0.1, 0.0, 1.0), (5.0, 6.0, 1.0)])
def test_points_behind_and_beside_have_no_place(point):
    assert place_of(VIEW, np.array(point), SIZE) is None


def test_a_line_is_cut_where_it_passes_the_camera():
    found = segment(VIEW, np.array([-5.0, -1.0, 1.0]), np.array([5.0, -1.0, 1.0]), SIZE)
    assert found[1] == pytest.approx([50.0, 100 + FOCAL / 5])
    assert found[0] == pytest.approx([50.0, 100 + FOCAL / 0.3])
    assert segment(VIEW, np.array([-5.0, 0, 1]), np.array([-1.0, 0, 1]), SIZE) is None


def test_the_frame_of_a_box_touches_its_nearest_edges():
    # The rear is nearer: 8 m away; the front 12 m.
    pose = np.array([12.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    corners = box_corners(pose, np.array([4.0, 2.0, 1.5]))
    top, left, bottom, right = frame_around(VIEW, corners, SIZE)
    assert (left, right) == pytest.approx((100 - FOCAL / 8, 100 + FOCAL / 8))
    assert bottom == pytest.approx(50 + FOCAL / 8)
    assert top == pytest.approx(50 - FOCAL * 0.5 / 8)


def test_a_box_behind_or_beside_has_no_frame():
    for front in ((-3.0, 0.0), (10.0, 30.0)):
        pose = np.array([*front, 0.0, 0.0, 0.0, 0.0])
        assert frame_around(VIEW, box_corners(pose, np.array([4.0, 2.0, 1.5])), SIZE) is None
