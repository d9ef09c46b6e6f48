"""What a street sees on a wall: doors, shops, gates, down-pipes, machines.

In wall coordinates: (along, inward, up) [m]. The renderer finds what shop windows (`shop0` ...
`shop5`) show, which shine at night.
"""

from __future__ import annotations

import numpy as np

from sumo3dviz_pt.library.buildings.facade import FAR, NEAR, PROUD, SLACK, by_class, storey
from sumo3dviz_pt.library.buildings.shell import Shell, box, joined, rectangles
from sumo3dviz_pt.library.buildings.sign_boards import Boards, sign_boards
from sumo3dviz_pt.model.geometry import Floats

GOODS = 6
"""How many shops of a building are told apart."""

_BAY = 3.4  # between the piers of shops, about [m]

FOOT = -1.0
"""How deep walls and steps reach [m]."""


def door(opening: Floats, *, step: float, level: int) -> Shell:
    """Build a door leaf set back, steps up to it and a canopy.

    Args:
        opening: u0, u1, z0, z1 [m].
        step: Height of its threshold above the ground [m].
        level: Level of detail.
    """
    u0, u1, z0, z1 = (float(value) for value in opening)
    if level != NEAR:
        return {"door": rectangles(u0, u1, z0, z1, inward=-PROUD)}
    depth, light = 0.18, z1 - 0.45 if z1 - z0 > 2.3 else z1
    leaf = rectangles(u0, u1, z0, light, inward=depth)
    top = rectangles(u0, u1, light, z1, inward=depth)
    bars = np.concatenate(
        [
            rectangles([u0, u1 - 0.07], [u0 + 0.07, u1], z0, z1, inward=depth - 0.03),
            rectangles(
                u0 + 0.07, u1 - 0.07, [light, z1 - 0.05], [light + 0.05, z1], inward=depth - 0.03
            ),
        ]
    )
    rebate = rectangles(
        u0 + 0.2,
        u1 - 0.2,
        [z0 + 0.2, z0 + 0.95],
        [z0 + 0.8, min(z0 + 1.8, light - 0.1)],
        inward=depth - 0.006,
    )
    shell: Shell = {
        "door": leaf,
        "panel": rebate,
        "frame": bars,
        "bare1": top[: int(light < z1)],
        "reveal": recess(u0, u1, (z0, z1), depth),
        "metal": box((u1 - 0.2, depth - 0.07, z0 + 1.0), (u1 - 0.16, depth, z0 + 1.13), skip="Y"),
        "trim": box((u0 - 0.3, -0.85, z1 + 0.2), (u1 + 0.3, 0.0, z1 + 0.31), skip="Y"),
    }
    return joined([shell, _steps(u0, u1, z0, step)])


def shops(
    length: float,
    height: float,
    *,
    level: int,
    rng: np.random.Generator,
    boards: Boards,
) -> Shell:
    """Build glazing between piers under sign boards, with a door now and then.

    Args:
        length: Of the wall [m].
        height: Of the ground floor [m].
        level: Of detail.
        rng: Chooses doors, awnings and what is shown.
        boards: What is written over the shops.
    """
    count = max(int(length / _BAY), 1)
    edges = np.linspace(0.25, length - 0.25, count + 1)
    low = np.where(rng.random(count) < 0.3, 0.04, 0.42)
    openings = np.column_stack(
        [edges[:-1] + 0.16, edges[1:] - 0.16, low, np.full(count, height - 1.0)]
    )
    parts: list[Shell] = [_glazing(openings, level, rng)]
    parts.append(sign_boards(edges, height, boards, level=level, rng=rng))
    if level == NEAR:
        parts.append(storey(length, 0.0, height, openings, "front"))
        parts.append(_awnings(openings, rng))
        parts.append(_footing(length, openings))
    else:
        parts.append({"front": rectangles(0.0, length, 0.0, height)})
    return joined(parts)


def gates(length: float, height: float, *, level: int) -> Shell:
    """Build roller gates in the wall of a hall, and the wall around them.

    Args:
        length: Of the wall [m].
        height: Of the ground floor [m].
        level: Of detail.
    """
    wide, tall = 3.6, min(4.0, height - 0.8)
    count = max(int((length - 3.0) / 6.5), 1)
    axes = (np.arange(count) + 0.5) * length / count
    if length < wide + 1.2:
        return {"wall": rectangles(0.0, length, 0.0, height)}
    openings = np.column_stack([axes - wide / 2, axes + wide / 2, 0 * axes, 0 * axes + tall])
    if level != NEAR:
        leaves = rectangles(openings[:, 0], openings[:, 1], 0.0, tall, inward=-PROUD)
        return {"wall": rectangles(0.0, length, 0.0, height), "door": leaves}
    parts: list[Shell] = [storey(length, 0.0, height, openings)]
    for u0, u1, *_ in openings.tolist():
        z = np.arange(0.0, tall - 0.01, 0.5)
        slats = rectangles(u0, u1, z + 0.02, np.minimum(z + 0.5, tall), inward=0.22)
        gaps = rectangles(u0, u1, 0.0, tall, inward=0.24)
        parts.append({"door": slats, "rail": gaps, "reveal": recess(u0, u1, (0.0, tall), 0.24)})
        dock = rectangles([u0 - 0.25, u1], [u0, u1 + 0.25], 0.0, tall + 0.25, inward=-0.03)
        parts.append({"rail": dock})
    return joined(parts)


def recess(u0: float, u1: float, heights: tuple[float, float], depth: float) -> Floats:
    """Build the faces of the wall's thickness in an opening: sides, head and foot.

    Args:
        u0: Where the opening begins along the wall [m].
        u1: Where it ends [m].
        heights: Of its foot and its head [m].
        depth: Of the wall there [m].

    Returns:
        Quads, (4, 4, 3) [m].
    """
    z0, z1 = heights
    left = [(u0, 0, z0), (u0, depth, z0), (u0, depth, z1), (u0, 0, z1)]
    right = [(u1, depth, z0), (u1, 0, z0), (u1, 0, z1), (u1, depth, z1)]
    head = [(u0, 0, z1), (u0, depth, z1), (u1, depth, z1), (u1, 0, z1)]
    foot = [(u0, 0, z0), (u1, 0, z0), (u1, depth, z0), (u0, depth, z0)]
    return np.array([left, right, head, foot], dtype=np.float64)


def _steps(u0: float, u1: float, z0: float, rise: float) -> Shell:
    """Build steps up to a door."""
    count = max(round(rise / 0.17), 1)
    parts = []
    for k in range(count):
        z = z0 - (k + 1) * rise / (count + 1) if k else z0
        deep = 0.95 + 0.3 * k
        parts.append(box((u0 - 0.25, -deep, FOOT), (u1 + 0.25, 0.0, z), skip="bY"))
    return {"plinth": np.concatenate(parts)}


def _glazing(openings: Floats, level: int, rng: np.random.Generator) -> Shell:
    """Build panes with things behind them, bars between them, and their recess."""
    u0, u1, z0, z1 = openings.T
    inward = 0.3 if level == NEAR else -PROUD
    panes = rectangles(u0, u1, z0, z1, inward=inward)
    panes[:, 1:3, 1] += rng.normal(0.0, 0.004, (len(panes), 1)).clip(-SLACK, SLACK)
    shown = _goods(panes, rng)
    if level == FAR:
        return shown
    bar, middle = 0.05, (u0 + u1) / 2
    head = z1 - 0.75
    bars = [
        rectangles(middle - bar / 2, middle + bar / 2, z0, z1, inward=inward - 0.02),
        rectangles(u0, u1, head, head + bar, inward=inward - 0.02),
    ]
    if level != NEAR:
        return {**shown, "joint": np.concatenate(bars)}
    open_ = z0 < 0.2  # a glazed door in the middle of its pane
    for side in (-0.5, 0.5):
        jamb = middle[open_] + side
        leaf = rectangles(jamb - 0.04, jamb + 0.04, z0[open_], head[open_], inward=inward - 0.022)
        bars.append(leaf)
    bars += [
        rectangles(u0, u1, z0, z0 + 0.08, inward=inward - 0.02),
        rectangles(u0, u0 + bar, z0, z1, inward=inward - 0.02),
        rectangles(u1 - bar, u1, z0, z1, inward=inward - 0.02),
    ]
    walls = [recess(a, b, (c, d), inward + 2 * SLACK) for a, b, c, d in openings.tolist()]
    return {**shown, "joint": np.concatenate(bars), "reveal": np.concatenate(walls)}


def _goods(panes: Floats, rng: np.random.Generator) -> Shell:
    """Sort panes by the shops behind them: neighbours are often one shop."""
    starts = rng.random(len(panes)) < 0.6
    shop = np.cumsum(starts) + rng.integers(0, GOODS)
    return by_class({"shop": (panes, (shop * 5 % GOODS).astype(np.int64))})


def _footing(length: float, openings: Floats) -> Shell:
    """Build dark stone at the foot of piers and under shop windows."""
    starts, ends = np.append(0.0, openings[:, 1]), np.append(openings[:, 0], length)
    piers = rectangles(starts, ends, FOOT, 0.55, inward=-0.025)
    closed = openings[openings[:, 2] > 0.2]
    below = rectangles(closed[:, 0], closed[:, 1], FOOT, closed[:, 2] - 0.02, inward=-0.025)
    return {"plinth": np.concatenate([piers, below])}


def _awnings(openings: Floats, rng: np.random.Generator) -> Shell:
    """Build sloping cloth over some of the shop windows, seen from above and below."""
    some = openings[rng.random(len(openings)) < 0.35]
    if not len(some):
        return {}
    u0, u1, _, z1 = some.T
    cloth = rectangles(u0, u1, z1 - 0.5, z1 + 0.05)
    cloth[:, :2, 1], cloth[:, 2:, 1] = -1.15, -0.05
    hem = rectangles(u0, u1, z1 - 0.68, z1 - 0.5, inward=-1.15)
    return {"awning": np.concatenate([cloth, cloth[:, ::-1] - [0, 0, 0.015], hem])}


_COOLED = 0.07  # share of windows with a machine under them


def down_pipe(height: float, *, level: int, rng: np.random.Generator, hopper: float = 0.5) -> Shell:
    """Build a pipe from the eaves to the ground near the beginning of a wall.

    Args:
        height: Of the wall [m].
        level: Of detail.
        rng: Places it.
        hopper: How far below the eaves water is collected [m].
    """
    u = 0.22 + 0.12 * float(rng.random())
    if level == FAR:
        return {}
    pipe = box((u - 0.055, -0.15, 0.0), (u + 0.055, -0.04, height - hopper), skip="btY")
    head = box((u - 0.13, -0.2, height - hopper - 0.3), (u + 0.13, 0.0, height - hopper), skip="Y")
    if level != NEAR:
        return {"pipe": pipe}
    clamps = [
        box((u - 0.075, -0.16, z), (u + 0.075, 0.0, z + 0.05), skip="Y")
        for z in np.arange(2.2, height - 1.5, 2.4).tolist()
    ]
    return {"pipe": np.concatenate([pipe, head, *clamps])}


def coolers(openings: Floats, *, level: int, rng: np.random.Generator) -> Shell:
    """Build air conditioners under some windows.

    Args:
        openings: Windows, (k, 4) as u0, u1, z0, z1 [m].
        level: Of detail.
        rng: Chooses windows.
    """
    some = openings[rng.random(len(openings)) < _COOLED]
    if level == FAR or not len(some):
        return {}
    parts: list[Shell] = []
    for u0, u1, z0, _ in some.tolist():
        u, z = (u0 + u1) / 2 - 0.4, z0 - 0.72
        case = box((u, -0.36, z), (u + 0.8, -0.06, z + 0.55), skip="Y")
        parts.append({"cooler": case})
        if level == NEAR:
            fan = rectangles(u + 0.06, u + 0.52, z + 0.06, z + 0.49, inward=-0.364)
            feet = box((u + 0.1, -0.3, z - 0.1), (u + 0.7, 0.0, z), skip="Yt")
            parts.append({"rail": np.concatenate([fan, feet])})
    return joined(parts)
