"""What a driver sees of the own cabin: a padded dashboard, its vents and seams, wipers.

Glass is left out, so that nothing hides the road. Instruments and the steering wheel are made in
`controls`, the screen in `screen`, mirrors in `mirrors`, roof, pillars and doors in `shell`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.library.mesh.noise import smoothstep
from sumo3dviz_pt.library.mesh.solids import bevelled, box, by_material, moved, superellipsoid, tube
from sumo3dviz_pt.library.vehicles.interior.controls import binnacle, tick_lamps, wheel
from sumo3dviz_pt.library.vehicles.interior.flats import sheet, stitches
from sumo3dviz_pt.library.vehicles.interior.mirrors import DEEP, inner_mirror
from sumo3dviz_pt.library.vehicles.interior.screen import screen, screen_lamps, screen_middle
from sumo3dviz_pt.library.vehicles.interior.shell import pillar
from sumo3dviz_pt.library.vehicles.recipe import MaterialMesh
from sumo3dviz_pt.model.geometry import Floats, Mesh
from sumo3dviz_pt.model.scene import VehicleLamp

_ROWS, _COLUMNS = 58, 170
_DEPTH = 0.44
"""From the windscreen's foot to the dashboard's edge [m]."""

_BOW = 0.1
"""By how much the windscreen's foot bends back at its ends [m]."""

_GRAIN = 0.035
"""Standard deviation of the pad's normals, as a slope."""

_SLOT = (0.085, 0.014)
"""Of the defroster: behind the windscreen's foot and half its depth [m]."""

_SEAM = 0.165
"""Of the stitched seam, behind the windscreen's foot [m]."""

_PITCH = 0.0085
"""From a stitch to the next [m]."""


@dataclass(frozen=True, slots=True)
class _Pad:
    """The form of a dashboard's upper side.

    Attributes:
        half: Half its width [m].
        front: x of the windscreen's foot [m].
        belt: Its height [m].
        edge: Height of the bonnet's rear edge [m].
    """

    half: float
    front: float
    belt: float
    edge: float

    def points(self, back: Floats, y: Floats) -> Floats:
        """Return where points lie behind its front edge, (..., 3) [m].

        Args:
            back: From the windscreen's foot, measured on the vehicle's axis [m].
            y: To the left [m].
        """
        back, y = np.broadcast_arrays(np.asarray(back, np.float64), np.asarray(y, np.float64))
        aside = np.abs(y / self.half)
        # The glass is bent: its foot lies farther back at the sides, the rear edge does not.
        bend = _BOW * aside**3 * np.clip(1.0 - back / _DEPTH, 0.0, 1.0)
        rise = np.interp(
            back,
            [0.0, 0.06, 0.22, 0.36, _DEPTH, 0.475, _DEPTH + 0.05, _DEPTH + 0.055],
            [-0.012, -0.004, 0.004, 0.004, 0.0, -0.014, -0.05, -0.5],
        )
        base = self.edge + (self.belt - self.edge) * smoothstep(0.0, 0.16, back)
        # The middle sinks a little, the corners fall away: flat shelves look like boxes.
        sag = 0.012 * np.cos(0.5 * np.pi * aside) ** 2 + 0.03 * aside**6
        seam = 0.0035 * np.exp(-(((back - _SEAM) / 0.004) ** 2))
        z = base + rise - seam - sag * smoothstep(0.01, 0.08, back)
        return np.stack([self.front + 0.03 - back - bend, y, np.maximum(z, 0.2)], axis=-1)


def cockpit(
    width: float, *, front: float, belt: float, edge: float, eye: Floats, wipers: bool = True
) -> Iterator[MaterialMesh]:
    """Build dashboard, instruments, steering wheel and what lies at the windscreen's foot.

    Args:
        width: Of the body [m].
        front: x of the windscreen's foot [m].
        belt: Height of the dashboard [m].
        edge: Height of the bonnet's rear edge [m].
        eye: The driver's, (3,) [m].
        wipers: Whether there are any; where rain falls, those that move are drawn later.
    """
    pad = _Pad(half_dashboard(width), front, belt, edge)
    yield "dash_pad", _shelf(pad)
    yield from wheel(eye, belt=belt, large=width > 2.2)
    yield from _scuttle(pad)
    if wipers:
        yield from _wipers(pad, side=float(np.sign(eye[1]) or 1.0))
    if eye[2] - belt < DEEP:
        yield "stitch", _seam(pad)
        yield from by_material((*_defroster(pad), *_vents(pad, eye))).items()
        yield from binnacle(eye, belt=belt, front=front)
        yield from by_material(screen(eye, belt=belt)).items()
        yield from inner_mirror(eye)


def desk(
    width: float, *, front: float, belt: float, edge: float, eye: Floats
) -> Iterator[MaterialMesh]:
    """Build what also trains have, a dashboard between its pillars; arguments as in `cockpit`."""
    half = half_dashboard(width)
    yield "dash_pad", _shelf(_Pad(half, front, belt, edge))
    head = min(float(eye[0]) + 0.3, front - 0.1)
    for side in (1.0, -1.0):
        foot = (front - 0.1, side * half, belt - 0.08)
        yield "interior", pillar(foot, (head, side * (half - 0.13), belt + 0.46))


def half_dashboard(width: float) -> float:
    """Return half the width of a dashboard in a body of a width [m]."""
    return width / 2.0 - 0.12


def cockpit_lamps(*, belt: float, eye: Floats) -> tuple[VehicleLamp, ...]:
    """Return what glows at night in a cabin; arguments as in `cockpit`."""
    if eye[2] - belt >= DEEP:
        return ()
    return (*tick_lamps(eye), *screen_lamps(eye))


def _shelf(pad: _Pad) -> Mesh:
    """The dashboard from the bonnet's edge back and down."""
    front = np.linspace(0.0, 0.36, _ROWS - 16)
    back = np.concatenate([front, np.linspace(0.37, _DEPTH + 0.05, 14), [0.492, _DEPTH + 0.055]])
    y = np.linspace(pad.half, -pad.half, _COLUMNS)
    return _grained(sheet(pad.points(back[:, None], y)))


def _grained(mesh: Mesh) -> Mesh:
    """The same mesh with the fine grain of a soft pad in its normals."""
    assert mesh.normals is not None
    grain = np.random.default_rng(5).normal(scale=_GRAIN, size=mesh.normals.shape)
    normals = mesh.normals + grain
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return Mesh(mesh.vertices, mesh.faces, normals)


def _seam(pad: _Pad) -> Mesh:
    """The thread of the seam across the pad."""
    y = np.arange(-0.9 * pad.half, 0.9 * pad.half, _PITCH)
    row = pad.points(np.array(_SEAM - 0.006), y)
    out = np.broadcast_to([0.0, 0.0, 1.0], row.shape)
    return stitches(row + 0.0008 * out, out, size=(0.0026, 0.0009))


def _scuttle(pad: _Pad) -> Iterator[MaterialMesh]:
    """The black tray between bonnet and glass, under what the bent glass leaves free."""
    low = (pad.front - _BOW - 0.06, -pad.half - 0.04, pad.edge - 0.06)
    high = (pad.front + 0.05, pad.half + 0.04, pad.edge - 0.03)
    yield "trim", bevelled(low, high, bevel=0.006)


def _defroster(pad: _Pad) -> Iterator[MaterialMesh]:
    """A slot with slats under the windscreen, and grilles over loudspeakers at its ends."""
    reach, (at, deep) = 0.92 * pad.half, _SLOT
    y = np.linspace(reach, -reach, 72)
    lifted = np.array([0.0, 0.0, 0.0012])
    yield "gap", sheet(pad.points(np.array([[at - deep], [at + deep]]), y) + lifted)
    for left in np.linspace(-reach, reach, 72)[1:-1]:
        slat = pad.points(np.array([at - deep, at + deep]), np.array(left)) + 2.0 * lifted
        yield "trim", tube(slat, radius=0.0016, sides=4)
    for back in (at - deep, at + deep):
        yield "trim", tube(pad.points(np.array(back), y) + lifted, radius=0.0032, sides=6)
    for left in (-0.87 * pad.half, 0.87 * pad.half):
        grille = superellipsoid((0.045, 0.055, 0.008), squareness=2.2, segments=24, rings=6)
        yield "trim", moved(grille, *pad.points(np.array(at + 0.085), np.array(left)))


def _vents(pad: _Pad, eye: Floats) -> Iterator[MaterialMesh]:
    """Vents with slats in the dashboard's face: two in the middle, one at each end."""
    x = pad.front + 0.03 - _DEPTH - 0.048
    middle = float(screen_middle(eye)[1])
    for y, wide in (
        (middle + 0.075, 0.062),
        (middle - 0.075, 0.062),
        (pad.half - 0.13, 0.05),
        (0.13 - pad.half, 0.05),
    ):
        place = (x, y, pad.belt - 0.105)
        frame = bevelled((-0.006, -wide, -0.032), (0.03, wide, 0.032), bevel=0.004)
        yield "trim", moved(frame, *place)
        dark = box((-0.0068, -wide + 0.007, -0.026), (0.0, wide - 0.007, 0.026))
        yield "gap", moved(dark, *place)
        for up in (-0.017, -0.006, 0.005, 0.016):
            slat = bevelled(
                (-0.011, 0.008 - wide, up), (0.0, wide - 0.008, up + 0.003), bevel=0.001
            )
            yield "trim", moved(slat, *place)
        yield "chrome", moved(box((-0.013, -0.006, -0.0065), (-0.0105, 0.006, -0.0025)), *place)


def _wipers(pad: _Pad, *, side: float) -> Iterator[MaterialMesh]:
    """Two wipers at rest on the foot of the windscreen, pivots on the driver's side."""
    half, x, z = pad.half, pad.front + 0.01, pad.edge - 0.026
    for pivot, tip in ((0.80 * half, 0.06 * half), (0.02 * half, -0.74 * half)):
        root = np.array([x + 0.01, side * pivot, z])
        end = np.array([x - 0.05, side * tip, z + 0.02])
        middle = 0.45 * root + 0.55 * end + [0.008, 0.0, 0.006]
        yield "trim", tube([root, middle], radius=[0.0065, 0.0045], sides=6)
        way = end - middle
        blade = [middle - 0.75 * way, middle + 0.1 * way + [0, 0, 0.002], end]
        yield "trim", tube(np.array(blade) - [0.012, 0.0, 0.006], radius=0.0055, sides=5)
        knob = superellipsoid((0.014, 0.014, 0.009), squareness=2.5, segments=10, rings=6)
        yield "trim", moved(knob, *root)
