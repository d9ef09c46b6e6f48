"""What makes people of one look differ: hair, skin, trousers, shoes and bags, seeded by the id.

A look says what somebody wears and its colours. Each person takes some of these colours anew from
what is worn and grown here, so that two people of one look and coat are no twins. Suits stay
suits, the grey stay grey, and dark skin keeps dark hair.

Hair has natural colours, as rare as in a European street; shares and reflectances are our own.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any

import numpy as np

from sumo3dviz_pt import catalog
from sumo3dviz_pt.cast.choice import Choice, FigureChoice, ModelChoice
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
    ((0.0300, 0.0460, 0.0850), 22.0),  # dark denim
    ((0.0620, 0.0880, 0.1350), 14.0),  # denim
    ((0.1500, 0.1900, 0.2500),  6.0),  # worn denim
    ((0.0190, 0.0190, 0.0210), 20.0),  # black
    ((0.0520, 0.0530, 0.0570), 12.0),  # charcoal
    ((0.1200, 0.1200, 0.1240),  6.0),  # grey
    ((0.2700, 0.2180, 0.1520),  7.0),  # beige
    ((0.0780, 0.0760, 0.0480),  5.0),  # olive
    ((0.0190, 0.0270, 0.0540),  6.0),  # navy
    ((0.0850, 0.0580, 0.0400),  3.0),  # brown
)
FEET: tuple[Row, ...] = (
    ((0.0170, 0.0160, 0.0160), 10.0),  # black
    ((0.0680, 0.0400, 0.0250),  5.0),  # brown
    ((0.4300, 0.4220, 0.4050),  6.0),  # white
    ((0.1500, 0.1500, 0.1500),  4.0),  # grey
    ((0.0230, 0.0310, 0.0580),  3.0),  # navy
)
BAGS: tuple[Row, ...] = (
    ((0.0170, 0.0170, 0.0185), 10.0),  # black
    ((0.0560, 0.0570, 0.0620),  5.0),  # charcoal
    ((0.0210, 0.0300, 0.0580),  4.0),  # navy
    ((0.0760, 0.0460, 0.0290),  4.0),  # brown
    ((0.0700, 0.0760, 0.0470),  3.0),  # olive
    ((0.1500, 0.0270, 0.0270),  1.0),  # red
    ((0.2500, 0.1900, 0.1250),  2.0),  # canvas
)
# fmt: on

_DARK_SKIN = 0.20
"""Reflectance of the skin below which hair is black or of the darkest brown."""


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
