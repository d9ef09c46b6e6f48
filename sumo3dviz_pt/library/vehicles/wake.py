"""The wake of a ship: foam behind its stern, and along the waves that its bow throws.

Foam is many flat flecks on still water, most of them near the ship; the waves themselves are not
drawn.

References:
    The arms of a wake lie at arcsin(1/3) = 19.5 degrees to the way of the ship: W. Thomson (Lord
    Kelvin), On ship waves, Proceedings of the Institution of Mechanical Engineers 38, 1887.
"""

from __future__ import annotations

import numpy as np

from sumo3dviz_pt.model.geometry import Floats, Mesh
from sumo3dviz_pt.model.random import dice_of
from sumo3dviz_pt.model.scene import Part, Prototype

MATERIAL = "foam"

_BEHIND, _ALONG = 1100, 260  # flecks behind the stern, and along each arm
_REACH = 2.2  # how far foam reaches behind the stern and the bow, in lengths of the ship
_ARM = float(np.tan(np.arcsin(1.0 / 3.0)))
_ABOVE = 0.03  # height of foam above still water [m]
_LONGEST = 40.0  # a longer ship leaves no longer a wake [m]


def wake_name(length: float, width: float) -> str:
    """Return the name of the wake of a ship of a size [m]."""
    return f"wake {length:.0f}x{width:.0f}"


def wake(length: float, width: float) -> Prototype:
    """Build the wake of a ship, whose bow is at the origin.

    Args:
        length: Of the ship [m].
        width: Of the ship [m].
    """
    dice = dice_of(0, "wake", wake_name(length, width))
    reach = _REACH * min(length, _LONGEST)
    # Behind the stern foam is as wide as the ship at first, and spreads.
    away = reach * dice.random(_BEHIND) ** 2.6
    aside = (0.2 * width + 0.04 * away) * dice.standard_normal(_BEHIND)
    places = [np.column_stack([-0.97 * length - away, aside])]
    sizes = [(0.10 + 0.28 * dice.random(_BEHIND) ** 2) * (1.0 - 0.6 * away / reach)]
    for side in (-1.0, 1.0):
        along = reach * dice.random(_ALONG) ** 1.7
        wave = side * np.maximum(_ARM * along, 0.5 * width * np.minimum(along / width, 1.0) + 0.2)
        wave += 0.03 * along * dice.standard_normal(_ALONG)
        places.append(np.column_stack([-along, wave]))
        sizes.append((0.08 + 0.2 * dice.random(_ALONG) ** 2) * (1.0 - 0.6 * along / reach))
    mesh = _flecks(np.concatenate(places), np.concatenate(sizes))
    parts = (Part(mesh, MATERIAL),)
    return Prototype(wake_name(length, width), parts, parts)


def _flecks(places: Floats, sizes: Floats) -> Mesh:
    """Flat flecks, twice as long as wide, at places, (n, 2) [m], of sizes, (n,) [m]."""
    shape = np.array([(1.0, 0.0), (0.3, 0.5), (-0.8, 0.35), (-1.0, -0.1), (-0.2, -0.5)])
    corners = places[:, None] + sizes[:, None, None] * shape
    # Flecks overlap: each lies a little higher than the one before.
    heights = _ABOVE + 1e-4 * np.arange(len(places))
    flat = np.dstack([corners, np.repeat(heights[:, None], len(shape), axis=1)])
    fan = np.array([(0, k, k + 1) for k in range(1, len(shape) - 1)])
    faces = len(shape) * np.arange(len(places))[:, None, None] + fan
    return Mesh(flat.reshape(-1, 3), faces.reshape(-1, 3))
