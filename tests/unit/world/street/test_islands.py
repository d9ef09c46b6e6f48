"""Kerbed islands in roundabouts and between carriageways."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from sumo3dviz_pt.job.settings import RoadSettings
from sumo3dviz_pt.model.network import Edge, Lane, Location, Network
from sumo3dviz_pt.world.placement.lanes import build_lane_index
from sumo3dviz_pt.world.placement.surroundings import surroundings
from sumo3dviz_pt.world.roads.layout import layout_roads
from sumo3dviz_pt.world.street.islands import island_parts, island_shrubs, islands_of

CAR = frozenset({"passenger"})


def along(name, points, *, speed=13.9):
    """An edge of one lane along points, (n, 2) [m]."""
    shape = np.column_stack([points, np.zeros(len(points))])
    lane = Lane(f"{name}_0", name, 0, shape, 3.2, speed, 1.0, CAR)
    return Edge(name, "normal", f"{name}a", f"{name}b", (lane,))


def ring(*, stretch=1.0, clockwise=False, left=False, speed=13.9):
    """Four quarters of a ring of 15 m, or of an oval."""
    edges = []
    for quarter in range(4):
        turn = np.linspace(quarter, quarter + 1, 9) * np.pi / 2
        points = np.round(np.column_stack([15 * stretch * np.cos(turn), 15 * np.sin(turn)]), 3)
        edges.append(along(f"q{quarter}", points[::-1] if clockwise else points, speed=speed))
    return Network({e.id: e for e in edges}, {}, (), Location(), left)


def median(gap):
    """Two carriageways and what joins their ends."""
    y = gap / 2 + 1.6
    lines = {
        "east": [(0, -y), (60, -y)], "west": [(60, y), (0, y)],
        "turn": [(61.6, -y - 1.6), (61.6, y + 1.6)], "back": [(-1.6, y + 1.6), (-1.6, -y - 1.6)],
    }  # fmt: skip
    edges = [along(name, np.array(points, dtype=float)) for name, points in lines.items()]
    return Network({e.id: e for e in edges}, {}, (), Location())


def found(net):
    return islands_of(net, layout_roads(net, RoadSettings()), build_lane_index(net))


@pytest.mark.parametrize(
    ("options", "count"),
    [
        ({}, 1),
        ({"clockwise": True}, 0),
        ({"clockwise": True, "left": True}, 1),
        ({"left": True}, 0),
        ({"stretch": 3.0}, 0),
        ({"speed": 30.0}, 0),
    ],
)
def test_what_slow_traffic_passes_on_the_inner_side_and_is_round_is_an_island(options, count):
    assert len(found(ring(**options))) == count


@pytest.mark.parametrize(("gap", "count"), [(0.2, 0), (0.8, 1), (3.0, 1), (5.8, 1), (12.0, 0)])
def test_narrow_strips_between_carriageways_are_islands(gap, count):
    islands = found(median(gap))
    assert len(islands) == count
    assert all(island.paved == (gap < 1.6) for island in islands)
    for island in islands:
        assert island.shape.area == pytest.approx(60 * gap, rel=0.03)


@pytest.mark.parametrize("net", [ring(), median(0.8), median(3.0)])
def test_kerbs_stand_on_the_island_and_look_away_from_stone(net):
    layout, islands = layout_roads(net, RoadSettings()), found(net)
    (part,) = island_parts(islands, layout).static
    mesh = part.part.mesh
    assert mesh.vertices[:, 2].max() == pytest.approx(0.12)
    spots = shapely.points(mesh.vertices[:, :2])
    assert shapely.distance(spots, islands[0].shape).max() < 1e-6
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    flat = np.abs(normals[:, 2]) > 1e-9
    assert (normals[flat, 2] > 0.0).all()
    upper = mesh.vertices[mesh.faces[flat]][..., :2]
    stone = shapely.union_all(shapely.polygons(upper)).buffer(1e-6)
    side = normals[~flat, :2] / np.linalg.norm(normals[~flat, :2], axis=1, keepdims=True)
    before = (a + b + c)[~flat, :2] / 3 + 0.02 * side
    assert not shapely.contains(stone, shapely.points(before)).any()
    if islands[0].paved:
        assert stone.area == pytest.approx(islands[0].shape.area, rel=0.01)


def test_shrubs_grow_on_the_middle_of_roundabouts_alone_and_without_islands_it_says_so():
    around = surroundings(ring(), seed=2, viewpoints=np.array([[200.0, 0.0, 30.0]]))
    (island,) = found(ring())
    shrubs = island_shrubs([island], around)
    assert len(shrubs) > 5
    room = island.shape.buffer(-2.0)
    assert all(shapely.contains_xy(room, *poi.position) for poi in shrubs)
    assert island_shrubs(found(median(3.0)), around) == ()
    parts = island_parts((), layout_roads(ring(), RoadSettings()))
    assert not parts.static
    assert [out.what for out in parts.left_out] == ["traffic islands"]
