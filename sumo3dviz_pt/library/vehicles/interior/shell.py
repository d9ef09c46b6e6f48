"""What closes a cabin around its driver: roof with sun visors, pillars, doors.

The roof takes the light of the zenith from the dashboard, as it does in a car: what is left comes
through the windows, so a dashboard is light under the glass and dark towards the driver. It ends
behind the seats, since the mirror shows the road and no rear window. Nothing here stands in a
driver's way to the road or to a mirror that was not there before.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from sumo3dviz_pt.library.mesh.solids import bevelled, moved, superellipsoid, tube
from sumo3dviz_pt.library.vehicles.interior.mirrors import DEEP
from sumo3dviz_pt.library.vehicles.recipe import MaterialMesh
from sumo3dviz_pt.model.geometry import Floats, Mesh, Transform

_HEAD, _VAN_HEAD = 0.30, 0.72
"""From the eye to the windscreen's upper edge, along the vehicle; in vans pillars stand steeper,
between the road and the mirror [m]."""

_HEAVY = 1.08
"""Dashboards that are wider on either side are those of buses and lorries [m]."""

BEHIND = 1.1
"""And to where the roof ends [m]."""

_LINING = 0.055
"""From the body's top down to the roof's lining [m]."""

_HEADROOM = (0.2, 0.5)
"""Least and most from the eye up to the lining: signs on a roof count as its top [m]."""

_LEAN, _VAN_LEAN = 0.13, 0.07
"""By how much pillars lean inwards, and those of vans [m]."""

_DOOR = 0.045
"""Half as thick is a door [m]."""


def roof_over(eye: Floats, *, top: float) -> float:
    """Return the height of a roof's lining [m].

    Args:
        eye: The driver's, (3,) [m].
        top: Of the body [m].
    """
    low, high = _HEADROOM
    return float(np.clip(top - _LINING, eye[2] + low, eye[2] + high))


def shell(
    half: float, *, front: float, belt: float, eye: Floats, top: float
) -> Iterator[MaterialMesh]:
    """Build roof, pillars and doors.

    Args:
        half: Half the dashboard's width [m].
        front: x of the windscreen's foot [m].
        belt: Height of the dashboard [m].
        eye: The driver's, (3,) [m].
        top: Of the body [m].
    """
    roof = roof_over(eye, top=top)
    van = eye[2] - belt >= DEEP and half < _HEAVY
    head = min(float(eye[0]) + (_VAN_HEAD if van else _HEAD), front - 0.1)
    wide = half - (_VAN_LEAN if van else _LEAN)
    yield from _roof(wide + 0.03, head=head, end=eye[0] - BEHIND, roof=roof)
    yield from _visors(wide, head=head, roof=roof)
    for side in (1.0, -1.0):
        foot = (front - 0.1, side * half, belt - 0.08)
        yield "pillar_cloth", pillar(foot, (head, side * wide, roof + 0.01))
        yield from _door(half, side=side, front=front, belt=belt, end=eye[0] - 0.9)


def pillar(foot: tuple[float, float, float], head: tuple[float, float, float]) -> Mesh:
    """Build a windscreen's pillar between two points [m], in an easy bow."""
    share = np.linspace(0.0, 1.0, 7)
    bow = 0.02 * np.sin(np.pi * share)[:, None] * np.array([0.7, 0.0, 0.7])
    path = np.array(foot) + share[:, None] * (np.array(head) - foot) + bow
    return tube(path, radius=np.interp(share, [0.0, 0.25, 1.0], [0.048, 0.04, 0.034]), sides=12)


def _roof(wide: float, *, head: float, end: float, roof: float) -> Iterator[MaterialMesh]:
    """The lining, and the beam over the windscreen."""
    yield "headliner", bevelled((end, -wide, roof), (head - 0.01, wide, roof + 0.04), bevel=0.018)
    beam = superellipsoid((0.035, wide, 0.022), squareness=3.0, segments=24, rings=8)
    yield "headliner", moved(beam, head, 0.0, roof + 0.006)


def _visors(wide: float, *, head: float, roof: float) -> Iterator[MaterialMesh]:
    """Two sun visors that are folded up, their front edges on hinges."""
    across = 0.5 * wide - 0.05
    for side in (1.0, -1.0):
        pad = superellipsoid((0.085, across - 0.02, 0.009), squareness=4.0, segments=28, rings=6)
        placed = Transform.from_pose((head - 0.12, side * 0.5 * wide, roof - 0.014), pitch=0.06)
        yield "headliner", placed.mesh(pad)


def _door(
    half: float, *, side: float, front: float, belt: float, end: float
) -> Iterator[MaterialMesh]:
    """A door's panel up to the window, its sill and the strip that seals the glass."""
    inner, outer = sorted((side * (half - _DOOR), side * (half + _DOOR)))
    low, high = (end, inner, 0.3), (front - 0.02, outer, belt - 0.015)
    yield "dash_pad", bevelled(low, high, bevel=0.022)
    strip = [(end, side * (half + 0.012), belt - 0.014), (front - 0.1, side * half, belt - 0.014)]
    yield "rubber", tube(np.array(strip), radius=0.008, sides=6)
