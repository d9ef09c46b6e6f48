"""Moves between lanes: where they lie, in order, within their run, never while standing."""

from dataclasses import replace

import numpy as np
import pytest
from drives import NAMES, changing, network_of, stopping, straight, trace_of

from sumo3dviz_pt.motion.lanes import LaneGraph, Tracks
from sumo3dviz_pt.motion.path import follow, lane_path
from sumo3dviz_pt.motion.samples import split
from sumo3dviz_pt.motion.setting import Setting
from sumo3dviz_pt.motion.smoothers.hermite import run_along

WIDTH = 3.2


def made(network, trace, names=NAMES):
    """Path, moves and stations over time of a trace that is one run."""
    tracks = Tracks(LaneGraph(network))
    (samples,) = split(trace, step=0.0)
    (run,), failed = follow(samples, Setting(tracks, names))
    assert not failed
    along = run_along(samples.times, np.array(run.stations), samples.speeds, euler=False)
    path, blends = lane_path(tracks, run, along)
    return path, blends, along


def changed(along, lanes, *, step=1.0, speeds=np.nan):
    """A log of places on a road of two lanes."""
    times = step * np.arange(len(along))
    xy = np.column_stack([along, WIDTH * np.asarray(lanes)])
    return trace_of(times, xy, 0.0, speeds, lanes=np.asarray(lanes), offsets=along, exact=True)


# Size --------------------------------------------------------------------------------------


@pytest.mark.parametrize("speed", [8.0, 13.9, 36.0])
def test_an_instant_change_takes_its_time_around_the_middle_of_the_step(speed):
    network, trace = changing(speed, changes=(20.5,))
    _, (blend,), along = made(network, trace)
    assert blend.times == pytest.approx((18.5, 22.5))
    expected = along.at(np.array(blend.times))[0]
    np.testing.assert_allclose([blend.begin, blend.end], expected, atol=0.02)
    assert blend.width == pytest.approx(WIDTH)


def test_a_change_to_the_right_has_a_negative_width():
    network, trace = changing(10.0, changes=(10.5, 25.5))
    _, blends, _ = made(network, trace)
    np.testing.assert_allclose([blend.width for blend in blends], [WIDTH, -WIDTH])


@pytest.mark.parametrize("speed", [2.0, 1.0])
def test_who_drives_slowly_takes_longer(speed):
    network, trace = changing(speed, changes=(20.5,))
    _, (blend,), _ = made(network, trace)
    # Four widths ahead, by widening half a second on each side, but 8 s at most on each.
    seconds = min(np.ceil(4.0 * WIDTH / speed), 16.0)
    assert blend.times[1] - blend.times[0] == pytest.approx(seconds, abs=1.01)
    assert blend.end - blend.begin == pytest.approx(seconds * speed, abs=1.01 * speed)


def test_who_creeps_moves_over_one_and_a_half_widths():
    along = 10.0 + np.concatenate([9.0 * np.arange(20), 171.0 + 0.2 * np.arange(40)])
    along = np.concatenate([along, along[-1] + 9.0 * np.arange(1, 20)])
    network, lanes = straight(), (np.arange(len(along)) > 40).astype(int)
    _, (blend,), _ = made(network, changed(along, lanes))
    assert blend.end - blend.begin >= 1.5 * WIDTH - 1e-6


# Place -------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(6))
def test_moves_are_in_order_and_within_their_run(seed):
    chance = np.random.default_rng(seed)
    steps = np.minimum(chance.exponential(4.0, 60), 8.0) * (chance.random(60) > 0.3)
    along = 10.0 + np.concatenate([[0.0], np.cumsum(steps)])
    lanes = np.cumsum(chance.random(61) < 0.15) % 2
    path, blends, _ = made(straight(), changed(along, lanes))
    assert len(blends) == np.count_nonzero(np.diff(lanes)) == len(path.begins)
    assert len(path.tracks) == len(blends) + 1
    for blend in blends:
        assert blend.begin < blend.end
        assert blend.begin >= along[0] - 0.51 and blend.end <= along[-1] + 0.51
    assert (np.diff(path.begins) >= -1e-5).all() and (np.diff(path.ends) >= 0.0).all()


@pytest.mark.parametrize("at", [15, 20, 25, 29], ids=["amid", "amid too", "later", "last"])
def test_who_stands_keeps_its_lane(at):
    # 10 s drive, 20 s stand at 110 m, drive on; the log jumps amid the standstill.
    times = np.arange(45.0)
    along = 10.0 + 10.0 * (np.minimum(times, 10.0) + np.maximum(times - 30.0, 0.0))
    path, (blend,), _ = made(straight(), changed(along, (times > at).astype(int)))
    assert blend.end <= 110.0 + 1e-6 or blend.begin >= 110.0 - 1e-6
    shown = path.at(np.array([110.0]))[0][0, 1]
    assert min(abs(shown), abs(shown - WIDTH)) < 1e-6


def test_a_wide_move_is_not_begun_before_a_narrow_one_that_comes_first():
    # There is room for the first after the standstill, for the second only before it.
    lefts = np.array([0.0, WIDTH, WIDTH + 6.0])
    network = network_of({f"a_{k}": [(0, left), (900, left)] for k, left in enumerate(lefts)})
    times = np.arange(34.0)
    along = 10.0 + 10.0 * np.minimum(times, 10.0) + 2.0 * np.maximum(times - 30.0, 0.0)
    lanes = np.searchsorted([15.5, 25.5], times)
    xy = np.column_stack([along, lefts[lanes]])
    trace = trace_of(times, xy, 0.0, lanes=lanes, offsets=along, exact=True)
    path, (first, second), _ = made(network, trace, ("a_0", "a_1", "a_2"))
    assert first.begin >= 110.0 - 1e-6
    assert second.begin >= first.begin - 1e-5 and second.end >= first.end
    assert (path.at(np.linspace(100.0, 116.0, 50))[0][:, 1] >= -1e-9).all()


def test_who_brakes_to_a_stop_is_across_before_it():
    s, times = stopping(10.0, 3.0, 9.0), np.arange(30.0)
    along = s(times)
    path, (blend,), _ = made(straight(), changed(along, (times > 11.0).astype(int)))
    assert blend.end <= along[-1] + 1e-6
    assert path.at(along[-1:])[0][0, 1] == pytest.approx(WIDTH, abs=1e-6)


@pytest.mark.parametrize("change", [0.5, 1.5, 38.5])
def test_near_birth_and_death_moves_stay_inside(change):
    network, trace = changing(12.0, changes=(change,), last=39.0)
    path, (blend,), along = made(network, trace)
    assert blend.begin >= along.values[0] - 1e-6 and blend.end <= along.values[-1] + 1e-6
    ends = path.at(along.values[[0, -1]])[0][:, 1]
    np.testing.assert_allclose(ends, [0.0, WIDTH], atol=1e-6)


# Path --------------------------------------------------------------------------------------


def crossing_over(name=("a_0", "a_1", ":j_0_1", "b_1")):
    """Two lanes into a junction of which both lead on, 2 m to the left of where they were."""
    shapes = {
        "a_0": [(0, 0), (100, 0)],
        "a_1": [(0, WIDTH), (100, WIDTH)],
        ":j_0_0": [(100, 0), (120, 2)],
        ":j_0_1": [(100, WIDTH), (120, WIDTH + 2)],
        "b_0": [(120, 2), (400, 2)],
        "b_1": [(120, WIDTH + 2), (400, WIDTH + 2)],
    }
    return network_of(shapes, [("a_0", "b_0", ":j_0_0"), ("a_1", "b_1", ":j_0_1")]), name


def test_a_move_across_a_junction_has_both_tracks_beneath_it():
    network, names = crossing_over()
    along = 20.0 + 12.0 * np.arange(25)
    long = network.lanes[":j_0_1"].length
    lane = np.where(along < 95.0, 0, np.where(along < 100, 1, np.where(along < 100 + long, 2, 3)))
    offsets = along - np.array([0.0, 0.0, 100.0, 100.0 + long])[lane]
    shapes = [network.lanes[name].shape for name in names]
    at = [shapes[k][0] + (shapes[k][1] - shapes[k][0]) * o / network.lanes[names[k]].length
          for k, o in zip(lane, offsets, strict=True)]  # fmt: skip
    trace = trace_of(np.arange(25.0), np.array(at), 0.0, 12.0, lanes=lane, offsets=offsets)
    path, (blend,), _ = made(network, trace, names)
    assert blend.width == pytest.approx(WIDTH, abs=0.05)
    asked = np.linspace(blend.begin - 5.0, blend.end + 5.0, 200)
    points = path.at(asked)[0]
    low, high = (track.at(asked)[0][:, 1] for track in path.tracks)
    assert (points[:, 1] >= low - 1e-6).all() and (points[:, 1] <= high + 1e-6).all()
    np.testing.assert_allclose(high - low, WIDTH, atol=0.05)


@pytest.mark.parametrize("changes", [(20.5,), (20.5, 22.5), (20.5, 21.5, 23.5)])
def test_rates_are_derivatives_and_the_path_has_no_step(changes):
    network, trace = changing(13.9, changes=changes)
    path, blends, _ = made(network, trace)
    asked = np.linspace(blends[0].begin - 5.0, blends[-1].end + 5.0, 800)
    points, _, rates = path.at(asked)
    slope = (path.at(asked + 1e-5)[0] - path.at(asked - 1e-5)[0]) / 2e-5
    np.testing.assert_allclose(rates, slope, atol=1e-4)
    assert np.abs(np.diff(points[:, 1])).max() < 0.05


def test_the_direction_of_the_road_leaves_the_move_out():
    network, trace = changing(13.9)
    path, (blend,), _ = made(network, trace)
    middle = np.array([(blend.begin + blend.end) / 2.0])
    _, ahead, rates = path.at(middle)
    np.testing.assert_allclose(ahead, [[1.0, 0.0, 0.0]], atol=1e-9)
    # Half over, the eased move leads aside by 15/8 of its mean.
    assert rates[0, 1] == pytest.approx(15.0 / 8.0 * WIDTH / (blend.end - blend.begin))


def test_without_moves_the_path_is_its_track():
    network, trace = changing(13.9)
    trace = replace(trace, lanes=0 * trace.lanes, positions=trace.positions * [1.0, 0.0, 1.0])
    path, blends, _ = made(network, trace)
    assert blends == ()
    asked = np.linspace(-5.0, 500.0, 60)
    for shown, expected in zip(path.at(asked), path.tracks[0].at(asked), strict=False):
        np.testing.assert_array_equal(shown, expected)
