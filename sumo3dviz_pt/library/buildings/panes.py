"""Panes tell the renderer where on which pane a ray meets them, so that it can show the room there.

Three numbers in [0, 1] at each corner: how wide the pane is and where along it the corner lies, how
high it is and where up it, and which room lies behind it. The room's number is a hash of the pane's
place, so no two neighbours have the same one, and all levels of detail agree.
"""

from __future__ import annotations

import numpy as np

from sumo3dviz_pt.model.geometry import (
    PANE_SIZES,
    PANE_STEP,
    Floats,
    Ints,
    settled,
)

PANE = "room_pane"
"""The material of panes before rooms."""

ROOMS = 128
"""How many rooms of each kind, with cloth at their windows or without, are told apart."""

_KINDS = {kind: k for k, kind in enumerate(("room", "office", "shop"))} | {"bare": 0}

_MARGIN = 0.01  # of a step, so that no corner falls into the next one
_GRID = 4.0  # places are told apart by so much of a metre
_CORNERS = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], dtype=np.float64)


def pane_places(quads: Floats, role: str, *, office: bool) -> Floats:
    """Return what the corners of panes tell, (n, 4, 3) in [0, 1].

    Args:
        quads: Lower left corner first, as the street sees them, (n, 4, 3) [m].
        role: Of a building's shell; other ones than panes are plain.
        office: Whether offices lie behind its windows, and no homes.
    """
    name = role.rstrip("0123456789")
    kind = (
        _KINDS["office" if office and name in ("room", "bare") else name] if name in _KINDS else 3
    )
    sides = np.linalg.norm(quads[:, [1, 3]] - quads[:, :1], axis=2)
    steps = np.clip(np.rint(settled(sides) / PANE_STEP), 1, PANE_SIZES - 1)
    within = _MARGIN + (1.0 - 2.0 * _MARGIN) * _CORNERS
    along = (steps[:, None] + within) / PANE_SIZES
    number = ROOMS * (2 * kind + (name == "bare")) + room_numbers(quads)
    room = np.broadcast_to(((number + 0.5) / (8 * ROOMS))[:, None, None], (len(quads), 4, 1))
    return np.concatenate([along, room], axis=-1)


def room_walls(places: Floats) -> Floats:
    """Return the reflectance of the walls of lit rooms, (n, 3); of what is no pane, dark glass.

    Args:
        places: Of one corner of each pane, as `pane_places` returns them, (n, 3).
    """
    number = np.floor(places[:, 2:] * (8 * ROOMS)).astype(np.int64)
    shade = 0.4 + 0.3 * (number * 37 % ROOMS) / ROOMS
    warmth = (number * 53 % ROOMS) / ROOMS * np.array([0.0, 0.06, 0.2])
    return np.where(number < 6 * ROOMS, shade * (1.0 - warmth), 0.03)


def room_numbers(quads: Floats) -> Ints:
    """Return a hash of the places of panes, (n,), below `ROOMS`."""
    cells = np.floor(settled(quads.mean(axis=1)) * _GRID).astype(np.int64)
    mixed = (cells * (73856093, 19349663, 83492791)).sum(axis=1) & 0xFFFFFFFF
    mixed = (mixed ^ (mixed >> 15)) * 0x2C1B3C6D & 0xFFFFFFFF
    return np.asarray((mixed ^ (mixed >> 13)) % ROOMS)
