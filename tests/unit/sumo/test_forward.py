"""Skipping the beginning of a log."""

from array import array

import pytest

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.sumo import read_trajectories
from sumo3dviz_pt.sumo.formats.xml import FastForward

HEAD = b"<?xml version='1.0'?>\n<!-- a > b\n<c/> -->\n<fcd-export>\n"
STEPS = [
    f'<timestep time="{t}.00">\n<vehicle id="v{t}"/>\n</timestep>\n'.encode() for t in range(9)
]
LOG = HEAD + b"".join(STEPS) + b"</fcd-export>\n"


def run(log, begin, size):
    steps = array("d")
    forward = FastForward(begin, steps)
    out = b"".join(forward(log[i : i + size]) for i in range(0, len(log), size))
    return out, list(steps), forward.lines


@pytest.mark.parametrize("size", [1, 2, 7, 16, 64, 10_000])
@pytest.mark.parametrize("begin", [-5, 0, 0.5, 3, 8, 8.5, 99])
def test_exactly_the_earlier_steps_are_dropped(size, begin):
    out, steps, lines = run(LOG, begin, size)
    early = [t for t in range(9) if t < begin]
    assert out == HEAD + b"".join(STEPS[len(early) :]) + b"</fcd-export>\n"
    assert steps == early
    assert lines == 3 * len(early)


@pytest.mark.parametrize("size", [3, 1000])
def test_odd_steps_are_left_to_the_parser(size):
    for tag in (b'<timestep time="soon">', b"<timestep>", b'<timestep when="1">'):
        log = HEAD + STEPS[0] + tag + STEPS[1]
        out, steps, _ = run(log, 5, size)
        assert out == HEAD + tag + STEPS[1]
        assert steps == [0]


def test_other_notations_of_a_step():
    log = HEAD + b"<timestep note='x' time = '00:00:02'/>" + STEPS[5] + b"</fcd-export>"
    out, steps, _ = run(log, 5, 50)
    assert (out, steps) == (HEAD + STEPS[5] + b"</fcd-export>", [2])


def test_later_errors_name_the_right_line(tmp_path):
    rows = "".join(
        f'<timestep time="{t}">\n<vehicle id="v" x="0" y="0" angle="{"nan" if t == 700 else 0}"/>\n'
        "</timestep>\n"
        for t in range(800)
    )
    path = tmp_path / "log.xml"
    path.write_text(f"<fcd-export>\n{rows}</fcd-export>", encoding="utf-8")
    for begin in (None, 0, 5, 700):
        with pytest.raises(InputError, match="angle") as caught:
            read_trajectories([path], begin=begin)
        assert caught.value.line == 2 + 3 * 700 + 1


@pytest.mark.parametrize("begin", [None, 0, 30, 49, 90])
def test_breaking_off_is_seen_wherever_the_window_lies(tmp_path, begin):
    rows = "".join(
        f'<timestep time="{t}">\n<vehicle id="v" x="0" y="0" angle="0"/></timestep>\n'
        for t in range(50)
    )
    path = tmp_path / "log.xml"
    path.write_text(f"<fcd-export>\n{rows}<oops", encoding="utf-8")
    with pytest.raises(InputError, match="breaks off after 49 complete") as caught:
        read_trajectories([path], begin=begin)
    assert caught.value.line in (101, 102)
