"""Grass, hedges and far woods in their colours of the season."""

import numpy as np
from builders import plane, static

from sumo3dviz_pt.model.scene import Part, StaticPart
from sumo3dviz_pt.world.build import grounds_in_season, in_season

GREEN = np.tile((0.1, 0.2, 0.04), (2, 1))


def part(name, family, material="leaf"):
    return StaticPart(name, family, Part(plane(1.0), material, GREEN))


def test_summer_is_left_alone():
    parts = [part("ground/blades/fine", "ground"), static("road", plane(1.0), "asphalt")]
    assert in_season(parts, "summer") == tuple(parts)


def test_only_what_has_no_species_is_turned():
    parts = [
        part("ground/blades/fine", "ground"),
        part("ground/planted", "ground"),
        part("areas/shrubs", "areas"),
        part("trees/a", "trees"),
        part("roof", "homes", "roof"),
    ]
    winter = in_season(parts, "winter")
    turned = [a.part is not b.part for a, b in zip(parts, winter, strict=True)]
    assert turned == [True, True, True, False, False]
    woods = winter[1].part.tint
    assert woods is not None and (woods[:, 0] > woods[:, 1]).all()


def test_grounds_of_grass_get_a_gain_and_others_none():
    grass = {"type": "principled", "base_color": {"type": "untiled", "patches": 1.0}}
    asphalt = {"type": "principled", "base_color": {"type": "untiled", "wear": True}}
    given = {"grass": grass, "asphalt": asphalt}
    assert grounds_in_season(given, "summer") is given
    winter = grounds_in_season(given, "winter")
    assert winter["asphalt"] is asphalt
    red, green, _ = winter["grass"]["base_color"]["gain"]
    assert red > green
