"""Bridges, walls and the terrain around sloped roads, of networks made by hand."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from sumo3dviz_pt.job.settings import RoadSettings
from sumo3dviz_pt.model.network import Edge, Lane, Location, Network
from sumo3dviz_pt.world.land.terrain import STEEPEST, terrain
from sumo3dviz_pt.world.roads.cells import surface_heights
from sumo3dviz_pt.world.roads.layout import layout_roads, levels_of, lowest_surface
from sumo3dviz_pt.world.roads.roads import build_roads
from sumo3dviz_pt.world.structures.bridges import (
    RADIUS,
    THICKNESS,
    bridge_zone,
    build_structures,
    deck_mesh,
    decks_of,
    piers,
)

CARS, WALK = frozenset({"passenger"}), frozenset({"pedestrian"})
RISE = ((0, 0), (130, 0.3), (190, 4), (235, 7), (265, 7), (310, 4), (370, 0.3), (500, 0))
"""Heights of a street along its way: over a motorway, or mirrored, below a street."""


def lanes(edge, points, *, side=0.0, foot=False):
    """A lane, and a footway to its right, beside a line along x or y."""
    line = np.array(points, dtype=float)
    along = line[-1, :2] - line[0, :2]
    right = np.array([along[1], -along[0]]) / np.linalg.norm(along)

    def lane(index, away, width, allowed):
        shape = line.copy()
        shape[:, :2] += (side + away) * right
        return Lane(f"{edge}_{index}", edge, index, shape, width, 13.9, 500.0, allowed)

    found = [lane(0, 2.6, 2.0, WALK)] if foot else []
    return (*found, lane(len(found), 0.0, 3.2, CARS))


def network(**ways):
    """Edges from lines, each with or without a footway."""
    edges = {
        key: Edge(key, "normal", f"{key}0", f"{key}1", lanes(key, points, foot=foot))
        for key, (points, foot) in ways.items()
    }
    return Network(edges, {}, (), Location(boundary=(0.0, 0.0, 500.0, 500.0)))


def overpass(*, foot=False, sign=1.0, other=0.0):
    """A street along y that rises over a straight road along x, or dives below it."""
    rise = [(250, y, sign * z) for y, z in RISE]
    return network(street=(rise, foot), road=([(0, 250, other), (500, 250, other)], foot))


def stacked_ways():
    """A ramp that winds up one turn and a half around one place."""
    turn = np.linspace(0.0, 3.0 * np.pi, 31)
    line = np.column_stack([30 * np.cos(turn), 30 * np.sin(turn), 6.0 * turn / np.pi])
    return network(ramp=(line + np.array([250, 250, 0]), False))


def beside():
    """Two roads 4 m apart, of which one lies 3 m higher."""
    return network(
        low=([(0, 0, 0), (200, 0, 0)], False), high=([(0, 7.2, 2.0), (200, 7.2, 2.0)], True)
    )


NETWORKS = {
    "overpass": overpass(),
    "overpass with footways": overpass(foot=True),
    "underpass": overpass(sign=-1.0),
    "underpass with footways": overpass(sign=-1.0, foot=True),
    "ramp": stacked_ways(),
    "beside": beside(),
}


def built(name):
    """A layout, and mesh and height of its terrain."""
    layout = layout_roads(NETWORKS[name], RoadSettings())
    return (layout, *terrain(layout, NETWORKS[name]))


def on_cells(layout, rng):
    """Places on the surface, (n, 2), and their cells."""
    places, cells = [], []
    for k, area in enumerate(layout.cells.polygons):
        low, high = np.reshape(area.bounds, (2, 2))
        some = rng.uniform(low, high, (12, 2))
        some = some[shapely.intersects_xy(area, some[:, 0], some[:, 1])]
        places.append(some)
        cells += [k] * len(some)
    return np.concatenate(places), np.array(cells)


@pytest.mark.parametrize("name", NETWORKS)
def test_the_terrain_is_never_above_a_road(name):
    layout, _, height_at = built(name)
    places, cells = on_cells(layout, np.random.default_rng(1))
    assert (height_at(places) < surface_heights(layout.cells, cells, places)).all()


@pytest.mark.parametrize("name", NETWORKS)
def test_something_solid_meets_every_border(name):
    """Ground, a wall, a beam or a deck's side lies within 10 cm below each point of a border."""
    layout, _, height_at = built(name)
    parts = build_structures(layout, height_at)
    sides = [part.part.mesh for part in parts if part.id == "ground/walls"]
    tops = np.concatenate([np.zeros((0, 3)), *(mesh.vertices for mesh in sides)])
    for border in levels_of(layout).borders:
        middles = 0.5 * (border.line[1:] + border.line[:-1])
        depth = middles[:, 2] - height_at(middles[:, :2])
        for place, below in zip(middles, depth, strict=True):
            if below > 0.1:
                near = np.abs(tops - place)
                length = 3.0 + np.abs(np.diff(border.line, axis=0)).max()
                assert ((near[:, :2] < length).all(axis=1) & (near[:, 2] < length)).any(), place


def test_levels_count_what_lies_below():
    assert levels_of(built("ramp")[0]).of_cell.max() == 1
    layout = built("overpass")[0]
    levels = levels_of(layout)
    assert set(levels.crossings.gap.round(3)) == {7.0}
    owners = np.array(layout.cells.owners)
    assert set(owners[levels.of_cell == 1]) == {"street"}
    assert not levels_of(built("beside")[0]).of_cell.any()


def test_borders_do_not_cross_the_surface_where_levels_change():
    levels = levels_of(built("overpass")[0])
    upper = [border for border in levels.borders if border.level == 1]
    assert len(upper) == 2 and not any(border.closed for border in upper)
    for border in upper:
        assert np.ptp(border.line[:, 0]) == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("name", ["overpass", "overpass with footways", "underpass"])
def test_decks_clear_the_road_below(name):
    layout, _, height_at = built(name)
    decks = decks_of(layout, bridge_zone(levels_of(layout)), height_at)
    levels = levels_of(layout)
    below = shapely.get_coordinates(shapely.centroid(levels.crossings.shared))
    found = [undersides(deck_mesh(deck, layout), below) for deck in decks]
    assert len(found) >= 1 and np.isfinite(found).any(axis=0).all()
    clear = np.nanmin(found, axis=0) - lowest_surface(layout, below)
    assert clear.min() > 3.5
    assert (np.nanmin(found, axis=0) - height_at(below)).min() > 3.5


def undersides(mesh, places):
    """Height of a mesh's lowest face above places, (n, 2), as (n,); NaN where there is none."""
    heights = np.full(len(places), np.nan)
    for face in mesh.vertices[mesh.faces]:
        normal = np.cross(face[1] - face[0], face[2] - face[0])
        if abs(normal[2]) < 1e-6:
            continue
        inside = shapely.intersects_xy(shapely.Polygon(face[:, :2]), *places.T)
        z = face[0, 2] - (places - face[0, :2]) @ normal[:2] / normal[2]
        heights = np.where(inside, np.fmin(heights, z), heights)
    return heights


def test_piers_stand_beside_the_road_below_and_reach_the_deck():
    layout, _, height_at = built("overpass")
    decks = decks_of(layout, bridge_zone(levels_of(layout)), height_at)
    columns = piers(layout, decks, height_at)
    assert len(columns.faces)
    away = np.abs(columns.vertices[:, 1] - 250.0)
    assert away.min() > 1.6 + 0.9
    assert columns.vertices[:, 0] == pytest.approx(250.0, abs=RADIUS + 0.01)
    assert 7.0 - THICKNESS - 1.5 < columns.vertices[:, 2].max() < 7.0


def test_embankments_have_the_slope_of_grass():
    _, _, height_at = built("overpass")
    # Away from the crossing, on a ramp 4 m high.
    out = np.arange(3.0, 6.0, 0.5)
    z = height_at(np.column_stack([250.0 + out, np.full(len(out), 190.0)]))
    slope = np.diff(z) / 0.5
    assert slope.min() > -STEEPEST - 0.15
    assert slope.mean() < -0.3
    assert z[0] > 2.5
    assert height_at(np.array([[263.0, 190.0]]))[0] < 2.0


def test_a_wall_stands_where_a_slope_has_no_room():
    layout, _, height_at = built("beside")
    parts = {part.id: part.part.mesh for part in build_structures(layout, height_at)}
    wall = parts["ground/walls"]
    assert np.median(wall.vertices[:, 1]) == pytest.approx(3.6, abs=0.4)
    assert "ground/walls" not in {p.id for p in build_structures(*flat())}


def flat():
    net = network(road=([(0, 0, 0), (100, 0, 0)], True))
    layout = layout_roads(net, RoadSettings())
    return layout, lambda places: np.zeros(len(places))


def test_kerbs_of_crossing_footways_stay_on_their_levels():
    roads = build_roads(NETWORKS["underpass with footways"], RoadSettings(), textured=False)
    for part in roads.static:
        corners = part.part.mesh.vertices[part.part.mesh.faces]
        assert np.ptp(corners[..., 2], axis=1).max() < 6.0, part.id
        upright = np.ptp(corners[..., :2], axis=1).max(axis=1) < 1.0
        assert np.ptp(corners[upright, :, 2], axis=1).max(initial=0.0) < 0.6, part.id
