"""Single pictures out of films."""

import numpy as np
import pytest

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.video import encode
from sumo3dviz_pt.video.ffmpeg import film_picture

SHADES = (30, 90, 150, 210)


def film(folder):
    path = folder / "a.mp4"
    frames = [np.full((36, 64, 3), (shade, 120, 60), np.uint8) for shade in SHADES]
    encode(frames, path, size=(64, 36), fps=2)
    return path


@pytest.mark.parametrize(("time", "shade"), [(0.0, 30), (0.5, 90), (1.0, 150), (1.5, 210)])
def test_the_picture_of_a_time_has_its_colours(tmp_path, time, shade):
    pixels = film_picture(film(tmp_path), time, size=(32, 18))
    assert pixels.shape == (18, 32, 3) and pixels.dtype == np.uint8
    assert np.abs(pixels.mean(axis=(0, 1)) - (shade, 120, 60)).max() < 6


def test_what_is_no_film_or_too_short_is_refused(tmp_path):
    with pytest.raises(InputError, match="has no picture at 9 s"):
        film_picture(film(tmp_path), 9.0, size=(32, 18))
    (tmp_path / "b.mp4").write_text("no film")
    with pytest.raises(InputError, match="has no picture at 0 s"):
        film_picture(tmp_path / "b.mp4", 0.0, size=(32, 18))
