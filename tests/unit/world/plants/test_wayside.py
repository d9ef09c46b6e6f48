"""Belts and verges of fast roads: none elsewhere, nothing tall in the clear zone."""

from dataclasses import replace

import numpy as np
import pytest
import shapely

from sumo3dviz_pt.library.plants.tree import tree
from sumo3dviz_pt.model.camera import CameraPath
from sumo3dviz_pt.model.geometry import Mesh
from sumo3dviz_pt.model.network import Edge, Lane, Location, Network
from sumo3dviz_pt.model.scene import Part
from sumo3dviz_pt.model.traffic import Poi, Polygon
from sumo3dviz_pt.world.objects.lines import OFF, guard_rails
from sumo3dviz_pt.world.placement.surroundings import surroundings
from sumo3dviz_pt.world.plants.near import near_leaves, tree_pits
from sumo3dviz_pt.world.plants.trees import Plot
from sumo3dviz_pt.world.plants.wayside import (
    CLEAR_ZONE,
    MOST_SHRUBS,
    MOST_TREES,
    MOST_WEEDS,
    verges,
    wayside,
)

PAVED = shapely.box(-900.0, -5.25, 900.0, 5.25)
EYE = (0.0, 0.0, 1.5)


def road(speed=36.0, lanes=3, cycles=0):
    """A straight road to the east along the x axis; its outermost lanes may be for cycles."""
    made = tuple(
        Lane(
            f"e_{k}",
            "e",
            k,
            np.array([[-900.0, 3.5 * (k - lanes // 2), 0.0], [900.0, 3.5 * (k - lanes // 2), 0.0]]),
            3.5,
            speed,
            1800.0,
            frozenset({"bicycle"} if k < cycles else {"passenger", "bus", "truck"}),
        )
        for k in range(lanes)
    )
    return Network({"e": Edge("e", "normal", "A", "B", made)}, {}, (), Location())


def around(network, seed=1, eye=EYE):
    camera_path = CameraPath(np.array([eye]), np.array([[1.0, 0.0, 0.0]]), np.array([0.6]))
    return surroundings(
        network, seed=seed, camera_path=camera_path, height_at=lambda at: np.zeros(len(at))
    )


def belts(seed=1, pois=(), **kw):
    network = road(**kw)
    return wayside(network, Plot([PAVED]), pois, around=around(network, seed))


def spots(pois, kind):
    return np.array([poi.position for poi in pois if poi.type == kind]).reshape(-1, 2)


@pytest.mark.parametrize(
    ("speed", "lanes", "cycles", "some"),
    [(36.0, 2, 0, True), (13.9, 3, 0, True), (13.9, 2, 0, False), (13.9, 3, 1, False)],
)
def test_only_fast_and_wide_roads_have_belts_verges_and_rails(speed, lanes, cycles, some):
    network = road(speed, lanes, cycles)
    pois, far = belts(speed=speed, lanes=lanes, cycles=cycles)
    assert bool(pois) == bool(far) == some
    assert bool(guard_rails(network, [PAVED], (), around=around(network)).polygons) == some
    assert bool(verges(network, Plot([PAVED]), around=around(network))) == some


def test_nothing_tall_stands_in_the_clear_zone():
    pois, far = belts()
    trees = spots(pois, "tree")
    assert 30 < len(trees) <= MOST_TREES
    assert 20 < len(spots(pois, "shrub")) <= MOST_SHRUBS
    assert np.abs(trees[:, 1]).min() > 5.25 + CLEAR_ZONE - 0.01
    assert np.abs(far[0].part.mesh.vertices[:, 1]).min() > 5.25


def test_belts_depend_on_the_seed_only():
    one, again, other = (belts(seed)[0] for seed in (1, 1, 2))
    assert one == again != other
    assert len({poi.id for poi in one}) == len(one)


def test_belts_leave_buildings_their_room():
    free = spots(belts()[0], "tree")
    block = Poi("b", "block", (float(free[0, 0]), float(free[0, 1])), None, None, "a.xml")
    trees = spots(belts(pois=(block,))[0], "tree")
    assert np.hypot(*(trees - free[0]).T).min() > 20.0


def test_a_camera_that_stays_sees_the_road_behind_no_belt():
    network = road()
    how = around(network, eye=(-20.0, -30.0, 8.0))
    trees = spots(wayside(network, Plot([PAVED]), (), around=how)[0], "tree")
    line = shapely.STRtree(shapely.buffer(shapely.points(trees), 2.0))
    for x in (20.0, 60.0, 100.0):
        sight = shapely.LineString([(-20.0, -30.0), (x, -5.25)])
        assert not len(line.query(sight, predicate="intersects"))


def test_verges_lie_beside_the_asphalt_and_keep_their_budget():
    network = road()
    parts = {part.id: part.part for part in verges(network, Plot([PAVED]), around=around(network))}
    gravel, weeds = parts["ground/gravel"], parts["ground/weeds"]
    assert gravel.mesh.vertices[:, 1].max() < -5.2
    assert abs(gravel.mesh.vertices[:, 2]).max() < 0.05
    a, b, c = (gravel.mesh.vertices[gravel.mesh.faces[:, k]] for k in range(3))
    assert (np.cross(b - a, c - a)[:, 2] > 0.0).mean() > 0.97
    assert 1000 < len(weeds.mesh.faces) <= MOST_WEEDS * 1.1
    assert weeds.mesh.vertices[:, 1].max() < -5.25
    assert len(weeds.tint) == len(weeds.mesh.faces)


@pytest.mark.parametrize(("away", "finer"), [(6.0, True), (200.0, False)])
def test_leaves_are_finer_before_cameras_only(away, finer):
    how = around(road())
    bark, leaf = tree("lime", seed=1, level=3)
    moved = [
        Part(
            Mesh(p.mesh.vertices + np.array([away, 0.0, 0.0]), p.mesh.faces, p.mesh.normals),
            p.material,
            p.tint,
        )
        for p in (bark, leaf)
    ]
    found = near_leaves(moved, around=how, budget=20_000)
    assert found[0] is moved[0]
    assert (len(found[1].mesh.faces) > len(leaf.mesh.faces)) == finer
    assert len(found[1].mesh.faces) <= len(leaf.mesh.faces) + 20_000


def test_rails_stand_beside_fast_roads_where_the_scenario_has_no_fences():
    network = road()
    rails = guard_rails(network, [PAVED], (), around=around(network)).polygons
    points = np.concatenate([rail.shape for rail in rails])
    away = shapely.distance(PAVED, shapely.points(points))
    assert away.min() > 0.9 * OFF
    assert away.max() < 1.1 * OFF
    assert points[:, 1].min() < 0.0 < points[:, 1].max()
    own = Polygon("f", "fence", points[:2], False, None, "fences.add.xml")
    for where, polygons, why in ((network, (own,), "of its own"), (road(13.9, 2), (), "no fast")):
        none = guard_rails(where, [PAVED], polygons, around=around(where))
        assert none.polygons == ()
        assert [(item.what, why in item.why) for item in none.left_out] == [("guard rails", True)]


def test_rails_leave_gaps_where_ramps_join():
    ramp = shapely.box(40.0, -40.0, 48.0, 0.0)
    network = road()
    for rail in guard_rails(network, [PAVED, ramp], (), around=around(network)).polygons:
        assert shapely.LineString(rail.shape).distance(ramp) > 0.9 * OFF


@pytest.mark.parametrize("above", [-7.0, 6.0], ids=["bridge", "tunnel"])
def test_rails_end_where_bridges_and_tunnels_begin(above):
    network = road()
    ground = replace(
        around(network), height_at=lambda at: np.where(np.abs(at[:, 0]) < 100.0, above, -0.03)
    )
    rails = guard_rails(network, [PAVED], (), around=ground).polygons
    points = np.concatenate([rail.shape for rail in rails])
    assert 90.0 < np.abs(points[:, 0]).min() < 115.0
    assert points[:, 0].min() < 0.0 < points[:, 0].max()


def test_trees_in_pavements_stand_in_pits():
    court = shapely.box(10.0, 8.0, 60.0, 14.0)
    trees = [Poi(f"t{k}", "tree", (20.0 + 9.0 * k, 11.0), None, None, "a.xml") for k in range(3)]
    trees.append(Poi("lawn", "tree", (30.0, 20.0), None, None, "a.xml"))
    how = around(road(13.9, 2))
    soil, frame = tree_pits(trees, [court], standing=lambda at: np.full(len(at), 0.1), around=how)
    assert len(frame.part.mesh.vertices) == 3 * 16
    for part in (soil, frame):
        a, b, c = (part.part.mesh.vertices[part.part.mesh.faces[:, k]] for k in range(3))
        up = np.cross(b - a, c - a)[:, 2]
        assert up.max() > 0.0
        assert up.min() > -1e-9
        assert part.part.mesh.vertices[:, 1].max() < 14.0
    assert soil.part.mesh.vertices[:, 2].min() > 0.1
    assert tree_pits(trees, [], standing=lambda at: np.zeros(len(at)), around=how) == ()


def test_the_edge_of_a_wood_is_no_wall():
    """Trees of the first row stand back in bays, so that one sees others from aside."""
    pois, _ = belts()
    first = [abs(poi.position[1]) for poi in pois if ":tree:e:0:" in poi.id]
    assert len(first) > 12
    near, far = np.percentile(first, [10, 90])
    assert 3.5 < far - near < 9.0
