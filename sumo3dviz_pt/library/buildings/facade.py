"""Walls with windows and balconies, in wall coordinates: (along, inward, up) [m].

Every pane is tilted by millimetres: reflections that break up pane by pane are what makes a facade
look real. Panes are opaque; what is seen behind them (rooms, blinds, curtains) is their colour,
which the renderer finds by the ray, under the same reflection.

Every window belongs to one of `CLASSES` classes, which is the number in the roles `room` (with a
blind or curtains) and `bare`; a palette gives the rooms of each class the colour of their walls,
and lights some of them at night.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np

from sumo3dviz_pt.library.asset_files import RecipeValue
from sumo3dviz_pt.library.buildings.shell import BELOW, Shell, box, joined, rectangles
from sumo3dviz_pt.model.geometry import Floats, Ints

NEAR, MIDDLE, FAR = 0, 1, 2
"""Levels of detail."""

CLASSES = 12
"""How many sorts of rooms are told apart in a building."""

SLACK = 0.01
"""How far the corners of panes tilt out of their plane, at most [m]."""

PROUD = 0.02
"""How far panes lie before walls that have no holes for them [m]."""

_TILT = 0.004  # standard deviation of a pane's corners from its plane [m]
_FRAME = 0.06  # width of a window frame [m]
_TIPPED = 0.11  # how far the top of a tipped sash leans inwards [m]
_SHUT, _HALF_SHUT = 0.14, 0.07  # shares of windows with both shutters closed, and with one
_STAND_OFF = 0.15  # share of open shutters that stand off the wall
_NARROW = 1.0  # windows narrower than this are not seen from afar [m]


@dataclass(frozen=True, slots=True)
class Facade(RecipeValue):
    """How the windows of a wall look.

    Attributes:
        bay: Distance between window axes [m]; the wall's length rounds it.
        width: Of a window [m]; 0 means as wide as the bay.
        height: Of a window [m].
        sill: Height above the floor [m].
        inset: Of the pane behind the wall [m].
        drapes: Share of windows with a blind or curtains, [0, 1].
        mullions: Upright bars within a window.
        transom: Height of a level bar, as a share of the window's; 0 for none.
        boards: Whether sills reach out.
        surround: Width of a pale band around each window [m]; 0 for none.
        hood: Whether a small cornice crowns each window.
        lintel: Whether a pale beam lies over each window.
        shutters: Whether shutters hang beside each window; most are open.
        ajar: Share of windows whose sash is tipped inwards, [0, 1].
    """

    bay: float = 3.1
    width: float = 1.3
    height: float = 1.5
    sill: float = 0.9
    inset: float = 0.16
    drapes: float = 0.72
    mullions: int = 1
    transom: float = 0.0
    boards: bool = True
    surround: float = 0.0
    hood: bool = False
    lintel: bool = False
    shutters: bool = False
    ajar: float = 0.07

    def openings(self, length: float, floor: float) -> Floats:
        """Place the windows of a storey, (k, 4) as u0, u1, z0, z1 [m]; none without room."""
        count = int(length / self.bay + 0.35)
        if self.width <= 0.0:
            return self._ribbon(length, floor)
        if count < 1 or length < max(self.width + 0.6, 1.5):
            return np.zeros((0, 4))
        axes = (np.arange(count) + 0.5) * length / count
        low = np.full(count, floor + self.sill)
        half = min(self.width, length / count - 0.3) / 2
        return np.stack([axes - half, axes + half, low, low + self.height], axis=1)

    def _ribbon(self, length: float, floor: float) -> Floats:
        """Place windows side by side along the whole wall, (k, 4) [m]."""
        if length < 1.5:
            return np.zeros((0, 4))
        end = min(0.3, 0.1 * length)
        edges = np.linspace(end, length - end, max(round((length - 2 * end) / self.bay), 1) + 1)
        low = np.full(len(edges) - 1, floor + self.sill)
        return np.stack([edges[:-1], edges[1:], low, low + self.height], axis=1)


def storey(
    length: float, low: float, high: float, openings: Floats, role: str = "wall"
) -> dict[str, Floats]:
    """Build the wall around a row of openings; below each, where sills drip, it has its own role.

    Args:
        length: Of the wall [m].
        low: Where the storey begins [m].
        high: Where it ends [m].
        openings: Within the storey, sorted along the wall, (k, 4) as u0, u1, z0, z1 [m].
        role: Of the wall; that below openings ends with `BELOW`.
    """
    u0, u1, z0, z1 = openings.T
    starts, ends = np.append(0.0, u1), np.append(u0, length)
    piers = rectangles(starts, ends, low, high)[ends > starts + 1e-6]
    below = rectangles(u0, u1, low, z0)[z0 > low + 1e-6]
    above = rectangles(u0, u1, z1, high)[z1 < high - 1e-6]
    return {role: np.concatenate([piers, above]), role + BELOW: below}


def windows(
    openings: Floats, facade: Facade, *, level: int, rng: np.random.Generator
) -> dict[str, Floats]:
    """Fill the openings of a wall; rooms are the same at all levels of detail.

    Args:
        openings: (k, 4) as u0, u1, z0, z1 [m].
        facade: How they look.
        level: `NEAR` for reveals, frames and sills, else panes on the wall.
        rng: Tilts the panes, chooses rooms and lowers the blinds.
    """
    if not len(openings):
        return {}
    if level == FAR and facade.width <= 0.0:
        # A ribbon of panes has one colour from afar.
        openings = np.array([[openings[0, 0], openings[-1, 1], *openings[0, 2:]]])
    inward = facade.inset if level == NEAR else -PROUD
    panes = rectangles(*openings.T, inward=inward)
    # What only nearby windows have takes chance of its own, so that the rest stays the same.
    own = rng.spawn(1)[0]
    # A pane stays plane: two of its edges tilt, the fourth corner follows.
    tilt = rng.normal(0.0, _TILT, (len(panes), 2)).clip(-SLACK, SLACK)
    panes[:, 1:3, 1] += tilt[:, :1]
    panes[:, 2:, 1] += tilt[:, 1:]
    ajar = np.zeros(len(panes), dtype=np.bool_)
    if level == NEAR and facade.width > 0.0:
        ajar = own.random(len(panes)) < facade.ajar
        panes[ajar, 2:, 1] += _TIPPED
    filled = glazed(panes, facade.drapes, rng=rng)
    if level == FAR:
        return filled
    filled["frame"] = _frames(openings, inward - 0.02, facade, edges=level == NEAR)
    if level == NEAR:
        deep = facade.inset + np.where(ajar, _TIPPED + 0.02, 0.0)
        filled["reveal"] = _reveals(openings, deep)
        dark = rectangles(*openings[ajar].T, inward=facade.inset + _TIPPED + 0.02)
        filled = joined([filled, {"gap": dark}, _dressing(openings, facade)])
        if facade.shutters:
            filled = joined([filled, _shutters(openings, own)])
    return filled


def glazed(panes: Floats, drapes: float, *, rng: np.random.Generator) -> dict[str, Floats]:
    """Sort panes: `room` and `bare` with the number of a class.

    Args:
        panes: (k, 4, 3) [m], lower left corner first.
        drapes: Share of panes with a blind or curtains, [0, 1].
        rng: Chooses.
    """
    classes = rng.integers(0, CLASSES, len(panes))
    draped = rng.random(len(panes)) < drapes
    return by_class(
        {"room": (panes[draped], classes[draped]), "bare": (panes[~draped], classes[~draped])}
    )


def by_class(quads: Mapping[str, tuple[Floats, Ints]]) -> dict[str, Floats]:
    """Number roles by the classes, (n,), of their quads, (n, 4, 3)."""
    parts: dict[str, Floats] = {}
    for role, (some, classes) in quads.items():
        for number in np.unique(classes).tolist():
            parts[f"{role}{number}"] = some[classes == number]
    return parts


def wall(
    length: float,
    floors: Floats,
    facade: Facade,
    *,
    level: int,
    rng: np.random.Generator,
    french: slice | None = None,
) -> dict[str, Floats]:
    """Build a wall of storeys with windows.

    Args:
        length: Of the wall [m].
        floors: Where storeys begin, and where the last one ends, (n + 1,) [m].
        facade: How its windows look.
        level: Level of detail; the wall has holes for its windows only nearby.
        rng: Tilts the panes and lowers the blinds.
        french: Which windows of a storey above the lowest one reach the floor.
    """
    parts: list[Shell] = []
    if level != NEAR:
        parts.append({"wall": rectangles(0.0, length, floors[0], floors[-1])})
    for low, high in pairwise(floors.tolist()):
        openings = facade.openings(length, low)
        openings = openings[openings[:, 3] < high - 0.15]
        if level == FAR and 0.0 < facade.width < _NARROW:
            continue
        if french is not None and low > floors[0]:
            openings[french, 2] = low + 0.08
        if level == NEAR:
            parts.append(storey(length, low, high, openings))
        parts.append(windows(openings, facade, level=level, rng=rng))
    return joined(parts)


def _reveals(openings: Floats, inset: Floats) -> Floats:
    """Build the four faces of the wall's thickness in each opening, (4 k, 4, 3).

    Args:
        openings: (k, 4) as u0, u1, z0, z1 [m].
        inset: Of the panes behind the wall, (k,) [m].
    """
    # They reach behind the tilted panes, so that no slit is left.
    front, back = rectangles(*openings.T), rectangles(*openings.T)
    back[..., 1] = inset[:, None] + 2 * SLACK
    rolled = [
        np.stack([front[:, i], front[:, j], back[:, j], back[:, i]], axis=1)
        for i, j in ((0, 1), (1, 2), (2, 3), (3, 0))
    ]
    return np.concatenate(rolled)


def _frames(openings: Floats, inward: float, facade: Facade, *, edges: bool) -> Floats:
    """Build flat bars around each opening, where wanted, and those that divide it."""
    u0, u1, z0, z1 = openings.T
    bar = _FRAME
    bars = [rectangles(u0, u0, z0, z0)[:0]]
    if facade.width <= 0.0 and not edges:
        bars.append(rectangles(u0 - bar / 2, u0 + bar / 2, z0, z1, inward=inward))
    if edges:
        bars += [
            rectangles(u0, u1, z0, z0 + bar, inward=inward),
            rectangles(u0, u1, z1 - bar, z1, inward=inward),
            rectangles(u0, u0 + bar, z0 + bar, z1 - bar, inward=inward),
            rectangles(u1 - bar, u1, z0 + bar, z1 - bar, inward=inward),
        ]
    for k in range(facade.mullions):
        middle = u0 + (u1 - u0) * (k + 1) / (facade.mullions + 1)
        bars.append(rectangles(middle - bar / 2, middle + bar / 2, z0, z1, inward=inward - 0.004))
    if facade.transom and edges:
        z = z0 + facade.transom * (z1 - z0)
        bars.append(rectangles(u0, u1, z - bar / 2, z + bar / 2, inward=inward - 0.002))
    return np.concatenate(bars)


def _dressing(openings: Floats, facade: Facade) -> dict[str, Floats]:
    """Build what reaches out around windows: sills, surrounds, hoods and lintels."""
    u0, u1, z0, z1 = openings.T
    shells: list[Shell] = []
    if facade.boards:
        shells.append({"trim": _ledges(u0 - 0.08, u1 + 0.08, (z0 - 0.06, z0), 0.08)})
    if facade.surround:
        wide, out = facade.surround, -0.012
        bands = [
            rectangles(u0 - wide, u0, z0, z1 + wide, inward=out),
            rectangles(u1, u1 + wide, z0, z1 + wide, inward=out),
            rectangles(u0, u1, z1, z1 + wide, inward=out),
        ]
        shells.append({"trim": np.concatenate(bands)})
    if facade.hood:
        z = z1 + facade.surround + 0.1
        shells.append({"trim": _ledges(u0 - 0.2, u1 + 0.2, (z, z + 0.13), 0.16)})
    if facade.lintel:
        shells.append({"trim": rectangles(u0 - 0.12, u1 + 0.12, z1, z1 + 0.2, inward=-0.015)})
    return joined(shells)


def _shutters(openings: Floats, rng: np.random.Generator) -> dict[str, Floats]:
    """Build two leaves beside each window: most lie open, some stand off the wall, some are shut.

    Args:
        openings: (k, 4) as u0, u1, z0, z1 [m].
        rng: Turns the leaves.
    """
    count = len(openings)
    u0, u1, z0, z1 = openings.T
    wide = 0.5 * (u1 - u0) - 0.005
    # Angles out of the wall's plane: 0 lies open, a half-turn is shut.
    turn = rng.uniform(0.02, 0.12, (count, 2))
    off = rng.random((count, 2)) < _STAND_OFF
    turn = np.where(off, rng.uniform(0.25, 1.1, (count, 2)), turn)
    shut = rng.random(count)
    turn[shut < _SHUT] = np.pi
    one = (shut >= _SHUT) & (shut < _SHUT + _HALF_SHUT)
    turn[one, rng.integers(0, 2, count)[one]] = np.pi
    hinges = ((u0 - 0.02, -1.0), (u1 + 0.02, 1.0))
    leaves = [
        _leaves(np.stack([hinge, wide, z0, z1], axis=1), turn[:, side], outward)
        for side, (hinge, outward) in enumerate(hinges)
    ]
    return {"shutter": np.concatenate(leaves)}


def _leaves(boards: Floats, turn: Floats, outward: float) -> Floats:
    """Build shutters on one side of their windows: boards with three rails, (n, 4, 3) [m].

    Args:
        boards: Hinge along the wall, width, foot and head, (k, 4) [m].
        turn: Out of the wall's plane; a half-turn is shut, (k,) [rad].
        outward: Direction away from the window along the wall, -1 or 1.
    """
    hinge, wide, low, high = boards.T
    # Leaves that are shut hang within the opening.
    shut = turn > 3.0
    hinge = np.where(shut, hinge - 0.025 * outward, hinge)
    behind = np.where(shut, 0.05, -0.02)
    low, high = np.where(shut, low, low - 0.03), np.where(shut, high, high + 0.03)
    along, deep = outward * np.cos(turn), -np.sin(turn)
    bars = [low + share * (high - low - 0.09) for share in (0.0, 0.5, 1.0)]
    flat = [rectangles(0.0, wide, low, high)]
    flat += [rectangles(0.0, wide, bar, bar + 0.09, inward=-0.012) for bar in bars]
    leaves = []
    for quads in flat:
        across, out = quads[..., 0], quads[..., 1]
        u = hinge[:, None] + along[:, None] * across
        inward = behind[:, None] + deep[:, None] * across + out
        turned = np.stack([u, inward, quads[..., 2]], axis=-1)
        # Corners run counter-clockwise as the street sees them.
        turned[along < 0.0] = turned[along < 0.0][:, [1, 0, 3, 2]]
        leaves.append(turned)
    return np.concatenate([*leaves, leaves[0][:, ::-1] + np.array([0.0, 0.015, 0.0])])


def _ledges(u0: Floats, u1: Floats, heights: tuple[Floats, Floats], out: float) -> Floats:
    """Build boards that reach out of a wall: front, top and underside, (3 k, 4, 3)."""
    z0, z1 = heights
    front = rectangles(u0, u1, z0, z1, inward=-out)
    top, under = front[:, [3, 2, 2, 3]].copy(), front[:, [1, 0, 0, 1]].copy()
    top[:, 2:, 1], under[:, 2:, 1] = 0.0, 0.0
    return np.concatenate([front, top, under])


Balconies = Literal["none", "iron", "solid", "glass", "gallery"]
"""Iron bars, a solid parapet, a glass one, or a gallery along the whole storey."""

_DEEP, _RAIL = 1.1, 1.0  # of a balcony's slab, and of its railing above the floor [m]
_PITCH = 0.14  # of bars [m]


def balconies(
    length: float, floors: Floats, facade: Facade, *, sort: Balconies, level: int, seed: int
) -> Shell:
    """Build balconies in front of some bays, from the second upper storey on.

    Args:
        length: Of the wall [m].
        floors: Of the upper storeys, and where the last one ends, (n + 1,) [m].
        facade: Says where the bays are.
        sort: Which kind.
        level: Of detail.
        seed: Chooses the bays.
    """
    openings = facade.openings(length, 0.0)
    if sort == "none" or not len(openings):
        return {}
    if sort == "gallery":
        return joined(
            [_balcony(0.15, length - 0.15, float(z), "solid", level) for z in floors[:-1]]
        )
    bays = french_doors(sort, seed) or slice(None)
    parts: list[Shell] = []
    rng = np.random.default_rng([seed, 19])
    for u0, u1, *_ in openings[bays].tolist():
        wide = min(u0, length - u1, 0.5)
        for z in floors[1:-1].tolist():
            parts.append(_balcony(u0 - wide, u1 + wide, z, sort, level))
            if level == NEAR:
                parts.append(_lived_on(u0 - wide, u1 + wide, z, sort, rng))
    return joined(parts)


_BLADES = 14  # of a flower box


def _lived_on(u0: float, u1: float, z: float, sort: Balconies, rng: np.random.Generator) -> Shell:
    """Build what people put on a balcony: flower boxes, a screen of cloth, a folded parasol."""
    chance, start = rng.random(3), rng.uniform(0.0, 0.35)
    u = u0 + 0.1 + (u1 - u0 - 0.2) * np.linspace(start, start + rng.uniform(0.4, 0.65), _BLADES)
    lean, tall = rng.uniform(-0.09, 0.09, (2, _BLADES)), rng.uniform(0.08, 0.3, _BLADES)
    parts: list[Shell] = []
    if chance[0] < 0.55:
        top, out = z + _RAIL, -_DEEP - 0.2
        parts.append({"door": box((u[0], out, top - 0.2), (u[-1], -_DEEP - 0.02, top), skip="Y")})
        leaves = rectangles(u - 0.07, u + 0.07, top - 0.09, top + tall, inward=out + 0.08)
        leaves[:, 2:, 0] += lean[0][:, None]
        leaves[:, 2:, 1] += lean[1][:, None]
        leaves[:, :2, 1] -= 0.1
        parts.append({"greens": np.concatenate([leaves, leaves[:, ::-1]])})
    if chance[1] < 0.2 and sort == "iron":
        cloth = rectangles(u0 + 0.04, u1 - 0.04, z + 0.1, z + 0.92, inward=-_DEEP + 0.035)
        parts.append({"awning": cloth})
    if chance[2] < 0.2:
        foot = float(u[-1])
        stand = box((foot - 0.07, -0.6, z + 0.05), (foot + 0.07, -0.46, z + 2.0), skip="b")
        parts.append({"awning": stand})
    return joined(parts)


def french_doors(sort: Balconies, seed: int) -> slice | None:
    """Choose the bays whose windows reach the floor: those with balconies, None for none."""
    if sort == "none":
        return None
    if sort == "gallery":
        return slice(1, None, 2)
    rng = np.random.default_rng([seed, 17])
    return slice(int(rng.integers(0, 2)), None, int(rng.integers(2, 4)))


def _balcony(u0: float, u1: float, z: float, sort: Balconies, level: int) -> Shell:
    """Build a slab and its railing."""
    if level == FAR:
        if sort == "iron":  # a slab and its shadow, and a veil of bars
            return {
                "trim": box((u0, -_DEEP, z - 0.12), (u1, 0.0, z + 0.04), skip="YxX"),
                "rail": rectangles(u0, u1, z + _RAIL - 0.3, z + _RAIL, inward=-_DEEP),
            }
        return {"panel": rectangles(u0, u1, z - 0.1, z + _RAIL, inward=-_DEEP)}
    slab = {"trim": box((u0, -_DEEP, z - 0.12), (u1, 0.0, z + 0.04), skip="Y")}
    z0, z1 = z + 0.04, z + _RAIL
    if sort in ("solid", "glass"):
        role = "panel" if sort == "solid" else "glazing"
        return joined([slab, {role: _upright(u0, u1, z0, z1, 0.0)}, _handrail(u0, u1, z1, level)])
    if level != NEAR:
        # From here on, bars are a veil: a low dark band stands for them.
        return joined([slab, {"rail": _upright(u0, u1, z1 - 0.12, z1, 0.01)}])
    return joined([slab, {"rail": _bars(u0, u1, z0, z1)}, _handrail(u0, u1, z1, level)])


def _upright(u0: float, u1: float, z0: float, z1: float, inset: float) -> Floats:
    """Build front and sides of a railing, both faces of each, (6, 4, 3)."""
    y, thick = -_DEEP + inset, 0.05
    outer = box((u0 + inset, y, z0), (u1 - inset, 0.0, z1), skip="Ybt")
    inner = box((u0 + inset + thick, y + thick, z0), (u1 - inset - thick, 0.0, z1), skip="Ybt")
    return np.concatenate([outer, inner[:, ::-1]])


def _handrail(u0: float, u1: float, z: float, level: int) -> Shell:
    """Build a rail along the top of the parapet's front and sides."""
    if level != NEAR:
        return {}
    front = box((u0, -_DEEP - 0.01, z), (u1, -_DEEP + 0.05, z + 0.05), skip="bxX")
    left = box((u0, -_DEEP + 0.05, z), (u0 + 0.06, 0.0, z + 0.05), skip="YybX")
    right = box((u1 - 0.06, -_DEEP + 0.05, z), (u1, 0.0, z + 0.05), skip="Yybx")
    return {"rail": np.concatenate([front, left, right])}


def _bars(u0: float, u1: float, z0: float, z1: float) -> Floats:
    """Build upright bars: flat ones in front, seen from outside and inside, (n, 4, 3)."""
    u = np.linspace(u0 + 0.03, u1 - 0.03, max(int((u1 - u0) / _PITCH), 2))
    front = rectangles(u - 0.011, u + 0.011, z0, z1, inward=-_DEEP + 0.02)
    y = np.linspace(-_DEEP + 0.15, -0.1, 6)
    sides = []
    for u_side in (u0 + 0.03, u1 - 0.03):
        side = rectangles(y - 0.011, y + 0.011, z0, z1)[:, :, [1, 0, 2]]
        side[..., 0] = u_side
        sides.append(side if u_side > u0 + 0.1 else side[:, ::-1])
    # No camera stands on a balcony, so bars need one face only.
    return np.concatenate([front, *sides])
