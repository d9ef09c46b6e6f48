"""What panes and walls tell the renderer about themselves."""

import numpy as np
import pytest

from sumo3dviz_pt.library.buildings.facade import NEAR
from sumo3dviz_pt.library.buildings.palettes import palette
from sumo3dviz_pt.library.buildings.panes import (
    PANE,
    ROOMS,
    pane_places,
    room_numbers,
    room_walls,
)
from sumo3dviz_pt.library.buildings.shell import paint, rectangles
from sumo3dviz_pt.library.buildings.styles import BLOCKS
from sumo3dviz_pt.model.geometry import PANE_SIZES, PANE_STEP, WALL_REACH

ROW = rectangles(np.arange(40) * 3.0, np.arange(40) * 3.0 + 1.3, 4.0, 5.5)


def test_corners_tell_sizes_and_where_they_are():
    places = pane_places(ROW, "room3", office=False)
    steps = places[..., :2] * PANE_SIZES
    assert np.floor(steps)[..., 0] * PANE_STEP == pytest.approx(1.3)
    assert np.floor(steps)[..., 1] * PANE_STEP == pytest.approx(1.5)
    within = (steps - np.floor(steps))[0]
    assert within.round(1).tolist() == [[0, 0], [1, 0], [1, 1], [0, 1]]


@pytest.mark.parametrize(
    ("role", "office", "block"),
    [
        ("room1", False, 0),
        ("bare1", False, 1),
        ("room1", True, 2),
        ("shop2", True, 4),
        ("sign0", False, 6),
    ],
)
def test_rooms_are_numbered_by_what_they_are(role, office, block):
    number = (pane_places(ROW, role, office=office)[..., 2] * 8 * ROOMS).astype(int)
    assert (number // ROOMS == block).all()
    assert (number == number[:, :1]).all()


def test_neighbouring_panes_have_other_rooms_and_the_same_place_the_same():
    numbers = room_numbers(ROW)
    assert (numbers[1:] != numbers[:-1]).mean() > 0.9
    assert len(np.unique(numbers)) > 25
    assert (room_numbers(ROW + 1e-9) == numbers).all()


def test_lit_rooms_have_walls_and_signs_have_none():
    walls = room_walls(pane_places(ROW, "room0", office=False)[:, 0])
    assert ((walls > 0.25) & (walls <= 0.75)).all()
    assert room_walls(pane_places(ROW, "sign0", office=False)[:, 0]).max() < 0.05


def test_painted_walls_tell_their_height_and_panes_their_rooms():
    style = BLOCKS["brick"]
    colours = palette(style.colours, np.random.default_rng(1), textured=True)
    tiles = {material: 3.0 for material, _ in colours.values() if material.startswith("cladding:")}
    parts = {part.material: part for part in paint(style.build(1, NEAR), colours, tiles=tiles)}
    assert parts[PANE].mesh.wear is not None
    mesh = parts["cladding:brick"].mesh
    height = mesh.vertices[:, 2] - mesh.wear[:, 0] * WALL_REACH
    inside = (mesh.wear[:, 0] > 0.0) & (mesh.wear[:, 0] < 1.0)
    assert np.ptp(height[inside]) < 1e-6
    assert mesh.wear[:, 2].max() == 1.0, "water runs from sills"


def test_neighbours_of_one_style_differ_in_colour():
    style = BLOCKS["brick"]
    walls = [palette(style.colours, np.random.default_rng(k))["wall"][1] for k in range(12)]
    apart = np.abs(np.diff(np.array(walls), axis=0)).max(axis=1)
    assert (apart > 0.002).all()
