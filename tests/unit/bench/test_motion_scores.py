"""The benchmark's measures on motion whose errors are known."""

import numpy as np
import pytest
from bench.motion_scores import (
    REAR_AXLE,
    Frames,
    Pool,
    errors,
    excess,
    feel,
    lane_distances,
    near,
    summary,
    turning,
)

RADIUS, SPEED, LENGTH = 25.0, 9.0, 4.6


def circle(*, radius: float = RADIUS, late: float = 0.0, nose: float = 0.0) -> Frames:
    """Counter-clockwise; `late` in seconds, the nose turned by an angle [rad]."""
    times = np.arange(0.0, 30.0, 0.04)
    angles = SPEED / RADIUS * (times - late)
    places = radius * np.column_stack([np.cos(angles), np.sin(angles)])
    return Frames(times, places, angles + np.pi / 2 + nose, np.full(len(times), SPEED))


def straight(speeds: np.ndarray, *, step: float = 0.04) -> Frames:
    """North-east, at the given speeds."""
    ways = np.concatenate([[0.0], np.cumsum((speeds[1:] + speeds[:-1]) / 2 * step)])
    times = np.arange(len(speeds)) * step
    places = ways[:, None] * np.full(2, np.sqrt(0.5))
    return Frames(times, places, np.full(len(times), np.pi / 4), speeds)


def test_what_is_true_has_no_error() -> None:
    assert max(values.max() for values in errors(circle(), circle()).values()) == 0.0


def test_a_wider_circle_is_a_lateral_error() -> None:
    found = errors(circle(radius=RADIUS + 0.3), circle())
    assert found["lateral"] == pytest.approx(0.3)
    assert found["along"] == pytest.approx(0.0, abs=1e-9)
    assert found["distance"] == pytest.approx(0.3)


def test_lag_is_an_error_along_the_way() -> None:
    found = errors(circle(late=0.02), circle())
    assert found["along"] == pytest.approx(SPEED * 0.02, rel=1e-4)
    assert found["lateral"].max() < 1e-3
    assert found["heading"] == pytest.approx(np.degrees(SPEED * 0.02 / RADIUS))


@pytest.mark.parametrize(("nose", "degrees"), [(0.1, 5.73), (-3.0, 171.89), (2 * np.pi, 0.0)])
def test_headings_differ_the_short_way_round(nose: float, degrees: float) -> None:
    assert errors(circle(nose=nose), circle())["heading"] == pytest.approx(degrees, abs=0.01)


def test_a_circle_feels_as_the_formulas_say() -> None:
    found = {name: values[3:-3] for name, values in feel(circle(), length=LENGTH).items()}
    assert found["acceleration"] == pytest.approx(SPEED**2 / RADIUS, rel=1e-3)
    assert found["across"] == pytest.approx(SPEED**2 / RADIUS, rel=1e-3)
    assert found["jerk"] == pytest.approx(SPEED**3 / RADIUS**2, rel=1e-3)
    assert found["yaw_rate"] == pytest.approx(np.degrees(SPEED / RADIUS))


def test_the_rear_axle_slides_unless_the_nose_points_inwards() -> None:
    axle = REAR_AXLE * LENGTH
    assert feel(circle(), length=LENGTH)["crab"][3:-3] == pytest.approx(
        axle * SPEED / RADIUS, rel=0.01
    )
    # A car whose rear axle follows its front axle has its nose inside the tangent's left.
    nose = -np.arcsin(axle / RADIUS)
    assert feel(circle(nose=nose), length=LENGTH)["crab"][3:-3].max() < 0.01


def test_braking_in_a_straight_line_is_felt_along_only() -> None:
    found = feel(straight(20.0 - 4.5 * np.arange(100) * 0.04), length=LENGTH)
    assert found["acceleration"][3:-3] == pytest.approx(4.5)
    assert found["across"][3:-3].max() < 1e-9
    assert found["jerk"][3:-3].max() < 1e-6


def test_standing_still_is_felt_as_nothing() -> None:
    found = feel(straight(np.zeros(50)), length=LENGTH)
    assert max(np.nanmax(values) for values in found.values()) == 0.0


def test_few_frames_feel_of_nothing() -> None:
    frames = straight(np.ones(3))
    assert all(np.isnan(values).all() for values in feel(frames, length=LENGTH).values())


def test_a_jump_exceeds_the_logged_speed() -> None:
    frames = straight(np.full(101, 10.0))
    times, speeds = np.arange(5.0), np.full(5, 10.0)
    assert excess(frames, times=times, speeds=speeds) == pytest.approx(0.4 - 0.6 - 0.02)
    frames.positions[60:] += 1.0
    over = excess(frames, times=times, speeds=speeds)
    assert np.flatnonzero(over > 0.0).tolist() == [59]
    assert over[59] > 1.0


def test_the_faster_of_two_rows_allows_the_step() -> None:
    frames = straight(np.full(51, 8.0))
    assert excess(frames, times=np.arange(3.0), speeds=np.array([0.0, 8.0, 0.0])).max() < 0.0
    assert excess(frames, times=np.arange(3.0), speeds=np.array([0.0, 0.0, 8.0]))[:24].min() > 0.0


def test_near_events() -> None:
    times = np.arange(10.0)
    assert np.flatnonzero(near(times, np.array([7.5, 2.0]), 1.0)).tolist() == [1, 2, 3, 7, 8]
    assert not near(times, np.empty(0), 100.0).any()


def test_a_bend_is_where_the_heading_changes_enough() -> None:
    degrees = np.degrees(SPEED / RADIUS)
    assert turning(circle(), within=1.0, least=np.radians(1.9 * degrees))[25:-25].all()
    assert not turning(circle(), within=1.0, least=np.radians(2.1 * degrees)).any()


def test_distance_from_lanes_knows_the_lanes_before_and_after() -> None:
    shapes = {
        "a_0": np.array([[0.0, 0.0], [10.0, 0.0]]),
        "b_0": np.array([[10.0, 0.0], [10.0, 9.0]]),
    }
    places = np.array([[5.0, 0.3], [9.0, -0.2], [9.9, 0.0], [10.5, 4.0]])
    found = lane_distances(places, ["a_0", "a_0", "b_0", "b_0"], shapes)
    assert found == pytest.approx([0.3, 0.2, 0.0, 0.5])
    assert np.isnan(lane_distances(places[:1], ["c_0"], shapes)).all()


def test_a_pool_leaves_out_what_is_not_finite() -> None:
    pool = Pool()
    pool.add("distance", np.array([3.0, np.nan, 4.0]))
    pool.add("excess", np.array([-1.0, 0.5]))
    pool.add("change_peak", 31.0)
    found = summary(pool)
    assert found["rmse"] == pytest.approx(np.sqrt(12.5))
    assert (found["max"], found["jumps"], found["spikes"], found["changes"]) == (4.0, 1.0, 1.0, 1.0)
    assert np.isnan(found["jerk_p99"])
