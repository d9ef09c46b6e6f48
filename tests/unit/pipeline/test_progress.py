"""How far work is and how long it will take."""

import io
import re
import sys
import threading
import time

import pytest

from sumo3dviz_pt.model.progress import Doing, ProgressEvent, announce, heard_by
from sumo3dviz_pt.pipeline.steps import WorkCourse, WorkStep, can_redraw, clock, followed

FILM = (
    WorkStep(Doing.READ, 2.0),
    WorkStep(Doing.BUILD, 10.0),
    WorkStep(Doing.OPEN, 3.0),
    WorkStep(Doing.RENDER, 100.0),
    WorkStep(Doing.ENCODE, 5.0),
)


def replayed(slowness, frames=10, *, every=0.5):
    """Time, estimate and true time left of work that takes `slowness` times as long as expected."""
    course = WorkCourse(FILM, 100.0)
    events = [(100.0, None)]
    now = 100.0
    for step in FILM:
        if step.doing is Doing.RENDER:
            for number in range(frames + 1):
                seconds = slowness * step.seconds * number / frames
                events.append((now + seconds, ProgressEvent(step.doing, number, frames)))
        else:
            events.append((now, ProgressEvent(step.doing)))
        now += slowness * step.seconds
    end, found, time_ = now, [], 100.0
    while time_ < end:
        while events and events[0][0] <= time_ + 1e-9:
            _, event = events.pop(0)
            if event is not None:
                course.hear(event, time_)
        found.append((time_, course.seconds_left(time_), end - time_))
        time_ += every
    return found


@pytest.mark.parametrize("slowness", [0.6, 1.0, 1.8])
def test_estimates_stay_within_a_factor_of_two(slowness):
    for now, estimate, truth in replayed(slowness):
        if truth > 10:
            assert 0.5 < estimate / truth < 2.0, now


def test_a_machine_that_is_slower_is_learnt():
    at_half = [row for row in replayed(5.0) if row[2] < 300]
    assert all(0.7 < estimate / truth < 1.4 for _, estimate, truth in at_half if truth > 30)


def test_the_first_estimate_is_the_expectation():
    assert WorkCourse(FILM, 0.0).seconds_left(0.0) == pytest.approx(120.0)


def test_frames_that_were_there_before_do_not_count_for_the_pace():
    course = WorkCourse(FILM, 0.0)
    course.hear(ProgressEvent(Doing.RENDER, 90, 100), 15.0)
    for number in range(1, 6):
        course.hear(ProgressEvent(Doing.RENDER, 90 + number, 100), 15.0 + 10 * number)
    # Five frames at 10 s each, then encoding, which is as fast as expected so far.
    assert course.seconds_left(65.0) == pytest.approx(55.0)


def test_frames_that_compile_do_not_count_for_the_pace():
    course = WorkCourse(FILM, 0.0)
    now = 15.0
    course.hear(ProgressEvent(Doing.RENDER, 0, 100), now)
    for number, seconds in enumerate([20, 15, 15, 2, 2, 2], start=1):
        now += seconds
        course.hear(ProgressEvent(Doing.RENDER, number, 100), now)
    assert course.seconds_left(now) == pytest.approx(94 * 2 + 5)


def test_a_step_that_is_late_is_never_said_to_be_done():
    course = WorkCourse((WorkStep(Doing.READ, 1.0),), 0.0)
    assert course.seconds_left(0.0) == pytest.approx(1.0)
    assert course.seconds_left(100.0) == pytest.approx(25.0)


def left_under_load(share):
    """Estimates and truths of reading and four shots, given a share of the processor."""
    steps = 4 * (WorkStep(Doing.READ, 3.0), WorkStep(Doing.BUILD, 14.0))
    clock_ = [0.0]
    course = WorkCourse(steps, 0.0, lambda: share * clock_[0])
    ends = [sum(step.seconds for step in steps[: k + 1]) / share for k in range(len(steps))]
    at = 0
    while clock_[0] < ends[-1]:
        if clock_[0] >= ends[at]:
            at += 1
            course.hear(ProgressEvent(steps[at].doing), clock_[0])
        yield clock_[0], course.seconds_left(clock_[0]), ends[-1] - clock_[0]
        clock_[0] += 0.5


@pytest.mark.parametrize("share", [0.1, 0.3, 1.0])
def test_a_share_of_the_processor_is_seen_before_any_step_is_late(share):
    for now, estimate, truth in left_under_load(share):
        if now > 20 and truth > 10 / share:
            assert 0.6 < estimate / truth < 1.4, now


def test_a_step_that_is_late_slows_down_those_to_come():
    steps = (WorkStep(Doing.BUILD, 10.0), WorkStep(Doing.OPEN, 20.0))
    course = WorkCourse(steps, 0.0)
    assert course.seconds_left(0.0) == pytest.approx(30.0)
    # It took 40 s in place of 10: the next one is not said to take its 20 s after all.
    assert course.seconds_left(40.0) == pytest.approx(10.0 + 20.0 * 50.0 / 20.0)


def test_several_films_are_one_course():
    course = WorkCourse((*FILM, *FILM), 0.0)
    course.hear(ProgressEvent(Doing.ENCODE), 115.0)
    assert course.seconds_left(115.0) == pytest.approx(125.0)
    course.hear(ProgressEvent(Doing.READ), 120.0)
    assert course.seconds_left(120.0) == pytest.approx(120.0)


def test_the_share_grows_from_nothing_to_all():
    course = WorkCourse(FILM, 0.0)
    assert course.share(0.0) == 0.0
    course.hear(ProgressEvent(Doing.ENCODE), 115.0)
    assert course.share(115.0) == pytest.approx(115 / 120)


def test_words():
    course = WorkCourse(FILM, 0.0)
    assert course.words() == "reading the simulation"
    course.hear(ProgressEvent(Doing.RENDER, 3, 50), 20.0)
    assert course.words() == "rendering 3 of 50"


@pytest.mark.parametrize(
    ("seconds", "text"), [(0.4, "0:00"), (7, "0:07"), (750, "12:30"), (7500, "2:05:00")]
)
def test_durations(seconds, text):
    assert clock(seconds) == text


def test_logs_get_a_line_within_the_first_second():
    log = io.StringIO()
    with followed("drive.mp4", FILM, stream=log):
        time.sleep(1.2)
        announce(Doing.BUILD)
    # Who sleeps seems to wait for the processor, so how long is left hangs on the machine.
    assert re.match(r"drive.mp4: reading the simulation, about \d+:\d\d left\n", log.getvalue())


def test_nothing_is_said_of_what_is_over_at_once():
    log = io.StringIO()
    with followed("drive.mp4", FILM, stream=log):
        announce(Doing.READ)
    assert log.getvalue() == ""


class Terminal(io.StringIO):
    def isatty(self):
        return True


def test_lines_are_only_overwritten_where_they_can_be(monkeypatch):
    """A notebook's packages may be imported in a program that is no notebook."""
    monkeypatch.setitem(sys.modules, "ipykernel", sys)
    assert can_redraw(Terminal()) and not can_redraw(io.StringIO())


def test_terminals_get_a_bar_that_goes_on_by_itself():
    screen = Terminal()
    with followed("drive.mp4", FILM, stream=screen):
        announce(Doing.RENDER, 3, 50)
        time.sleep(1.2)
    assert "drive.mp4" in screen.getvalue() and "rendering 3 of 50" in screen.getvalue()
    assert "\n" not in screen.getvalue().strip("\n")


def test_a_part_of_a_step_says_nothing_of_its_own():
    course = WorkCourse((WorkStep(Doing.READ, 2.0), WorkStep(Doing.MEASURE, 60.0)), 0.0)
    course.hear(ProgressEvent(Doing.MEASURE, 1, 4, "noon"), 2.0)
    course.hear(ProgressEvent(Doing.BUILD), 10.0)
    course.hear(ProgressEvent(Doing.RENDER, 0, 9), 11.0)
    assert course.words() == "measuring noon, 1 of 4"


def test_nobody_hears_what_is_told_elsewhere():
    heard = []
    with heard_by(heard.append):
        announce(Doing.READ)
        other = threading.Thread(target=announce, args=(Doing.BUILD,))
        other.start()
        other.join()
    announce(Doing.OPEN)
    assert heard == [ProgressEvent(Doing.READ)]


def test_work_that_fails_leaves_no_thread():
    with pytest.raises(ZeroDivisionError), followed("a.png", FILM, stream=io.StringIO()):
        raise ZeroDivisionError
    assert not [one for one in threading.enumerate() if one.name == "progress"]
