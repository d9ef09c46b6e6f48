"""A car, a house and a tree beside a road: what skies are shown with."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from sumo3dviz_pt.library.materials.by_key import metres_per_tile, surface_material
from sumo3dviz_pt.library.materials.named import principled
from sumo3dviz_pt.model.geometry import Floats, Mesh, Transform
from sumo3dviz_pt.model.scene import Bsdf, Part
from sumo3dviz_pt.shot.showroom import Exhibit, exhibits

_FAR = 3000.0
_ROAD = (-8.6, -1.6)  # its edges, left of an eye that looks along it [m]
_LINE = "line"

_THINGS = (
    # family, title, place before the eye: ahead, left [m], yaw [rad]
    ("vehicles", "hatchback", (12.0, -3.3), np.pi),
    ("buildings", "homes: plaster", (31.0, 10.0), np.radians(-125.0)),
    ("trees", "lime", (36.0, -19.0), 0.4),
)


def still_life(yaw: float) -> Exhibit:
    """Return everything before an eye at the origin.

    Args:
        yaw: Where the eye looks to, counter-clockwise from east [rad].
    """
    turned = Transform.from_pose((0.0, 0.0, 0.0), yaw=yaw)
    parts: list[Part] = []
    materials: dict[str, Bsdf] = {_LINE: principled((0.62, 0.62, 0.60), roughness=0.45)}
    for name, mesh in _land():
        parts.append(Part(turned.mesh(mesh), name))
        if name != _LINE:
            materials[name] = surface_material(name, textured=True)
    for family, title, (ahead, left), faces in _THINGS:
        shown = next(thing for thing in exhibits(family) if thing.title == title)
        place = turned @ Transform.from_pose((ahead, left, 0.0), yaw=faces)
        parts += [Part(place.mesh(part.mesh), part.material, part.tint) for part in shown.parts]
        materials |= dict(shown.materials)
    return Exhibit("still life", tuple(parts), materials)


def _land() -> Iterator[tuple[str, Mesh]]:
    """Meadow, road and lines by their materials."""
    right, left = _ROAD
    yield "ground_grass", _quad("ground_grass", (-_FAR, _FAR), (-_FAR, _FAR), -0.06)
    yield "asphalt", _quad("asphalt", (-60.0, _FAR), (right, left), 0.0)
    edges = [((-20.0, _FAR), (y - 0.06, y + 0.06)) for y in (right + 0.3, left - 0.3)]
    middle = 0.5 * (right + left)
    dashes = [((x, x + 4.0), (middle - 0.06, middle + 0.06)) for x in np.arange(-6.0, 300.0, 12.0)]
    for ahead, across in (*edges, *dashes):
        yield _LINE, _quad(None, ahead, across, 0.004)


def _quad(
    surface: str | None, ahead: tuple[float, float], across: tuple[float, float], height: float
) -> Mesh:
    """A level rectangle [m], with the texture coordinates of a surface."""
    x, y = np.array([0, 1, 1, 0]), np.array([0, 0, 1, 1])
    places: Floats = np.column_stack([np.array(ahead)[x], np.array(across)[y]])
    uvs = None if surface is None else places / metres_per_tile(surface)
    corners = np.column_stack([places, np.full(4, height)])
    return Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]]), None, uvs)
