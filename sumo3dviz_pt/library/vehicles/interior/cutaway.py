"""Opens a vehicle for a camera inside it: its glass and cabin go, and one for a driver is built.

What remains of it is the bonnet and the low body (so that its shadow stays plausible). Dashboard,
wheel, pillars, doors and roof are built anew; nothing is before the road but what a driver has.
Ships, aircraft and such have no such cabin: of them remains what lies well below the eye and faces
it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from enum import Enum
from itertools import chain

import numpy as np

from sumo3dviz_pt.library.vehicles.glazing import PANE
from sumo3dviz_pt.library.vehicles.interior.cockpit import (
    cockpit,
    cockpit_lamps,
    desk,
    half_dashboard,
)
from sumo3dviz_pt.library.vehicles.interior.mirrors import outer_mirrors
from sumo3dviz_pt.library.vehicles.interior.saloon import saloon
from sumo3dviz_pt.library.vehicles.interior.shell import BEHIND, shell
from sumo3dviz_pt.model.geometry import Floats, Ints, Mesh, area_vectors, areas
from sumo3dviz_pt.model.scene import Part, Prototype, VehicleLamp

LOW_SHARE = 0.55
"""The body is kept below this share of its height."""

_BONNET_ABOVE_BELT = 0.06
"""What is ahead of the windscreen and higher is a mirror or a wiper [m]; `mirrors` makes mirrors
anew, with panes that show the scene."""

_TRIM_ABOVE_BELT = 0.0
"""Unpainted parts ahead of the windscreen are left out above this, since the cockpit brings its own
wipers [m]."""

_UNDER_EYE = 0.25
"""Bodies without a cabin are kept below the eye less this [m]: decks and noses, no bridges."""

_FLATTEST = 0.1
"""Least cosine between a shown face's normals and the direction to the eye."""

_TRIMMINGS = frozenset({"trim", "gloss_black", "rubber", "gap", "glass", "chrome"})

_DOORS = 0.14
"""By how much both doors together are thinner than a cockpit takes them to be [m]."""

_SKIN = 0.03
"""From a bus's side to the wall of its passengers' room [m]."""

_NARROWEST_DASHBOARD = 1.2
"""Two-wheelers and people have none [m]."""


class CutawayCabin(Enum):
    """What stands before who steers: a dashboard with wheel and mirrors, a desk, or only the body.

    Behind a bus's driver is the passengers' room. Bodies that stay as they are have a handlebar
    and a windscreen, or nothing, or are closed boxes.
    """

    ROAD = "road"
    BUS = "bus"
    RAIL = "rail"
    BARS = "bars"
    NONE = "none"
    BOX = "box"

    @property
    def is_built(self) -> bool:
        """Whether anything is built anew in it."""
        return self.is_driven or self is CutawayCabin.RAIL

    @property
    def is_driven(self) -> bool:
        """Whether it has a steering wheel and mirrors."""
        return self in (CutawayCabin.ROAD, CutawayCabin.BUS)


def cutaway(
    prototype: Prototype,
    *,
    cowl: float,
    belt: float,
    eye: Floats,
    wipers: bool = True,
    cabin: CutawayCabin = CutawayCabin.ROAD,
) -> Prototype:
    """Keep what a driver sees of his own vehicle.

    Args:
        prototype: The whole body.
        cowl: x where bonnet and windscreen meet, at most 0 [m].
        belt: Height of the dashboard, about where the side windows begin [m].
        eye: The driver's, (3,) [m].
        wipers: Whether wipers rest on the windscreen's foot.
        cabin: What is built anew in it.

    Returns:
        A body called `<name>~cockpit`, with its lamps and those of the instruments.
    """
    bounds = np.stack([part.mesh.bounds for part in prototype.parts if len(part.mesh.vertices)])
    low = min(LOW_SHARE * float(bounds[:, 1, 2].max()), belt - 0.05)
    high = _Limit(belt + _BONNET_ABOVE_BELT, 0.5 * float(np.ptp(bounds[:, :, 1])))
    # No dashboard hides the cut: it lies higher, and no wall is seen from inside.
    cut = (
        low if cabin.is_built or cabin is CutawayCabin.BOX else max(low, float(eye[2]) - _UNDER_EYE)
    )
    solid = tuple(part for part in prototype.parts if part.material != PANE)
    parts = tuple(_opened(solid, cowl=cowl, low=cut, high=high))
    if not cabin.is_built:
        parts = tuple(_without_backs(parts, eye, above=low))
    parts = tuple(replace(part, mesh=_seen_from(part.mesh, eye)) for part in parts)
    lamps: tuple[VehicleLamp, ...] = ()
    flank = _flank(prototype.parts, below=low)
    if has_dashboard(2.0 * flank, cabin):
        edge = max([belt, *(_edge(part.mesh, cowl=cowl) for part in parts)])
        front = min(cowl, -0.08)
        # The dashboard ends at the doors' own panels.
        across = 2.0 * flank + _DOORS
        made = desk(across, front=front, belt=belt, edge=edge, eye=eye)
        if cabin.is_driven:
            made = cockpit(across, front=front, belt=belt, edge=edge, eye=eye, wipers=wipers)
            top = float(bounds[:, 1, 2].max())
            half = half_dashboard(across)
            made = chain(
                made,
                shell(half, front=front, belt=belt, eye=eye, top=top),
                outer_mirrors(flank, front=front, belt=belt, eye=eye),
            )
            lamps = cockpit_lamps(belt=belt, eye=eye)
            if cabin is CutawayCabin.BUS:
                room = {"front": float(eye[0]) - BEHIND, "rear": float(bounds[:, 0, 0].min())}
                made = chain(made, saloon(flank - _SKIN, **room, eye=eye, top=top))
        parts = (*parts, *(Part(mesh, material) for material, mesh in made))
    far = tuple(_opened(prototype.far, cowl=cowl, low=cut, high=high))
    return Prototype(f"{prototype.name}~cockpit", parts, far, (*prototype.lamps, *lamps))


def has_dashboard(width: float, cabin: CutawayCabin) -> bool:
    """Return whether a body so wide [m] has a dashboard; two-wheelers and ships have none."""
    return width > _NARROWEST_DASHBOARD and cabin.is_built


def clip(mesh: Mesh, heights: Floats) -> tuple[Mesh, Ints]:
    """Cut a mesh where a field is zero and keep where it is at most zero.

    Args:
        mesh: Any triangles.
        heights: The field at the vertices, (n,); linear within a face.

    Returns:
        The rest, and for each of its faces the face it came from, (m,).
    """
    outside = heights[mesh.faces] > 0.0
    count = outside.sum(axis=1)
    whole = np.flatnonzero(count == 0)
    tips, stumps = np.flatnonzero(count == 2), np.flatnonzero(count == 1)
    # The corner that is alone on its side comes first; the turn keeps the orientation.
    tip_faces = _turned(mesh.faces[tips], np.argmin(outside[tips], axis=1))
    stump_faces = _turned(mesh.faces[stumps], np.argmax(outside[stumps], axis=1))
    lone = np.concatenate([tip_faces[:, 0], stump_faces[:, 0]])
    starts, total = len(mesh.vertices), len(lone)
    others = np.concatenate([tip_faces[:, 1:], stump_faces[:, 1:]])
    share = heights[lone][:, None] / (heights[lone][:, None] - heights[others])
    first, second = starts + np.arange(total), starts + total + np.arange(total)
    a, b = len(tips), slice(len(tips), None)
    faces = np.concatenate(
        [
            mesh.faces[whole],
            np.column_stack([tip_faces[:, 0], first[:a], second[:a]]),
            np.column_stack([first[b], stump_faces[:, 1], stump_faces[:, 2]]),
            np.column_stack([first[b], stump_faces[:, 2], second[b]]),
        ]
    )
    source = np.concatenate([whole, tips, stumps, stumps])
    cut = _with_cuts(mesh, lone, others, share)
    # A cut through a corner leaves triangles without area.
    solid = areas(cut.vertices, faces) > 1e-12
    return _compact(cut, faces[solid]), source[solid]


@dataclass(frozen=True, slots=True)
class _Limit:
    """How high the bonnet reaches: less at the flanks, where mirrors stand on their feet.

    Attributes:
        middle: On the axis [m].
        half: Half the body's width [m].
    """

    middle: float
    half: float

    def over(self, points: Floats) -> Floats:
        """Return how far points, (n, 3), lie above it, (n,) [m]."""
        flank = np.maximum(np.abs(points[:, 1]) / self.half - 0.68, 0.0)
        return np.asarray(points[:, 2] - (self.middle - 0.4 * flank))


def _opened(parts: tuple[Part, ...], *, cowl: float, low: float, high: _Limit) -> list[Part]:
    """The parts below `low`, or below `high` ahead of the cowl; empty ones are left out."""
    opened = []
    for part in parts:
        z = part.mesh.vertices[:, 2]
        below, above = _clipped(part, z - low), _clipped(part, low - z)
        above = _clipped(above, high.over(above.mesh.vertices))
        if part.material in _TRIMMINGS:
            limit = high.middle - _BONNET_ABOVE_BELT + _TRIM_ABOVE_BELT
            above = _clipped(above, above.mesh.vertices[:, 2] - limit)
        ahead = _clipped(above, cowl - above.mesh.vertices[:, 0])
        opened += [rest for rest in (below, ahead) if len(rest.mesh.faces)]
    return opened


def _without_backs(parts: tuple[Part, ...], eye: Floats, *, above: float) -> Iterator[Part]:
    """Yield parts without the faces that reach higher and turn their backs to a front seat."""
    for part in parts:
        mesh = part.mesh
        corners = mesh.vertices[mesh.faces]
        stays = corners[:, :, 2].max(axis=1) <= above
        seats = eye * np.array([[1.0, 1.0, 1.0], [1.0, -1.0, 1.0]])
        facing = (seats[:, None] - corners[:, 0]) * area_vectors(mesh.vertices, mesh.faces)
        stays |= (facing.sum(axis=2) > 0.0).all(axis=0)
        if stays.any():
            tint = None if part.tint is None else part.tint[stays]
            yield replace(part, mesh=_compact(mesh, mesh.faces[stays]), tint=tint)


def _clipped(part: Part, heights: Floats) -> Part:
    """A part where the field is at most zero, with the tints of its faces."""
    mesh, source = clip(part.mesh, heights)
    return replace(part, mesh=mesh, tint=None if part.tint is None else part.tint[source])


def _turned(faces: Ints, first: Ints) -> Ints:
    """The same faces, beginning with the given corner, (m, 3)."""
    order = (first[:, None] + np.arange(3)) % 3
    return np.take_along_axis(faces, order, axis=1)


def _with_cuts(mesh: Mesh, lone: Ints, others: Ints, share: Floats) -> Mesh:
    """The mesh's vertices and those on the cut: first all to one side, then to the other."""

    def extended(values: Floats | None) -> Floats | None:
        if values is None:
            return None
        cuts = [
            values[lone] + share[:, [k]] * (values[others[:, k]] - values[lone]) for k in (0, 1)
        ]
        return np.concatenate([values, *cuts])

    vertices = extended(mesh.vertices)
    assert vertices is not None
    none = np.zeros((0, 3), np.int64)
    return Mesh(vertices, none, extended(mesh.normals), extended(mesh.uvs))


def _seen_from(mesh: Mesh, eye: Floats) -> Mesh:
    """The same mesh, its normals bent to the eye where a face is seen but its normals look away.

    A driver looks along the bonnet at so flat an angle that the smooth normals of its few faces
    would turn it black.
    """
    if mesh.normals is None or not len(mesh.faces):
        return mesh
    away = eye - mesh.vertices
    away /= np.linalg.norm(away, axis=1, keepdims=True)
    ahead = (area_vectors(mesh.vertices, mesh.faces) * away[mesh.faces[:, 0]]).sum(axis=1) > 0.0
    shown = np.zeros(len(mesh.vertices), dtype=np.bool_)
    shown[mesh.faces[ahead]] = True
    lacking = np.maximum(_FLATTEST - (mesh.normals * away).sum(axis=1), 0.0) * shown
    bent = mesh.normals + lacking[:, None] * away
    return replace(mesh, normals=bent / np.linalg.norm(bent, axis=1, keepdims=True))


def _compact(mesh: Mesh, faces: Ints) -> Mesh:
    """The faces with only the vertices that they use."""
    used, places = np.unique(faces, return_inverse=True)
    chosen = [None if v is None else v[used] for v in (mesh.normals, mesh.uvs)]
    return Mesh(mesh.vertices[used], places.reshape(-1, 3), *chosen)


def _edge(mesh: Mesh, *, cowl: float) -> float:
    """Height of the bonnet's rear edge about its middle [m]; 0 where the mesh has none."""
    near = (np.abs(mesh.vertices[:, 0] - cowl) < 0.05) & (np.abs(mesh.vertices[:, 1]) < 0.35)
    return float(mesh.vertices[near, 2].max(initial=0.0))


def _flank(parts: tuple[Part, ...], *, below: float) -> float:
    """Return y of a body's left side below a height, where no mirrors stick out [m]."""
    low = [part.mesh.vertices[part.mesh.vertices[:, 2] < below, 1] for part in parts]
    return float(max(np.abs(y).max(initial=0.0) for y in low))
