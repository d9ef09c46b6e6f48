"""Light, contrast and motion energy of films whose pictures are known."""

import math

import numpy as np
import pytest

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.image.exr import write_exr
from sumo3dviz_pt.model.layers import linear_from_srgb
from sumo3dviz_pt.studies.measured.pictures import picture_rows, scene_row
from sumo3dviz_pt.video import encode
from sumo3dviz_pt.video.ffmpeg import film_pictures

SIZE = (64, 36)


def film_of(path, *shades):
    pictures = [np.full((36, 64, 3), shade / 255.0, np.float32) for shade in shades]
    encode(pictures, path, size=SIZE, fps=10)
    return path


def test_all_pictures_come_in_order(tmp_path):
    film = film_of(tmp_path / "a.mp4", 30, 90, 200)
    shades = [float(picture.mean()) for picture in film_pictures(film, size=SIZE)]
    assert shades == pytest.approx([30, 90, 200], abs=2.5)


def test_luminance_and_change_of_plain_pictures(tmp_path):
    film = film_of(tmp_path / "a.mp4", 120, 120, 180)
    rows = list(picture_rows(film_pictures(film, size=SIZE), white=200.0))
    dark, bright = (200.0 * linear_from_srgb(shade / 255.0) for shade in (120, 180))
    assert rows[0]["shown_mean"] == pytest.approx(dark, rel=0.05)
    assert rows[2]["shown_p99"] == pytest.approx(bright, rel=0.05)
    assert math.isnan(rows[0]["motion_energy"])
    assert rows[1]["motion_energy"] == pytest.approx(0.0, abs=0.5)
    assert rows[2]["motion_energy"] == pytest.approx(bright - dark, rel=0.05)
    assert rows[0]["contrast"] == pytest.approx(0.0, abs=0.01) and rows[0]["clutter"] == 0.0


def test_contrast_of_two_halves(tmp_path):
    picture = np.zeros((36, 64, 3), np.float32)
    picture[:, 32:] = 1.0
    encode([picture], tmp_path / "a.mp4", size=SIZE, fps=10)
    (row,) = picture_rows(film_pictures(tmp_path / "a.mp4", size=SIZE), white=100.0)
    assert row["contrast"] == pytest.approx(1.0, abs=0.03)  # half black, half white


def test_light_of_the_scene_is_in_candelas_and_lamps_count(tmp_path):
    film = tmp_path / "a.mp4"
    assert math.isnan(scene_row(film, 0)["scene_mean"])
    (tmp_path / "a.frames").mkdir()
    radiance = np.full((36, 64, 3), 0.125, np.float32)
    write_exr(tmp_path / "a.frames" / "000000.exr", {"radiance": radiance})
    write_exr(tmp_path / "a.frames" / "000001.exr", {"radiance": radiance, "excess": radiance})
    assert scene_row(film, 0)["scene_mean"] == pytest.approx(4000.0)  # 32,000 cd/m2 each
    assert scene_row(film, 1)["scene_p99"] == pytest.approx(8000.0)


def test_what_is_no_film_is_refused(tmp_path):
    (tmp_path / "a.mp4").write_bytes(b"no film")
    with pytest.raises(InputError, match="cannot be read"):
        list(film_pictures(tmp_path / "a.mp4", size=SIZE))
