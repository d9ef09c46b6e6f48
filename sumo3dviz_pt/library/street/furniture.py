"""What stands on sidewalks: bollards, bins, benches, parking meters, bus shelters.

Frame: origin on the ground in the middle of the foot, +x towards the road, z up. Every
function takes a level of detail: 0 near, 1 beyond 60 m.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise

import numpy as np

from sumo3dviz_pt.library.mesh.solids import box, moved, prism, superellipsoid, tube
from sumo3dviz_pt.library.street import corners
from sumo3dviz_pt.library.street.corners import coloured
from sumo3dviz_pt.library.street.strokes import lettering
from sumo3dviz_pt.library.street.traffic_light import upward
from sumo3dviz_pt.model.geometry import Colour, Mesh, merge_meshes
from sumo3dviz_pt.model.scene import Part

_DARK: Colour = (0.03, 0.033, 0.035)
_WHITE: Colour = (0.6, 0.6, 0.58)
_BLUE: Colour = (0.006, 0.06, 0.26)
_PAPER: Colour = (0.55, 0.55, 0.5)

SHELTER = (4.0, 1.5, 2.5)
"""Length, depth and height of a bus shelter [m]."""


def bollard(level: int = 0) -> list[Part]:
    """Build a steel post of 0.95 m with a reflecting band."""
    sides = 6 if level else 14
    body = [(0.0, -0.3), (0.05, -0.3), (0.05, 0.72)]
    top = [(0.0, 0.80), (0.05, 0.80), (0.05, 0.90), (0.035, 0.935), (0.0, 0.95)]
    band = [(0.0, 0.72), (0.051, 0.72), (0.051, 0.80), (0.0, 0.80)]
    steel = merge_meshes([upward([*body, (0.0, 0.72)], segments=sides),
                          upward(top, segments=sides)])  # fmt: skip
    return [coloured(steel, _DARK), coloured(upward(band, segments=sides), _WHITE)]


def bin_(level: int = 0) -> list[Part]:
    """Build a round litter bin on a post, its mouth under a lid."""
    sides = 7 if level else 18
    can = upward(
        [(0.0, 0.22), (0.17, 0.22), (0.2, 0.26), (0.21, 0.78), (0.0, 0.78)], segments=sides
    )
    lid = upward(
        [(0.0, 0.93), (0.22, 0.93), (0.225, 0.95), (0.15, 1.0), (0.0, 1.02)], segments=sides
    )
    mouth = upward([(0.0, 0.78), (0.14, 0.78), (0.14, 0.93), (0.0, 0.93)], segments=sides)
    parts = [coloured(merge_meshes([can, lid]), (0.035, 0.07, 0.045)), coloured(mouth, _DARK)]
    stands = [tube([(x, y, -0.2), (x, y, 0.95)], radius=0.018, sides=5)
              for x, y in ((0.17, 0.1), (0.17, -0.1), (-0.2, 0.0))]  # fmt: skip
    return [*parts, Part(merge_meshes(stands), "galvanised")]


def bench(level: int = 0) -> list[Part]:
    """Build a bench of 1.8 m with a back: boards on two cast feet; people on it look to +x."""
    half = 0.9
    boards = []
    count = 1 if level else 5
    for x in np.linspace(-0.18, 0.2, count) if count > 1 else (0.01,):
        wide = 0.21 if level else 0.035
        boards.append(box((x - wide, -half, 0.42), (x + wide, half, 0.455)))
    for z in (0.55, 0.67, 0.79)[: 1 if level else 3]:
        lean = -0.22 - 0.18 * (z - 0.45)
        tall = 0.3 if level else 0.085
        boards.append(box((lean - 0.015, -half, z), (lean + 0.015, half, z + tall)))
    side = [(-0.2, 0.0), (-0.14, 0.0), (-0.13, 0.36), (0.17, 0.36), (0.16, 0.0), (0.22, 0.0),
            (0.23, 0.42), (-0.2, 0.42), (-0.27, 0.88), (-0.31, 0.88)]  # fmt: skip
    legs = [_frame(side, y) for y in (-0.65, 0.65)]
    return [Part(merge_meshes(boards), "street_wood"), coloured(merge_meshes(legs), _DARK)]


def parking_meter(level: int = 0) -> list[Part]:
    """Build a ticket machine: a slim case with a screen and a hat."""
    case = moved(
        superellipsoid((0.13, 0.16, 0.5), squareness=8.0, segments=8 if level else 20, rings=6),
        0.0, 0.0, 1.2,
    )  # fmt: skip
    stand = box((-0.06, -0.08, -0.3), (0.06, 0.08, 0.8))
    hat = box((-0.16, -0.19, 1.69), (0.17, 0.19, 1.73))
    screen = box((0.1, -0.09, 1.38), (0.135, 0.09, 1.52))
    sign = box((-0.02, -0.16, 1.73), (0.02, 0.16, 2.05))
    return [
        coloured(merge_meshes([case, stand, hat]), (0.1, 0.11, 0.12)),
        Part(screen, "pane"),
        coloured(sign, _BLUE),
        coloured(_letter("P", 0.2, x=0.0215, z=1.89), _WHITE),
    ]


def charging_post(level: int = 0) -> list[Part]:
    """Build a charging post: a slim case with a screen, a socket and a green band."""
    case = moved(
        superellipsoid((0.12, 0.2, 0.72), squareness=8.0, segments=8 if level else 20, rings=6),
        0.0, 0.0, 0.72,
    )  # fmt: skip
    foot = box((-0.16, -0.24, -0.3), (0.16, 0.24, 0.06))
    screen = box((0.1, -0.1, 1.16), (0.125, 0.1, 1.3))
    socket = box((0.1, -0.06, 0.86), (0.14, 0.06, 0.98))
    band = box((-0.122, -0.203, 1.36), (0.122, 0.203, 1.4))
    return [
        coloured(case, (0.52, 0.53, 0.53)),
        coloured(merge_meshes([foot, socket]), _DARK),
        Part(screen, "pane"),
        coloured(band, (0.03, 0.3, 0.09)),
    ]


def bus_shelter(level: int = 0) -> list[Part]:
    """Build roof, panes at the back and the left end, posts, bench, timetable; open to +x."""
    (long, deep, tall), post = SHELTER, 0.035
    back, half = -deep / 2, long / 2
    posts = [box((back - post, y - post, -0.4), (back + post, y + post, tall - 0.1))
             for y in np.linspace(-half + 0.1, half - 0.1, 4)]  # fmt: skip
    posts.append(box((deep / 4, half - 0.1 - post, -0.4), (deep / 4 + 0.07, half - 0.03, tall)))
    rails = [box((back - 0.02, -half + 0.1, z), (back + 0.02, half - 0.1, z + 0.05))
             for z in (0.22, 2.12)]  # fmt: skip
    rails += [box((back, half - 0.12, z), (deep / 4, half - 0.08, z + 0.05)) for z in (0.22, 2.12)]
    roof = prism(
        [(back - 0.25, tall - 0.1), (deep / 2 + 0.2, tall + 0.02), (deep / 2 + 0.2, tall + 0.12),
         (0.0, tall + 0.1), (back - 0.25, tall)],
        half_width=half + 0.1,
    )  # fmt: skip
    edges = np.linspace(-half + 0.1, half - 0.1, 4)
    panes = [box((back - 0.006, a + 0.06, 0.29), (back + 0.006, b - 0.06, 2.1))
             for a, b in pairwise(edges)]  # fmt: skip
    panes.append(box((back + 0.08, half - 0.106, 0.29), (deep / 4 - 0.04, half - 0.094, 2.1)))
    seat = [box((back + 0.15, -1.2, 0.45), (back + 0.5, 1.0, 0.49))]
    feet = [box((back + 0.05, y, -0.2), (back + 0.42, y + 0.05, 0.45)) for y in (-1.0, 0.75)]
    board = box((back + 0.012, -half + 0.25, 0.9), (back + 0.03, -half + 0.95, 1.9))
    parts = [
        coloured(merge_meshes([*posts, *rails, roof, *feet]), (0.07, 0.075, 0.08)),
        Part(merge_meshes(panes), "pane"),
        Part(merge_meshes(seat), "street_wood"),
        coloured(board, _PAPER),
    ]
    if level == 0:
        head = box((back + 0.03, -half + 0.25, 1.74), (back + 0.034, -half + 0.95, 1.9))
        parts.append(coloured(head, _BLUE))
    return parts


FURNITURE: Mapping[str, Callable[[int], list[Part]]] = {
    "bollard": bollard,
    "bin": bin_,
    "bench": bench,
    "parking_meter": parking_meter,
    "charging_post": charging_post,
    "bus_shelter": bus_shelter,
    "cabinet": corners.cabinet,
    "post_box": corners.post_box,
    "advertising_column": corners.advertising_column,
    "bicycle_stand": corners.bicycle_stand,
}
"""Every piece by its name."""


def _frame(outline: Sequence[tuple[float, float]], y: float) -> Mesh:
    """Build a flat cast foot of strips between an outline's points."""
    bars = [
        tube([(a[0], y, a[1]), (b[0], y, b[1])], radius=0.02, sides=4)
        for a, b in (
            (outline[0], outline[-2]),
            (outline[5], outline[6]),
            (outline[7], outline[6]),
        )
    ]
    return merge_meshes(bars)


def _letter(text: str, height: float, *, x: float, z: float) -> Mesh:
    """Write a word that looks to +x."""
    flat = lettering(text, height=height).reshape(-1, 2)
    vertices = np.column_stack([np.full(len(flat), x), flat[:, 0], z + flat[:, 1]])
    faces = np.arange(len(flat)).reshape(-1, 3)
    return Mesh(vertices, faces, np.tile([1.0, 0.0, 0.0], (len(flat), 1)))
