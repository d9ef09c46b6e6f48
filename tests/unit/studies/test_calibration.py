"""The clip for a photometer: codes as they should be, also encoded; every frame is marked."""

from __future__ import annotations

import json
from fractions import Fraction

import numpy as np
import pytest

from sumo3dviz_pt.job.settings import OutputSettings
from sumo3dviz_pt.job.study import CalibrationSettings
from sumo3dviz_pt.studies.outputs import GREYS, account, chart, clip_frames, write_calibration
from sumo3dviz_pt.video.ffmpeg import film_picture

SIZE = (256, 144)
SHORT = CalibrationSettings(white=250.0, seconds=0.2)


def test_luminances_follow_srgbs_curve_from_black_to_the_assumed_white():
    steps = account(SHORT, SIZE, Fraction(10))["steps"]
    found = {step["code"]: step["luminance"] for step in steps}
    assert (found[0], found[255]) == (0.0, 250.0)
    assert found[128] == pytest.approx(250.0 * ((128 / 255 + 0.055) / 1.055) ** 2.4, abs=1e-3)
    assert [step["first_frame"] for step in steps] == [30 + 2 * k for k in range(len(GREYS))]


def test_frames_have_their_grey_a_number_and_a_square_that_blinks():
    frames = [*clip_frames(SHORT, SIZE, Fraction(10))]
    steps = account(SHORT, SIZE, Fraction(10))
    assert len(frames) == steps["frames"]
    for step in steps["steps"]:
        frame = frames[step["first_frame"]]
        assert (frame[:100] == step["code"]).all()
        assert (frame[100:] != step["code"]).any()
    flags = [int(frame[-2, 2, 0]) for frame in frames]
    assert flags == [255, 0] * (len(frames) // 2)
    # Numbers differ from frame to frame, at their place and nowhere else but in the square.
    changed = np.argwhere((frames[30] != frames[31]).any(axis=-1))
    assert (changed[:, 0] > 120).all()
    assert (changed[:, 1] > 200).any()


def test_the_charts_wedge_rises_evenly_and_checkers_are_half_white():
    pixels = chart(SIZE)
    wedge = pixels[30, 20:236, 0].astype(int)
    assert (np.diff(wedge) >= 0).all() and len(np.unique(wedge)) == 16
    checks = pixels[84:118, 16:64, 0]
    assert checks.mean() == pytest.approx(127.5, abs=3)


def test_the_encoded_clip_keeps_its_greys(tmp_path):
    output = OutputSettings(size=SIZE, fps=Fraction(10))
    clip, picture, note = write_calibration(tmp_path, SHORT, output)
    assert picture.is_file()
    for step in json.loads(note.read_bytes())["steps"]:
        found = film_picture(clip, max(step["begin"] - 0.01, 0.0), size=SIZE)
        assert np.abs(found[:100].astype(int) - step["code"]).max() <= 2


def test_no_calibration_writes_nothing(tmp_path):
    assert write_calibration(tmp_path, None, OutputSettings()) == []
    assert not [*tmp_path.iterdir()]
