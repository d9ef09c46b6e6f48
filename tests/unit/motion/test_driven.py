"""The driven path: its way, its points behind the front, and where it lay before the log."""

from dataclasses import replace

import numpy as np
import pytest
from drives import Way, drive, network_of, road, trace_of

from sumo3dviz_pt.motion.driven import STEP, Driven
from sumo3dviz_pt.motion.samples import absolute_times, split
from sumo3dviz_pt.motion.setting import Setting
from sumo3dviz_pt.motion.smoothers.hermite import bridge

RADIUS = 20.0


def driven_of(trace, *, length=5.0):
    (samples,) = split(trace, step=0.0)
    front = bridge(samples, Setting(length=length))
    return Driven.of(front, samples, length=length, yaw=float(samples.yaws[0]))


def on_a_circle(*, speed=5.0, length=5.0, last=8.0, start=0.0):
    """A left turn on a circle about (0, 20), with the exact angle of the chord."""
    times = np.arange(0.0, last)

    def place(way):
        turned = (start + way) / RADIUS
        return RADIUS * np.column_stack([np.sin(turned), 1.0 - np.cos(turned)])

    ahead = place(speed * times) - place(speed * times - length)
    yaws = np.arctan2(ahead[:, 1], ahead[:, 0])
    return trace_of(times, place(speed * times), yaws, speed, exact=True)


def off_circle(points):
    return np.abs(np.linalg.norm(points[:, :2] - [0.0, RADIUS], axis=1) - RADIUS)


# Times -------------------------------------------------------------------------------------


def test_absolute_times_do_not_depend_on_the_begin():
    one, two = (absolute_times(begin, 9.27, step=STEP) for begin in (3.03, 5.55))
    assert one[0] == 3.03 and one[-1] == 9.27 and two[0] == 5.55
    np.testing.assert_allclose(one[1:-1], np.arange(31, 93) / 10.0)
    assert set(two[1:].tolist()) <= set(one.tolist())


def test_absolute_times_have_both_ends_once():
    np.testing.assert_allclose(absolute_times(1.0, 1.3, step=STEP), [1.0, 1.1, 1.2, 1.3])
    np.testing.assert_array_equal(absolute_times(1.01, 1.02, step=STEP), [1.01, 1.02])


# Travelled ---------------------------------------------------------------------------------


def test_way_on_a_circle_is_its_arc():
    driven = driven_of(on_a_circle())
    asked = np.linspace(0.0, 7.0, 61)
    travelled = driven.travelled_at(asked, driven.front.at(asked).positions)
    np.testing.assert_allclose(travelled, 5.0 * asked, atol=0.02)
    assert np.diff(travelled).min() >= 0.0


def test_way_is_level():
    times = np.arange(0.0, 6.0)
    xyz = np.column_stack([3.0 * times, 4.0 * times, 2.0 * times])
    driven = driven_of(trace_of(times, xyz, np.arctan2(4.0, 3.0), 5.0, exact=True))
    assert driven.travelled[-1] == pytest.approx(25.0, abs=1e-6)


def test_standing_adds_no_way():
    times = np.arange(0.0, 100.0)
    along = np.clip(4.0 * times, 0.0, 40.0) + np.clip(4.0 * (times - 80.0), 0.0, None)
    driven = driven_of(trace_of(times, np.column_stack([along, 0 * along]), 0.0, exact=True))
    asked = np.linspace(10.0, 80.0, 300)
    travelled = driven.travelled_at(asked, driven.front.at(asked).positions)
    np.testing.assert_allclose(travelled, 40.0, atol=1e-9)
    # Much of a city stands: no knots there.
    assert ((driven.knots > 11.5) & (driven.knots < 78.5)).sum() == 0
    behind = driven.points_at(np.array([35.0, 39.99, 40.0, 40.01]))
    np.testing.assert_allclose(behind[:, 0], [35.0, 39.99, 40.0, 40.01], atol=0.03)


# Points ------------------------------------------------------------------------------------


def test_points_of_the_way_lie_where_the_front_was():
    driven = driven_of(on_a_circle())
    travelled = np.linspace(0.0, driven.travelled[-1], 57)
    points = driven.points_at(travelled)
    turned = travelled / RADIUS
    expected = RADIUS * np.column_stack([np.sin(turned), 1.0 - np.cos(turned)])
    np.testing.assert_allclose(points[:, :2], expected, atol=0.03)


@pytest.mark.parametrize("length", [5.0, 12.0])
def test_the_past_lies_on_the_circle_that_the_angles_tell(length):
    driven = driven_of(on_a_circle(length=length, speed=3.0), length=length)
    # Where the rear was at the samples of the first length: on the path.
    assert driven.past_travelled[0] == pytest.approx(-length, abs=1e-9)
    assert driven.past_travelled[-1] == 0.0 and (np.diff(driven.past_travelled) > 0.0).all()
    assert len(driven.past) >= 3
    # The chord is a little shorter than the body's way, so the rear lies a little outside.
    slack = length**3 / RADIUS**2 / 24.0 + 0.01
    assert off_circle(driven.past).max() <= slack
    asked = np.linspace(-length, 0.0, 40)
    assert off_circle(driven.points_at(asked)).max() <= slack + 3.0**2 / 8.0 / RADIUS


def test_the_first_point_of_the_past_is_one_length_along_the_first_angle():
    trace = on_a_circle()
    driven = driven_of(trace)
    yaw = trace.yaws[0]
    expected = trace.positions[0] - 5.0 * np.array([np.cos(yaw), np.sin(yaw), 0.0])
    np.testing.assert_allclose(driven.points_at(np.array([-5.0]))[0], expected, atol=1e-6)


def test_further_back_the_path_is_straight():
    driven = driven_of(on_a_circle())
    points = driven.points_at(np.array([-5.0, -15.0, -25.0, -200.0]))
    steps = np.diff(points, axis=0) / [[10.0], [10.0], [175.0]]
    np.testing.assert_allclose(steps, np.repeat(steps[:1], 3, axis=0), atol=1e-9)
    assert np.linalg.norm(steps[0]) == pytest.approx(1.0, abs=0.15)


def test_the_past_of_a_body_born_behind_a_corner_goes_round_it():
    network, way = road("corner")
    # Born 3 m beyond the corner: 12 m of bus are in it and before it.
    start = way.starts[2] + 3.0
    trace = drive(way, np.arange(0.0, 8.0), lambda t: start + 2.0 * np.asarray(t), length=12.0)
    driven = driven_of(trace, length=12.0)
    truth = way.at(start + np.linspace(-8.0, 0.0, 30))
    shown = driven.points_at(np.linspace(-8.0, 0.0, 30))
    assert np.linalg.norm(shown - truth, axis=1).max() < 1.0
    assert network.lanes["a_0"].length == 100.0


def test_angles_that_jump_tell_of_no_path():
    times = np.arange(0.0, 6.0)
    trace = trace_of(times, np.column_stack([2.0 * times, 0 * times]), 0.0, 2.0, exact=True)
    front = driven_of(trace).front
    (samples,) = split(trace, step=0.0)
    turned = replace(samples, yaws=np.where(times == 1.0, np.pi, 0.0))
    driven = Driven.of(front, turned, length=5.0, yaw=0.0)
    asked = np.linspace(-5.0, 0.0, 40)
    expected = np.column_stack([asked, 0.0 * asked, 0.0 * asked])
    np.testing.assert_allclose(driven.points_at(asked), expected, atol=1e-6)


def test_slopes_lead_downhill_before_the_first_sample():
    network = network_of({"a_0": [(0, 0, 0), (300, 0, 30)]})
    way = Way.of(network, ("a_0",))
    slope = np.arctan2(30, 300)
    trace = drive(way, np.arange(0.0, 6.0), lambda t: 50.0 + 8.0 * t, exact=True, slopes=slope)
    driven = driven_of(trace)
    points = driven.points_at(np.array([-50.0, -5.0, -2.0, 0.0, 8.0]))
    np.testing.assert_allclose(points[:, 2], points[:, 0] / 10.0, atol=1e-4)
