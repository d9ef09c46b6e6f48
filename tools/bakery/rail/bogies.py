"""Running gear of trains as pieces: bogies with wheels on the rails, pantographs.

Coordinates are those of `heavy/recipe.py`: d behind the front, y, z over the rails.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from bakery.heavy.recipe import Fitting, Points
from sumo3dviz_pt.library.asset_files import RecipeValue

_WHEEL = (0.685, 0.82)
"""|y| of a wheel's inner and outer face [m], on the standard gauge of 1.435 m (UIC 510)."""


@dataclass(frozen=True, slots=True)
class Bogie(RecipeValue):
    """Two wheelsets in a frame.

    Attributes:
        at: d of its middle [m].
        base: Between its axles [m].
        radius: Of the wheels [m].
        frame: |y| of the side beams' middle [m].
        floor: Height of the vehicle's floor, which it carries [m].
        hidden: Whether skirts hide all but its lower edge, as on trams.
        freight: Whether it has neither air springs, dampers nor drives, as goods wagons' have.
    """

    at: float
    base: float = 2.5
    radius: float = 0.46
    frame: float = 1.02
    floor: float = 1.0
    hidden: bool = False
    freight: bool = False


@dataclass(frozen=True, slots=True)
class Pantograph(RecipeValue):
    """A raised single-arm pantograph whose knee points backwards.

    Attributes:
        at: d of its base [m].
        foot: Height of the roof [m].
        top: Height of the contact strips [m].
        ahead: Whether its knee points forwards instead.
    """

    at: float
    foot: float
    top: float
    ahead: bool = False


def bogie_pieces(bogie: Bogie) -> Iterator[Fitting]:
    """Build wheels, axles, frame and springs of a bogie."""
    for sign in (-0.5, 0.5):
        yield from _wheelset(bogie, bogie.at + sign * bogie.base)
    yield _side_beam(bogie)
    if bogie.hidden:
        return
    if bogie.freight:
        yield from _plain_gear(bogie)
        return
    yield from _middle(bogie)
    for sign in (-0.5, 0.5):
        yield from _axle_box(bogie, bogie.at + sign * bogie.base)


def _wheelset(bogie: Bogie, at: float) -> Iterator[Fitting]:
    """Two wheels with a polished tread and a dished web, and what joins them."""
    inner, outer = _WHEEL
    r = bogie.radius
    low = (at, 0.0, r)
    web = 0.5 * (inner + outer)
    face = ((0.84 * r, outer), (0.80 * r, web), (0.0, outer))
    rim = () if bogie.freight else ((r, outer),)
    yield Fitting(
        "turned", "wheel_steel", low, view="y", mirror=True, far=True,
        outline=((0.0, inner), (r, inner), (r, outer)),
    )  # fmt: skip
    yield Fitting("turned", "bogie", low, view="y", outline=(*rim, *face), mirror=True)
    axle = ((at, -inner, r), (at, inner, r))
    yield Fitting("rod", "bogie", outline=axle, round=0.08)


def _side_beam(bogie: Bogie) -> Fitting:
    """Both side beams: high over the axles, deep between them."""
    half, r, end = 0.5 * bogie.base, bogie.radius, 0.42
    over = r + (0.10 if bogie.hidden else 0.17)
    low = 0.62 * r
    top = over + 0.16
    upper = [(half + end, over + 0.1), (half - 0.25, top), (0.45, 0.86 * top), (0.0, 0.84 * top)]
    lower = [(0.0, low), (0.5, low), (half - 0.35, over - 0.08), (half + end, over - 0.02)]
    right = [*lower, *upper]
    left = [(-d, z) for d, z in reversed(right) if d > 0.0]
    outline = tuple((bogie.at + d, z) for d, z in (*right, *left))
    span = (bogie.frame - 0.07, bogie.frame + 0.07)
    return Fitting("plate", "bogie", view="side", outline=outline, span=span, mirror=True, far=True)


def _middle(bogie: Bogie) -> Iterator[Fitting]:
    """Transom, air springs, dampers and the drive between the wheelsets."""
    at, top, y = bogie.at, bogie.floor, bogie.frame
    low = 0.62 * bogie.radius + 0.5 * (top - bogie.radius) * 0.5
    yield Fitting("block", "bogie", (at - 0.28, -y, low), (at + 0.28, y, low + 0.2), round=0.03)
    yield Fitting(
        "block", "bogie", (at - 0.95, -0.62, 0.3), (at + 0.95, 0.62, 0.66), round=0.06, far=True
    )
    foot = 0.84 * (bogie.radius + 0.33)
    bulge = 0.5 * (foot + top)
    yield Fitting(
        "turned", "rubber", (at, y, 0.0), view="z", mirror=True,
        outline=((0.2, foot), (0.29, bulge), (0.22, top)),
    )  # fmt: skip
    damper = ((at - 0.62, y + 0.13, 0.52), (at + 0.30, y + 0.13, 0.56))
    yield Fitting("rod", "bogie", outline=damper, round=0.045, mirror=True)
    inner = ((at - 0.2, y + 0.13, 0.54), (at + 0.62, y + 0.13, 0.575))
    yield Fitting("rod", "galvanised", outline=inner, round=0.024, mirror=True)


def _plain_gear(bogie: Bogie) -> Iterator[Fitting]:
    """Transom with its side bearers, and bearings with their springs, of a goods wagon."""
    at, y, r = bogie.at, bogie.frame, bogie.radius
    yield Fitting(
        "block", "bogie", (at - 0.3, -y, r - 0.05), (at + 0.3, y, r + 0.3), round=0.0, far=True
    )
    yield Fitting(
        "block", "bogie", (at - 0.16, y - 0.32, r + 0.3), (at + 0.16, y - 0.04, bogie.floor),
        round=0.0, mirror=True,
    )  # fmt: skip
    front, step = at - 0.5 * bogie.base, (bogie.base, 0.0, 0.0)
    cover = ((0.14, 0.1), (0.0, 0.13))
    yield Fitting(
        "turned", "bogie", (front, y, r), view="y", outline=cover, mirror=True, repeat=2, step=step
    )
    for side in (-0.25, 0.25):
        low, high = (
            (front + side - 0.07, y - 0.07, r - 0.1),
            (front + side + 0.07, y + 0.07, r + 0.2),
        )
        yield Fitting("block", "bogie", low, high, round=0.0, mirror=True, repeat=2, step=step)


def _axle_box(bogie: Bogie, at: float) -> Iterator[Fitting]:
    """A bearing with its cover, its springs, its brake and its sand pipe."""
    y, r = bogie.frame, bogie.radius
    cover = ((0.15, -0.1), (0.15, 0.11), (0.0, 0.13))
    yield Fitting("turned", "bogie", (at, y, r), view="y", outline=cover, mirror=True)
    cap = ((0.058, 0.11), (0.058, 0.145), (0.0, 0.145))
    yield Fitting("turned", "galvanised", (at, y, r), view="y", outline=cap, mirror=True)
    foot, top = r - 0.04, r + 0.24
    for side in (-0.27, 0.27):
        yield Fitting(
            "turned", "bogie", (at + side, y, 0.0), view="z", mirror=True,
            outline=((0.09, foot), (0.09, top)),
        )  # fmt: skip
    yield Fitting(
        "block", "bogie", (at - 0.36, y - 0.06, r - 0.12), (at + 0.36, y + 0.06, r - 0.03),
        round=0.0, mirror=True,
    )  # fmt: skip
    outward = 1.0 if at > bogie.at else -1.0
    pipe = tuple((at + outward * d, 0.76, z) for d, z in ((0.62, 0.75), (0.6, 0.3), (0.52, 0.09)))
    yield Fitting("rod", "rubber", outline=pipe, round=0.022, mirror=True)


def pantograph_pieces(item: Pantograph) -> Iterator[Fitting]:
    """Build insulators, frame, arms and the strips that touch the wire."""
    sign = -1.0 if item.ahead else 1.0
    foot, top = item.foot + 0.26, item.top
    knee = (item.at + sign * 1.25, 0.5 * (foot + top) - 0.04)
    head = (item.at + sign * 0.05, top - 0.14)
    shape = ((0.05, 0.0), (0.059, 0.05), (0.045, 0.08), (0.059, 0.12), (0.05, 0.18))
    for d in (-0.55, 0.55):
        yield Fitting(
            "turned", "coat_red", (item.at + d, 0.42, item.foot), view="z", mirror=True,
            outline=((0.0, 0.0), *shape, (0.0, 0.18)), outside=True,
        )  # fmt: skip
    frame = ((item.at - 0.62, 0.42, foot - 0.05), (item.at + 0.62, 0.42, foot - 0.05))
    yield _arm(frame, 0.03, mirror=True)
    for d in (-0.55, 0.0, 0.55):
        yield _arm(((item.at + d, -0.45, foot - 0.05), (item.at + d, 0.45, foot - 0.05)), 0.03)
    yield _arm(((item.at, 0.0, foot), (knee[0], 0.0, knee[1])), 0.05)
    yield _arm(
        ((item.at - sign * 0.3, 0.0, foot), (knee[0] + sign * 0.12, 0.0, knee[1] - 0.1)), 0.022
    )
    yield _arm(((knee[0], 0.06, knee[1]), (head[0], 0.32, head[1])), 0.024, mirror=True)
    yield _arm(((head[0], -0.5, head[1]), (head[0], 0.5, head[1])), 0.02)
    for d in (head[0] - 0.22, head[0] + 0.22):
        yield _arm(((d, -0.5, top), (d, 0.5, top)), 0.022)
        yield _arm(((d, 0.49, top), (d, 0.68, top - 0.05), (d, 0.8, top - 0.2)), 0.02, mirror=True)
    link = ((head[0] - 0.22, 0.45, top - 0.03), (head[0] + 0.22, 0.45, top - 0.03))
    yield _arm(link, 0.015, mirror=True)


def _arm(path: Points, radius: float, *, mirror: bool = False) -> Fitting:
    """A tube of a pantograph."""
    return Fitting(
        "rod", "galvanised", outline=path, round=radius, outside=True, mirror=mirror
    )  # fmt: skip
