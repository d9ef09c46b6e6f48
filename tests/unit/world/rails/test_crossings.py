"""Level crossings: barriers at every road, and arms that follow the log."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
import shapely
from builders import aspect_at

from sumo3dviz_pt.job.settings import SignalSettings
from sumo3dviz_pt.library.street.road_styles import STYLES
from sumo3dviz_pt.model.network import Connection, Edge, Junction, Lane, Location, Network
from sumo3dviz_pt.model.traffic import Scenario, SignalPhases, TrafficLog
from sumo3dviz_pt.world.placement.surroundings import surroundings
from sumo3dviz_pt.world.rails.crossings import RISING, SINKING, barriers_of, build_railway, lowering
from sumo3dviz_pt.world.signals.heads import course_of
from sumo3dviz_pt.world.signals.signals import build_signals

STYLE = STYLES["european"]
CAR, TRAIN = frozenset({"passenger", "bus"}), frozenset({"rail"})


def lane(edge, points, *, width=3.2, allowed=CAR, index=0) -> Lane:
    shape = np.array([(*point, 0.0) for point in points], dtype=float)
    return Lane(f"{edge}_{index}", edge, index, shape, width, 13.9, 100.0, allowed)


def road(key, start, end, points, **words) -> Edge:
    return Edge(key, "normal", start, end, (lane(key, points, **words),))


@cache
def crossing(*, left=False) -> Network:
    """A road to the east and back over a track to the north, which both end at x = 6."""
    side = 1.0 if left else -1.0
    rails = {"allowed": TRAIN, "width": 4.0}
    edges = [
        road("in", "W", "X", [(-90, side * 1.6), (-6, side * 1.6)]),
        road("on", "X", "E", [(6, side * 1.6), (90, side * 1.6)]),
        road("back", "E", "X", [(90, -side * 1.6), (6, -side * 1.6)]),
        road("off", "X", "W", [(-6, -side * 1.6), (-90, -side * 1.6)]),
        road("south", "S", "X", [(0, -90), (0, -5)], **rails),
        road("north", "X", "N", [(0, 5), (0, 90)], **rails),
    ]
    outline = np.array([(-6, -5, 0), (6, -5, 0), (6, 5, 0), (-6, 5, 0)], dtype=float)
    junctions = {"X": Junction("X", "rail_crossing", np.zeros(3), outline)}
    links = (
        Connection("in_0", "on_0", "", "X", 0),
        Connection("back_0", "off_0", "", "X", 1),
        Connection("south_0", "north_0", "", "X", -1),
    )
    return Network({e.id: e for e in edges}, junctions, links, Location(), left)


def phases(*entries) -> dict[str, SignalPhases]:
    times, letters = zip(*entries, strict=True)
    return {"X": SignalPhases("X", times, tuple(2 * letter for letter in letters))}


CLOSING = phases((0.0, "G"), (20.0, "y"), (23.0, "r"), (50.0, "u"), (53.0, "G"))


def scenario(net, log=CLOSING) -> Scenario:
    return Scenario(net, TrafficLog((), (), 0.0, 0.0, 0.0), signals=log)


def railway(log=CLOSING, *, left=False):
    net = crossing(left=left)
    around = surroundings(net, seed=1, viewpoints=np.array([(0.0, -30.0, 2.0)]))
    return build_railway(scenario(net, log), net.connections, around=around, style=STYLE)


@pytest.mark.parametrize("left", [False, True])
def test_every_road_has_a_barrier_and_no_track_has_one(left):
    net = crossing(left=left)
    found = {barrier.edge: barrier for barrier in barriers_of(net, net.connections, CLOSING)}
    assert set(found) == {"in", "back"}
    track = shapely.LineString([(0, -90), (0, 90)])
    for barrier in found.values():
        tip = barrier.foot[:2] + barrier.length * np.array(
            [np.cos(barrier.arm_yaw), np.sin(barrier.arm_yaw)]
        )
        arm = shapely.LineString([barrier.foot[:2], tip])
        edge = net.edges[barrier.edge]
        own = shapely.LineString(edge.lanes[0].shape[:, :2])
        assert arm.distance(track) > 2.3
        assert arm.distance(shapely.Point(own.coords[-1])) < 6.0
        # It closes its own half of the road and leaves the other one open.
        assert abs(tip[1]) < 1.0
        assert abs(barrier.foot[1]) > 3.2 + 0.5
        assert np.sign(tip[1] or barrier.foot[1]) == np.sign(barrier.foot[1])


def test_arms_follow_the_log_and_cars_that_may_go_meet_no_arm():
    course = course_of(CLOSING["X"], 0)
    times, shares = lowering(course)
    assert (np.diff(times) >= 0.0).all()
    assert shares.min() == 0.0
    assert shares.max() == 1.0
    down = dict(zip(railway().barriers, [None] * 2, strict=True))
    for barrier in down:
        assert [barrier.lowered_at(t) for t in (0.0, 19.0, 22.9)] == [0.0, 0.0, 0.0]
        assert barrier.lowered_at(23.0 + SINKING / 2) == pytest.approx(0.5)
        assert barrier.lowered_at(40.0) == 1.0
        assert barrier.lowered_at(50.0 + RISING) == 0.0
        assert [sum(barrier.lit_at(t)) for t in (10.0, 21.0, 30.0, 52.0, 54.0)] == [0, 1, 1, 1, 0]
        assert barrier.lit_at(30.0) != barrier.lit_at(30.5)


def test_a_log_that_begins_closed_or_changes_fast_never_jumps():
    for entries in ([(5.0, "r")], [(0.0, "G"), (10.0, "r"), (12.0, "G"), (13.0, "r")]):
        times, shares = lowering(course_of(phases(*entries)["X"], 0))
        steps = np.abs(np.diff(shares)) <= np.diff(times) / min(SINKING, RISING) + 1e-9
        assert steps.all()
    assert lowering(course_of(phases((5.0, "r"))["X"], 0))[1].tolist()[0] == 1.0


def test_moving_arms_are_fixtures_in_slots_and_lights_are_lamps():
    made = railway()
    assert sum(made.slots.values()) == len(made.movers_at(0.0)) == 2
    assert {mover.prototype for mover in made.movers_at(0.0)} == set(made.prototypes)
    up, down = (made.movers_at(t)[0].world_from_body.matrix[:3, 0] for t in (0.0, 40.0))
    assert up[2] > 0.9
    assert abs(down[2]) < 1e-9
    rows = made.radiance_at(30.0)["level_crossings"]
    assert (rows.sum(axis=1) > 0).sum() == 2
    assert not made.radiance_at(0.0)["level_crossings"].any()
    assert len(made.lamps[0].lamps) == 4


@pytest.mark.parametrize("log", [{}, phases((0.0, "G"))])
def test_arms_that_never_move_stand_open_and_cost_no_slot(log):
    made = railway(log)
    assert made.movers_at(0.0) == ()
    assert made.slots == {}
    red = next(part.part.mesh for part in made.static if "barrier_red" in part.id)
    assert red.vertices[:, 2].max() > 4.0
    assert bool(made.left_out) == (not log)


def test_networks_without_level_crossings_get_nothing_and_say_so():
    net = crossing()
    around = surroundings(net, seed=1)
    plain = Network(net.edges, {}, net.connections, net.location)
    made = build_railway(scenario(plain), plain.connections, around=around, style=STYLE)
    assert made.static == ()
    assert made.lamps == ()
    assert made.radiance_at(3.0) == {}
    assert "crosses a railway" in made.left_out[0].why


def test_level_crossings_have_no_street_lights():
    signals = build_signals(crossing(), CLOSING, SignalSettings())
    assert signals.heads == ()


def rail_signal() -> Network:
    edges = [
        road("a", "A", "S", [(0, 0), (90, 0)], allowed=TRAIN),
        road("b", "S", "B", [(90, 0), (180, 0)], allowed=TRAIN),
    ]
    junction = Junction("S", "rail_signal", np.array([90.0, 0, 0]), np.zeros((0, 3)))
    link = Connection("a_0", "b_0", "", "S", 0)
    return Network({e.id: e for e in edges}, {"S": junction}, (link,), Location())


def test_rail_signals_are_two_lamps_on_a_mast_at_the_tracks_right():
    log = {"S": SignalPhases("S", (0.0, 10.0), ("r", "G"))}
    signals = build_signals(rail_signal(), log, SignalSettings())
    (head,) = signals.heads
    assert (head.kind, head.lamps) == ("rail", 2)
    assert head.foot[1] < -2.0
    assert head.position[2] > 3.5
    assert aspect_at(signals, "S", 0, 1.0) == {"red"}
    assert aspect_at(signals, "S", 0, 11.0) == {"green"}
    assert {"signals/barrier_red", "signals/barrier_white"} <= {p.id for p in signals.static}


def test_barriers_follow_another_log_unless_one_moves_that_was_built_not_to():
    net, later = crossing(), phases((0.0, "G"), (40.0, "y"), (43.0, "r"))
    followed = railway().following(later, net)
    assert followed is not None and followed.slots == railway().slots
    for time in (0.0, 25.0, 41.0, 44.0, 60.0):
        own, those = (
            [mover.world_from_body.matrix for mover in each.movers_at(time)]
            for each in (followed, railway(later))
        )
        np.testing.assert_array_equal(own, those)
    assert railway(phases((0.0, "G"))).following(later, net) is None
