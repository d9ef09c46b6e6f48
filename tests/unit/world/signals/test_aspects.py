"""Letters of the signal log as lamps."""

import pytest

from sumo3dviz_pt.model.traffic import SignalPhases
from sumo3dviz_pt.world.signals.heads import course_of, with_yellow

RED, YELLOW, GREEN = "red", "yellow", "green"


def course(letters, *, step=10.0, start=0.0):
    times = tuple(start + step * i for i in range(len(letters)))
    return course_of(SignalPhases("J", times, tuple(letters)), 0)


@pytest.mark.parametrize(
    ("letter", "three", "two"),
    [
        ("r", {RED}, {RED}),
        ("s", {RED}, {RED}),
        ("u", {RED, YELLOW}, {RED}),
        ("y", {YELLOW}, {RED}),
        ("Y", {YELLOW}, {RED}),
        ("g", {GREEN}, {GREEN}),
        ("G", {GREEN}, {GREEN}),
        ("O", set(), set()),
        ("?", set(), set()),
    ],
)
def test_every_letter(letter, three, two):
    assert course([letter]).lit_at(5.0, lamps=3) == three
    assert course([letter]).lit_at(5.0, lamps=2) == two


@pytest.mark.parametrize(("time", "lit"), [(7.0, True), (7.49, True), (7.5, False), (7.99, False)])
def test_o_blinks_once_a_second_by_absolute_time(time, lit):
    assert course("o").lit_at(time) == ({YELLOW} if lit else set())
    assert course("o").lit_at(time, lamps=2) == set()
    # A log that begins later blinks in the same phase.
    assert course("o", start=3.3).lit_at(time) == ({YELLOW} if lit else set())


def test_dark_before_the_log_and_for_links_that_it_does_not_know():
    assert course("G", start=100.0).lit_at(99.9) == set()
    assert course("G", start=100.0).lit_at(100.0) == {GREEN}
    assert course_of(SignalPhases("J", (0.0,), ("Gr",)), 2).lit_at(5.0) == set()


def test_letters_that_look_the_same_are_one_stretch():
    found = course("GgGrsrY")
    assert found.letters == ("G", "r", "y")
    assert found.times == (0.0, 30.0, 60.0)


def test_yellow_ends_the_green_when_the_log_knows_none():
    found = with_yellow(course("rGr"), 3.0)
    assert found.lit_at(16.99) == {GREEN}
    assert found.lit_at(17.0) == {YELLOW}
    assert found.lit_at(19.99) == {YELLOW}
    assert found.lit_at(20.0) == {RED}


@pytest.mark.parametrize("letters", ["Gyr", "GYr", "ruGr"])
def test_logged_yellow_forbids_interpolated_yellow(letters):
    assert with_yellow(course(letters), 3.0) == course(letters)


@pytest.mark.parametrize("letters", ["rG", "GO", "Go", "G", "r", "rrr"])
def test_no_yellow_without_a_change_to_red(letters):
    assert with_yellow(course(letters), 3.0) == course(letters)


def test_short_greens_keep_their_first_half():
    found = with_yellow(course("rGr", step=2.0), 3.0)
    assert found.lit_at(2.5) == {GREEN}
    assert found.lit_at(3.0) == {YELLOW}
    assert found.lit_at(4.0) == {RED}


def test_g_after_G_is_one_green():
    found = with_yellow(course("rGgr"), 3.0)
    assert found.lit_at(18.0) == {GREEN}
    assert found.lit_at(28.0) == {YELLOW}
