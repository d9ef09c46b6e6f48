"""Traffic signs: plates on posts, boards beside the road, gantries over it.

Frame of a sign: origin below the middle of its plate, the face looks to -x, that is,
towards traffic that drives to +x; +y is that traffic's left.

References:
    Shapes and colours: Vienna Convention on Road Signs and Signals, 1968, annex 1
    (B,1 give way; B,2 stop; B,3 priority road; C,14 speed limit).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cache

import numpy as np

from sumo3dviz_pt.library.mesh.solids import box, prism, tube
from sumo3dviz_pt.library.street.lettering import lettering
from sumo3dviz_pt.library.street.strokes import arrow, disc, fan, regular, ring, upright
from sumo3dviz_pt.library.street.traffic_light import rounded
from sumo3dviz_pt.model.geometry import Colour, Floats, Transform, merge_meshes
from sumo3dviz_pt.model.scene import Part

WHITE: Colour = (0.72, 0.72, 0.70)
RED: Colour = (0.5, 0.012, 0.015)
BLUE: Colour = (0.006, 0.06, 0.26)
YELLOW: Colour = (0.72, 0.4, 0.01)
GREEN: Colour = (0.0, 0.16, 0.09)
BLACK: Colour = (0.015, 0.015, 0.015)

_LIFT = 0.003  # between a sign's layers of paint [m]

SignLayer = tuple[Floats, Colour]
"""Triangles of a reader's plane, (n, 3, 2) [m], and their colour."""


def post(height: float, *, level: int = 0) -> Part:
    """Build a round steel post from 0.5 m below the ground."""
    mesh = tube([(0.0, 0.0, -0.5), (0.0, 0.0, height)], radius=0.03, sides=5 if level else 10)
    return Part(mesh, "galvanised")


def plate(outline: Floats, layers: Sequence[SignLayer], *, z: float) -> list[Part]:
    """Build a convex plate with painted layers in front of a post.

    Args:
        outline: Counter-clockwise for the reader, (n, 2) [m].
        layers: From the lowest to the highest.
        z: Height of the plate's middle [m].
    """
    sheet = prism(outline.tolist(), half_width=0.006, crease=0.5)
    turned = Transform.from_pose((-0.042, 0.0, z), yaw=np.pi / 2).mesh(sheet)
    return [Part(turned, "galvanised"), painted(layers, x=-0.048, z=z)]


def painted(layers: Sequence[SignLayer], *, x: float, z: float) -> Part:
    """Paint layers in front of a plane, each a little nearer to the reader.

    Args:
        layers: From the lowest to the highest.
        x: Where the plane stands [m].
        z: Height of the layers' origin [m].
    """
    meshes, tints = [], []
    for i, (flat, colour) in enumerate(layers):
        meshes.append(upright(flat, x=x - _LIFT * (i + 1), z=z))
        tints.append(np.tile(colour, (len(flat), 1)))
    return Part(merge_meshes(meshes), "sign", np.concatenate(tints))


@cache
def speed_limit(number: int) -> tuple[Part, ...]:
    """Build a round sign with a red ring and a number [km/h]."""
    outer, inner = regular(0.30, sides=28), regular(0.235, sides=28)
    digits = lettering(str(number), height=0.25 if number < 100 else 0.2, weight=0.15)
    if number >= 100:
        digits = digits * [0.85, 1.0]
    layers = [(disc(0.24), WHITE), (ring(outer, inner), RED), (digits, BLACK)]
    return tuple(plate(outer, layers, z=0.0))


@cache
def give_way() -> tuple[Part, ...]:
    """Build a triangle on its tip, white with a red border."""
    outline, layers = triangle_face()
    return tuple(plate(outline, layers, z=-0.08))


def triangle_face() -> tuple[Floats, list[SignLayer]]:
    """Return outline, (n, 2) [m], and layers of a white triangle on its tip with a red border."""
    outer, inner = _triangle(0.45), _triangle(0.31)
    return outer, [(fan(inner), WHITE), (ring(outer, inner), RED)]


@cache
def stop() -> tuple[Part, ...]:
    """Build a red octagon with a white border and the word."""
    turn = np.pi / 8
    outer, inner = (regular(r, sides=8, turn=turn) for r in (0.41, 0.385))
    word = lettering("STOP", height=0.21, weight=0.16, gap=0.22)
    layers = [(fan(inner), RED), (ring(outer, inner), WHITE), (word, WHITE)]
    return tuple(plate(outer, layers, z=0.0))


@cache
def priority_road() -> tuple[Part, ...]:
    """Build a yellow square on its tip with a white border."""
    outer, inner = regular(0.36, sides=4), regular(0.24, sides=4)
    layers = [(fan(inner), YELLOW), (ring(outer, inner), WHITE)]
    return tuple(plate(outer, layers, z=0.0))


@cache
def bus_stop() -> tuple[Part, ...]:
    """Build a blue plate with a bus."""
    outline = rounded(0.42, 0.56, radius=0.04)
    body = fan([(-0.15, -0.05), (0.15, -0.05), (0.15, 0.12), (-0.15, 0.12)])
    panes = [fan([(u, 0.0), (u + 0.07, 0.0), (u + 0.07, 0.075), (u, 0.075)]) for u in
             (-0.135, -0.045, 0.045)]  # fmt: skip
    wheels = [disc(0.035, centre=(u, -0.06), sides=10) for u in (-0.085, 0.085)]
    word = lettering("BUS", height=0.09) - np.array([0.0, 0.19])
    layers = [
        (fan(outline), BLUE),
        (fan(0.93 * outline), BLUE),
        (np.concatenate([body, word]), WHITE),
        (np.concatenate([*panes, *wheels]), BLUE),
    ]
    return tuple(plate(outline, layers, z=0.0))


SIGNS: Mapping[str, Callable[[], tuple[Part, ...]]] = {
    "give_way": give_way,
    "stop": stop,
    "priority_road": priority_road,
    "bus_stop": bus_stop,
}
"""Signs without a number."""


def on_post(face: Sequence[Part], *, bottom: float = 2.1, level: int = 0) -> list[Part]:
    """Put a sign's plate on a post.

    Args:
        face: Parts of the plate.
        bottom: Height of its lowest edge [m].
        level: 0 near; from 2 on, the post and the paint alone.
    """
    low = min(float(part.mesh.bounds[0, 2]) for part in face)
    high = max(float(part.mesh.bounds[1, 2]) for part in face)
    up = Transform.from_pose((0.0, 0.0, bottom - low))
    shown = [part for part in face if level == 0 or part.material == "sign" or level == 1]
    parts = [Part(up.mesh(part.mesh), part.material, part.tint) for part in shown]
    return [post(bottom + high - low, level=level), *parts]


@cache
def board(lines: tuple[str, ...], pointer: str, *, height: float = 0.32) -> tuple[Part, ...]:
    """Build a blue board with white lettering around the origin, for gantries and exits.

    Args:
        lines: Text from top to bottom.
        pointer: An arrow at its right: `down`, `up`, `exit` (slanting right), or empty.
        height: Of letters [m].
    """
    words = [lettering(line, height=height, weight=0.15) for line in lines]
    wide = max(np.ptp(word[..., 0]) for word in words)
    tall = 1.7 * height * len(lines)
    shown = {"down": np.pi, "up": 0.0, "exit": -np.pi / 4}
    room = 1.6 * height if pointer in shown else 0.0
    size = (wide + room + 1.4 * height, max(tall, 2.0 * height) + 0.7 * height)
    layers: list[Floats] = []
    for i, word in enumerate(words):
        at = ((len(lines) - 1) / 2 - i) * 1.7 * height
        left = -size[0] / 2 + 0.7 * height - word[..., 0].min()
        layers.append(word + np.array([left, at]))
    if pointer in shown:
        drawn = arrow(min(size[1] - 0.9 * height, 2.2 * height), 1.2 * height, turn=shown[pointer])
        layers.append(drawn + np.array([size[0] / 2 - 0.6 * height - room / 2, 0.0]))
    outer = rounded(*size, radius=0.12)
    inner = rounded(size[0] - 0.16, size[1] - 0.16, radius=0.07)
    rim = rounded(size[0] - 0.06, size[1] - 0.06, radius=0.1)
    white = np.concatenate([ring(rim, inner), *layers])
    parts = plate(outer, [(fan(outer), BLUE), (white, WHITE)], z=0.0)
    stiff = [
        box((-0.036, -size[0] / 2 + 0.1, z - 0.03), (0.0, size[0] / 2 - 0.1, z + 0.03))
        for z in (-size[1] / 4, size[1] / 4)
    ]
    return (*parts, Part(merge_meshes(stiff), "galvanised"))


def board_size(face: Sequence[Part]) -> tuple[float, float]:
    """Return width and height of a board [m]."""
    low, high = face[0].mesh.bounds
    return float(high[1] - low[1]), float(high[2] - low[2])


def exit_board(lines: tuple[str, ...]) -> list[Part]:
    """Build a low board on two posts at the nose of an exit."""
    face = board(lines, "exit", height=0.24)
    wide, tall = board_size(face)
    up = Transform.from_pose((0.0, 0.0, 1.5 + tall / 2))
    parts = [Part(up.mesh(part.mesh), part.material, part.tint) for part in face]
    posts = [
        tube([(0.02, y, -0.6), (0.02, y, 1.5 + tall)], radius=0.05, sides=8)
        for y in (-wide / 3, wide / 3)
    ]
    return [Part(merge_meshes(posts), "galvanised"), *parts]


def gantry(
    left: float, right: float, boards: Sequence[tuple[float, tuple[Part, ...]]], *, portal: bool
) -> list[Part]:
    """Build a frame over a carriageway with boards.

    Args:
        left: Where its left post stands, along +y [m]; for a single post, its arm's end.
        right: Where its right post stands, usually negative [m].
        boards: Middle of each along y [m], and its parts.
        portal: Whether a left post stands; else the right one carries it alone.
    """
    clear, depth = 5.6, 0.28
    # Four chords, slanting bars and ties between them make the lattice beam.
    chord = [
        tube([(x, left, z), (x, right, z)], radius=0.06, sides=8)
        for x in (-depth, depth)
        for z in (clear, clear + 0.9)
    ]
    count = max(2, round(abs(left - right) / 1.2))
    ys = np.linspace(left, right, count + 1)
    lattice = [
        tube([(x, y, clear), (x, after, clear + 0.9)], radius=0.025, sides=4)
        for x in (-depth, depth)
        for y, after in (pair if i % 2 else pair[::-1] for i, pair in enumerate(
            zip(ys[:-1].tolist(), ys[1:].tolist(), strict=True)))
    ]  # fmt: skip
    ties = [
        tube([(-depth, y, z), (depth, y, z)], radius=0.025, sides=4)
        for y in ys.tolist()
        for z in (clear, clear + 0.9)
    ]
    feet = (left, right) if portal else (right,)
    posts = [
        box((-depth - 0.1, y - 0.14, -0.5), (depth + 0.1, y + 0.14, clear + 1.05)) for y in feet
    ]
    plinths = [box((-0.7, y - 0.45, -0.6), (0.7, y + 0.45, 0.25)) for y in feet]
    parts = [Part(merge_meshes([*chord, *lattice, *ties, *posts]), "galvanised")]
    parts.append(Part(merge_meshes(plinths), "kerb"))
    for y, face in boards:
        hung = Transform.from_pose((-depth - 0.06, y, clear + 0.45))
        parts += [Part(hung.mesh(part.mesh), part.material, part.tint) for part in face]
    return parts


def _triangle(half: float) -> Floats:
    """Outline a triangle on its tip with cut corners, counter-clockwise, (6, 2) [m]."""
    tall, cut = half * np.sqrt(3.0), 0.09
    corners = np.array([(-half, tall / 3), (0.0, -2 * tall / 3), (half, tall / 3)])
    points: list[Floats] = []
    for i in range(3):
        before, after = corners[i - 1], corners[(i + 1) % 3]
        points += [
            corners[i] + cut * (before - corners[i]),
            corners[i] + cut * (after - corners[i]),
        ]
    return np.array(points)
