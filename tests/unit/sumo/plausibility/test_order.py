"""Logs whose rows are out of order are sorted, and a note says so."""

import logging

import pytest

from sumo3dviz_pt.sumo import read_trajectories, reader


def row(name, x):
    return f'<vehicle id="{name}" x="{x}" y="2" angle="90" type="car" lane="a_0"/>'


def log(folder, *steps):
    text = "".join(f'<timestep time="{time}">{rows}</timestep>\n' for time, rows in steps)
    path = folder / "log.xml"
    path.write_text(f"<fcd-export>\n{text}</fcd-export>", encoding="utf-8")
    return path


TWICE = ((0, row("v", 1)), (1, row("v", 2) + row("u", 9) + row("v", 40)), (2, row("v", 3)))
BACK = ((0, row("v", 1)), (2, row("v", 3)), (1, row("v", 2)), (2, row("v", 3)), (3, row("v", 4)))


@pytest.mark.parametrize(
    ("steps", "said"),
    [
        (TWICE, "a road user is at two places at one time, once (first: `v` at 1 s)"),
        (BACK, "time goes backward once, at first from 2 s to 1 s; the steps are sorted"),
    ],
)
def test_what_is_out_of_order_is_said(steps, said, tmp_path, caplog, monkeypatch):
    monkeypatch.setenv("SUMO3DVIZ_PT_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(reader, "_LEAST", 0)
    path = log(tmp_path, *steps)
    # What was kept of a log says it as well.
    for _ in range(2):
        caplog.clear()
        with caplog.at_level(logging.WARNING):
            (trace,) = (t for t in read_trajectories([path]).traces if t.id == "v")
        (message,) = caplog.messages
        assert said in message and str(path) in message
        assert trace.positions[:, 0].tolist() == [1, 2, 3, 4][: len(trace.times)]
    assert len(list((tmp_path / "cache" / "logs").iterdir())) == 1


def test_repeated_steps_that_agree_are_sorted_in_silence(tmp_path, caplog):
    path = log(tmp_path, (0, row("v", 1)), (1, row("v", 2)), (1, row("v", 2)), (2, row("v", 3)))
    with caplog.at_level(logging.WARNING):
        (trace,) = read_trajectories([path]).traces
    assert not caplog.messages and trace.times.tolist() == [0, 1, 2]


def test_logs_of_two_runs_are_told_and_parts_of_one_are_not(tmp_path, caplog):
    """Rows of another run would join those of the first where that ends, without a word."""
    steps = [(t, row("v", t)) for t in range(6)]
    runs = {"a": steps[:4], "b": [(t, row("v", 90 + t)) for t in range(6)], "c": steps[3:]}
    for name in runs:
        (tmp_path / name).mkdir()
    whole, other, rest = (log(tmp_path / name, *some) for name, some in runs.items())
    read_trajectories([whole, other])
    assert "two places at one time, 4 times (first: `v` at 0 s)" in caplog.text
    assert "logs of several runs are no one simulation" in caplog.text
    caplog.clear()
    (trace,) = read_trajectories([whole, rest]).traces
    assert not caplog.text and len(trace.times) == 6
