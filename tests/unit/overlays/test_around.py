"""Plain pictures, fades and captions."""

from __future__ import annotations

import numpy as np
import pytest
from unit.overlays.drawing import GREY, film_of

from sumo3dviz_pt.job.overlays import StillOverlay
from sumo3dviz_pt.overlays.canvas import (
    captions_text,
    faded,
    still_count,
    still_frames,
    still_picture,
)


def test_plain_pictures_last_whole_frames():
    film = film_of({"before": [{"show": "fixation", "seconds": 0.26}, {"seconds": 0.01}]})
    assert still_count(film.settings.before, film.rate) == 4
    assert len([*still_frames(film.settings.before, film)]) == 4


def test_a_cross_stands_in_the_middle_and_on_nothing_else():
    picture = still_picture(StillOverlay(show="fixation"), (320, 180))
    ground = np.float32(0x77 / 255)
    rows, columns = np.nonzero(np.abs(picture - ground).max(axis=-1) > 1e-6)
    assert (rows.min() + rows.max(), columns.min() + columns.max()) == (179, 319)
    assert np.ptp(rows) == np.ptp(columns) <= 12
    plain = still_picture(StillOverlay(colour="#102030"), (32, 18))
    assert plain == pytest.approx(
        np.broadcast_to(np.array([16, 32, 48]) / 255, plain.shape), abs=1e-6
    )


def test_a_film_fades_in_and_out_and_is_whole_between():
    film = film_of({"fade": {"in": 0.2, "out": 0.1, "colour": "#000000"}}, frames=6)
    seen = [float(faded(GREY, film, number).mean() / 0.25) for number in range(6)]
    assert seen == pytest.approx([0.25, 0.75, 1.0, 1.0, 1.0, 0.5], abs=1e-6)


def test_captions_count_from_the_first_frame_of_all_and_end_with_the_film():
    film = film_of(
        {
            "before": [{"seconds": 1}],
            "captions": [
                {"text": "later <i> & so", "from": 0.25},
                {"text": "first\n\nline", "to": 0.2},
                {"text": "never", "from": 9},
            ],
        }
    )
    assert captions_text(film.settings.captions, film) == (
        "WEBVTT\n\n00:00:01.000 --> 00:00:01.200\nfirst\nline\n\n"
        "00:00:01.250 --> 00:00:01.400\nlater &lt;i> &amp; so\n"
    )
