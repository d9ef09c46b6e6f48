"""What a driver sees of the own cabin: a padded dashboard, the instruments' hood, the wheel.

Glass, roof and pillars are left out, so that nothing hides the road.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from sumo3dviz_pt.model.geometry import Floats, Mesh
from sumo3dviz_pt.shapes.solids import tube

Piece = tuple[str, Mesh]
"""Material and mesh."""

_ROWS, _COLUMNS = 22, 61
_DEPTH = 0.44
"""From the windscreen's foot to the dashboard's edge [m]."""

_HOOD = 0.075
"""Height of the instruments' hood over the dashboard [m]."""

_LEAN = np.radians(24.0)
"""Of the wheel's rim, from upright."""


def cockpit(
    width: float, *, front: float, belt: float, edge: float, eye: Floats
) -> Iterator[Piece]:
    """Dashboard and steering wheel of a cabin.

    Args:
        width: Of the body [m].
        front: x of the windscreen's foot [m].
        belt: Height of the dashboard [m].
        edge: Height of the bonnet's rear edge [m].
        eye: The driver's, (3,) [m].
    """
    half = width / 2.0 - 0.12
    yield "interior", _shelf(half, front=front, belt=belt, edge=edge, driver=float(eye[1]))
    yield from _wheel(eye, belt=belt, large=width > 2.2)


def _shelf(half: float, *, front: float, belt: float, edge: float, driver: float) -> Mesh:
    """The dashboard from the bonnet's edge back and down, swelling before the driver."""
    along = np.linspace(0.0, 1.0, _ROWS)
    y = np.linspace(half, -half, _COLUMNS)
    back = np.interp(along, [0.0, 0.8, 0.93, 1.0], [0.0, _DEPTH, _DEPTH + 0.05, _DEPTH + 0.055])
    rise = np.interp(along, [0.0, 0.12, 0.8, 0.93, 1.0], [-0.02, 0.0, 0.0, -0.05, -0.5])
    base = np.interp(along, [0.0, 0.3], [edge, belt]) + rise
    share = np.exp(-(((y - driver) / 0.19) ** 4))
    swell = np.interp(along, [0.25, 0.5, 0.8, 0.93], [0.0, 0.7, 1.0, 0.0])
    # The middle sinks a little, the corners fall away: flat shelves look like boxes.
    sag = 0.012 * np.cos(np.pi * y / (2 * half)) ** 2 + 0.05 * np.abs(y / half) ** 6
    x = np.broadcast_to(front + 0.03 - back[:, None], (_ROWS, _COLUMNS))
    z = base[:, None] + _HOOD * swell[:, None] * share - sag * (along[:, None] > 0.05)
    points = np.stack([x, np.broadcast_to(y, x.shape), np.maximum(z, 0.2)], axis=-1)
    return _sheet(points)


def _wheel(eye: Floats, *, belt: float, large: bool) -> Iterator[Piece]:
    """The steering wheel before the driver: rim, hub and three spokes."""
    radius = 0.23 if large else 0.187
    centre = np.array([eye[0] + 0.46, eye[1], min(belt - 0.04, eye[2] - 0.30)])
    across = np.array([0.0, 1.0, 0.0])
    up = np.array([np.sin(_LEAN), 0.0, np.cos(_LEAN)])
    yield "trim", _rim(centre, across=radius * across, up=radius * up, thick=0.0155)
    for angle in (np.pi / 2, np.pi, 3 * np.pi / 2):
        out = np.sin(angle) * across + np.cos(angle) * up
        yield "trim", tube(np.stack([centre, centre + radius * out]), radius=0.013, sides=7)
    hub = np.stack([centre - 0.035 * np.cross(across, up), centre])
    yield "interior", tube(hub, radius=0.06, sides=16)


def _rim(centre: Floats, *, across: Floats, up: Floats, thick: float) -> Mesh:
    """A ring of round section; `across` and `up` reach from its centre to its middle line."""
    turn = np.linspace(0.0, 2.0 * np.pi, 49)[:, None, None]
    section = np.linspace(0.0, 2.0 * np.pi, 10)[None, :, None]
    radius = float(np.linalg.norm(up))
    out = (np.sin(turn) * across + np.cos(turn) * up) / radius
    axis = np.cross(across, up) / radius**2
    normals = np.cos(section) * out - np.sin(section) * axis
    return _sheet(centre + radius * out + thick * normals, normals=normals)


def _sheet(points: Floats, *, normals: Floats | None = None) -> Mesh:
    """A smooth surface through a grid of points, (n, m, 3), facing rows x columns."""
    rows, columns = points.shape[:2]
    index = np.arange(rows * columns).reshape(rows, columns)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]
    faces = np.concatenate([np.stack(t, -1).reshape(-1, 3) for t in ((a, d, c), (a, c, b))])
    if normals is None:
        down, right = np.gradient(points, axis=0), np.gradient(points, axis=1)
        normals = np.cross(down, right)
        normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    return Mesh(points.reshape(-1, 3), faces, normals.reshape(-1, 3))
