"""Hedges and shrubs of a scenario: they are found, stand on the ground and leave roads free."""

import numpy as np

from sumo3dviz_pt.job.settings import ObjectSettings, ObjectsSettings
from sumo3dviz_pt.model.network import Edge, Lane, Location, Network
from sumo3dviz_pt.model.traffic import Poi, Polygon
from sumo3dviz_pt.world.objects.objects import build_scenery
from sumo3dviz_pt.world.placement.surroundings import surroundings


def poi(kind, x, y):
    return Poi(f"{kind}_{x}", kind, (x, y), None, (1.0, 0.0, 0.0), "objects.add.xml")


def polygon(kind, points, *, fill):
    return Polygon("p", kind, np.array(points, float), fill, None, "x.add.xml", {})


def build(pois=(), polygons=(), settings=None):
    """Objects beside a road from (0, 0) to (400, 0)."""
    shape = np.array([(0.0, 0.0, 0.0), (400.0, 0.0, 0.0)])
    lane = Lane("e_0", "e", 0, shape, 3.2, 14, 400, frozenset({"passenger"}))
    network = Network({"e": Edge("e", "normal", "A", "B", (lane,))}, {}, (), Location())
    around = surroundings(network, seed=7)
    return build_scenery(pois, polygons, settings or ObjectsSettings(), around=around)


def points_of(parts, material):
    some = [p.part.mesh.vertices for p in parts if p.part.material == material]
    return np.concatenate(some)


def test_shrubs_grow_where_their_points_are():
    found = build([poi("shrub", 50, 30), poi("bush", 90, 40)])
    assert {part.family for part in found.static} == {"shrubs"}
    leaves = points_of(found.static, "leaf")
    near = np.minimum(*(np.hypot(*(leaves[:, :2] - spot).T) for spot in ([50, 30], [90, 40])))
    assert near.max() < 4.0 and leaves[:, 2].max() < 4.0
    assert points_of(found.static, "bark")[:, 2].min() < 0.0


def test_hedges_follow_their_lines_and_stop_at_carriageways():
    line = polygon("hedge", [(200, -30), (200, 30)], fill=False)
    found = build(polygons=[line])
    assert {part.family for part in found.static} == {"hedges"}
    core = points_of(found.static, "bark")
    assert np.abs(core[:, 1]).min() > 1.6
    assert core[:, 1].min() < -20 and core[:, 1].max() > 20
    assert np.abs(core[:, 0] - 200).max() < 0.6


def test_hedges_have_the_colour_and_size_that_is_asked_for():
    line = polygon("hedge", [(100, 20), (120, 20)], fill=False)
    for colour, strongest in (("#a03020", 0), ("#3050c0", 2)):
        own = ObjectSettings(colour=colour, scale=2.0, variation=0.0)
        found = build(polygons=[line], settings=ObjectsSettings(hedges=own))
        leaves = next(p.part for p in found.static if p.part.material == "leaf")
        assert leaves.tint.mean(axis=0).argmax() == strongest
        assert 2.4 < leaves.mesh.vertices[:, 2].max() < 3.4
