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
