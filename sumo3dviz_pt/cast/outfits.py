"""What makes people of one look differ: hair, skin, trousers, shoes and bags, seeded by the id.

A look says what somebody wears and its colours. Each person takes some of these colours anew from
what is worn and grown here, so that two people of one look and coat are no twins. Suits stay
suits, the grey stay grey, and dark skin keeps dark hair.

Hair has natural colours, as rare as in a European street; shares and reflectances are our own.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from enum import Enum
from types import MappingProxyType
from typing import Any

import numpy as np

from sumo3dviz_pt import catalog
from sumo3dviz_pt.cast.choice import Choice, FigureChoice, Model, ModelChoice, PersonLook
from sumo3dviz_pt.library.vehicles.cycles.pedalling import pedals
from sumo3dviz_pt.model.geometry import Colour
from sumo3dviz_pt.model.random import pick, share_of

Row = tuple[Colour, float]
"""A reflectance, and how common it is."""

# fmt: off
HAIR: tuple[Row, ...] = (
    ((0.0100, 0.0090, 0.0085), 22.0),  # black
    ((0.0230, 0.0160, 0.0120), 30.0),  # very dark brown
    ((0.0430, 0.0290, 0.0205), 24.0),  # dark brown
    ((0.0780, 0.0540, 0.0380), 13.0),  # brown
    ((0.1650, 0.1250, 0.0840),  7.0),  # dark blond
    ((0.2600, 0.2060, 0.1400),  4.0),  # blond
)
GREYS: tuple[Row, ...] = (
    ((0.1500, 0.1460, 0.1400),  3.0),  # iron
    ((0.2700, 0.2640, 0.2550),  4.0),  # grey
    ((0.4300, 0.4230, 0.4100),  3.0),  # white
)
LOWER: tuple[Row, ...] = (
    ((0.0300, 0.0460, 0.0850), 17.0),  # dark denim
    ((0.0620, 0.0920, 0.1500), 15.0),  # denim
    ((0.1600, 0.2150, 0.2950),  9.0),  # worn denim
    ((0.0190, 0.0190, 0.0210), 14.0),  # black
    ((0.0520, 0.0530, 0.0570),  7.0),  # charcoal
    ((0.1500, 0.1500, 0.1540),  5.0),  # grey
    ((0.3300, 0.2650, 0.1850), 10.0),  # beige
    ((0.5400, 0.5150, 0.4600),  6.0),  # cream
    ((0.0980, 0.0960, 0.0600),  6.0),  # olive
    ((0.0190, 0.0270, 0.0540),  5.0),  # navy
    ((0.1050, 0.0690, 0.0460),  3.0),  # brown
    ((0.2100, 0.0450, 0.0420),  3.0),  # brick
)
FEET: tuple[Row, ...] = (
    ((0.0170, 0.0160, 0.0160),  8.0),  # black
    ((0.0900, 0.0520, 0.0310),  5.0),  # brown
    ((0.5600, 0.5500, 0.5300), 10.0),  # white
    ((0.2400, 0.2380, 0.2340),  4.0),  # grey
    ((0.0230, 0.0310, 0.0580),  3.0),  # navy
    ((0.3600, 0.2850, 0.2050),  4.0),  # sand
    ((0.3000, 0.0350, 0.0320),  1.0),  # red
)
BAGS: tuple[Row, ...] = (
    ((0.0170, 0.0170, 0.0185), 10.0),  # black
    ((0.0560, 0.0570, 0.0620),  5.0),  # charcoal
    ((0.0210, 0.0300, 0.0580),  4.0),  # navy
    ((0.0760, 0.0460, 0.0290),  4.0),  # brown
    ((0.0700, 0.0760, 0.0470),  3.0),  # olive
    ((0.2200, 0.0300, 0.0290),  2.0),  # red
    ((0.3300, 0.2600, 0.1750),  3.0),  # canvas
)
# fmt: on

_DARK_SKIN = 0.20
"""Reflectance of the skin below which hair is black or of the darkest brown."""


class Air(Enum):
    """What people dress for.

    Its two numbers: how much commoner light clothes are than by a mean, and how much warm ones.
    """

    MILD = (3.0, 0.08)
    MIXED = (1.2, 0.6)
    COLD = (0.02, 2.5)

    @classmethod
    def in_season(cls, season: str) -> Air:
        """Tell what people dress for: the season only, as weather and night must change no person.

        Args:
            season: A name of `Weather.season`.
        """
        return {"summer": cls.MILD, "winter": cls.COLD}.get(season, cls.MIXED)

    def factor(self, recipe: Mapping[str, Any]) -> float:
        """Return how much commoner a look is in this air than in a mean one."""
        light, warm = self.value
        cuts = {recipe["top"]["cut"], recipe["bottom"]["cut"]}
        if cuts & _LIGHT:
            return float(light)
        worn = {item["style"] for item in recipe.get("head", ())}
        warmly = cuts & _WARM or worn & {"beanie", "hood"} or "gloves" in recipe
        return float(warm) if warmly or "scarf" in recipe else 1.0


_LIGHT = frozenset({"tee", "polo", "vest", "dress", "shorts"})
_WARM = frozenset({"coat", "trench", "padded", "parka", "bomber"})
"""Cuts that leave arms or legs bare, and cuts against the cold."""


def dressed_looks(looks: Sequence[PersonLook], air: Air) -> tuple[PersonLook, ...]:
    """Return looks as common as they are in some air."""
    recipes = [catalog.find("people", look.name).meta["recipe"] for look in looks]
    factors = [air.factor(recipe) for recipe in recipes]
    return tuple(
        replace(look, share=look.share * factor)
        for look, factor in zip(looks, factors, strict=True)
    )


def dressed_riders(models: Sequence[Model], air: Air) -> tuple[Model, ...]:
    """Return vehicles, those with a rider who pedals as common as they are in some air."""

    def common(model: Model) -> float:
        """Of one."""
        meta = catalog.find("vehicles", model.name).meta
        return air.factor(meta["recipe"]["rider"]) if pedals(meta) else 1.0

    return tuple(replace(model, share=model.share * common(model)) for model in models)


def outfit_for(choice: Choice, *, seed: int, key: str) -> Mapping[str, Colour]:
    """Return the outfit of whoever shows a body; empty where nobody is seen.

    Args:
        choice: Of the body.
        seed: The job's.
        key: SUMO's id of the road user.
    """
    if isinstance(choice, FigureChoice):
        return outfit_of(catalog.find("people", choice.look).meta["recipe"], seed=seed, key=key)
    if isinstance(choice, ModelChoice):
        meta = catalog.find("vehicles", choice.model.name).meta
        if pedals(meta):
            return outfit_of(meta["recipe"]["rider"], seed=seed, key=key)
    return MappingProxyType({})


def outfit_of(recipe: Mapping[str, Any], *, seed: int, key: str) -> Mapping[str, Colour]:
    """Return what the colours of a look are multiplied with, by role.

    Args:
        recipe: Of the look, as in `people`.
        seed: The job's.
        key: SUMO's id of the road user.
    """
    face = recipe.get("face", {})
    skin, hair = face.get("skin", (0.48, 0.32, 0.24)), face.get("hair", (0.03, 0.02, 0.014))
    made = {
        "skin": _complexion(share_of(seed, key, "skin")),
        "hair": _factor(hair, _hair(hair, skin), share_of(seed, key, "hair")),
    }
    lower, suit = recipe["bottom"].get("colour"), recipe["top"].get("colour")
    if lower is not None and suit is None:
        made["lower"] = _factor(lower, LOWER, share_of(seed, key, "lower"))
    elif lower is not None:
        made["lower"] = _sober(share_of(seed, key, "lower"))
    feet = recipe["shoes"].get("colour")
    if feet is not None and suit is None:
        made["feet"] = _factor(feet, FEET, share_of(seed, key, "feet"))
    bags = [item["colour"] for item in recipe.get("carries", ()) if item.get("colour")]
    if bags:
        made["bag"] = _factor(bags[0], BAGS, share_of(seed, key, "bag"))
    return MappingProxyType(made)


def _factor(own: Sequence[float], rows: tuple[Row, ...], share: float) -> Colour:
    """Return what turns a colour into one of a table."""
    chosen = np.array(rows[pick([row[1] for row in rows], share)][0])
    red, green, blue = (chosen / np.maximum(own, 1e-3)).tolist()
    return red, green, blue


def _hair(own: Sequence[float], skin: Sequence[float]) -> tuple[Row, ...]:
    """The hair colours that suit somebody."""
    if own[2] > 0.8 * own[0] and own[0] > 0.1:
        return GREYS
    return HAIR[:2] if float(np.mean(skin)) < _DARK_SKIN else HAIR


def _complexion(share: float) -> Colour:
    """Return a factor of the skin: paler or darker, and redder the darker it is."""
    level = 0.80 + 0.26 * share
    return level, level ** (1.15), level**1.25


def _sober(share: float) -> Colour:
    """Return a factor of a suit: the same cloth, lighter or darker."""
    level = 0.7 + 0.9 * share
    return level, level, level
