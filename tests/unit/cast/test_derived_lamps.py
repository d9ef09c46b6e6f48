"""Lamps that the log does not tell: brakes, indicators, reversing."""

from __future__ import annotations

import numpy as np
import pytest
from analytic_motion import PathPiece

from sumo3dviz_pt.cast.lamps import derived_lamps
from sumo3dviz_pt.model.trajectory import Motion, Remark


class Speeds(PathPiece):
    """Straight on at speeds that are given at times."""

    knots = ((0.0, 10.0), (20.0, 10.0))

    def sample(self, times):
        at, speeds = np.array(self.knots).T
        fine = np.linspace(0.0, 20.0, 4001)
        ways = np.concatenate([[0.0], np.cumsum(np.interp(fine[:-1], at, speeds) * 0.005)])
        motion = super().sample(times)
        way = np.interp(times, fine, ways)
        places = np.column_stack([way, 0 * way, 0 * way])
        speeds = np.interp(times, at, speeds)
        return Motion(motion.alive, places, 0 * way, 0 * way, speeds, way)


def braking(knots):
    piece = type("Given", (Speeds,), {"knots": knots})()
    times = np.arange(0.0, 20.0, 0.04)
    lamps = derived_lamps(piece)
    return times, np.array(["brake" in lamps.roles_at(t) for t in times])


def test_at_one_speed_nothing_shines():
    assert derived_lamps(PathPiece()).spans == {}
    _, lit = braking(((0, 10), (10, 10), (14, 7.2), (20, 7.2)))
    assert not lit.any(), "engine braking, 0.7 m/s^2"


def test_who_brakes_and_stands_shows_it_until_it_goes():
    times, lit = braking(((0, 10), (5, 10), (9, 0), (13, 0), (18, 9), (20, 9)))
    assert lit[(times > 5.4) & (times < 12.8)].all()
    assert not lit[(times < 4.6) | (times > 13.8)].any()
    assert np.count_nonzero(np.diff(lit)) == 2


def test_brake_lamps_do_not_flicker_at_the_threshold():
    noise = np.random.default_rng(3).normal(0.0, 0.04, 101)
    at = np.linspace(0.0, 20.0, 101)
    times, lit = braking(tuple(zip(at, 30.0 - 1.3 * at + noise, strict=True)))
    changes = np.flatnonzero(np.diff(lit))
    assert len(changes) < 8
    assert (np.diff(times[changes]) > 0.35).all()


def test_brake_lamps_stay_on_while_braking_goes_up_and_down():
    """Between 1.0 and 1.8 m/s^2, changing every two seconds."""
    at = np.arange(0.0, 21.0, 2.0)
    change = np.where(np.arange(len(at)) % 2 == 0, -1.8, -1.0)
    speeds = 34.0 + np.concatenate([[0.0], np.cumsum(2.0 * change)])[:-1]
    speeds -= speeds[-1] - 1.0
    times, lit = braking(tuple(zip(at, np.minimum(speeds, 12.0), strict=True)))
    slow = (times > 14.5) & (times < 19.0)
    assert lit[slow].all()


def test_fast_cars_that_dawdle_do_not_brake():
    _, lit = braking(((0, 33), (8, 33), (10, 28.5), (20, 28.5)))
    assert not lit.any(), "2.2 m/s^2 at 30 m/s is what SUMO's vehicles lose by themselves"
    _, lit = braking(((0, 33), (8, 33), (10, 20), (20, 20)))
    assert lit.any()


def test_what_never_moves_is_parked():
    assert derived_lamps(PathPiece(speed=0.0)).spans == {}


class Corner(PathPiece):
    """Straight, a quarter of a turn, straight on."""

    radius = 8.0
    angle = np.pi / 2

    def point(self, ways):
        r, side = abs(self.radius), np.sign(self.radius)
        ways = np.asarray(ways, dtype=float)
        bend = np.clip(ways / r, 0.0, self.angle)
        x, y = r * np.sin(bend), side * r * (1 - np.cos(bend))
        before, after = np.minimum(ways, 0.0), np.maximum(ways - r * self.angle, 0.0)
        end = self.angle * side
        return np.stack([x + before + after * np.cos(end), y + after * np.sin(end), 0 * x], axis=-1)


@pytest.mark.parametrize(
    ("radius", "role", "other"), [(8.0, "left", "right"), (-8.0, "right", "left")]
)
def test_turns_are_shown_before_and_while_they_last(radius, role, other):
    piece = type("Turn", (Corner,), {"radius": radius})(speed=10.0, start=-100.0)
    lamps = derived_lamps(piece)
    assert other not in lamps.spans
    ((begin, end),) = lamps.spans[role]
    assert begin == pytest.approx(10.0 - 3.0, abs=0.5)
    assert end == pytest.approx(10.0 + 1.25, abs=0.5)


def test_slow_ones_show_a_turn_thirty_metres_before():
    piece = Corner(speed=3.0, start=-50.0, end=30.0)
    ((begin, _),) = derived_lamps(piece).spans["left"]
    assert begin == pytest.approx(20.0 / 3.0, abs=1.0)


@pytest.mark.parametrize(("radius", "angle"), [(80.0, np.pi / 2), (8.0, np.radians(20))])
def test_bends_of_the_road_are_no_turns(radius, angle):
    piece = type("Bend", (Corner,), {"radius": radius, "angle": angle})(speed=10.0, start=-60.0)
    assert derived_lamps(piece).spans == {}


def test_trams_show_no_turn():
    assert derived_lamps(Corner(speed=10.0, start=-100.0), steers=False).spans == {}


def test_remarks_light_lamps():
    class Drift(PathPiece):
        def point(self, ways):
            points = super().point(ways)
            points[..., 1] -= 3.2 * np.clip((np.asarray(ways) - 80.0) / 40.0, 0.0, 1.0)
            return points

    remarks = (Remark("lane change", 8.0, 12.0, 3.2), Remark("reversing", 15.0, 17.0, 4.0))
    lamps = derived_lamps(Drift(), remarks)
    assert lamps.spans["right"] == ((6.0, 12.0),)
    assert lamps.roles_at(16.0) == {"reverse"}
    assert lamps.roles_at(14.0) == frozenset()


def test_parked_cars_put_their_lamps_out():
    knots = ((0, 10), (5, 0), (20, 0))
    piece = type("Given", (Speeds,), {"knots": knots})()
    lamps = derived_lamps(piece, (Remark("parking", 6.0, 20.0, 6.0),))
    assert "brake" in lamps.roles_at(4.0)
    assert "brake" not in lamps.roles_at(10.0)
