"""The surface that road users stand on, and junctions on slopes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import shapely

from sumo3dviz_pt.job.settings import RoadSettings
from sumo3dviz_pt.model.network import Edge, Junction, Lane, Location, Network
from sumo3dviz_pt.world.roads.cells import Cells
from sumo3dviz_pt.world.roads.layout import layout_roads
from sumo3dviz_pt.world.roads.roads import DrawnSurface, drawn_surface
from sumo3dviz_pt.world.roads.strips import PAVING

CARS = frozenset({"passenger", "bus"})
FOOT = frozenset({"pedestrian", "wheelchair"})


def edge(key: str, points, *, width=3.2, allowed=CARS, function="normal") -> Edge:
    shape = np.array(points, dtype=float)
    ends = ("m", "m") if function == "internal" else (f"{key}0", f"{key}1")
    lane = Lane(f"{key}_0", key, 0, shape, width, 13.9, 100.0, allowed)
    return Edge(key, function, *ends, (lane,))


def network(*edges: Edge, outline=()) -> Network:
    place = np.zeros(3)
    corners = np.array(outline, dtype=float).reshape(-1, 3)
    node = Junction("m", "priority", place, corners, ())
    location = Location(boundary=(-50.0, -50.0, 50.0, 50.0))
    return Network({e.id: e for e in edges}, {"m": node}, (), location)


def crossing(rise: float) -> Network:
    """Two ways through a junction 20 m wide; one lies higher than the other where they cross."""
    return network(
        edge("w", [(-50, 0, 0), (-10, 0, 0)]),
        edge("e", [(10, 0, 0), (50, 0, 0)]),
        edge("s", [(0, -50, rise), (0, -10, rise)]),
        edge("n", [(0, 10, rise), (0, 50, rise)]),
        edge(":m_0", [(-10, 0, 0), (10, 0, 0)], function="internal"),
        edge(":m_1", [(0, -10, rise), (0, 10, rise)], function="internal"),
        outline=[(-10, -10, 0), (10, -10, 0), (10, 10, 0), (-10, 10, 0)],
    )


def cells_of(net: Network) -> Cells:
    return layout_roads(net, RoadSettings()).cells


def surface_of(net: Network) -> DrawnSurface:
    surface = drawn_surface(layout_roads(net, RoadSettings()))
    assert surface is not None
    return surface


# The surface ---------------------------------------------------------------------------------


def test_flat_networks_need_no_surface():
    assert drawn_surface(layout_roads(crossing(0.0), RoadSettings())) is None


def test_ways_that_contradict_each_other_meet_on_one_surface():
    surface = surface_of(crossing(0.8))
    low, high = np.array([[0.0, 0.0, 0.0]]), np.array([[0.0, 0.0, 0.8]])
    assert 0.05 < surface.rise_at(low)[0] < 0.75
    assert low[0, 2] + surface.rise_at(low)[0] == pytest.approx(0.8 + surface.rise_at(high)[0])


def test_lanes_outside_junctions_keep_their_heights():
    points = np.array([[-30.0, 0.5, 0.0], [0.3, 40.0, 0.8]])
    assert surface_of(crossing(0.8)).rise_at(points) == pytest.approx(0.0, abs=1e-6)


def test_nobody_jumps_on_the_way_through_a_junction():
    ways = np.linspace(-20.0, 20.0, 801)
    rise = surface_of(crossing(0.8)).rise_at(np.column_stack([ways, 0.0 * ways, 0.0 * ways]))
    assert np.abs(np.diff(rise)).max() < 0.03 and np.ptp(rise) > 0.05


def test_other_levels_do_not_count():
    corners = np.array([[[0, 0, 5.0], [9, 0, 5.0], [0, 9, 5.0]]])
    under = np.column_stack([np.full((80, 2), 1.0), np.linspace(0.0, 8.0, 80)])
    rise = DrawnSurface(corners).rise_at(under)
    assert (rise[np.abs(under[:, 2] - 5.0) > 3.0] == 0.0).all()
    near = np.abs(under[:, 2] - 5.0) < 2.4
    assert (under[:, 2] + rise)[near] == pytest.approx(5.0)


def test_the_surface_fades_out_beside_the_road():
    corners = np.array([[[0, 0, 0.4], [9, 0, 0.4], [0, 9, 0.4]]])
    beside = np.column_stack([np.linspace(1.0, -2.0, 301), np.full(301, 2.0), np.zeros(301)])
    rise = DrawnSurface(corners).rise_at(beside)
    assert rise[0] == pytest.approx(0.4) and rise[-1] == 0.0
    assert np.abs(np.diff(rise)).max() < 0.005


# Pieces of roads -----------------------------------------------------------------------------


def test_ways_through_junctions_are_kept_free_of_footways():
    path = edge("f", [(-3, -20, 0), (-3, -9, 0), (2, 20, 0)], width=2.0, allowed=FOOT)
    net = crossing(0.0)
    cells = cells_of(replace(net, edges={**net.edges, "f": path}))
    way = shapely.LineString([(-10, 0), (10, 0)]).buffer(1.2)
    raised = shapely.union_all(cells.polygons[cells.raised])
    assert raised.area > 20.0
    assert raised.intersection(way).area < 1e-6
    assert way.difference(shapely.union_all(cells.polygons)).area < 1e-3


def test_a_footbridge_over_a_way_stays_whole():
    path = edge("f", [(-3, -20, 6), (-3, 20, 6)], width=2.0, allowed=FOOT)
    net = crossing(0.0)
    cells = cells_of(replace(net, edges={**net.edges, "f": path}))
    assert shapely.union_all(cells.polygons[cells.raised]).area == pytest.approx(80.0, abs=0.01)


def test_lanes_of_people_on_foot_inside_junctions_are_paved():
    angles = np.linspace(-0.5, 0.5, 9) * np.pi
    corners = np.column_stack([3.0 * np.cos(angles), 3.0 + 3.0 * np.sin(angles), 0.0 * angles])
    turn = edge(":m_0", corners, width=2.0, allowed=FOOT, function="internal")
    ways = edge("f", [(-40, 0, 0), (0, 0, 0)], width=2.0, allowed=FOOT)
    back = edge("b", [(0, 6, 0), (-40, 6, 0)], width=2.0, allowed=FOOT)
    cells = cells_of(network(ways, back, turn))
    line = shapely.LineString(corners).buffer(0.9, cap_style="flat", join_style="bevel")
    assert line.difference(shapely.union_all(cells.polygons)).area < 0.01
    index = cells.owners.index("m")
    assert cells.raised[index] and cells.surfaces[index] == PAVING


def test_roads_that_climb_away_from_each_other_are_cut_only_where_they_are_near():
    low = edge("low", [(0, 0, 0), (60, 0, 0)])
    ramp = edge("ramp", [(0, 0, 0), (60, 0, 6)])
    cells = cells_of(network(low, ramp))
    left = cells.polygons[cells.owners.index("ramp")]
    # A storey is 2.5 m, which the ramp reaches after 25 m.
    assert left.bounds[0] == pytest.approx(25.0, abs=0.6)
    assert left.area == pytest.approx(35.0 * 3.2, abs=2.0)
