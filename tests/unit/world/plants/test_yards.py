"""Yards: hedges at the street, trees inside the lot, none in a camera's way."""

from pathlib import Path

import numpy as np
import pytest
import shapely
from drives import network_of

from sumo3dviz_pt.job.settings import EulerianCamera
from sumo3dviz_pt.model.camera import CameraPath
from sumo3dviz_pt.model.network import Location, Network
from sumo3dviz_pt.pipeline.production import read
from sumo3dviz_pt.pipeline.scene_file import load_job
from sumo3dviz_pt.shot.cameras.aiming import clearance_of
from sumo3dviz_pt.world.build import World, build_place
from sumo3dviz_pt.world.objects.kinds import kind_of
from sumo3dviz_pt.world.placement.surroundings import surroundings
from sumo3dviz_pt.world.plants.wayside import gardens, yard_hedges, yard_trees
from sumo3dviz_pt.world.rows.fronts import House, Rows, Yard

PLAN = np.array([[0.0, 0.0], [20.0, 0.0], [20.0, 14.0], [0.0, 14.0]])
YARD = Yard("10:0", PLAN, 1)
EMPTY = Network({}, {}, (), Location())


def around(*eyes, seed=1):
    camera_path = CameraPath.all_round(np.array(eyes, dtype=float).reshape(-1, 3)) if eyes else None
    return surroundings(
        EMPTY, seed=seed, camera_path=camera_path, height_at=lambda at: np.zeros(len(at))
    )


def places(pois):
    return np.array([poi.position for poi in pois]).reshape(-1, 2)


def test_trees_stand_inside_and_apart():
    trees = yard_trees([YARD], around())
    spots = places(trees)
    assert 4 <= len(trees) <= 12
    assert all(kind_of(tree.type, tree.source) == "trees" for tree in trees)
    assert len({tree.id for tree in trees}) == len(trees)
    assert (shapely.distance(shapely.Polygon(PLAN).exterior, shapely.points(spots)) > 2.5).all()
    gaps = np.hypot(*(spots[:, None] - spots[None]).transpose(2, 0, 1))
    assert gaps[~np.eye(len(spots), dtype=bool)].min() > 3.0


def test_the_seed_and_the_lot_decide_where():
    one, again, other = (places(yard_trees([YARD], around(seed=seed))) for seed in (1, 1, 2))
    np.testing.assert_array_equal(one, again)
    assert one.shape != other.shape or not np.allclose(one, other)


def test_trees_keep_clear_of_cameras():
    eye = (10.0, 7.0, 5.0)
    spots = places(yard_trees([YARD], around(eye)))
    assert 0 < len(spots) < len(yard_trees([YARD], around()))
    assert np.hypot(*(spots - eye[:2]).T).min() > 5.0


@pytest.mark.parametrize("fronts", [1, 2])
def test_hedges_run_along_the_streets_only(fronts):
    (line,) = yard_hedges([Yard("10:0", PLAN, fronts)], around())
    assert line.type == "hedge" and not line.fill and kind_of(line.type, line.source) == "hedges"
    hedge = shapely.LineString(line.shape)
    sides = [shapely.LineString(ends) for ends in zip(PLAN, np.roll(PLAN, -1, 0), strict=True)]
    along = [hedge.intersection(side.buffer(1.0)).length > 5.0 for side in sides]
    assert along == [True, fronts > 1, False, False]
    assert shapely.Polygon(PLAN).covers(hedge)


@pytest.mark.parametrize(("height", "hedges"), [(2.2, 0), (9.0, 1)])
def test_no_hedge_stands_before_a_camera_at_the_height_of_people(height, hedges):
    road = network_of({"a_0": [(-30.0, -5.0), (50.0, -5.0)]})
    camera = EulerianCamera.model_validate(
        {"mode": "eulerian", "position": (10.0, 6.0, height), "look_at": (10.0, -5.0, 1.0)}
    )
    clear = clearance_of([camera], aspect=0.5)
    assert len(yard_hedges([YARD], surroundings(road, seed=1, clearance=clear))) == hedges


def test_no_garden_overlaps_a_house_or_another_garden():
    def moved(name, x, y):
        return Yard(name, np.add(PLAN, (x, y)), 1)

    house = House("h", np.add(PLAN, (45.0, 3.0)), 1, (), corner=True, main=False)
    open_lots = (YARD, moved("beside", 20.0, 0.0), moved("over", 10.0, 9.0), moved("in", 50.0, 0.0))
    kept = gardens(Rows(houses=(house,), yards=open_lots))
    assert [yard.id for yard in kept] == [YARD.id, "beside"]
    assert gardens(Rows()) == ()


@pytest.mark.slow
def test_where_nothing_is_planted_no_garden_grows():
    crossing = Path(__file__).parents[4] / "examples" / "crossing" / "scene.yaml"
    camera_path = CameraPath.all_round(np.array([[300.0, 300.0, 8.0]]))
    grown = {}
    for planting in ("auto", "none"):
        job = load_job(crossing, {"ground.planting": planting})
        _, scenario, _ = read(job, begin=450.0, end=451.0)
        clear = clearance_of(job.cameras.values(), aspect=0.5)
        place = build_place(World.of(scenario, job, clearance=clear), camera_path)
        grown[planting] = {part.id.split("/")[0] for part in place.static}
    assert "hedges" in grown["auto"] and "hedges" not in grown["none"]


def test_a_lot_too_small_for_anything_stays_empty():
    tiny = Yard("0:0", np.array([[0.0, 0.0], [1.5, 0.0], [1.5, 1.5], [0.0, 1.5]]), 1)
    assert yard_trees([tiny], around()) == () and yard_hedges([tiny], around()) == ()
