"""Lenses, shutters and exposures as people write them."""

import math

import pytest
from pydantic import ValidationError

from sumo3dviz_pt.job.cameras import ExposureSettings, LensSettings, ShutterSettings
from sumo3dviz_pt.job.settings import EulerianCamera


def camera(**more):
    return EulerianCamera(mode="eulerian", position=(0, 0, 5), heading=0, **more)


def test_what_photographers_say():
    lens = LensSettings(focal_length="35 mm", f_number=2.8, focus="12 m")
    assert lens.degrees(50.0) == pytest.approx(2 * math.degrees(math.atan(18 / 35)))
    assert lens.aperture(54.0) == pytest.approx(0.035 / 2.8 / 2)
    assert lens.focus == 12.0
    small = LensSettings(focal_length="6 mm", sensor="6.4 mm")
    assert small.degrees(50.0) == pytest.approx(2 * math.degrees(math.atan(3.2 / 6)))
    following = LensSettings(f_number=1.4, focus={"vehicle": "bus_1"})
    assert following.focus.vehicle == "bus_1"
    assert LensSettings().degrees(60.0) == 60.0 and LensSettings().is_pinhole
    assert LensSettings(projection="equirectangular").degrees(60.0) == 360.0
    assert LensSettings(distortion=-0.1).distortion == (-0.1, 0.0)


@pytest.mark.parametrize(
    ("said", "why"),
    [
        ({"fov": 50, "focal_length": "35 mm"}, "either fov or focal_length"),
        ({"projection": "orthographic"}, "needs its width"),
        ({"width": "20 m"}, "width belongs to orthographic"),
        ({"fov": 175}, "at most 170"),
        ({"projection": "equirectangular", "fov": 65}, "fov of 180 or 360"),
        ({"projection": "fisheye", "focal_length": "8 mm"}, "belongs to perspective"),
        ({"projection": "orthographic", "width": 20, "f_number": 2}, "no f_number"),
        ({"focus": "3 m"}, "f_number"),
        ({"projection": "fisheye", "distortion": 0.1}, "distortion belongs"),
        ({"projection": "fisheye", "vignetting": 0.1}, "vignetting belongs"),
        ({"fov": 100, "distortion": -0.6}, "folds"),
        ({"focal_length": "35 in"}, "mm"),
    ],
)
def test_what_does_not_fit_is_refused_in_words(said, why):
    with pytest.raises(ValidationError, match=why):
        LensSettings(**said)


@pytest.mark.parametrize(
    ("said", "span"),
    [({}, 0.02), ({"angle": 90}, 0.01), ({"time": "5 ms"}, 0.005), ({"time": "1/50 s"}, 0.02)],
)
def test_a_shutter_is_open_for_an_angle_or_a_time(said, span):
    assert ShutterSettings(**said).span(0.04) == pytest.approx(span)


def test_a_shutter_has_one_length():
    with pytest.raises(ValidationError, match="either angle or time"):
        ShutterSettings(angle=180, time="10 ms")


def test_an_exposure_may_be_a_word_or_a_number():
    assert camera(exposure="auto").exposure == ExposureSettings(mode="auto")
    assert camera(exposure=1.5).exposure == ExposureSettings(ev=1.5)
    assert camera().exposure is None and camera().shutter is None


@pytest.mark.parametrize(
    ("lens", "size", "fits"),
    [
        ({"projection": "equirectangular"}, (1920, 1080), "size: \\[1920, 960\\]"),
        ({"projection": "equirectangular", "fov": 180}, (1080, 1080), ""),
        ({"projection": "equirectangular", "stereo": "top_bottom"}, (960, 960), ""),
        ({"projection": "equirectangular", "fov": 180, "stereo": "side_by_side"}, (960, 480), ""),
        ({"stereo": "side_by_side"}, (1281, 720), "even"),
        ({}, (1281, 721), ""),
    ],
)
def test_a_size_must_fit_the_projection(lens, size, fits):
    settings = LensSettings(**lens)
    if not fits:
        settings.check_size(size)
        return
    with pytest.raises(ValueError, match=fits):
        settings.check_size(size)
