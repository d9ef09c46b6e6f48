"""Rails, sleepers and what they lie in."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from sumo3dviz_pt.job.settings import RoadSettings
from sumo3dviz_pt.model.network import Connection, Edge, Junction, Lane, Location, Network
from sumo3dviz_pt.world.rails.tracks import (
    GAUGE,
    RISE,
    SLEEPER_EVERY,
    flush_paint,
    track_parts,
    track_rise,
)
from sumo3dviz_pt.world.rails.ways import shoulder
from sumo3dviz_pt.world.roads.layout import layout_roads

CAR, TRAM, TRAIN = frozenset({"passenger"}), frozenset({"tram"}), frozenset({"rail"})


def edge(key, y, allowed, *, x=(0.0, 120.0), ends=("a", "b"), function="normal") -> Edge:
    shape = np.array([(x[0], y, 0.0), (x[1], y, 0.0)])
    return Edge(key, function, *ends, (Lane(f"{key}_0", key, 0, shape, 3.2, 20, 100, allowed),))


def layout(*edges, junctions=()):
    net = Network({e.id: e for e in edges}, {j.id: j for j in junctions}, (), Location())
    return layout_roads(net, RoadSettings())


def surfaces(made, key):
    return {strip.look.surface for strip in made.strips[key]}


def test_trams_alone_run_on_grass_and_those_in_a_street_on_its_surface():
    made = layout(edge("own", 20, TRAM), edge("street", 0.4, CAR), edge("shared", 0, TRAM))
    assert surfaces(made, "own") == {"ground_grass"}
    assert surfaces(made, "shared") == surfaces(made, "street") == {"asphalt"}
    assert {paint.owner for paint in flush_paint(made)} == {"shared"}


def test_rails_of_a_train_stand_at_standard_gauge_above_sleepers_on_ballast():
    made = layout(edge("r", 0, TRAIN))
    parts = {p.id: p.part.mesh for p in track_parts(made, track_rise(made), None)}
    heads = parts["rails/rail_head"].vertices
    rust = parts["rails/rail_rust"].vertices
    inner = rust[rust[:, 2] > RISE - 0.02]
    assert 2 * np.abs(inner[:, 1]).min() == pytest.approx(GAUGE, abs=0.03)
    assert heads[:, 2] == pytest.approx(RISE + 0.012)
    # Sleepers stand every 0.6 m, also where pieces of track meet.
    sleepers = parts["rails/sleeper"].vertices
    middles = np.unique(sleepers[:, 0].round(3)).reshape(-1, 2).mean(axis=1)
    assert np.diff(middles) == pytest.approx(SLEEPER_EVERY, abs=0.31)
    assert len(middles) == pytest.approx(120 / SLEEPER_EVERY, abs=2)
    assert sleepers[:, 2].max() < RISE
    assert sleepers[:, 2].max() > 0.0


def test_far_tracks_have_fewer_faces():
    made = layout(edge("r", 0, TRAIN))
    counts = [
        sum(len(p.part.mesh.faces) for p in track_parts(made, track_rise(made), focus))
        for focus in ((0, 0, 1, 1), (500, 0, 501, 1), (2000, 0, 2001, 1))
    ]
    assert counts[0] > 1.5 * counts[1] > 3 * counts[2] > 0


def test_tracks_come_down_to_a_level_crossing_and_trains_with_them():
    outline = np.array([(120, -8, 0), (132, -8, 0), (132, 8, 0), (120, 8, 0)], dtype=float)
    crossing = Junction("X", "rail_crossing", outline.mean(axis=0), outline, ("c_0", "r_0"))
    made = layout(
        edge("r", 0, TRAIN, ends=("a", "X")),
        edge(":X_0", 0, TRAIN, x=(120, 132), function="internal"),
        edge("s", 0, TRAIN, x=(132, 250), ends=("X", "b")),
        edge("c", 30, CAR, ends=("c", "X")),
        junctions=[crossing],
    )
    rise = track_rise(made)
    at = np.array([(20.0, 0.0), (100.0, 0.0), (113.0, 0.0), (126.0, 0.0), (20.0, 30.0)])
    up = rise(at)
    assert up[[0, 3, 4]] == pytest.approx([RISE, 0.0, 0.0])
    assert 0.0 < up[2] < up[1] <= RISE
    assert {paint.owner for paint in flush_paint(made)} == {":X_0"}
    steps = rise(np.column_stack([np.linspace(90, 120, 61), np.zeros(61)]))
    assert np.abs(np.diff(steps)).max() < 0.02


def test_ballast_slopes_down_beside_the_track_and_not_over_roads():
    made = layout(edge("r", 0, TRAIN), edge("c", 3.6, CAR))
    slope = shoulder(made.cells)
    road = shapely.box(0, 2.05, 120, 5.1)
    spots = shapely.points(slope.vertices[slope.faces].mean(axis=1)[:, :2])
    assert not shapely.contains(road, spots).any()
    assert slope.vertices[:, 2].min() < -0.1
    assert slope.vertices[:, 2].max() <= 0.0
    assert len(shoulder(layout(edge("c", 0, CAR)).cells).faces) == 0


def test_rails_lead_from_track_to_track_and_not_along_every_turn_of_a_tram():
    both = CAR | TRAM | {"rail"}
    edges = (
        edge("in", 0, TRAM, x=(0, 100), ends=("a", "J")),
        edge("on", 0, TRAM, x=(120, 200), ends=("J", "b")),
        edge("back", 6, TRAM, x=(100, 0), ends=("J", "a")),
        edge("road", -9, both, x=(120, 200), ends=("J", "c")),
        edge(":J_0", 0, TRAM, x=(100, 110), ends=("", ""), function="internal"),
        edge(":J_1", -4, TRAM, x=(100, 120), ends=("", ""), function="internal"),
        edge(":J_2", 3, TRAM, x=(100, 110), ends=("", ""), function="internal"),
        edge(":J_3", 0, TRAM, x=(110, 120), ends=("", ""), function="internal"),
    )
    links = (
        Connection("in_0", "on_0", ":J_0_0"),
        Connection("in_0", "road_0", ":J_1_0", direction="r"),
        Connection("in_0", "back_0", ":J_2_0", direction="t"),
        Connection(":J_0_0", "on_0", ":J_3_0"),
        Connection(":J_3_0", "on_0"),
    )
    outline = np.array([(100, -12, 0), (100, 8, 0), (120, 8, 0), (120, -12, 0)], dtype=float)
    junction = Junction("J", "priority", np.zeros(3), outline)
    net = Network({e.id: e for e in edges}, {"J": junction}, links, Location())
    ways = layout_roads(net, RoadSettings()).insides["J"].ways
    assert {s.lane.id for s in ways if s.look.rails} == {":J_0_0", ":J_3_0"}
    assert len(ways) == 4
