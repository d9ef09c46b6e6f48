"""A moving window of a log shows what films show, and nothing beyond its last step."""

import gzip
from dataclasses import replace

import numpy as np
import pytest

from sumo3dviz_pt import example
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.motion import MARGIN
from sumo3dviz_pt.pipeline.reading import Ground
from sumo3dviz_pt.pipeline.scene_file import load_job
from sumo3dviz_pt.recording.feeds import LoopFeed
from sumo3dviz_pt.recording.live_log import HELD, LiveLog
from sumo3dviz_pt.recording.stepped import steps_of

WAY = 30.0  # that a road user must drive before and after, to be the film's [m]


@pytest.fixture(scope="module")
def recorded():
    """A junction's scene file, its log as films read it, and the log's steps."""
    scene = example("crossing")
    job = load_job(scene)
    with gzip.open(scene.with_name("fcd.xml.gz"), "rt", encoding="utf-8") as stream:
        steps = tuple(steps_of(stream))
    return job, Ground.of(job), steps


def fed(recorded, until, *, delay=MARGIN):
    """A window that was fed in pieces until a time."""
    job, ground, steps = recorded
    log = LiveLog(job, ground, delay=delay)
    there = [step for step in steps if float(step.time) <= until]
    for first in range(0, len(there), 40):
        log.take(there[first : first + 40])
    return log


def test_all_steps_are_found(recorded):
    _, ground, steps = recorded
    traffic = ground.scenario.traffic
    assert (float(steps[0].time), float(steps[-1].time)) == (traffic.begin, traffic.end)
    count = sum(len(step.rows) for step in steps)
    assert count >= sum(len(trace.times) for trace in traffic.traces) > 1000


def test_a_step_that_breaks_off_is_none():
    row = '<vehicle id="a" x="0"/>\n'
    lines = ['<tlsState time="1" id="J" state="G"/>\n', '<timestep time="1">\n', row]
    assert list(steps_of(lines)) == []
    (step,) = steps_of([*lines, "</timestep>\n", '<timestep time="2">\n', row])
    assert (step.time, step.rows, len(step.lights)) == ("1", (row,), 1)
    people = ['<timestep time="1">\n', '<person id="p"/>\n', "</timestep>\n"]
    (step,) = steps_of([*lines, "</timestep>\n", *people])
    assert len(step.rows) == 2


def far_enough(trace, time, begin, end):
    """Whether a trace is known over its whole life, or far enough, before and after a time."""
    held = (trace.times >= begin) & (trace.times <= end)
    ways = np.linalg.norm(np.diff(trace.positions[held], axis=0), axis=1)
    after = trace.times[held][1:] > time
    before = held[0] or (ways[~after].sum() > WAY and begin <= time - MARGIN)
    return before and (held[-1] or (ways[after].sum() > WAY and end >= time + MARGIN))


def test_poses_are_those_of_films_where_the_window_covers(recorded):
    _, film, _ = recorded
    whole = {each.key: each for each in film.trajectories}
    traces = {trace.key: trace for trace in film.scenario.traffic.traces}
    compared = 0
    for newest in (film.end - 20.0, film.end - 8.0, film.end):
        window = fed(recorded, newest).ground()
        assert window is not None and window.end == pytest.approx(newest - MARGIN, abs=0.2)
        held = window.scenario.traffic
        time = window.end - 0.37
        for each in window.trajectories:
            if not far_enough(traces[each.key], time, held.begin, held.end):
                continue
            live, own = (some.sample(np.array([time])) for some in (each, whole[each.key]))
            assert live.alive[0] == own.alive[0], each.key
            if live.alive[0]:
                compared += 1
                np.testing.assert_allclose(live.positions, own.positions, atol=1e-6)
                turned = np.angle(np.exp(1j * (live.yaws - own.yaws)))
                np.testing.assert_allclose(turned, 0.0, atol=1e-6)
    assert compared > 30


def test_nobody_is_drawn_beyond_the_last_step(recorded):
    _, film, _ = recorded
    log = fed(recorded, film.begin + 20.0, delay=2.0)
    window = log.ground()
    assert window is not None and log.newest is not None and window.growing
    assert window.end == log.newest - 2.0
    assert max(piece.end for each in window.trajectories for piece in each.pieces) <= log.newest
    frames = window.frames(25.0)
    assert frames[0] >= window.begin - 1e-6 and frames[-1] <= window.end + 1e-6
    assert fed(recorded, film.begin + 1.0, delay=2.0).ground() is None
    ended = log.ground(ended=True)
    assert ended is not None and ended.end == log.newest and not ended.growing


def test_frames_keep_their_times_when_the_window_moves(recorded):
    _, film, _ = recorded
    one = replace(film, begin=3.1, end=8.0, origin=0.0)
    shared = np.intersect1d(one.frames(25.0), replace(one, begin=4.3, end=9.0).frames(25.0))
    assert shared[0] >= 4.3 and shared[-1] <= 8.0 and len(shared) == 93


def test_memory_holds_the_window_only(recorded):
    job, ground, steps = recorded
    log, sizes = LiveLog(job, ground, delay=2.0), []
    lasts = float(steps[-1].time) - float(steps[0].time) + ground.scenario.traffic.step
    for turn in range(4):
        moved = [replace(s, time=f"{float(s.time) + turn * lasts:.2f}") for s in steps]
        light = f'<tlsState time="0" id="J" state="{"Gr"[turn % 2]}"/>\n'
        moved[0] = replace(moved[0], lights=(light,))
        log.take(moved)
        if turn not in (1, 3):
            continue
        window = log.ground()
        assert window is not None
        traffic = window.scenario.traffic
        assert traffic.end - traffic.begin <= HELD + 1e-6
        cars = [trace for trace in traffic.traces if trace.kind == "vehicle"]
        assert min(trace.times[0] for trace in cars) >= traffic.end - HELD - 1e-6
        sizes.append(sum(len(trace.times) for trace in cars))
    assert sizes[1] <= 1.1 * sizes[0]
    assert window.scenario.signals["J"].states[-1] == "r"


def test_a_loop_never_waits_and_loses_only_what_is_not_shown(recorded):
    job, ground, steps = recorded
    feed = LoopFeed(LiveLog(job, ground, delay=2.0))
    for step in steps[:40]:
        feed.put(step)
    window = feed.advance(0.0)
    assert window is not None and window.behind < HELD
    assert feed.advance(0.0) is None
    feed.stop("the loop has ended")
    last = feed.advance(0.0)
    assert last is not None and last.end == float(steps[39].time) and not last.growing


def test_changed_traffic_needs_a_recording(recorded):
    job, ground, _ = recorded
    changed = load_job(example("crossing"), {"traffic.leave_out": ["*"]})
    assert job.traffic is None
    with pytest.raises(ConfigError, match="view a recording"):
        LiveLog(changed, ground, delay=2.0)
