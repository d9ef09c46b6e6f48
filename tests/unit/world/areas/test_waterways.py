"""Lanes for ships alone lie in water, and ships float on it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import shapely
from builders import write_scenario

from sumo3dviz_pt.job.settings import RoadSettings
from sumo3dviz_pt.model.traffic import Polygon
from sumo3dviz_pt.pipeline.production import Request, prepare
from sumo3dviz_pt.pipeline.scene_file import load_job
from sumo3dviz_pt.sumo import find_scenario, read_scenario
from sumo3dviz_pt.world.areas.covers import _ring, water_depth, with_waterways
from sumo3dviz_pt.world.roads.layout import layout_roads

TYPES = '<additional><vType id="car" vClass="ship" length="17" width="4"/></additional>'


@pytest.fixture
def scene(tmp_path):
    """The straight road as a waterway."""
    scene = write_scenario(tmp_path, vehicles=1)
    net = tmp_path / "net.net.xml"
    wet = net.read_text(encoding="utf-8").replace(' speed="13.9"', ' speed="13.9" allow="ship"')
    net.write_text(wet, encoding="utf-8")
    (tmp_path / "types.add.xml").write_text(TYPES, encoding="utf-8")
    return scene


def read(scene):
    return read_scenario(find_scenario(scene.parent))


def areas(scenario):
    return [shapely.make_valid(shapely.Polygon(item.shape)) for item in scenario.polygons]


def test_water_lies_around_lanes_of_ships_and_nothing_is_paved(scene):
    scenario = with_waterways(read(scene))
    (water,) = areas(scenario)
    for lane in scenario.network.lanes.values():
        assert water.contains(shapely.LineString(lane.shape[:, :2]).buffer(0.5 * lane.width))
    assert not len(layout_roads(scenario.network, RoadSettings()).outline)


def test_a_polygon_of_water_is_enough(scene):
    shore = np.array([(-300, -90), (300, -90), (300, 90), (-300, 90)])
    given = Polygon("lake", "natural.water", shore, True, None, "a.xml")
    lake = replace(read(scene), polygons=(given,))
    assert with_waterways(lake).polygons == (given,)


def test_rings_of_waterways_keep_their_island():
    ring = shapely.Point(0, 0).buffer(50).difference(shapely.Point(3, 0).buffer(20))
    area = shapely.make_valid(shapely.Polygon(_ring(ring)))
    assert area.symmetric_difference(ring).area < 1e-6


@pytest.mark.slow
def test_ships_float_on_water_that_is_drawn(scene):
    text = scene.read_text(encoding="utf-8")
    scene.write_text(text.replace("template: abstract", "template: village_day"), encoding="utf-8")
    shot = prepare(load_job(scene), Request(camera="post"), np.array([6.0])).shot
    (water,) = [part.part.mesh for part in shot.data.static if part.part.material == "water"]
    level = water.vertices[:, 2].max()
    assert np.ptp(water.vertices[:, 2]) < 0.01
    feet = [mover.world_from_body.position[2] for mover in shot.frame_at(6.0).movers]
    assert feet and np.allclose(feet, level, atol=0.02)
    assert level == pytest.approx(-water_depth(), abs=0.02)
