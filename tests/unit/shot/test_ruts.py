"""Ruts of lanes: on both sides of the middle of what motor vehicles drive on, near cameras."""

import numpy as np
import pytest

from sumo3dviz_pt.model.network import Lane
from sumo3dviz_pt.model.weather import Weather, WeatherCourse
from sumo3dviz_pt.shot.tracks import ruts
from sumo3dviz_pt.world.roads.wear.lanes import TRACK_PLACE

WET = WeatherCourse((0.0,), (Weather(wetness=1.0, puddles=0.5),))
EYE = np.zeros((1, 3))


def lane(edge="a", allowed=("passenger",), x=0.0):
    shape = np.array([[x, 0.0, 1.0], [x + 33.0, 0.0, 1.0]])
    return Lane(f"{edge}_0", edge, 0, shape, 3.2, 13.9, 33.0, frozenset(allowed))


def test_two_ruts_run_along_a_lane_without_gaps():
    found = ruts(WET, [lane()], EYE)
    assert sorted(set(np.round(found.begins[:, 1], 6))) == [-TRACK_PLACE, TRACK_PLACE]
    for side in (-1.0, 1.0):
        own = np.sign(found.begins[:, 1]) == side
        begins, ends = found.begins[own, 0], found.ends[own, 0]
        np.testing.assert_allclose(begins[1:], ends[:-1], atol=1e-9)
        assert begins.min() == 0.0 and ends.max() == pytest.approx(33.0)


@pytest.mark.parametrize(
    "other",
    [lane(":junction"), lane(allowed=("pedestrian",)), lane(allowed=("tram",)), lane(x=9e3)],
    ids=["junction", "sidewalk", "rails", "far away"],
)
def test_nothing_else_has_ruts(other):
    assert len(ruts(WET, [other], EYE).begins) == 0


@pytest.mark.parametrize("course", [None, WeatherCourse((0.0,), (Weather(wetness=1.0),))])
def test_none_are_looked_for_where_no_puddles_stand(course):
    assert ruts(course, [lane()], EYE) is None
