"""People of one look are no twins: their hair, skin, trousers, shoes and bags differ."""

from __future__ import annotations

import numpy as np
import pytest

from sumo3dviz_pt.cast.choice import (
    FigureChoice,
    ModelChoice,
    PlainChoice,
    choose,
    looks_for,
    models_for,
)
from sumo3dviz_pt.cast.colours import CLOTHES, paint_of
from sumo3dviz_pt.cast.outfits import (
    BAGS,
    FEET,
    GREYS,
    HAIR,
    LOWER,
    Air,
    dressed_looks,
    dressed_riders,
    outfit_for,
    outfit_of,
)
from sumo3dviz_pt.catalog import find, names
from sumo3dviz_pt.model.traffic import UNKNOWN_TYPES

WALKER = UNKNOWN_TYPES["person"]


def seen(seed: int, key: str):
    """Shape, coat and all other colours of somebody on foot."""
    choice = choose(WALKER, name=key, models=(), own={}, seed=seed, looks=looks_for(()))
    assert isinstance(choice, FigureChoice)
    outfit = outfit_for(choice, seed=seed, key=key)
    worn = tuple(sorted((role, tuple(np.round(colour, 3))) for role, colour in outfit.items()))
    return choice.look, CLOTHES.draw(seed, key), worn


@pytest.mark.parametrize("seed", [0, 7, 42])
def test_a_crowd_of_sixty_has_no_twins(seed):
    crowd = [seen(seed, f"walk_{number}") for number in range(60)]
    assert len(set(crowd)) == 60
    # Nor do skins alone tell them apart: hair, coat and trousers do.
    plain = [(look, coat, [c for r, c in worn if r != "skin"]) for look, coat, worn in crowd]
    assert len({str(each) for each in plain}) == 60
    assert len({look for look, _, _ in crowd}) > 24


def test_hair_is_never_orange():
    for colour, _ in (*HAIR, *GREYS):
        red, green, blue = colour
        assert red >= green >= blue and (red - blue) / red < 0.56
    shares = {sum(share for _, share in rows) for rows in (HAIR, GREYS, LOWER, FEET, BAGS)}
    assert min(shares) > 0


@pytest.mark.parametrize("look", names("people"))
def test_who_is_seen_keeps_natural_colours(look):
    recipe = find("people", look).meta["recipe"]
    hair, skin = np.array(recipe["face"]["hair"]), np.array(recipe["face"]["skin"])
    for number in range(20):
        outfit = outfit_of(recipe, seed=3, key=f"p{number}")
        red, green, blue = hair * outfit["hair"]
        assert red >= 0.999 * green >= 0.998 * blue
        assert (red - blue) / red < 0.56
        if skin.mean() < 0.2 and hair.max() < 0.1:
            assert red < 0.03
        own = skin * outfit["skin"]
        assert own.max() < 0.65 and own[0] > own[1] > own[2]
        assert all(0.0 < channel < 100.0 for colour in outfit.values() for channel in colour)


def test_an_outfit_hangs_on_seed_and_id_alone():
    choice = FigureChoice(names("people")[0], 1.7)
    one, same = (outfit_for(choice, seed=1, key="a") for _ in range(2))
    assert one == same != outfit_for(choice, seed=1, key="b")
    assert one != outfit_for(choice, seed=2, key="a")


def test_riders_have_one_and_vehicles_none():
    models = {model.name: model for model in models_for({})}
    rider = ModelChoice(models["bicycle"], "bicycle", models["bicycle"].size)
    assert {"hair", "skin", "lower"} <= set(outfit_for(rider, seed=1, key="a"))
    car = ModelChoice(models["sedan"], "passenger", models["sedan"].size)
    assert not outfit_for(car, seed=1, key="a")
    assert not outfit_for(PlainChoice("ship", (20.0, 5.0, 5.0)), seed=1, key="a")


def kind_of(colour) -> str:
    """Tell what somebody would call a colour of cloth."""
    red, green, blue = colour
    light = 0.2126 * red + 0.7152 * green + 0.0722 * blue
    vivid = (max(colour) - min(colour)) / max(colour)
    if blue > max(1.25 * red, green) and light > 0.04:
        return "blue"
    if light < 0.075 and (vivid < 0.45 or max(colour) < 0.07):
        return "dark"
    return "pale" if light > 0.28 and vivid < 0.48 else "bright"


@pytest.mark.parametrize("seed", [0, 7])
@pytest.mark.parametrize("who", ["walk", "bicycle"])
def test_tops_have_the_colours_of_a_street(seed, who):
    """Of 400: a third dark, a quarter pale, a fifth blue, a fifth bright; riders are no cars."""
    kind = WALKER if who == "walk" else UNKNOWN_TYPES["vehicle"]
    vclass = "pedestrian" if who == "walk" else "bicycle"
    tops = [
        kind_of(paint_of(vclass, kind, key=f"{who}_{k}", colours="european", seed=seed))
        for k in range(400)
    ]
    wanted = {"dark": 0.35, "pale": 0.25, "blue": 0.20, "bright": 0.20}
    for name, share in wanted.items():
        spread = 3.3 * np.sqrt(share * (1.0 - share) / len(tops))
        assert tops.count(name) / len(tops) == pytest.approx(share, abs=spread), name


def test_trousers_and_shoes_are_not_all_dark():
    for rows in (LOWER, FEET):
        total = sum(row[1] for row in rows)
        pale = sum(row[1] for row in rows if max(row[0]) > 0.2)
        assert pale / total > 0.25


def bare_armed(looks) -> float:
    """How many wear what leaves arms or legs bare, as a share."""
    cuts = {name: find("people", name).meta["recipe"] for name in (look.name for look in looks)}
    light = {"tee", "polo", "vest", "dress", "shorts"}
    worn = [{cuts[look.name]["top"]["cut"], cuts[look.name]["bottom"]["cut"]} for look in looks]
    bare = [look.share * bool(each & light) for look, each in zip(looks, worn, strict=True)]
    return sum(bare) / sum(look.share for look in looks)


def test_people_dress_for_the_air():
    shares = {air: bare_armed(dressed_looks(looks_for(()), air)) for air in Air}
    assert shares[Air.MILD] > 0.5 > shares[Air.MIXED] > 0.2
    assert shares[Air.COLD] < 0.02
    riders = {model.name: model.share for model in dressed_riders(models_for({}), Air.COLD)}
    usual = {model.name: model.share for model in models_for({})}
    assert riders["bicycle_summer"] < 0.1 * usual["bicycle_summer"]
    assert riders["sedan"] == usual["sedan"]


def test_the_season_says_what_people_dress_for():
    assert [Air.in_season(each) for each in ("spring", "summer", "autumn", "winter")] == [
        Air.MIXED,
        Air.MILD,
        Air.MIXED,
        Air.COLD,
    ]
