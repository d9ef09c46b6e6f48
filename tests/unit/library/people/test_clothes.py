"""Cloth, hair and what hands hold: what makes people no mannequins."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from sumo3dviz_pt.catalog import find, names
from sumo3dviz_pt.library.materials import MATERIALS
from sumo3dviz_pt.library.people.body import GarmentCut, arm
from sumo3dviz_pt.library.people.hair import STYLES
from sumo3dviz_pt.library.people.people import LEVELS, clothed, figure
from sumo3dviz_pt.library.people.posture import BONES, BodyMeasures
from sumo3dviz_pt.library.people.skin import Cloth, Counts, dressed

LOOKS = names("people")
BODY = BodyMeasures()


def recipe(name: str):
    return find("people", name).meta["recipe"]


@cache
def near(name: str):
    return figure(recipe(name))


def test_cloth_shoes_and_bags_are_dull():
    dull = [name for name in MATERIALS if name.startswith(("cloth", "denim", "fabric", "leather"))]
    dull = [name for name in dull if name != "leather_rim"]
    assert len(dull) >= 7
    for name in dull:
        assert 0.8 <= MATERIALS[name]["roughness"] <= 0.95, name
    for name in ("hair", "hair_dark", "hair_fair"):
        assert MATERIALS[name]["roughness"] == 0.8


@pytest.mark.parametrize("name", LOOKS)
def test_hair_has_a_natural_colour(name):
    red, green, blue = recipe(name)["face"]["hair"]
    assert red >= green >= blue
    assert (red - blue) / red < 0.56
    assert green / red > 0.6


def test_there_are_many_cuts():
    worn = {item["style"] for name in LOOKS for item in recipe(name)["head"]}
    grown = {style for style in worn if STYLES[style].material == "hair"}
    assert len(grown) >= 14 and {"cap", "hat", "hood", "beanie"} <= worn


@pytest.mark.parametrize("name", LOOKS)
def test_no_cloth_is_of_one_colour(name):
    """Patches differ by a few percent, hems and hollows by more, and no face is far off."""
    cloth = [
        piece for piece in clothed(recipe(name), LEVELS["middle"]) if piece.material == "cloth"
    ]
    assert all(piece.shade is not None and piece.slopes is not None for piece in cloth)
    shade = np.concatenate([piece.shade for piece in cloth if piece.shade is not None])
    assert 0.03 < shade.std() < 0.15
    assert shade.min() > 0.4 and shade.max() < 1.2
    steep = [
        np.linalg.norm(piece.slopes, axis=1).max() for piece in cloth if len(piece.faces) > 200
    ]
    assert 0.2 < max(steep) < 0.45


def test_far_away_all_is_as_simple_as_it_was():
    assert all(piece.shade is None for piece in clothed(recipe(LOOKS[0]), LEVELS["far"]))


def test_sleeves_crease_as_the_elbow_bends():
    sleeve = arm(BODY, "l", GarmentCut(ease=0.01), Cloth("cloth"), Counts(13, 8))
    (crease,) = sleeve.creases
    assert crease.bones == ("upper_arm_l", "forearm_l")
    assert 0.004 < np.linalg.norm(crease.offsets, axis=1).max() < 0.03
    straight = np.tile(np.eye(3, 4), (2, len(BONES), 1, 1))
    angle = np.radians(60.0)
    turn = [[np.cos(angle), 0, -np.sin(angle)], [0, 1, 0], [np.sin(angle), 0, np.cos(angle)]]
    bent = straight.copy()
    bent[1, BONES.index("forearm_l"), :, :3] = turn
    plain = dressed([sleeve], straight)[1].vertices
    assert np.array_equal(plain[0], plain[1])
    upper = sleeve.weights[:, BONES.index("upper_arm_l")] > 0.99
    moved = dressed([sleeve], bent)[1].vertices
    step = np.linalg.norm(moved[1] - moved[0], axis=1)[upper]
    assert 0.002 < step.max() < 0.03


@pytest.mark.parametrize(("what", "side"), [("phone", "l"), ("tote", "r")])
def test_hands_hold_what_is_carried(what, side):
    """All that is in a hand moves with it, and its top is at the fingers."""
    bone = BONES.index(f"hand_{side}")
    (name, *_) = [n for n in LOOKS if any(i["what"] == what for i in recipe(n).get("carries", ()))]
    held = [p for p in clothed(recipe(name), LEVELS["middle"]) if (p.weights[:, bone] == 1.0).all()]
    skin = np.concatenate([p.vertices for p in held if p.material == "complexion"])
    things = np.concatenate([p.vertices for p in held if p.material != "complexion"])
    apart = np.linalg.norm(skin[:, None] - things[None], axis=2)
    assert apart.min() < 0.03
