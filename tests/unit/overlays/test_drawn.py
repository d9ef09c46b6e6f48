"""What overlays change in a picture, and what they leave as it is."""

from __future__ import annotations

import numpy as np
import pytest
from pydantic import ValidationError
from unit.overlays.drawing import GREY, KEYS, SIZE, changed, film_of

from sumo3dviz_pt.job.overlays import ClockOverlay, OverlaySettings
from sumo3dviz_pt.model.geometry import Transform
from sumo3dviz_pt.overlays.canvas import Canvas, rgba, speed_colour
from sumo3dviz_pt.overlays.drawing import ShownUsers, drawn, label_text, speed_of, time_text
from sumo3dviz_pt.overlays.facts import box_corners, facts_of, facts_text, frame_around

NOBODY = ShownUsers(frozenset(), np.zeros((180, 320), dtype=bool))
ALL = {
    "text": [{"text": "A"}],
    "speed": {},
    "clock": {},
    "labels": [{"ids": "*"}],
    "highlights": [{"ids": "near*"}],
    "trails": [{"ids": "*"}],
    "dots": {},
    "scale": {"place": "bottom"},
    "map": {},
    "fade": {"in": 0.1},
    "before": [{"show": "fixation"}],
    "captions": [{"text": "words"}],
}


def test_without_overlays_a_picture_keeps_its_values():
    noise = np.random.default_rng(1).random((180, 320, 3), dtype=np.float32)
    assert (drawn(noise, film_of({}), 0) == noise).all()


def test_facts_come_back_from_their_text_and_draw_the_same():
    film = film_of(ALL)
    again = facts_of(facts_text(film))
    assert again.settings == film.settings
    assert (drawn(GREY, again, 2) == drawn(GREY, film, 2)).all()


@pytest.mark.parametrize("text", ["{}", '{"size": 3}', "[]"])
def test_damaged_facts_are_refused(text):
    with pytest.raises(ValueError, match="overlays show"):
        facts_of(text)


def test_a_frame_is_drawn_around_the_body_and_nowhere_else():
    film = film_of({"highlights": [{"ids": "near.1"}]})
    found = changed(drawn(GREY, film, 0), GREY)
    corners = box_corners(film.frames[0].poses[1], film.sizes[1])
    top, left, bottom, right = frame_around(film.frames[0].view, corners, SIZE)
    assert found.min(axis=0) == pytest.approx([top, left], abs=4.5)
    assert found.max(axis=0) == pytest.approx([bottom, right], abs=4.5)
    middle = (found > [top + 3, left + 3]) & (found < [bottom - 3, right - 3])
    assert not middle.all(axis=1).any()


def test_what_no_pixel_shows_is_not_marked_but_what_is_unknown_is():
    for overlays in ({"highlights": [{"ids": "*"}]}, {"labels": [{"ids": "*"}]}, {"dots": {}}):
        film = film_of(overlays)
        assert len(changed(drawn(GREY, film, 0), GREY))
        assert not len(changed(drawn(GREY, film, 0, NOBODY), GREY))
        only = ShownUsers(frozenset(KEYS[1:2]), NOBODY.covered)
        assert len(changed(drawn(GREY, film, 0, only), GREY))


def test_the_vehicle_that_the_camera_is_in_has_no_label_but_one_beside_it_has():
    # From 10 m behind, all three are ahead.
    film = film_of({"labels": [{"ids": "own"}]}, inside=False)
    back = film.frames[0]
    matrix = back.view.world_from_camera.matrix.copy()
    matrix[0, 3] -= 10.0
    object.__setattr__(back.view, "world_from_camera", Transform(matrix))
    assert len(changed(drawn(GREY, film, 0), GREY))
    object.__setattr__(film, "inside", True)
    assert not len(changed(drawn(GREY, film, 0), GREY))


def test_of_labels_that_overlap_only_the_nearest_is_written():
    text = {"text": "a rather long text", "ids": "*"}
    both = drawn(GREY, film_of({"labels": [text]}), 0)
    near = drawn(GREY, film_of({"labels": [{**text, "ids": "near.1"}]}), 0)
    far = drawn(GREY, film_of({"labels": [{**text, "ids": "far.2"}]}), 0)
    assert len(changed(far, GREY))
    assert (both == near).all()


def test_labels_say_id_speed_and_distance():
    film = film_of({})
    assert label_text(film, film.frames[0], 1, "{id}: {speed}, {distance} m") == "near.1: 36, 14 m"
    assert label_text(film, film.frames[0], 2, "{speed}") == "?"


def test_trails_lie_on_the_ground_behind_the_body_and_never_on_road_users():
    film = film_of({"trails": [{"ids": "near.1", "seconds": 0.9, "width": 1.0}]})
    found = changed(drawn(GREY, film, 0), GREY)
    # From the rear at 10 m back to where it was 0.9 s before, at 5 m: rows below the horizon.
    focal = 160 / np.tan(np.radians(30))
    assert found[:, 0].min() == pytest.approx(89.5 + focal * 1.5 / 10.0, abs=1.5)
    assert found[:, 0].max() >= 89.5 + focal * 1.5 / 5.2 or found[:, 0].max() == 179
    covered = np.zeros((180, 320), dtype=bool)
    covered[:, :160] = True
    half = changed(drawn(GREY, film, 0, ShownUsers(frozenset(), covered)), GREY)
    assert len(half) and half[:, 1].min() == 160
    assert half[:, 1].max() == found[:, 1].max()


def test_words_come_and_go_at_their_times():
    film = film_of({"text": [{"text": "now", "from": 0.1, "to": 0.3}]})
    seen = [bool(len(changed(drawn(GREY, film, number), GREY))) for number in range(4)]
    assert seen == [False, True, True, False]


def test_two_plates_at_one_place_do_not_overlap():
    one = {"text": "first", "place": "top_left"}
    other = {"text": "second", "place": "top_left"}
    first = changed(drawn(GREY, film_of({"text": [one]}), 0), GREY)
    both = changed(drawn(GREY, film_of({"text": [one, other]}), 0), GREY)
    below = both[both[:, 0] > first[:, 0].max()]
    assert len(below) >= 0.5 * len(first)


def test_clocks_cut_off_and_never_round_up():
    assert time_text(453.1999, ClockOverlay()) == "0:07:33.1"
    assert time_text(3_723.25, ClockOverlay()) == "1:02:03.2"
    assert time_text(453.3, ClockOverlay(form="seconds")) == "453.3 s"


def test_the_speed_is_that_of_the_ridden_or_the_named_vehicle():
    film = film_of({})
    assert speed_of(film, film.frames[0], None) == 5.0
    assert speed_of(film, film.frames[0], "near.1") == 10.0
    assert speed_of(film, film.frames[0], "far.2") is None  # not logged
    assert speed_of(film, film.frames[0], "other") is None


def test_colours_run_from_red_to_blue_and_stay_at_the_ends():
    scale = OverlaySettings().scale
    slow, fast = speed_colour(0.0, scale), speed_colour(14.0, scale)
    assert slow[0] > 200 > slow[2] and fast[2] > 190 > fast[0]
    assert speed_colour(99.0, scale) == fast


def test_the_scale_says_kilometres_an_hour(monkeypatch):
    said = []
    write = Canvas.text

    def noting(self, words, *args, **more):
        said.append(words)
        write(self, words, *args, **more)

    monkeypatch.setattr(Canvas, "text", noting)
    film = film_of({"scale": {"place": "bottom", "slowest": 5, "fastest": 25}})
    drawn(GREY, film, 0, NOBODY)
    assert said == ["18", "90 km/h"]


def test_the_map_turns_with_the_camera_or_keeps_north_up():
    turned = drawn(GREY, film_of({"map": {}}), 0)
    north = drawn(GREY, film_of({"map": {"north_up": True}}), 0)
    # The lane runs east, as the camera looks: upward on the one, across on the other.
    lane = np.abs(turned - np.float32(0x62 / 255)).max(axis=-1) < 0.06
    other = np.abs(north - np.float32(0x62 / 255)).max(axis=-1) < 0.06
    assert np.ptp(np.argwhere(lane)[:, 0]) > 3 * np.ptp(np.argwhere(lane)[:, 1])
    assert np.ptp(np.argwhere(other)[:, 1]) > 3 * np.ptp(np.argwhere(other)[:, 0])


def test_what_is_clear_lets_what_lies_below_through():
    canvas = Canvas((8, 8))
    square = np.array([[-1.0, -1.0], [-1.0, 9.0], [9.0, 9.0], [9.0, -1.0]])
    canvas.area(square, rgba("#ffffff"))
    canvas.area(square, rgba("#000000", 0.5))
    found = canvas.over(np.zeros((8, 8, 3), dtype=np.float32))
    assert found[2:6, 2:6] == pytest.approx(0.5, abs=0.01)


@pytest.mark.parametrize(
    "overlays",
    [
        {"text": [{"text": "x", "from": 2, "to": 1}]},
        {"scale": {"slowest": 9, "fastest": 3}},
        {"labels": [{}]},
        {"map": {"radius": 0}},
        {"wrong": 1},
    ],
)
def test_overlays_that_cannot_be_are_refused(overlays):
    with pytest.raises(ValidationError):
        OverlaySettings.model_validate(overlays)
