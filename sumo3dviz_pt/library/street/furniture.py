"""What stands on sidewalks and corners: lamps, bollards, bins, benches, cabinets, shelters.

Frame: origin on the ground in the middle of the foot, +x towards the road, z up. Functions take a
level of detail: 0 near, 1 beyond 60 m; those of lamps also 2, beyond 150 m. A street lamp is a
tapered pole, an arm over the kerb, and a flat head of light-emitting diodes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import pairwise

import numpy as np

from sumo3dviz_pt.library.materials import coloured
from sumo3dviz_pt.library.mesh.solids import box, by_material, moved, prism, superellipsoid, tube
from sumo3dviz_pt.library.street.lettering import lettering
from sumo3dviz_pt.library.street.traffic_light import foot, upward
from sumo3dviz_pt.library.vehicles.cycles.bicycle import BicycleRecipe, still_parts
from sumo3dviz_pt.library.vehicles.cycles.parts import FAR, CycleWheel, Fineness, wheel
from sumo3dviz_pt.library.vehicles.recipe import MaterialMesh
from sumo3dviz_pt.model.geometry import Colour, Floats, Mesh, Transform, merge_meshes
from sumo3dviz_pt.model.scene import Part

LENS = (0.60, 0.24)
"""Size of the area that shines: across the road and along it [m]."""

REACH = 1.5
"""From the pole to the middle of the lens [m]."""


def pole(height: float, *, level: int = 0) -> Mesh:
    """Build pole, arm and the case of the head; the lens hangs below at a height [m].

    Args:
        height: Of the lens above the foot [m].
        level: 0 near, 1 beyond 60 m, 2 beyond 150 m.
    """
    sides = (12, 7, 4)[level]
    bend = np.linspace(0.0, np.pi / 2, (6, 3, 2)[level])
    top, radius = height + 0.05, 0.55
    arm = [
        *(
            (radius * (1 - np.cos(t)), 0.0, top - radius + radius * np.sin(t))
            for t in bend.tolist()
        ),
        (REACH - 0.25, 0.0, top),
    ]
    radii = np.linspace(0.046, 0.03, len(arm))
    parts = [tube(arm, radius=radii, sides=sides)]
    if level == 0:
        profile = [(0.0, -0.5), (0.085, -0.5), (0.085, 1.2), (0.07, 1.3), (0.046, top - radius)]
        parts += [upward([*profile, (0.0, top - radius)], segments=sides), foot(0.085)]
        parts.append(box((-0.095, -0.045, 0.5), (-0.06, 0.045, 0.95)))
    else:
        ends = [(0.0, 0.0, -0.5), (0.0, 0.0, top - radius)]
        parts.append(tube(ends, radius=(0.085, 0.046), sides=sides))
    return merge_meshes(parts)


def head(height: float, *, level: int = 0) -> Mesh:
    """Build the case over the lens, thin towards its tip."""
    back, tip = REACH - 0.42, REACH + 0.36
    low = height + 0.006
    if level == 2:
        return box((back, -0.13, low), (tip, 0.13, height + 0.09))
    outline = [
        (back, low),
        (tip, low),
        (tip + 0.02, low + 0.02),
        (REACH + 0.1, height + 0.07),
        (back + 0.1, height + 0.11),
        (back, height + 0.09),
    ]
    return prism(outline, half_width=0.145, crease=0.5)


def lens(height: float) -> Mesh:
    """Build the area that shines, looking down, of two triangles."""
    u, v = LENS[0] / 2, LENS[1] / 2
    corners = [(REACH - u, -v), (REACH - u, v), (REACH + u, v), (REACH + u, -v)]
    vertices = np.array([(x, y, height) for x, y in corners])
    return Mesh(vertices, np.array([[0, 1, 2], [0, 2, 3]]), np.tile([0.0, 0.0, -1.0], (4, 1)))


_GREY: Colour = (0.2, 0.215, 0.2)
_PLINTH: Colour = (0.3, 0.295, 0.28)
_GAP: Colour = (0.02, 0.02, 0.02)
_YELLOW: Colour = (0.55, 0.33, 0.012)
_GREEN: Colour = (0.02, 0.06, 0.045)
_POSTERS: tuple[Colour, ...] = (
    (0.42, 0.09, 0.06),
    (0.5, 0.48, 0.4),
    (0.05, 0.16, 0.3),
    (0.52, 0.36, 0.07),
    (0.1, 0.2, 0.12),
    (0.45, 0.45, 0.44),
    (0.2, 0.07, 0.16),
)

_PARKED = Fineness(18, 10, 5, True)
_WHEEL, _AXLES = CycleWheel(0.342, 0.019), (-0.342, -1.372)
_FRAMES = ("enamel_black", "enamel_green", "enamel_red")


def cabinet(level: int = 0) -> list[Part]:
    """Build a cabinet of the power company: two doors on a plinth under a lid."""
    body = box((-0.16, -0.55, 0.12), (0.16, 0.55, 1.14))
    lid = box((-0.18, -0.57, 1.14), (0.18, 0.57, 1.18))
    plinth = box((-0.17, -0.56, -0.3), (0.17, 0.56, 0.12))
    parts = [coloured(merge_meshes([body, lid]), _GREY), coloured(plinth, _PLINTH)]
    if level == 0:
        # The joint of the doors, their slits for air, and a handle.
        cuts = [box((0.158, -0.05 - 0.004, 0.15), (0.1615, -0.05 + 0.004, 1.11))]
        cuts += [box((0.158, a, z), (0.1615, b, z + 0.012))
                 for a, b in ((-0.45, -0.2), (0.15, 0.4))
                 for z in (0.95, 0.98, 1.01)]  # fmt: skip
        cuts.append(box((0.16, 0.02, 0.62), (0.18, 0.045, 0.74)))
        stickers = [box((0.159, -0.4, 0.55), (0.1618, -0.22, 0.72)),
                    box((0.159, 0.28, 0.4), (0.1618, 0.37, 0.5))]  # fmt: skip
        parts.append(coloured(merge_meshes(cuts), _GAP))
        parts += [
            coloured(sticker, colour)
            for sticker, colour in zip(stickers, (_POSTERS[1], _POSTERS[2]), strict=True)
        ]
    return parts


def post_box(level: int = 0) -> list[Part]:
    """Build a letter box with its slot, on a post."""
    body = box((-0.19, -0.24, 0.62), (0.19, 0.24, 1.28))
    roof = box((-0.21, -0.26, 1.28), (0.22, 0.26, 1.33))
    post = box((-0.07, -0.09, -0.3), (0.07, 0.09, 0.62))
    parts = [coloured(merge_meshes([body, roof]), _YELLOW), coloured(post, _GREY)]
    if level == 0:
        slot = box((0.188, -0.17, 1.13), (0.1925, 0.17, 1.165))
        flap = box((0.188, -0.2, 1.165), (0.215, 0.2, 1.18))
        sheet = box((0.188, -0.13, 0.78), (0.192, 0.13, 1.02))
        parts += [coloured(slot, _GAP), coloured(flap, _YELLOW), coloured(sheet, _POSTERS[5])]
    return parts


def advertising_column(level: int = 0) -> list[Part]:
    """Build a round column of 3.6 m with posters, its foot and its hat."""
    sides = 12 if level else 30
    foot = [(0.0, -0.3), (0.66, -0.3), (0.66, 0.3), (0.62, 0.34), (0.0, 0.34)]
    trunk = [(0.0, 0.34), (0.6, 0.34), (0.6, 3.0), (0.0, 3.0)]
    hat = [(0.0, 3.0), (0.66, 3.0), (0.72, 3.06), (0.72, 3.14), (0.6, 3.2), (0.5, 3.36),
           (0.2, 3.5), (0.05, 3.56), (0.0, 3.56)]  # fmt: skip
    parts = [
        coloured(upward(foot, segments=sides), _PLINTH),
        coloured(upward(trunk, segments=sides), _POSTERS[1]),
        coloured(upward(hat, segments=sides), _GREEN),
    ]
    for k in range(18):
        turn, tall = 2.0 * np.pi * (k % 9) / 9.0, 1.16 if k % 4 else 0.84
        low = 0.42 + (1.28 if k > 8 else 0.0)
        sheet = _sheet(0.606, (turn, turn + 0.64), (low, low + tall))
        parts.append(coloured(sheet, _POSTERS[5 * k % len(_POSTERS)]))
    return parts


def bicycle_stand(level: int = 0) -> list[Part]:
    """Build two hoops in a row along the road, with bicycles leaning on them."""
    hoops = [_hoop(y, 4 if level else 8) for y in (-1.1, 1.1)]
    parts = [Part(merge_meshes(hoops), "galvanised")]
    # Side of the hoop, where the front wheel ends, number of the bicycle, to which side it leans.
    places = ((0.13, -0.22, 0, -1.0), (-0.13, 1.98, 1, 1.0), (0.14, 2.06, 2, -1.0))
    fine = FAR if level else _PARKED
    meshes: list[MaterialMesh] = []
    for x, y, kind, lean in places:
        stand = Transform.from_pose((x, y, -0.01), yaw=np.pi / 2 + 0.03 * lean, roll=0.08 * lean)
        meshes += [(name, stand.mesh(mesh)) for name, mesh in _bicycle(kind, fine)]
    return [*parts, *(Part(mesh, name) for name, mesh in by_material(meshes).items())]


def _bicycle(kind: int, fine: Fineness) -> Iterator[MaterialMesh]:
    """A bicycle that nobody rides, in metres behind the front of its wheel."""
    recipe = BicycleRecipe(frame=_FRAMES[kind], step_through=kind == 1, sporty=kind == 2)
    yield from still_parts(recipe, fine)
    for x in _AXLES:
        stand = Transform.from_pose((x, 0.0, _WHEEL.radius))
        yield from ((name, stand.mesh(mesh)) for name, mesh in wheel(_WHEEL, fine))


def _hoop(y: float, bends: int) -> Mesh:
    """Bend a tube along the y axis."""
    turn = np.linspace(np.pi, 0.0, bends)
    top = np.column_stack([np.zeros(bends), 0.22 * np.cos(turn), 0.58 + 0.22 * np.sin(turn)])
    path: Floats = np.concatenate([[[0.0, -0.22, -0.3]], top, [[0.0, 0.22, -0.3]]])
    return moved(tube(path, radius=0.024, sides=6), 0.0, y, 0.0)


def _sheet(radius: float, turns: tuple[float, float], heights: tuple[float, float]) -> Mesh:
    """Build a poster around a column."""
    turn = np.linspace(*turns, 6)
    ring = np.column_stack([np.cos(turn), np.sin(turn)])
    rows = [np.column_stack([radius * ring, np.full(6, z)]) for z in heights]
    low = np.arange(5)
    faces = np.concatenate(
        [np.stack([low, low + 1, low + 7], axis=1), np.stack([low, low + 7, low + 6], axis=1)]
    )
    normals = np.tile(np.column_stack([ring, np.zeros(6)]), (2, 1))
    return Mesh(np.concatenate(rows), faces, normals)


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
    "cabinet": cabinet,
    "post_box": post_box,
    "advertising_column": advertising_column,
    "bicycle_stand": bicycle_stand,
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
