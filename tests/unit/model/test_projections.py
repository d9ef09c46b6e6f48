"""Every projection: rays leave where points come in, and known points lie where they must."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sumo3dviz_pt.model.lens import Lens
from sumo3dviz_pt.model.projections import folds

SIZE = (64, 32)
LENSES = {
    "perspective": Lens.of_degrees(80.0),
    "barrel": replace(Lens.of_degrees(80.0), distortion=(-0.15, 0.03)),
    "fisheye": replace(Lens.of_degrees(180.0), projection="fisheye"),
    "360": replace(Lens.of_degrees(360.0), projection="equirectangular"),
    "180": replace(Lens.of_degrees(180.0), projection="equirectangular"),
    "plan": Lens(0.0, "orthographic", width=40.0),
}
BOTH = {
    f"{name} {stereo}": replace(LENSES[name], stereo=stereo)
    for name in ("perspective", "fisheye", "360", "180")
    for stereo in ("side_by_side", "top_bottom")
}


def starts(lens, size):
    origins = lens.origins(size)
    return np.zeros((size[1], size[0], 3)) if origins is None else origins


@pytest.mark.parametrize("name", [*LENSES, *BOTH])
@pytest.mark.parametrize("away", [0.7, 3.0, 500.0])
def test_points_on_a_pixels_ray_lie_in_its_middle(name, away):
    lens = {**LENSES, **BOTH}[name]
    points = starts(lens, SIZE) + away * lens.rays(SIZE)
    for part, eye in lens.halves(SIZE):
        size = lens.eye_size(SIZE)
        (rows, columns), ahead = eye.project(points[part], size)
        assert ahead.all()
        there = np.indices((size[1], size[0]))
        # Behind the camera the picture's left and right edge meet.
        columns = columns + size[0] * ((there[1] - columns) > size[0] / 2)
        assert np.abs(np.stack([rows, columns]) - there).max() < 1e-3


def place(lens, point, size=(360, 180)):
    """Column and row of a point, from the picture's left and upper edge [px]."""
    (row, column), ahead = lens.project(np.array(point, dtype=float), size)
    assert ahead
    return column + 0.5, row + 0.5


def test_known_points_lie_where_geometry_says():
    left_up = (1.0, 1.0, 1.0)
    assert place(Lens.of_degrees(90.0), left_up) == pytest.approx((0.0, -90.0))
    # Equirectangular: one pixel is one degree; 45 degrees to the left, 35.26 up.
    assert place(LENSES["360"], left_up) == pytest.approx((135.0, 90.0 - 35.264), abs=1e-3)
    assert place(LENSES["360"], (-1.0, -1.0, 0.0)) == pytest.approx((315.0, 90.0))
    half = place(LENSES["180"], left_up, (180, 180))
    assert half == pytest.approx((45.0, 90.0 - 35.264), abs=1e-3)
    # Fisheye: the angle from the axis is 54.74 degrees, to the upper left.
    aside = np.degrees(np.arccos(1 / np.sqrt(3))) / np.sqrt(2)
    seen = place(LENSES["fisheye"], left_up, (180, 180))
    assert seen == pytest.approx((90.0 - aside, 90.0 - aside), abs=1e-3)
    # A plan 40 m wide in 360 px: 9 px a metre, however far away.
    for ahead in (1.0, 300.0):
        assert place(LENSES["plan"], (ahead, 5.0, -2.0)) == pytest.approx((135.0, 108.0))


def test_distortion_is_what_opencv_writes():
    k1, k2 = 0.1, -0.02
    lens = replace(Lens.of_degrees(90.0), distortion=(k1, k2))
    x, y = 0.6, 0.3
    square = x * x + y * y
    stretch = 1 + k1 * square + k2 * square**2
    found = place(lens, (1.0, -x, -y))
    assert found == pytest.approx((180 + 180 * x * stretch, 90 + 180 * y * stretch))


@pytest.mark.parametrize("distance", [2.0, 10.0, 80.0])
def test_stereo_disparity_of_a_known_point(distance):
    """Parallel eyes: baseline over distance, in pixels of slope."""
    lens = replace(Lens.of_degrees(60.0), stereo="side_by_side")
    eyes = [eye for _, eye in lens.halves((1280, 360))]
    point = np.array([distance, 0.4, 0.1])
    (_, left), (_, right) = (eye.project(point, (640, 360))[0] for eye in eyes)
    focal = 640 / (2 * np.tan(np.radians(30.0)))
    assert left - right == pytest.approx(0.063 * focal / distance, abs=0.01)


@given(st.floats(0.0, 2 * np.pi), st.floats(-1.2, 1.2), st.floats(0.5, 300.0))
def test_omnidirectional_eyes_see_every_azimuth_alike(turn, rise, distance):
    """The disparity of a point on the horizon is twice asin(32 mm / distance), wherever it is."""
    lens = replace(LENSES["360"], stereo="top_bottom")
    eyes = [eye for _, eye in lens.halves((3600, 3600))]
    point = distance * np.array([np.cos(turn), np.sin(turn), np.tan(rise)])
    (_, left), (_, right) = (eye.project(point, (3600, 1800))[0] for eye in eyes)
    disparity = (left - right + 1800) % 3600 - 1800
    assert disparity == pytest.approx(2 * np.degrees(np.arcsin(0.0315 / distance)) * 10, abs=0.01)


def test_the_left_eye_is_on_the_left_and_on_top():
    for stereo, second in (("side_by_side", (0, 32)), ("top_bottom", (16, 0))):
        lens = replace(LENSES["perspective"], stereo=stereo)
        (one, left), (other, right) = lens.halves(SIZE)
        assert (one[0].start, one[1].start) == (0, 0)
        assert (other[0].start, other[1].start) == second
        assert left.shift == pytest.approx(0.0315) and right.shift == pytest.approx(-0.0315)
        assert starts(lens, SIZE)[one][0, 0] == pytest.approx((0.0, 0.0315, 0.0))


def test_a_distortion_that_folds_is_found():
    assert not folds(1.0, (-0.15, 0.03)) and not folds(1.0, (0.4, 0.0))
    assert folds(1.2, (-0.5, 0.0)) and folds(2.0, (0.3, -0.4))


@pytest.mark.parametrize("lens", LENSES.values(), ids=LENSES)
def test_what_a_lens_says_of_itself_makes_it_again(lens):
    assert Lens.from_dict(lens.as_dict()) == lens
    assert lens.is_pinhole == (lens == LENSES["perspective"])


@pytest.mark.parametrize("lens", LENSES.values(), ids=LENSES)
def test_seen_is_what_lies_in_the_picture(lens):
    points = 30.0 * np.random.default_rng(3).normal(size=(500, 3))
    (rows, columns), ahead = lens.project(points, SIZE)
    inside = ahead & (np.abs(rows - 15.5) < 16) & (np.abs(columns - 31.5) < 32)
    assert np.array_equal(lens.sees(points, 0.5), inside)
    near = np.abs(points[:, 1:]).max(axis=1) < np.abs(points[:, 0])
    assert lens.sees(points[near & ahead], 0.5, margin=1e4).all()


def test_what_is_far_beside_a_distorted_picture_is_not_in_it():
    """The polynomial turns back at a slope of 1.29, and is 0 again at 2.24."""
    lens = replace(LENSES["perspective"], distortion=(-0.2, 0.0))
    slopes = np.linspace(1.0, 50.0, 400)
    points = np.stack([np.ones(400), slopes, np.zeros(400)], axis=-1)
    (_, columns), _ = lens.project(points, SIZE)
    assert (np.diff(columns) < 0).all() and not lens.sees(points, 0.5)[5:].any()


def test_a_plain_lens_says_of_itself_what_it_did():
    """Stored frames and accounts of old films stay as they are."""
    assert Lens(1.25).as_dict() == {"opening": 1.25}
