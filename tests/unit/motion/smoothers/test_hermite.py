"""The `hermite` smoother: tangents of the front from angles of chords."""

import numpy as np
import pytest
from drives import trace_of

from sumo3dviz_pt.motion.front import velocity
from sumo3dviz_pt.motion.samples import split
from sumo3dviz_pt.motion.setting import Setting
from sumo3dviz_pt.motion.smoothers.hermite import bridge


def samples_of(times, xyz, yaws, speeds):
    (samples,) = split(trace_of(times, xyz, yaws, speeds, exact=True), step=1.0)
    return samples


def round_a_circle(*, radius, speed, length, side=1.0, step=1.0, last=6.0):
    """Samples of a drive on a circle, left (1) or right (-1) round, with the chord's angle."""
    times = np.arange(0.0, last + step / 2, step)
    turned = speed * times / radius
    xyz = radius * np.column_stack([np.sin(turned), side * (1.0 - np.cos(turned)), 0.0 * turned])
    # The chord to what lies `length` behind turned half of it less.
    yaws = side * (turned - length / radius / 2.0)
    return samples_of(times, xyz, yaws, speed), turned


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize(("radius", "length"), [(10.0, 5.0), (30.0, 12.0), (16.0, 4.3)])
def test_on_a_circle_the_front_moves_along_its_tangent(radius, length, side):
    samples, turned = round_a_circle(radius=radius, speed=5.0, length=length, side=side)
    front = bridge(samples, Setting(length=length))
    expected = 5.0 * np.column_stack([np.cos(turned), side * np.sin(turned)])
    np.testing.assert_allclose(front.curve.slopes[:, :2], expected, atol=0.02)
    asked = front.at(np.linspace(0.0, 6.0, 200)).positions[:, :2]
    away = np.linalg.norm(asked - [0.0, side * radius], axis=1)
    assert np.abs(away - radius).max() < 0.02


def test_without_a_lead_the_circle_is_left():
    # What the half length of curvature is for.
    samples, _ = round_a_circle(radius=10.0, speed=5.0, length=5.0)
    off = bridge(samples, Setting(length=0.0)).at(np.linspace(0, 6, 200)).positions[:, :2]
    assert np.abs(np.linalg.norm(off - [0.0, 10.0], axis=1) - 10.0).max() > 0.1


def test_speed_is_the_length_of_the_velocity():
    samples, _ = round_a_circle(radius=16.0, speed=5.0, length=5.0)
    front = bridge(samples, Setting())
    for time in (0.5, 2.2, 5.9):
        speed = front.at(np.array([time])).speeds[0]
        assert speed == pytest.approx(np.linalg.norm(velocity(front, time)), abs=1e-6)
    assert (front.begin, front.end) == (0.0, 6.0)


def test_given_velocities_are_kept_at_the_ends():
    samples, _ = round_a_circle(radius=16.0, speed=5.0, length=5.0)
    first, last = np.array([1.0, 2.0, 0.5]), np.array([3.0, -1.0, 0.0])
    front = bridge(samples, Setting(), first=first, last=last)
    np.testing.assert_allclose(velocity(front, 0.0), first, atol=5e-3)
    np.testing.assert_allclose(velocity(front, 6.0), last, atol=5e-3)


def test_who_backs_up_moves_against_its_angle():
    times = np.arange(0.0, 5.0)
    samples = samples_of(times, np.column_stack([-2.0 * times, 0 * times, 0 * times]), 0.0, 2.0)
    motion = bridge(samples, Setting()).at(np.linspace(0.0, 4.0, 50))
    np.testing.assert_allclose(motion.positions[:, 0], -2.0 * np.linspace(0.0, 4.0, 50), atol=1e-9)


def test_heights_overshoot_nothing():
    times, heights = np.arange(0.0, 6.0), np.array([0.0, 0.0, 1.0, 1.0, 4.0, 4.0])
    samples = samples_of(times, np.column_stack([9.0 * times, 0 * times, heights]), 0.0, 9.0)
    shown = bridge(samples, Setting()).at(np.linspace(0.0, 5.0, 500)).positions[:, 2]
    assert shown.min() >= 0.0 and shown.max() <= 4.0
    assert np.diff(shown).min() >= -1e-12


@pytest.mark.parametrize("push", [0.0, 2.0])
def test_a_slope_is_a_slope_from_the_first_sample_on(push):
    times = np.arange(0.0, 6.0)
    speeds = (8.0 if push == 0.0 else 0.0) + push * times
    along = (8.0 if push == 0.0 else 0.0) * times + push * times**2 / 2.0
    xyz = np.column_stack([along, 0.0 * along, along / 10.0])
    shown = bridge(samples_of(times, xyz, 0.0, speeds), Setting()).at(np.linspace(0.0, 5.0, 200))
    heights = shown.positions[:, 2]
    inside = shown.positions[:, 0] < along[1]
    np.testing.assert_allclose(heights[inside], shown.positions[inside, 0] / 10.0, atol=0.01)
