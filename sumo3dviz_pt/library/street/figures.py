"""What lamps show besides discs: standing and walking people, and digits of seven bars.

Figures lie in the plane of a lens and look to -x, as the heads in `traffic_light` do.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from sumo3dviz_pt.library.street.strokes import disc, fan
from sumo3dviz_pt.library.street.traffic_light import FRONT, HOUSING
from sumo3dviz_pt.model.geometry import Floats, Mesh

SEGMENTS: Mapping[str, str] = {
    "0": "abcdef",
    "1": "bc",
    "2": "abged",
    "3": "abgcd",
    "4": "fgbc",
    "5": "afgcd",
    "6": "afgedc",
    "7": "abc",
    "8": "abcdefg",
    "9": "abcdfg",
    " ": "",
}
"""Lit bars of each digit: a is the top, then clockwise to f, g is the middle."""

BARS = "abcdefg"
"""Every bar of a digit."""

_STANDING: Sequence[Sequence[tuple[float, float]]] = (
    [(-0.20, 0.42), (0.20, 0.42), (0.14, 0.50), (-0.14, 0.50)],
    [(-0.17, -0.08), (0.17, -0.08), (0.20, 0.42), (-0.20, 0.42)],
    [(-0.16, -0.90), (-0.03, -0.90), (-0.015, -0.08), (-0.17, -0.08)],
    [(0.03, -0.90), (0.16, -0.90), (0.17, -0.08), (0.015, -0.08)],
    [(-0.35, -0.14), (-0.25, -0.14), (-0.22, 0.44), (-0.31, 0.40)],
    [(0.25, -0.14), (0.35, -0.14), (0.31, 0.40), (0.22, 0.44)],
)
_WALKING: Sequence[Sequence[tuple[float, float]]] = (
    [(-0.17, -0.10), (0.13, -0.10), (0.15, 0.48), (-0.13, 0.48)],
    [(0.30, -0.88), (0.46, -0.82), (0.13, -0.10), (-0.06, -0.10)],
    [(-0.50, -0.72), (-0.38, -0.84), (0.02, -0.10), (-0.17, -0.10)],
    [(-0.58, -0.80), (-0.52, -0.90), (-0.34, -0.76), (-0.42, -0.66)],
    [(0.30, -0.92), (0.58, -0.92), (0.58, -0.82), (0.30, -0.82)],
    [(-0.44, -0.02), (-0.34, -0.08), (-0.06, 0.38), (-0.13, 0.48)],
    [(0.38, 0.02), (0.46, 0.10), (0.15, 0.48), (0.09, 0.34)],
)


def walker(index: int, *, walking: bool) -> Mesh:
    """Draw a standing or walking person in front of a lens; index 0 is the lowest lamp."""
    bodies = _WALKING if walking else _STANDING
    head = disc(0.155, centre=(0.02 if walking else 0.0, 0.69), sides=10)
    flat = np.concatenate([*(fan(body) for body in bodies), head]) * 0.088
    return upright(flat, x=FRONT - 0.012, z=HOUSING * (index + 0.5))


def tram_bar(index: int, meaning: str) -> Mesh:
    """Draw what trams are shown in front of a lens.

    Args:
        index: Which lamp from below.
        meaning: `stop` is a lying bar, `go` an upright one, `wait` a dot.

    References:
        Verordnung ueber den Bau und Betrieb der Strassenbahnen (BOStrab), annex 4,
        signals F 0, F 1 and F 4.
    """
    if meaning == "wait":
        flat = disc(0.045, sides=14)
    else:
        half = np.array([(-0.082, -0.021), (0.082, -0.021), (0.082, 0.021), (-0.082, 0.021)])
        flat = fan(half if meaning == "stop" else half[:, ::-1] * [-1.0, 1.0])
    return upright(flat, x=FRONT - 0.012, z=HOUSING * (index + 0.5))


def window(index: int, *, sides: int = 20) -> Mesh:
    """Build the dark disc behind a figure."""
    return upright(disc(0.1, sides=sides), x=FRONT - 0.007, z=HOUSING * (index + 0.5))


def digit(place: int, index: int) -> tuple[Mesh, ...]:
    """Build the seven bars of one of two digits, in the order of `BARS`.

    Args:
        place: 0 for tens, 1 for ones.
        index: Which housing from below.
    """
    wide, half, thick = 0.062, 0.072, 0.017
    across = [
        (0.0, 2 * half), (wide / 2, half / 1), (wide / 2, -half), (0.0, -2 * half),
        (-wide / 2, -half), (-wide / 2, half), (0.0, 0.0),
    ]  # fmt: skip
    centre = np.array([(-0.052, 0.052)[place], 0.0])
    bars = []
    for bar, (u, v) in zip(BARS, across, strict=True):
        lying = bar in "adg"
        long = (wide if lying else 2 * half) / 2 - 0.004
        v = {"a": 2 * half, "d": -2 * half, "g": 0.0}.get(bar, v)
        shape = _bar(long, thick / 2)
        flat = fan(shape if lying else shape[:, ::-1] * [-1.0, 1.0])
        centred = flat * [1.0, 0.66] + centre + [u, 0.66 * v]
        bars.append(upright(centred, x=FRONT - 0.006, z=HOUSING * (index + 0.5)))
    return tuple(bars)


def bars_of(number: int | None) -> frozenset[tuple[int, str]]:
    """Return the lit bars, as (place, bar), of a number from 0 to 99; none for anything else."""
    if number is None or not 0 <= number <= 99:
        return frozenset()
    return frozenset(
        (place, bar) for place, sign in enumerate(f"{number:2d}") for bar in SEGMENTS[sign]
    )


def upright(flat: Floats, *, x: float, z: float) -> Mesh:
    """Stand a flat drawing up, so that it looks to -x.

    Args:
        flat: Triangles of the reader's plane, (n, 3, 2) [m].
        x: Where they stand [m].
        z: Height of the plane's origin [m].
    """
    points = flat.reshape(-1, 2)
    vertices = np.column_stack([np.full(len(points), x), -points[:, 0], z + points[:, 1]])
    faces = np.arange(len(points)).reshape(-1, 3)
    return Mesh(vertices, faces, np.tile([-1.0, 0.0, 0.0], (len(points), 1)))


def _bar(half: float, thick: float) -> Floats:
    """Outline a lying bar with pointed ends, counter-clockwise, (6, 2) [m]."""
    return np.array(
        [
            (-half, 0.0),
            (-half + thick, -thick),
            (half - thick, -thick),
            (half, 0.0),
            (half - thick, thick),
            (-half + thick, thick),
        ]
    )
