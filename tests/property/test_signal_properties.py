"""Laws of signal courses, for any log."""

from bisect import bisect_right

from hypothesis import given
from hypothesis import strategies as st

from sumo3dviz_pt.model.traffic import SignalPhases
from sumo3dviz_pt.world.signals.heads import course_of, with_yellow

LETTERS = "rRyYgGuoOs"
LIT = {"r": {"red"}, "s": {"red"}, "y": {"yellow"}, "Y": {"yellow"}, "g": {"green"},
       "G": {"green"}, "u": {"red", "yellow"}}  # fmt: skip
LOGS = st.lists(st.tuples(st.floats(0.1, 60.0), st.sampled_from(LETTERS)), min_size=1, max_size=20)


def phases(log):
    times, time = [], 0.0
    for step, _ in log:
        times.append(time)
        time += step
    return SignalPhases("J", tuple(times), tuple(letter for _, letter in log))


@given(LOGS, st.floats(-10.0, 1500.0))
def test_lamps_are_those_of_the_logged_letter(log, time):
    entry = phases(log)
    index = bisect_right(entry.times, time + 1e-9) - 1
    letter = entry.states[index] if index >= 0 else "O"
    lit = course_of(entry, 0).lit_at(time)
    assert lit <= {"yellow"} if letter == "o" else lit == LIT.get(letter, set())


@given(LOGS, st.floats(-10.0, 1500.0), st.floats(0.1, 10.0))
def test_interpolated_yellow_replaces_nothing_but_green(log, time, duration):
    logged = course_of(phases(log), 0)
    shown = with_yellow(logged, duration)
    before, after = logged.lit_at(time), shown.lit_at(time)
    assert after == before or (before, after) == ({"green"}, {"yellow"})
    assert all(a < b for a, b in zip(shown.times, shown.times[1:], strict=False))
