"""Cloth, hair and what hands hold: what makes people no mannequins."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from sumo3dviz_pt.catalog import find, names
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.library.materials import MATERIALS
from sumo3dviz_pt.library.people.body import Fit, Garment, GarmentCut, arm
from sumo3dviz_pt.library.people.cloth import PRINTS
from sumo3dviz_pt.library.people.drapery import Drapery, Fold
from sumo3dviz_pt.library.people.hair import STYLES
from sumo3dviz_pt.library.people.people import LEVELS, clothed, figure, standing
from sumo3dviz_pt.library.people.posture import BONES, BodyMeasures, matrices
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
    assert 0.2 < max(steep) < 0.80


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


def test_a_fold_stands_out_where_it_lies_and_nowhere_else():
    cloth = Drapery.of([Fold(0.25, 1.0, 0.2, 0.0, 0.02, 0.01)], 1.0, seed=1)
    turn, place, *_ = cloth.folds[0]
    there = cloth.height(np.array([turn]), np.array([place]))
    assert 0.004 < there[0] < 0.02
    away = cloth.height(np.array([turn + 0.5, turn]), np.array([place, place + 0.3]))
    assert np.abs(away).max() < 1e-6
    # Around the tube there is no seam.
    once, again = (cloth.height(np.array([turn + k]), np.array([place])) for k in (0.0, 1.0))
    np.testing.assert_allclose(once, again)


def test_folds_rise_more_than_they_press_in_and_leave_the_hem_alone():
    garment = Garment.of(BODY, Fit())
    shares = np.linspace(0.47, 0.848, 40)
    turn = 2.0 * np.pi * np.arange(48) / 48
    pushed, plain = (garment.rings(shares, turn, fine=fine) for fine in (True, False))
    out = plain - plain.mean(axis=1, keepdims=True)
    out /= np.linalg.norm(out, axis=2, keepdims=True)
    high = ((pushed - plain) * out).sum(axis=2)
    assert 0.008 < high.max() < 0.05 and high.min() > -0.025
    assert np.abs(high[-1]).max() < 1e-9


def test_all_prints_are_worn_and_others_are_errors():
    worn = {recipe(name)["top"].get("print") for name in LOOKS} - {None}
    assert worn == set(PRINTS)
    (name, *_) = [n for n in LOOKS if recipe(n)["top"].get("print") == "stripes"]
    tints = [p.tint for p in clothed(recipe(name), LEVELS["middle"]) if p.tint is not None]
    assert any(np.ptp(tint, axis=0).max() > 0.5 for tint in tints if len(tint) > 500)
    wrong = {**recipe(name), "top": {"cut": "tee", "print": "zebra"}}
    with pytest.raises(ConfigError, match="zebra"):
        list(clothed(wrong, LEVELS["middle"]))


def test_nobody_stands_as_a_doll_and_not_two_alike():
    """One foot is forward, one arm bent more, the hips are off the middle, and looks differ."""
    poses = [standing(BODY, habit) for habit in range(40)]
    for pose in poses:
        assert abs(pose.hips[1]) > 0.01 and abs(pose.arms["l"].elbow - pose.arms["r"].elbow) > 0.01
        assert abs(pose.feet["l"].ankle[0] - pose.feet["r"].ankle[0]) > 0.02
    assert len({matrices(BODY, pose).tobytes() for pose in poses}) == 40
    assert {np.sign(pose.hips[1]) for pose in poses} == {-1.0, 1.0}


@pytest.mark.parametrize("name", LOOKS)
def test_locks_break_the_outline_of_hair_and_are_closed(name):
    """Each is a body of its own volume, and some leave the shell by millimetres."""
    hair = [p for p in clothed(recipe(name), LEVELS["middle"]) if p.material == "hair"]
    locks = [p for p in hair if len(p.vertices) * 4 == len(p.faces) * 7]
    grown = STYLES.get(recipe(name)["head"][0]["style"]) if recipe(name)["head"] else None
    assert len(locks) == (grown is not None and grown.material == "hair")
    for piece in locks:
        points = piece.vertices[piece.faces].reshape(-1, 4, 3, 3)
        a, b, c = (points[:, :, k] - points.mean(axis=(1, 2))[:, None] for k in range(3))
        assert ((a * np.cross(b, c)).sum(axis=(1, 2)) > 0).all()
