"""National styles: tables are complete, and networks find their own."""

from __future__ import annotations

from dataclasses import replace
from typing import get_args

import numpy as np
import pytest

from sumo3dviz_pt import catalog
from sumo3dviz_pt.job.settings import RoadSettings
from sumo3dviz_pt.library.street.lettering import GLYPHS
from sumo3dviz_pt.library.street.national import st_andrews_cross
from sumo3dviz_pt.library.street.road_styles import (
    AUTO,
    STYLES,
    road_style,
    style_name,
)
from sumo3dviz_pt.model.network import Location, Network
from sumo3dviz_pt.world.roads.strips import BICYCLES


def network(*, left=False, **place) -> Network:
    return Network({}, {}, (), Location(**place), left)


def test_the_scene_file_knows_every_style_and_no_other():
    choices = get_args(RoadSettings.model_fields["marking_style"].annotation)
    assert set(choices) == {AUTO, *STYLES} == {AUTO, "european", "american", "british"}


@pytest.mark.parametrize("name", sorted(STYLES))
def test_every_entry_of_a_style_can_be_drawn(name):
    style = STYLES[name]
    assert set(style.bus_lane.word) <= set(GLYPHS)
    assert style.bicycle_surface in catalog.names("surfaces")
    assert style.bicycle_surface in BICYCLES
    assert 0.0 < style.stop_line < 1.0
    assert min(style.give_way.depth, style.give_way.width, style.give_way.gap) > 0.0
    boards = st_andrews_cross(style.st_andrews_cross)
    assert all(np.isfinite(part.mesh.vertices).all() for part in boards)


@pytest.mark.parametrize(
    ("place", "left", "expected"),
    [
        ((52.45, 13.55), False, "european"),
        ((40.7, -74.0), False, "american"),
        ((51.05, -114.05), False, "american"),
        ((61.2, -149.8), False, "american"),
        ((51.5, -0.1), True, "british"),
        ((-33.85, 151.2), True, "british"),
    ],
)
def test_networks_find_their_style_by_place_and_side(place, left, expected):
    made = network(left=left, place=place)
    assert style_name(AUTO, made) == expected
    assert road_style(AUTO, made) is STYLES[expected]


def test_coordinates_without_a_projection_say_nothing():
    made = network(boundary=(-74.1, 40.6, -73.9, 40.8))
    assert style_name(AUTO, made) == "european"
    assert style_name("british", made) == "british"
    assert style_name(AUTO, replace(made, left_hand=True)) == "british"
