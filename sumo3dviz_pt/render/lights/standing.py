"""Lamps that stand still, and all lamps of a frame as points that shine.

Lamps that stand still are made once and lit frame by frame. The points, of lamps and of beams, are
for the light that air scatters.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from sumo3dviz_pt.model.geometry import Floats, Image, Mesh
from sumo3dviz_pt.model.scene import Beam, FrameState, LampSet
from sumo3dviz_pt.render import convert
from sumo3dviz_pt.render.lights.emitter import (
    Glow,
    axes_of,
    faces_of,
    lamp_emitter,
    lobe_row,
    weigh,
)

UNTINTED = 0.03
"""Reflectance of lenses without a colour: dark glass."""


class _Standing:
    """One lamp set as the renderer keeps it."""

    def __init__(self, lamps: LampSet) -> None:
        self.lamps, count = lamps, len(lamps.lamps)
        self.name = f"lamps_{lamps.id}"
        self.mesh = _apart(lamps)
        normals, self._areas = faces_of(self.mesh.vertices, self.mesh.faces)
        index = lamps.lamp_of_face
        self._axes = axes_of(normals, self._areas, index, count)
        self._lobes = np.tile(lobe_row(lamps.lobe), (count, 1))
        self._places = lamps.mesh.vertices[lamps.mesh.faces].mean(axis=1)

    def glow(self, frame: FrameState) -> Glow:
        """Return how the lamp set shines in a frame."""
        index, weight = self.lamps.lamp_of_face, self.lamps.weight if self.lamps.sampled else 0.0
        shapes = (self._axes, self._lobes, self._areas, index, self._places)
        return Glow(self.radiance(frame), *shapes, weight)

    def radiance(self, frame: FrameState) -> Floats:
        """Return the radiance of each lamp, (lamps, 3)."""
        constant = self.lamps.radiance
        return np.asarray(frame.lamps[self.lamps.id] if constant is None else constant)


class Lamps:
    """A scene's lamp sets.

    Args:
        sets: All of them.
        bsdf: The material of their glass.
        pane: That of panes before lit rooms.
        jit: Whether the variant compiles.
    """

    def __init__(self, sets: Sequence[LampSet], *, bsdf: Any, jit: bool, pane: Any = None) -> None:
        self._bsdf, self._jit, self._pane = bsdf, jit, pane
        self._sets = [_Standing(lamps) for lamps in sets]

    def is_pane(self, name: str) -> bool:
        """Return whether a mesh of lamps is of panes before lit rooms."""
        return any(each.name == name and each.mesh.wear is not None for each in self._sets)

    @property
    def names(self) -> tuple[str, ...]:
        """Of the meshes."""
        return tuple(each.name for each in self._sets)

    def things(self, mesh: str) -> tuple[tuple[str, int], ...]:
        """Return what the faces of a lamp set's mesh belong to; see `Mesh.things`."""
        things = (each.lamps.mesh.things for each in self._sets if each.name == mesh)
        return next(things, ())

    def entries(self, origin: Floats) -> dict[str, Any]:
        """Shapes by name, relative to an origin; all are dark."""
        return {each.name: self._shape(each, origin) for each in self._sets}

    def recentre(self, parameters: Any, origin: Floats) -> None:
        """Move all lamps to another origin."""
        for each in self._sets:
            key = f"{each.name}.vertex_positions"
            convert.overwrite(parameters, key, each.mesh.vertices - origin)

    def update(self, parameters: Any, frame: FrameState) -> None:
        """Light the lamps as a frame says."""
        for each in self._sets:
            if self._jit:
                weigh(parameters, each.name, each.glow(frame), frame.view)
            else:
                key = f"{each.name}.{convert.RADIANCE_ATTRIBUTE}"
                radiance = each.radiance(frame)[each.lamps.lamp_of_face]
                convert.overwrite(parameters, key, radiance)

    def glows(self, frame: FrameState) -> dict[str, Glow]:
        """Return how each lamp set's mesh shines in a frame."""
        return {each.name: each.glow(frame) for each in self._sets}

    def shining(self, frame: FrameState) -> list[Floats]:
        """Return the corners of faces that shine, relative to the origin, (n, 3, 3) [m]."""
        corners = []
        for each in self._sets:
            lit = (each.radiance(frame) != 0.0).any(axis=1)[each.lamps.lamp_of_face]
            corners.append(each.mesh.vertices.reshape(-1, 3, 3)[lit] - frame.origin)
        return corners

    @property
    def most(self) -> int:
        """Lamps that paths aim at."""
        return sum(len(each.lamps.lamps) for each in self._sets if each.lamps.sampled)

    def _shape(self, each: _Standing, origin: Floats) -> Any:
        """Make the mesh of one lamp set."""
        lamps, mesh = each.lamps, each.mesh
        rooms = mesh.wear is not None
        emitter = lamp_emitter(len(lamps.lamps), len(mesh.faces), jit=self._jit, rooms=rooms)
        placed = Mesh(mesh.vertices - origin, mesh.faces, None, mesh.uvs, mesh.wear)
        tint = np.full((len(mesh.faces), 3), UNTINTED) if lamps.tint is None else lamps.tint
        return convert.make_lamps(
            each.name,
            placed,
            bsdf=self._bsdf if mesh.wear is None or self._pane is None else self._pane,
            emitter=emitter,
            tint=np.asarray(tint),
        )


def _apart(lamps: LampSet) -> Mesh:
    """Return the mesh with corners of its own for every face: u tells the face, v the lamp."""
    corners = lamps.mesh.vertices[lamps.mesh.faces].reshape(-1, 3)
    faces = np.arange(len(corners)).reshape(-1, 3)
    face = (np.arange(len(faces)) + 0.5) / max(len(faces), 1)
    lamp = (lamps.lamp_of_face + 0.5) / max(len(lamps.lamps), 1)
    wear = None if lamps.mesh.wear is None else lamps.mesh.wear[lamps.mesh.faces].reshape(-1, 3)
    return Mesh(corners, faces, None, np.repeat(np.column_stack([face, lamp]), 3, axis=0), wear)


@dataclass(frozen=True, slots=True, eq=False)
class Sources:
    """Points that shine: lamps, n, then beams, m, whether they shine or not.

    Attributes:
        places: (n + m, 3) [m].
        axes: Unit, (n + m, 3).
        colours: Radiant intensity on the axis, (n + m, 3) in scene units x m^2.
        lobes: Floor and sharpness, (n + m, 2); beams do not use them.
        mean: Mean intensity in all directions and channels, (n + m,).
        sizes: Radius of each, (n + m,) [m].
        turns: From the world's axes to the beams', (m, 3, 3).
        beam: What beams throw, or None.
    """

    places: Floats
    axes: Floats
    colours: Floats
    lobes: Floats
    mean: Floats
    sizes: Floats
    turns: Floats
    beam: Beam | None = None

    @property
    def beams(self) -> int:
        """How many of them are beams."""
        return len(self.turns)

    def rows(self, origin: Floats) -> Floats:
        """Return each one's numbers relative to an origin, (n + m, 12).

        Place and size, axis and floor of the lobe, colour and sharpness of the lobe.
        """
        parts = (self.places - origin, self.sizes[:, None], self.axes, self.lobes[:, :1])
        return np.concatenate([*parts, self.colours, self.lobes[:, 1:]], axis=1)

    def towards(self, outward: Image) -> Image:
        """Return their intensities in directions, (..., n + m, 3) -> (..., n + m), as `mean`."""
        lamps = self.lamps
        cosine = np.einsum("...lk,lk->...l", outward[..., :lamps, :], self.axes[:lamps])
        return np.concatenate([self.by_lamps(cosine), self.by_beams(outward[..., lamps:, :])], -1)

    @property
    def lamps(self) -> int:
        """How many of them are lamps."""
        return len(self.places) - self.beams

    def by_lamps(self, cosine: Image) -> Image:
        """Return the lamps' intensities by cosines of angles from their axes, (..., n)."""
        lamps = self.lamps
        floor, sharpness = self.lobes[:lamps].T.astype(cosine.dtype)
        lobe = floor + (1 - floor) * np.exp(sharpness * (cosine - 1))
        mean = self.colours[:lamps].mean(axis=1).astype(cosine.dtype)
        return np.asarray(mean * lobe * np.maximum(cosine, 0))

    def by_beams(self, outward: Image) -> Image:
        """Return the beams' intensities in unit directions, (..., m, 3) -> (..., m)."""
        if self.beam is None or not self.beams:
            return np.zeros(outward.shape[:-1], outward.dtype)
        seen = np.einsum("...lk,lkj->...lj", outward, self.turns.astype(outward.dtype))
        return self._thrown(seen, self.beam).astype(outward.dtype)

    def _thrown(self, seen: Image, beam: Beam) -> Floats:
        """Intensities of beams in directions of their own frames, (..., m, 3) -> (..., m)."""
        # The spot's +z looks ahead, +x to its left, and +y up.
        half, count = np.tan(beam.half_angle), len(beam.pattern)
        ahead = np.maximum(seen[..., 2], 1e-6)
        across = (0.5 - 0.5 * seen[..., 0] / (ahead * half)) * count
        down = (0.5 - 0.5 * seen[..., 1] / (ahead * half)) * count
        inside = (seen[..., 2] > 0.0) & (np.abs(across - 0.5 * count) < 0.5 * count)
        inside &= np.abs(down - 0.5 * count) < 0.5 * count
        row, column = (np.where(inside, each, 0).astype(int) for each in (down, across))
        share = np.where(inside, beam.pattern[row, column], 0.0)
        return np.asarray(self.colours[len(self.places) - self.beams :].mean(axis=1) * share)


def sources_of(
    glows: Iterable[Glow],
    placed: Mapping[str, tuple[Floats, Floats]],
    *,
    beams: tuple[str, ...],
    beam: Beam | None,
    room: int,
    seen: tuple[Floats, Floats],
) -> Sources:
    """Return what shines in a frame.

    Args:
        glows: Lamps.
        placed: Placement of beams relative to the origin, (4, 4), and their intensity, by name.
        beams: Names of all beams; those that do not shine have no intensity.
        beam: What they throw.
        room: Lamps that are kept, those that matter most to the eye; fewer are filled up with
            dark ones.
        seen: Where the eye is and the renderer's origin, (3,) each [m].
    """
    eye, origin = seen
    lamps = [np.zeros((0, 13)), *(_lamp_rows(glow) for glow in glows)]
    rows = np.concatenate(lamps)
    nearness = 1.0 / (((rows[:, :3] - eye) ** 2).sum(axis=1) + 100.0)
    best = np.argsort(-rows[:, 11] * nearness, kind="stable")[:room]
    table = np.zeros((room + len(beams), 13))
    table[: len(best)] = rows[np.sort(best)]
    turns = np.zeros((len(beams), 3, 3))
    for k, name in enumerate(beams):
        if name in placed:
            matrix, intensity = placed[name]
            table[room + k, :3] = matrix[:3, 3] + origin
            table[room + k, 6:9] = intensity
            table[room + k, 11] = np.mean(intensity) * _BEAM_MEAN
            turns[k] = matrix[:3, :3]
    return Sources(
        places=table[:, :3],
        axes=table[:, 3:6],
        colours=table[:, 6:9],
        lobes=table[:, 9:11],
        mean=table[:, 11],
        sizes=table[:, 12],
        turns=turns,
        beam=beam,
    )


_BEAM_MEAN = 0.01
"""Mean intensity of a beam in all directions, about, against its peak."""


def _lamp_rows(glow: Glow) -> Floats:
    """Return the lamps of a mesh that shine, (lamps, 13), in the order of `Sources`."""
    count = len(glow.radiance)

    def summed(values: Floats) -> Floats:
        return np.bincount(glow.lamp_of_unit, values, minlength=count).astype(np.float64)

    areas = summed(glow.areas)
    whole = np.maximum(areas, 1e-12)
    places = np.stack([summed(glow.areas * axis) / whole for axis in glow.places.T], axis=1)
    colours = np.nan_to_num(glow.radiance * areas[:, None], posinf=1e3)
    mean = colours.mean(axis=1) * glow.lobes[:, 2] / (4.0 * np.pi)
    sizes = np.sqrt(areas / np.pi)
    rows = (places, glow.axes, colours, glow.lobes[:, :2], mean[:, None], sizes[:, None])
    return np.asarray(np.concatenate(rows, axis=1)[mean > 0.0])
