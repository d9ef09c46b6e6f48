"""Gaps, headways and times to collision, of cars that stand where they are put."""

import numpy as np
import pytest

from sumo3dviz_pt.studies.measured.traffic import Traffic, leader, traffic_rows

CAR = (4.0, 1.8, 1.5)


def traffic(*cars, ridden="vehicle:c0"):
    """Cars (x, y, yaw in degrees, speed) at one time."""
    x, y, yaw, speed = (
        np.array(values, dtype=float)[:, None] for values in zip(*cars, strict=True)
    )
    return Traffic(
        [f"vehicle:c{k}" for k in range(len(cars))],
        np.tile(CAR, (len(cars), 1)),
        np.ones((len(cars), 1), dtype=bool),
        np.stack([x, y, 0.0 * x], axis=-1),
        np.radians(yaw),
        speed,
        0.9 * speed,
        np.array([7.0]),
        ridden,
    )


def rows(some):
    return list(traffic_rows(some, [{"position": [-1.5, 0.4, 1.2], "forward": [1, 0, 0]}]))


def test_gap_headway_and_time_to_collision_in_closed_form():
    row = rows(traffic((0, 0, 0, 10), (24, 0, 0, 5)))[0]
    assert (row["role"], row["road_user"], row["leader"]) == ("ridden", "vehicle:c0", "vehicle:c1")
    assert row["gap"] == 20.0
    assert (row["time_gap"], row["headway"], row["time_to_collision"]) == (2.0, 2.4, 4.0)
    assert (row["speed"], row["logged_speed"]) == (10.0, 9.0)
    assert (row["leader_speed"], row["leader_logged_speed"]) == (5.0, 4.5)


@pytest.mark.parametrize("turn", [30.0, 90.0, 200.0])
def test_directions_do_not_matter(turn):
    angle = np.radians(turn)
    row = rows(traffic((0, 0, turn, 10), (24 * np.cos(angle), 24 * np.sin(angle), turn, 5)))[0]
    assert row["gap"] == pytest.approx(20.0, abs=1e-3)


def test_nobody_collides_with_who_is_faster_and_who_stands_has_no_headway():
    assert rows(traffic((0, 0, 0, 10), (24, 0, 0, 11)))[0]["time_to_collision"] == ""
    standing = rows(traffic((0, 0, 0, 0), (24, 0, 0, 0)))[0]
    assert standing["gap"] == 20.0
    assert standing["headway"] == standing["time_gap"] == standing["time_to_collision"] == ""


@pytest.mark.parametrize(
    "other",
    [
        (24, 3.2, 0, 5),  # on the next lane
        (-6, 0, 0, 5),  # behind
        (3, 1.9, 0, 5),  # beside
        (24, 0, 180, 5),  # comes towards
        (300, 0, 0, 5),  # too far away
    ],
)
def test_who_is_not_ahead(other):
    assert leader(traffic((0, 0, 0, 10), other), 0, 0) is None


def test_the_nearest_of_several_counts_also_across():
    found = leader(traffic((0, 0, 0, 10), (60, 0, 0, 5), (24, 0, 0, 5)), 0, 0)
    assert found == (2, pytest.approx(20.0))
    crossing = leader(traffic((0, 0, 0, 10), (12, 1, 90, 5)), 0, 0)
    assert crossing is not None and crossing[0] == 1 and crossing[1] == pytest.approx(12.0)


def test_the_three_nearest_are_told_beside_the_ridden():
    some = traffic((0, 0, 0, 1), (9, 9, 0, 1), (5, 5, 0, 1), (99, 0, 0, 1), (-7, 7, 0, 1))
    assert [row["road_user"] for row in rows(some)] == [
        "vehicle:c0", "vehicle:c2", "vehicle:c4", "vehicle:c1",
    ]  # fmt: skip
    assert [row["role"] for row in rows(some)] == ["ridden", "nearest1", "nearest2", "nearest3"]
    alone = traffic((0, 0, 0, 1), ridden="")
    assert [row["role"] for row in rows(alone)] == ["nearest1"]
