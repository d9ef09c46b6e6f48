"""Tunnels: roads that run deep below the ground for long, below other roads."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from sumo3dviz_pt.job.settings import GroundSettings, RoadSettings
from sumo3dviz_pt.model.network import Edge, Lane, Location, Network
from sumo3dviz_pt.world.land.ground import build_ground
from sumo3dviz_pt.world.land.horizon import built_points, land_around
from sumo3dviz_pt.world.land.terrain import ground_between
from sumo3dviz_pt.world.roads.layout import layout_roads
from sumo3dviz_pt.world.structures.deep_roads import HIGHEST, tunnels_of

CARS = frozenset({"passenger"})


def network(*, depth=8.0, flat=200.0, streets=(190.0, 250.0, 310.0)):
    """Two parallel roads along x that dive below streets along y.

    Args:
        depth: Of the roads between their ramps [m].
        flat: Length of the deep stretch [m].
        streets: Where streets cross them, x [m].
    """
    low, high = 250.0 - 0.5 * flat, 250.0 + 0.5 * flat
    ramp = 15.0 * depth
    way = [(low - ramp - 40, 0.0), (low - ramp, 0.0), (low, -depth), (high, -depth)]
    way += [(high + ramp, 0.0), (high + ramp + 40, 0.0)]
    lines = {f"deep{y}": [(x, y, z) for x, z in way] for y in (198.0, 202.0)}
    lines |= {f"street{k}": [(x, 50, 0), (x, 350, 0)] for k, x in enumerate(streets)}
    lines |= {f"side{y}": [(0, y, 0), (500, y, 0)] for y in (120, 280)}
    edges = {}
    for key, points in lines.items():
        lane = Lane(f"{key}_0", key, 0, np.array(points, dtype=float), 3.2, 13.9, 500.0, CARS)
        edges[key] = Edge(key, "normal", f"{key}a", f"{key}b", (lane,))
    return Network(edges, {}, (), Location(boundary=(0.0, 0.0, 500.0, 400.0)))


def found(net):
    """The layout of a network and its tunnels."""
    layout = layout_roads(net, RoadSettings())
    corners = built_points(layout.outline, net.location.boundary)
    land = land_around(corners, horizon="flat", surface="", seed=0)
    return layout, tunnels_of(layout, ground_between(layout, net, land))


def mesh_of(ground, name):
    """A part of the ground."""
    return next(part.part.mesh for part in ground.static if part.id == name)


def test_a_long_deep_road_below_a_street_is_one_tunnel_with_two_mouths():
    _, tunnels = found(network())
    (tunnel,) = tunnels
    assert len(tunnel.mouths) == 2 and 3.9 < tunnel.height <= HIGHEST
    for mouth in tunnel.mouths:
        assert abs(mouth.outward[0]) == pytest.approx(1.0, abs=1e-6)
        # One head wall for both carriageways.
        assert mouth.middle[1] == pytest.approx(200.0, abs=0.1)
        assert mouth.half == pytest.approx(3.6, abs=0.1)
        assert 6.0 <= -mouth.middle[2] < 8.1


@pytest.mark.parametrize(
    "other",
    [{"depth": 5.0}, {"depth": 7.0, "flat": 20.0}, {"streets": ()}, {"depth": 0.0}],
    ids=str,
)
def test_shallow_short_and_lonely_roads_are_open(other):
    assert found(network(**other))[1] == ()


def test_deep_roads_at_other_heights_are_no_mouths_of_a_tunnel():
    net = network(streets=(190.0, 310.0))
    line = np.array([(250.0, 150.0, 0.0), (250.0, 190.0, 0.0), (250.0, 260.0, 0.0)])
    lane = Lane("up_0", "up", 0, line, 3.2, 13.9, 110.0, CARS)
    edges = dict(net.edges) | {"up": Edge("up", "normal", "upa", "upb", (lane,))}
    layout = layout_roads(Network(edges, {}, (), net.location), RoadSettings())
    # The hill above both lies far above the upper road too.
    (tunnel,) = tunnels_of(
        layout, lambda places: np.where(np.abs(places[:, 0] - 250.0) < 120.0, 9.0, 0.0)
    )
    assert all(mouth.middle[2] < -2.9 for mouth in tunnel.mouths)
    assert all(abs(mouth.outward[0]) > 0.99 for mouth in tunnel.mouths)


def test_the_ground_lies_on_the_tunnel_and_below_the_streets():
    net = network()
    layout, (tunnel,) = found(net)
    ground = build_ground(GroundSettings(), net, roads=layout, textured=False)
    lo, hi = tunnel.area.bounds[0], tunnel.area.bounds[2]
    x = np.arange(lo + 1, hi - 1, 2.0)
    z = ground.height_at(np.column_stack([x, np.full(len(x), 200.0)]))
    assert z.min() > -1.0 and z.max() < 0.05
    # Before the mouths the road is open.
    out = np.array([[lo - 6.0, 198.0], [hi + 6.0, 202.0]])
    assert (ground.height_at(out) < -5.0).all()
    # Nothing reaches into the room of a lorry.
    shell = mesh_of(ground, "ground/tunnels").vertices
    for y in (198.0, 202.0):
        lane = shapely.box(lo + 1.0, y - 1.5, hi - 1.0, y + 1.5)
        over = shapely.intersects_xy(lane, shell[:, 0], shell[:, 1])
        assert (shell[over, 2] > -8.0 + 3.9).all()


def test_the_lid_meets_the_terrain_around():
    net = network()
    layout, (tunnel,) = found(net)
    ground = build_ground(GroundSettings(), net, roads=layout, textured=False)
    ring = shapely.segmentize(tunnel.lid.exterior, 3.0)
    points = shapely.get_coordinates(ring)
    lo, hi = (mouth.middle[0] for mouth in sorted(tunnel.mouths, key=lambda m: m.middle[0]))
    side = points[(points[:, 0] > lo + 1.0) & (points[:, 0] < hi - 1.0)]
    outward = np.column_stack([np.zeros(len(side)), np.sign(side[:, 1] - 200.0)])
    step = ground.height_at(side + 0.3 * outward) - ground.height_at(side - 0.3 * outward)
    assert np.abs(step).max() < 0.5


def test_lamps_hang_below_the_ceiling_and_none_elsewhere():
    net = network()
    layout, (tunnel,) = found(net)
    ground = build_ground(GroundSettings(), net, roads=layout, textured=False)
    always, by_day = ground.lamps
    assert len(always.lamps) > 20 and always.id != by_day.id
    ends = [mouth.middle[0] for mouth in tunnel.mouths]
    for lamps in ground.lamps:
        assert lamps.sampled
        assert shapely.intersects_xy(tunnel.area, *lamps.mesh.vertices[:, :2].T).all()
        corners = lamps.mesh.vertices[lamps.mesh.faces]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        assert (normals[:, 2] < 0.0).all()
    away = np.abs(by_day.mesh.vertices[:, 0][:, None] - ends).min(axis=1)
    assert away.max() < 61.0
    level = network(depth=0.0)
    bare = build_ground(GroundSettings(), level, roads=found(level)[0], textured=False)
    assert bare.lamps == () and "ground/tunnels" not in {part.id for part in bare.static}


def test_walls_show_concrete_at_one_scale():
    net = network()
    ground = build_ground(GroundSettings(), net, roads=found(net)[0], textured=True)
    mesh = mesh_of(ground, "ground/tunnels")
    assert "surface:concrete" in ground.materials and mesh.uvs is not None
    corners, uvs = mesh.vertices[mesh.faces], mesh.uvs[mesh.faces]
    drawn = np.linalg.norm(uvs[:, 1] - uvs[:, 0], axis=1) * 6.0
    long = np.linalg.norm(corners[:, 1] - corners[:, 0], axis=1)
    share = drawn[long > 0.1] / long[long > 0.1]
    assert share.min() > 0.55 and share.max() < 1.01
