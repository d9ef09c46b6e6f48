"""Which samples are of backing up and of moves aside into and out of parking places."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from drives import drive, road, trace_of

from sumo3dviz_pt.motion.manoeuvres import stretches
from sumo3dviz_pt.motion.samples import split

PARKING_TIME = 3.0  # as the manual says [s]


def samples_of(trace):
    (samples,) = split(trace, step=0.0)
    return samples


def kinds(found):
    return [stretch.kind for stretch in found]


def assert_whole(found, samples):
    """Each begins with the sample that the one before it ends with; together they are all."""
    assert found[0].samples.times[0] == samples.times[0]
    assert found[-1].samples.times[-1] == samples.times[-1]
    for before, after in pairwise(found):
        assert before.samples.times[-1] == after.samples.times[0]
        np.testing.assert_array_equal(before.samples.positions[-1], after.samples.positions[0])
    assert all(len(stretch.samples.times) >= 2 for stretch in found)


def parked(*, side=-5.0, stands=20, step=1.0, turned=0.0):
    """Drive, stand, jump aside in one step, stand, jump back, drive on; speeds as logged."""
    times = np.arange(0.0, 10.0 + 3.0 * stands, step)
    leaves = 10.0 + 2.0 * stands
    along = 5.0 * (np.minimum(times, 10.0) + np.maximum(times - leaves - 5.0, 0.0))
    aside = np.where((times > 10.0 + stands) & (times < leaves), side, 0.0)
    speeds = np.where((times < 10.0) | (times > leaves + 5.0), 5.0, 0.0)
    yaws = np.where(aside != 0.0, turned, 0.0)
    xy = np.column_stack([along, aside])
    return samples_of(trace_of(times, xy, yaws, speeds, lanes=0, offsets=along, exact=True))


def there_and_back(*, speeds=2.0, offsets=True, turning=0.0):
    """Ten seconds ahead, six backward, ten ahead; the angle stays."""
    times = np.arange(0.0, 27.0)
    along = 20.0 + 2.0 * np.interp(times, [0.0, 10.0, 16.0, 26.0], [0.0, 10.0, 4.0, 14.0])
    yaws = turning * times
    places = along if offsets else np.full(27, np.nan)
    xy = np.column_stack([along, 0.0 * along])
    lanes = 0 if offsets else -1
    return samples_of(trace_of(times, xy, yaws, speeds, lanes=lanes, offsets=places, exact=True))


# Parking -----------------------------------------------------------------------------------


@pytest.mark.parametrize("turned", [0.0, np.radians(45.0), np.radians(90.0)])
@pytest.mark.parametrize("side", [-8.0, -2.0, 3.5])
def test_a_step_aside_while_standing_is_parking(side, turned):
    samples = parked(side=side, turned=turned)
    found = stretches(samples, kind="vehicle")
    assert kinds(found) == ["", "parking", "", "parking", ""]
    assert_whole(found, samples)
    for stretch, jump in ((found[1], 30.0), (found[3], 49.0)):
        first, last = stretch.samples.times
        assert first <= jump and last >= jump + 1.0
        assert last - first == pytest.approx(PARKING_TIME)
        moved = stretch.samples.positions[-1] - stretch.samples.positions[0]
        assert abs(moved[1]) == pytest.approx(abs(side))
    # Nothing else of it stands where it jumps.
    rest = np.concatenate([np.diff(found[k].samples.positions[:, 1]) for k in (0, 2, 4)])
    np.testing.assert_allclose(rest, 0.0)


@pytest.mark.parametrize("step", [0.1, 0.5, 2.0])
def test_a_move_aside_takes_its_time_whatever_the_step(step):
    found = stretches(parked(step=step), kind="vehicle")
    for stretch in found:
        if stretch.kind:
            first, last = stretch.samples.times
            assert PARKING_TIME - 1e-6 <= last - first < PARKING_TIME + step + 1e-6


def test_less_than_a_parking_place_aside_is_a_drive():
    assert kinds(stretches(parked(side=-1.4), kind="vehicle")) == [""]


@pytest.mark.parametrize("lane", [0, 1], ids=["on one lane", "change of lanes"])
def test_a_change_of_lanes_before_driving_off_is_no_parking(lane):
    times = np.arange(0.0, 40.0)
    along = 5.0 * (np.minimum(times, 10.0) + np.maximum(times - 20.0, 0.0))
    over = times > 19.5
    speeds = np.where((times < 10.0) | (times > 20.0), 5.0, 0.0)
    xy = np.column_stack([along, 3.2 * over])
    trace = trace_of(times, xy, 0.0, speeds, lanes=lane * over, offsets=along)
    assert ("parking" in kinds(stretches(samples_of(trace), kind="vehicle"))) == (lane == 0)


def test_without_speeds_the_places_tell_who_stands():
    samples = parked()
    samples = replace(samples, speeds=np.full(len(samples.times), np.nan))
    assert kinds(stretches(samples, kind="vehicle")) == ["", "parking", "", "parking", ""]


@pytest.mark.parametrize("kind", ["person", "container"])
def test_only_vehicles_park_and_reverse(kind):
    for samples in (parked(), there_and_back()):
        (only,) = stretches(samples, kind=kind)
        assert only.samples is samples and only.kind == ""


# Reversing ---------------------------------------------------------------------------------


@pytest.mark.parametrize("offsets", [True, False], ids=["places tell", "angles tell"])
def test_steps_backward_are_reversing(offsets):
    samples = there_and_back(offsets=offsets)
    found = stretches(samples, kind="vehicle")
    assert kinds(found) == ["", "reversing", ""]
    assert_whole(found, samples)
    np.testing.assert_array_equal(found[1].samples.times, np.arange(10.0, 17.0))


def test_backward_by_rounding_is_not_meant():
    times = np.arange(0.0, 30.0)
    along = 20.0 + 0.1 * (-1.0) ** times
    xy = np.column_stack([along, 0.0 * along])
    samples = samples_of(trace_of(times, xy, 0.0, 0.0, lanes=0, offsets=along))
    along = samples.positions[:, 0] * 0.7
    samples = replace(samples, positions=np.column_stack([along, 0.0 * along, 0.0 * along]))
    assert kinds(stretches(samples, kind="vehicle")) == [""]


def test_who_turns_round_does_not_reverse():
    # Without lanes an angle that turns fast tells of a turn, not of backing up.
    samples = there_and_back(offsets=False, turning=2.0)
    assert "reversing" not in kinds(stretches(samples, kind="vehicle"))


@pytest.mark.parametrize("length", [5.0, 12.0, 25.0])
@pytest.mark.parametrize("name", ["corner", "roundabout", "dead end"])
def test_long_bodies_in_tight_turns_do_not_reverse(name, length):
    # The angle of a long chord may point away from the way; places on lanes still rise.
    _, way = road(name)
    trace = drive(way, np.arange(0.0, 30.0), lambda t: 60.0 + 4.0 * np.asarray(t), length=length)
    assert kinds(stretches(samples_of(trace), kind="vehicle")) == [""]


def test_places_that_fall_tell_of_reversing_even_where_the_angle_turns():
    samples = there_and_back(offsets=True, turning=0.02)
    assert kinds(stretches(samples, kind="vehicle")) == ["", "reversing", ""]


# Sliding -----------------------------------------------------------------------------------


def slid(*, speed, ahead, seconds=4):
    """A creep aside by 3.2 m in some seconds on one lane, with `ahead` m/s ahead around it."""
    times = np.arange(0.0, 30.0)
    aside = np.interp(times, [10.0, 10.0 + seconds], [0.0, 3.2])
    amid = (times > 10.0) & (times <= 10.0 + seconds)
    along = 10.0 + np.cumsum(np.where(amid, 0.1, ahead))
    xy = np.column_stack([along, aside])
    speeds = np.where(amid, speed, ahead)
    return samples_of(trace_of(times, xy, 0.0, speeds, lanes=0, offsets=along, exact=True))


def test_a_slide_aside_of_who_stands_around_it_is_a_manoeuvre():
    samples = slid(speed=0.1, ahead=0.0)
    found = stretches(samples, kind="vehicle")
    assert kinds(found) == ["", "parking", ""]
    assert_whole(found, samples)
    assert found[1].samples.times[0] <= 10.0 and found[1].samples.times[-1] >= 14.0


@pytest.mark.parametrize(("speed", "ahead"), [(5.0, 0.0), (0.1, 3.0)])
def test_a_slide_of_who_drives_is_a_drive(speed, ahead):
    # Its own speed says that it turns a corner, or it drives on far enough.
    assert kinds(stretches(slid(speed=speed, ahead=ahead), kind="vehicle")) == [""]


def test_manoeuvres_in_a_row_are_disjoint():
    one, two = parked(), there_and_back()
    shift = one.times[-1] + 1.0
    moved = two.positions + (one.positions[-1] - two.positions[0]) + [2.0, 0.0, 0.0]
    two = replace(two, times=two.times + shift, positions=moved)
    names = ("times", "positions", "yaws", "slopes", "speeds", "lanes", "offsets")
    both = {name: np.concatenate([getattr(one, name), getattr(two, name)]) for name in names}
    samples = replace(one, **both)
    found = stretches(samples, kind="vehicle")
    assert [kind for kind in kinds(found) if kind] == ["parking", "parking", "reversing"]
    assert_whole(found, samples)
