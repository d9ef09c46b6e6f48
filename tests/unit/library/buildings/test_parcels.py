"""Rows of houses along building lines."""

from itertools import pairwise

import numpy as np
import pytest
import shapely

from sumo3dviz_pt.library.buildings.styles import lots_along

DEPTH = 12.0


def everywhere(places):
    return np.ones(len(places), dtype=bool)


def chance(place, word):
    return (abs(float(place.sum())) * 0.37 + len(word) * 0.19) % 1.0


def lots_of(line, fit=everywhere):
    return lots_along(np.array(line, float), fit, depth=DEPTH, share=chance)


def arc(radius, count=25):
    angle = np.linspace(0.0, 0.5 * np.pi, count)
    return radius * np.column_stack([np.cos(angle), np.sin(angle)])


def test_a_straight_street_is_built_up_from_end_to_end_with_party_walls():
    lots = lots_of([(0, 0), (100, 0)])
    ends = [(lot.line[0, 0], lot.line[-1, 0]) for lot in lots]
    assert ends[0][0] == 0.0 and ends[-1][1] == 100.0
    assert all(a[1] == b[0] for a, b in pairwise(ends))
    assert all(8.0 < b - a < 24.0 for a, b in ends)
    assert lots[0].joined == (False, True)
    assert lots[-1].joined == (True, False)


def test_houses_stand_to_the_left_of_their_line_fronts_first():
    plan = lots_of([(0, 0), (60, 0)])[0].plan(DEPTH)
    assert plan is not None
    assert shapely.Polygon(plan).exterior.is_ccw
    assert plan[:2, 1].tolist() == [0.0, 0.0]
    assert plan[:, 1].max() == pytest.approx(DEPTH)


def test_a_block_has_a_corner_house_with_two_wings_at_each_corner():
    lots = lots_of([(0, 0), (80, 0), (80, 60), (0, 60), (0, 0)])
    corners = [lot for lot in lots if lot.corner]
    assert len(corners) == 4
    for lot in corners:
        plan = lot.plan(DEPTH)
        assert plan is not None and len(plan) == 6
    plans = [shapely.Polygon(lot.plan(DEPTH)) for lot in lots]
    total = sum(plan.area for plan in plans)
    assert total == pytest.approx(shapely.union_all(plans).area, rel=1e-6)
    assert total == pytest.approx(80 * 60 - 56 * 36, rel=0.02)


@pytest.mark.parametrize("inside", [True, False])
def test_houses_follow_a_curved_street_without_gaps(inside):
    line = arc(90.0) if inside else arc(90.0)[::-1]
    lots = lots_of(line)
    assert len(lots) > 6 and not any(lot.corner for lot in lots)
    plans = [shapely.Polygon(lot.plan(DEPTH)).buffer(0.05) for lot in lots]
    assert shapely.union_all(plans).geom_type == "Polygon"
    for one, other in pairwise(plans):
        assert one.intersection(other).area < 3.0


def test_where_nothing_may_stand_there_is_a_gap():
    lots = lots_of([(0, 0), (200, 0)], lambda places: np.abs(places[:, 0] - 100) > 20)
    assert all(abs(lot.line[:, 0] - 100).min() >= 20 for lot in lots)
    assert len(lots) > 8


def test_a_lot_that_is_too_short_for_its_depth_has_no_plan():
    lots = lots_of([(0, 0), (30, 0), (30, 30), (0, 30), (0, 0)])
    assert all(lot.plan(40.0) is None or shapely.Polygon(lot.plan(40.0)).is_valid for lot in lots)
