"""What a driver sees of the own cabin: a padded dashboard, pillars, wipers.

Glass and roof are left out, so that nothing hides the road. Instruments and the steering wheel
are made in `controls`, mirrors in `mirrors`.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from sumo3dviz_pt.library.mesh.solids import box, moved, superellipsoid, tube
from sumo3dviz_pt.library.vehicles.interior.controls import (
    binnacle,
    screen,
    screen_lamps,
    sheet,
    tick_lamps,
    wheel,
)
from sumo3dviz_pt.library.vehicles.interior.mirrors import DEEP, inner_mirror
from sumo3dviz_pt.library.vehicles.recipe import MaterialMesh
from sumo3dviz_pt.model.geometry import Floats, Mesh
from sumo3dviz_pt.model.scene import VehicleLamp

_ROWS, _COLUMNS = 64, 200
_DEPTH = 0.44
"""From the windscreen's foot to the dashboard's edge [m]."""

_GRAIN = 0.035
"""Standard deviation of the pad's normals, as a slope."""

_SLOT = (0.10, 0.016)
"""Of the defroster: behind the windscreen's foot and half its depth [m]."""


def cockpit(
    width: float, *, front: float, belt: float, edge: float, eye: Floats, wipers: bool = True
) -> Iterator[MaterialMesh]:
    """Build dashboard, instruments, steering wheel and what stands around the windscreen.

    Args:
        width: Of the body [m].
        front: x of the windscreen's foot [m].
        belt: Height of the dashboard [m].
        edge: Height of the bonnet's rear edge [m].
        eye: The driver's, (3,) [m].
        wipers: Whether there are any; where rain falls, those that move are drawn later.
    """
    half = width / 2.0 - 0.12
    yield "dash_pad", _shelf(half, front=front, belt=belt, edge=edge)
    yield from wheel(eye, belt=belt, large=width > 2.2)
    if wipers:
        yield from _wipers(half, front=front, edge=edge, side=float(np.sign(eye[1]) or 1.0))
    yield from _pillars(half, front=front, belt=belt, eye=eye)
    if eye[2] - belt < DEEP:
        yield from _defroster(half, front=front, belt=belt)
        yield from binnacle(eye, belt=belt, front=front)
        yield from screen(eye, belt=belt)
        yield from inner_mirror(eye)


def desk(
    width: float, *, front: float, belt: float, edge: float, eye: Floats
) -> Iterator[MaterialMesh]:
    """Build what also trains have, a dashboard between its pillars; arguments as in `cockpit`."""
    half = width / 2.0 - 0.12
    yield "dash_pad", _shelf(half, front=front, belt=belt, edge=edge)
    yield from _pillars(half, front=front, belt=belt, eye=eye)


def cockpit_lamps(*, belt: float, eye: Floats) -> tuple[VehicleLamp, ...]:
    """Return what glows at night in a cabin; arguments as in `cockpit`."""
    if eye[2] - belt >= DEEP:
        return ()
    return (*tick_lamps(eye), *screen_lamps(eye))


def _shelf(half: float, *, front: float, belt: float, edge: float) -> Mesh:
    """The dashboard from the bonnet's edge back and down."""
    along = np.linspace(0.0, 1.0, _ROWS)
    y = np.linspace(half, -half, _COLUMNS)
    back = np.interp(along, [0.0, 0.8, 0.93, 1.0], [0.0, _DEPTH, _DEPTH + 0.05, _DEPTH + 0.055])
    rise = np.interp(along, [0.0, 0.12, 0.5, 0.8, 0.93, 1.0], [-0.02, 0.0, 0.006, 0, -0.05, -0.5])
    base = np.interp(along, [0.0, 0.3], [edge, belt]) + rise
    # The middle sinks a little, the corners fall away: flat shelves look like boxes.
    sag = 0.012 * np.cos(np.pi * y / (2 * half)) ** 2 + 0.05 * np.abs(y / half) ** 6
    # A seam runs across the pad.
    seam = 0.004 * np.exp(-(((back - 0.235) / 0.006) ** 2))
    x = np.broadcast_to(front + 0.03 - back[:, None], (_ROWS, _COLUMNS))
    z = base[:, None] - seam[:, None] - sag * (along[:, None] > 0.05)
    points = np.stack([x, np.broadcast_to(y, x.shape), np.maximum(z, 0.2)], axis=-1)
    return _grained(sheet(points))


def _grained(mesh: Mesh) -> Mesh:
    """The same mesh with the fine grain of a soft pad in its normals."""
    assert mesh.normals is not None
    grain = np.random.default_rng(5).normal(scale=_GRAIN, size=mesh.normals.shape)
    normals = mesh.normals + grain
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return Mesh(mesh.vertices, mesh.faces, normals)


def _defroster(half: float, *, front: float, belt: float) -> Iterator[MaterialMesh]:
    """A slot with ribs under the windscreen, and grilles over loudspeakers at its ends."""
    x, z = front + 0.03 - _SLOT[0], belt + 0.002
    reach, deep = 0.72 * half, _SLOT[1]
    yield "gap", box((x - deep, -reach, z - 0.03), (x + deep, reach, z + 0.003))
    for y in np.linspace(-reach, reach, 44)[1:-1]:
        yield "trim", box((x - deep, y - 0.0025, z), (x + deep, y + 0.0025, z + 0.006))
    for low, high in ((deep, deep + 0.006), (-deep - 0.006, -deep)):
        yield "trim", box((x + low, -reach - 0.006, z - 0.03), (x + high, reach + 0.006, z + 0.007))
    for side in (-0.86 * half, 0.86 * half):
        grille = superellipsoid((0.045, 0.06, 0.012), squareness=2.2, segments=20, rings=6)
        yield "trim", moved(grille, x - 0.03, side, z - 0.028)


def _wipers(half: float, *, front: float, edge: float, side: float) -> Iterator[MaterialMesh]:
    """Two wipers at rest on the foot of the windscreen, pivots on the driver's side."""
    x, z = front + 0.01, edge - 0.012
    for pivot, tip in ((0.80 * half, 0.06 * half), (0.02 * half, -0.74 * half)):
        root = np.array([x + 0.01, side * pivot, z])
        end = np.array([x - 0.05, side * tip, z + 0.016])
        middle = 0.45 * root + 0.55 * end + [0.008, 0.0, 0.006]
        yield "trim", tube([root, middle], radius=[0.0065, 0.0045], sides=6)
        way = end - middle
        blade = [middle - 0.75 * way, middle + 0.1 * way + [0, 0, 0.002], end]
        yield "trim", tube(np.array(blade) - [0.012, 0.0, 0.006], radius=0.0055, sides=5)
        knob = superellipsoid((0.014, 0.014, 0.009), squareness=2.5, segments=10, rings=6)
        yield "trim", moved(knob, *root)


def _pillars(half: float, *, front: float, belt: float, eye: Floats) -> Iterator[MaterialMesh]:
    """The lower ends of the windscreen's pillars, leaning back and inwards."""
    for side in (1.0, -1.0):
        foot = np.array([front - 0.1, side * half, belt - 0.08])
        head = np.array([min(eye[0] + 0.3, front - 0.1), side * (half - 0.13), belt + 0.46])
        radius = np.array([0.045, 0.034])
        yield "interior", tube([foot, head], radius=radius, sides=10)
