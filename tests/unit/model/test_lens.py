"""A lens: rays leave where points come in."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sumo3dviz_pt.model.lens import Lens

OPENINGS = st.floats(0.05, 2.9)
SIZES = st.tuples(st.integers(1, 40), st.integers(1, 40))


@given(OPENINGS, SIZES, st.floats(0.1, 1e4))
def test_points_on_a_pixels_ray_lie_in_its_middle(opening, size, distance):
    lens = Lens(opening)
    (rows, columns), ahead = lens.project(distance * lens.rays(size), size)
    assert ahead.all()
    there = np.indices((size[1], size[0]))
    np.testing.assert_allclose(np.stack([rows, columns]), there, atol=1e-7 * max(size))


@given(OPENINGS, st.tuples(st.floats(0, 1), st.floats(0, 1)), st.floats(0.2, 2.0))
def test_a_ray_through_the_picture_is_seen_and_one_beside_it_is_not(opening, point, aspect):
    lens = Lens(opening)
    ray = lens.ray(point, aspect)
    assert np.linalg.norm(ray) == pytest.approx(1.0)
    assert lens.sees(ray, aspect, margin=1e-9)
    beside = lens.ray((-0.01, 0.5), aspect)
    assert not lens.sees(beside, aspect) and lens.sees(beside, aspect, margin=10.0)


def test_the_axis_is_the_middle_of_the_picture():
    lens = Lens.of_degrees(90.0)
    assert lens.half_width == pytest.approx(1.0)
    np.testing.assert_allclose(lens.ray((0.5, 0.5), 0.6), [1, 0, 0])
    np.testing.assert_allclose(lens.ray((0.0, 0.5), 0.6), np.sqrt([0.5, 0.5, 0]))
    assert lens.half_diagonal(1.0) == pytest.approx(np.arctan(np.sqrt(2.0)))
    assert lens.pixel_angle(90) == pytest.approx(np.radians(1.0))


def test_what_lies_behind_is_not_seen():
    lens = Lens.of_degrees(60.0)
    behind = np.array([[-5.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    assert not lens.sees(behind, 0.6, margin=100.0).any()
    (rows, columns), ahead = lens.project(behind, (64, 36))
    assert not ahead.any() and np.isfinite(rows).all() and np.isfinite(columns).all()


@given(OPENINGS, st.floats(0.0, 1.0), st.floats(1.0, 1e3))
def test_off_the_middle_by_half_widths(opening, left, distance):
    """1 is at the picture's edge; across or up, whichever is more."""
    lens = Lens(opening)
    ray = lens.ray((left, 0.5), 0.6)
    point = distance * ray / ray[0]
    assert lens.off_middle(point) == pytest.approx(abs(1.0 - 2.0 * left), abs=1e-9)
    assert lens.off_middle(point[[0, 2, 1]]) == pytest.approx(abs(1.0 - 2.0 * left), abs=1e-9)
    assert lens.off_middle(-point) == pytest.approx(distance * lens.off_middle(ray / ray[0]))


def test_near_the_columns():
    lens = Lens.of_degrees(90.0)
    points = np.array([[10.0, 11.9, 99], [10, 12.1, 0], [-0.9, 0.9, 0], [-1.1, 0, 0]])
    near = lens.is_near_columns(points, widened=1.1, margin=1.0)
    np.testing.assert_array_equal(near, [True, False, True, False])


@given(OPENINGS, st.integers(1, 9))
def test_parts_and_lengths_share_the_width(opening, count):
    lens = Lens(opening)
    width = lens.length_of(1.0, np.array([1.0, 7.0]))
    np.testing.assert_allclose(width, [2.0 * lens.half_width, 14.0 * lens.half_width])
    np.testing.assert_allclose(
        lens.middle_part(count).length_of(1.0, np.ones(1)), lens.length_of(1.0 / count, np.ones(1))
    )
    assert lens.pixel_width(count) == pytest.approx(lens.length_of(1.0 / count, np.ones(1))[0])
