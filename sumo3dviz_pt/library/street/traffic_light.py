"""Traffic lights: heads of stacked lamps, what they show, and what carries them.

Frame of a head: origin below the middle of its housing, the lenses look to -x, that
is, towards traffic that drives to +x; +y is that traffic's left.

Besides discs, lamps show standing and walking people, and digits of seven bars, in the plane of a
lens.

References:
    Lenses of 200 mm, housings of 300 mm per lamp: EN 12368.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from sumo3dviz_pt.library.mesh.solids import box, lathe, prism, shaded, tube
from sumo3dviz_pt.library.street.strokes import disc, fan, upright
from sumo3dviz_pt.model.geometry import Floats, Mesh, Transform, merge_meshes

HOUSING = 0.30
"""Height of the housing of one lamp [m]."""
WIDTH = 0.28
"""Width of a housing [m]."""
RADIUS = 0.10
"""Of a lens [m]."""
FRONT = -0.10
"""Where the front of a housing lies, along x [m]."""

# Of the backing board: half its width, its rim above and below the head, and its front [m].
_BOARD_HALF, _BOARD_RIM, _BOARD_FRONT = 0.25, 0.11, -0.03


def housing(lamps: int, *, backing: bool = True, counter: bool = False, level: int = 0) -> Mesh:
    """Build the dark body of a head with hoods, and the board behind it.

    Args:
        lamps: How many lamps are stacked.
        backing: Whether a black board stands around the head.
        counter: Whether a box for digits stands on top of it.
        level: 0 near, 1 beyond 150 m.
    """
    boxes = lamps + counter
    tall = HOUSING * boxes
    parts = [_case(HOUSING * i, level) for i in range(boxes)]
    if backing:
        wide, high = 2 * _BOARD_HALF, tall + 2 * _BOARD_RIM
        back = _BOARD_FRONT + 0.015
        parts.append(plate(wide, high, front=_BOARD_FRONT, back=back, z=tall / 2))
    for i in range(lamps):
        middle = HOUSING * (i + 0.5)
        parts.append(_visor(middle, 12 if level == 0 else 5))
        if level == 0:
            parts.append(_rim(middle))
    if counter:
        roof, half_width = tall - 0.012, WIDTH / 2
        parts.append(box((FRONT - 0.11, -half_width, roof), (FRONT, half_width, roof + 0.008)))
    return merge_meshes(parts)


def border(lamps: int) -> Mesh:
    """Build the white edge of the backing board: an open ring that looks to -x."""
    tall = HOUSING * lamps
    wide, high = 2 * _BOARD_HALF, tall + 2 * _BOARD_RIM
    outer = rounded(wide, high, radius=0.05)
    inner = rounded(wide - 0.06, high - 0.06, radius=0.03)
    count = len(outer)
    ring = np.vstack([outer, inner])
    vertices = np.column_stack([np.full(2 * count, _BOARD_FRONT - 0.004), -ring[:, 0], ring[:, 1]])
    vertices[:, 2] += tall / 2
    i, after = np.arange(count), (np.arange(count) + 1) % count
    faces = np.concatenate(
        [np.stack([i, after, after + count], 1), np.stack([i, after + count, i + count], 1)]
    )
    return Mesh(vertices, faces, np.tile([-1.0, 0.0, 0.0], (2 * count, 1)))


def bracket(lamps: int, *, reach: float = 0.17) -> Mesh:
    """Build two short arms from a head's back to the pole behind it, `reach` away [m]."""
    heights = (0.07, HOUSING * lamps - 0.07)
    return merge_meshes(
        [tube([(0.06, 0, z), (reach, 0, z)], radius=0.022, sides=6) for z in heights]
    )


def hanger(lamps: int, top: float, *, reach: float = 0.19) -> Mesh:
    """Build the bar behind a head that hangs on an arm.

    Args:
        lamps: How many lamps the head has.
        top: Height of the arm above the head's foot [m].
        reach: From the head's middle to the bar [m].
    """
    upright = tube([(reach, 0, 0.12), (reach, 0, top)], radius=0.03, sides=8)
    return merge_meshes([bracket(lamps, reach=reach), upright])


def lens(index: int, *, segments: int = 16) -> Mesh:
    """Build a domed disc; index 0 is the lowest lamp."""
    cap = segments // 2
    z = HOUSING * (index + 0.5)
    rings = [(RADIUS, -0.106, segments), (0.58 * RADIUS, -0.122, cap)]
    vertices = []
    for radius, x, count in rings:
        turn = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
        vertices.append(
            np.column_stack([np.full(count, x), -radius * np.sin(turn), z + radius * np.cos(turn)])
        )
    faces = [(segments, segments + k, segments + k + 1) for k in range(1, cap - 1)]
    for k in range(cap):
        near, after = segments + k, segments + (k + 1) % cap
        a, b, c = 2 * k, 2 * k + 1, (2 * k + 2) % segments
        faces += [(near, a, b), (near, b, after), (after, b, c)]
    points = np.concatenate(vertices)
    normals = points - np.array([0.26, 0.0, z])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return Mesh(points, np.array(faces)[:, ::-1], normals)


def pole(height: float, *, radius: float = 0.055, level: int = 0) -> Mesh:
    """Build an upright pole from 0.5 m below the ground, with a collar at its foot.

    Args:
        height: Above the ground [m].
        radius: [m].
        level: 0 near, 1 farther away: without the foot.
    """
    if level:
        return tube(np.array([(0, 0, -0.5), (0, 0, height)], float), radius=radius, sides=6)
    upright = upward(
        [(0.0, -0.5), (radius, -0.5), (radius, height - 0.02), (0.6 * radius, height), (0, height)]
    )
    return merge_meshes([upright, foot(radius)])


def foot(radius: float) -> Mesh:
    """Build base plate, bolts and collar of a pole of a radius [m]."""
    half = 2.6 * radius
    plate_ = box((-half, -half, -0.1), (half, half, 0.02))
    bolts = [
        box((x - 0.015, y - 0.015, 0.0), (x + 0.015, y + 0.015, 0.05))
        for x in (-0.75 * half, 0.75 * half)
        for y in (-0.75 * half, 0.75 * half)
    ]
    collar = upward(
        [
            (0.0, 0.0),
            (1.7 * radius, 0.0),
            (1.55 * radius, 0.1),
            (1.02 * radius, 0.16),
            (0.0, 0.16),
        ]
    )
    return merge_meshes([plate_, collar, *bolts])


def mast(height: float, reach: float, *, radius: float = 0.09, level: int = 0) -> Mesh:
    """Build a pole with an arm over the road.

    Args:
        height: Of the arm above the ground [m].
        reach: How long the arm is [m]; positive to the left (+y), negative to the right.
        radius: Of the pole [m].
        level: 0 near, 1 farther away: without foot and door.
    """
    side = float(np.sign(reach))
    turn = np.linspace(0.0, np.pi / 2, 3 if level else 6)
    # Laid out along +x, where `tube` has a frame for every point, and turned.
    bend = np.column_stack(
        [0.55 * (1.0 - np.cos(turn)), 0.0 * turn, height - 0.55 + 0.55 * np.sin(turn)]
    )
    path = np.vstack([bend, [[abs(reach), 0.0, height]]])
    radii = np.linspace(0.95, 0.78, len(path)) * radius
    radii[-1] = 0.5 * radius
    upright = tube(
        np.array([(0, 0, -0.5), (0, 0, height - 0.55)], float),
        radius=(1.15 * radius, 0.95 * radius),
        sides=6 if level else 14,
    )
    arm = placed(tube(path, radius=radii, sides=5 if level else 10), (0, 0, 0), side * np.pi / 2)
    if level:
        return merge_meshes([upright, arm])
    door = box((0.7 * radius, -0.05, 0.55), (1.2 * radius, 0.05, 1.0))
    return merge_meshes([upright, arm, foot(radius * 1.1), door])


def crossbar(width: float, height: float) -> Mesh:
    """Build a level bar that several heads hang on, `width` between the outer ones [m]."""
    ends = np.array([(-0.02, -width / 2, height), (-0.02, width / 2, height)], float)
    return tube(ends, radius=0.03, sides=8)


def placed(mesh: Mesh, position: Sequence[float] | Floats, yaw: float) -> Mesh:
    """Turn a mesh and move it.

    Args:
        mesh: About the origin.
        position: Where to, (3,) [m].
        yaw: By which angle [rad].
    """
    return Transform.from_pose(np.asarray(position), yaw=yaw).mesh(mesh)


def upward(profile: Sequence[Sequence[float]], *, segments: int = 12) -> Mesh:
    """Turn a profile of (radius, z) pairs [m], from foot to top, around the z axis."""
    body = lathe(profile, segments=segments)
    # `lathe` turns around y; z takes its place.
    swap = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
    normals = None if body.normals is None else body.normals @ swap.T
    return Mesh(body.vertices @ swap.T, body.faces, normals)


def rounded(width: float, height: float, *, radius: float, steps: int = 3) -> Floats:
    """Outline a rectangle with round corners around the origin, counter-clockwise, (n, 2) [m].

    Args:
        width: [m].
        height: [m].
        radius: Of the corners [m].
        steps: Pieces of a corner.
    """
    turn = np.linspace(0.0, np.pi / 2, steps + 1)
    corners = []
    for k, (x, y) in enumerate([(1, 1), (-1, 1), (-1, -1), (1, -1)]):
        centre = np.array([x * (width / 2 - radius), y * (height / 2 - radius)])
        angle = turn + k * np.pi / 2
        corners.append(centre + radius * np.column_stack([np.cos(angle), np.sin(angle)]))
    return np.vstack(corners)


def plate(width: float, height: float, *, front: float, back: float, z: float) -> Mesh:
    """Build an upright board with round corners.

    Args:
        width: Along y [m].
        height: [m].
        front: Its lower x [m].
        back: Its higher x [m].
        z: Height of its middle [m].
    """
    outline = rounded(width, height, radius=min(0.05, 0.2 * width))
    board = prism(outline.tolist(), half_width=(back - front) / 2, crease=0.9)
    turned = Transform.from_pose(((front + back) / 2, 0.0, z), yaw=np.pi / 2)
    return turned.mesh(board)


def _case(z: float, level: int) -> Mesh:
    """Build the housing of one lamp, rounded, from a height on [m]."""
    if level:
        return box((FRONT, -WIDTH / 2, z), (0.08, WIDTH / 2, z + HOUSING))
    outline = rounded(WIDTH, HOUSING - 0.006, radius=0.035)
    case = prism(outline.tolist(), half_width=0.09, crease=0.9)
    return Transform.from_pose((-0.01, 0.0, z + HOUSING / 2), yaw=np.pi / 2).mesh(case)


def _rim(z: float) -> Mesh:
    """Build the dark ring around a lens."""
    ring = lathe(
        [(RADIUS * 0.97, 0.0), (RADIUS * 0.99, 0.014), (0.119, 0.014), (0.124, 0.0)][::-1],
        segments=20,
        crease=0.9,
    )
    # `lathe` turns around y; a quarter turn makes that -x.
    turned = Transform.from_pose((FRONT, 0.0, z), yaw=np.pi / 2)
    return turned.mesh(ring)


def _visor(z: float, pieces: int) -> Mesh:
    """Build a hood over a lens: part of a cylinder with an inside, deepest on top."""
    turn = np.linspace(np.radians(-25), np.radians(205), pieces + 1)
    depth = 0.05 + 0.19 * np.clip(0.25 + 0.75 * np.sin(turn), 0.0, 1.0)
    rows = [
        (0.128, np.full(len(turn), FRONT)),
        (0.128, FRONT - depth),
        (0.124, FRONT - depth),
        (0.124, np.full(len(turn), FRONT)),
    ]
    vertices = np.stack(
        [np.column_stack([x, r * np.cos(turn), z + r * np.sin(turn)]) for r, x in rows]
    )
    count = len(turn)
    i = np.arange(pieces)
    quads = [(0, 1), (1, 2), (2, 3)]
    faces = [
        np.column_stack(
            [*(k * count + i for k in (a, b)), b * count + i + 1]
            if first
            else [a * count + i, b * count + i + 1, a * count + i + 1]
        )
        for a, b in quads
        for first in (True, False)
    ]
    return shaded(vertices.reshape(-1, 3), np.concatenate(faces), crease=0.9)


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
