"""What stands at the corners of streets: cabinets, post boxes, columns, parked bicycles.

Frame: origin on the ground in the middle of the foot, +x towards the road, z up. Every
function takes a level of detail: 0 near, 1 beyond 60 m.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from sumo3dviz_pt.library.mesh.solids import box, by_material, moved, tube
from sumo3dviz_pt.library.street.traffic_light import upward
from sumo3dviz_pt.library.vehicles.cycles.bicycle import BicycleRecipe, still_parts
from sumo3dviz_pt.library.vehicles.cycles.parts import FAR, CycleWheel, Fineness, wheel
from sumo3dviz_pt.library.vehicles.parts import MaterialMesh
from sumo3dviz_pt.model.geometry import Colour, Floats, Mesh, Transform, merge_meshes
from sumo3dviz_pt.model.scene import Part

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
    found: list[MaterialMesh] = []
    for x, y, kind, lean in places:
        stand = Transform.from_pose((x, y, -0.01), yaw=np.pi / 2 + 0.03 * lean, roll=0.08 * lean)
        found += [(name, stand.mesh(mesh)) for name, mesh in _bicycle(kind, fine)]
    return [*parts, *(Part(mesh, name) for name, mesh in by_material(found).items())]


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


def coloured(mesh: Mesh, colour: Colour) -> Part:
    """Paint a mesh in one colour."""
    return Part(mesh, "sign", np.tile(colour, (len(mesh.faces), 1)))
