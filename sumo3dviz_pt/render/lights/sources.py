"""Lamps and beams of a frame as points that shine, for the light that air scatters."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.lamps import Beam
from sumo3dviz_pt.render.lights.picks import Glow


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

    def towards(self, outward: Floats) -> Floats:
        """Return their intensities in directions, (..., n + m, 3) -> (..., n + m), as `mean`."""
        lamps = self.lamps
        cosine = np.einsum("...lk,lk->...l", outward[..., :lamps, :], self.axes[:lamps])
        return np.concatenate([self.by_lamps(cosine), self.by_beams(outward[..., lamps:, :])], -1)

    @property
    def lamps(self) -> int:
        """How many of them are lamps."""
        return len(self.places) - self.beams

    def by_lamps(self, cosine: Floats) -> Floats:
        """Return the lamps' intensities by cosines of angles from their axes, (..., n)."""
        lamps = self.lamps
        floor, sharpness = self.lobes[:lamps].T.astype(cosine.dtype)
        lobe = floor + (1 - floor) * np.exp(sharpness * (cosine - 1))
        mean = self.colours[:lamps].mean(axis=1).astype(cosine.dtype)
        return np.asarray(mean * lobe * np.maximum(cosine, 0))

    def by_beams(self, outward: Floats) -> Floats:
        """Return the beams' intensities in unit directions, (..., m, 3) -> (..., m)."""
        if self.beam is None or not self.beams:
            return np.zeros(outward.shape[:-1], outward.dtype)
        seen = np.einsum("...lk,lkj->...lj", outward, self.turns.astype(outward.dtype))
        return self._thrown(seen, self.beam).astype(outward.dtype)

    def _thrown(self, seen: Floats, beam: Beam) -> Floats:
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
    kept = np.zeros((room + len(beams), 13))
    kept[: len(best)] = rows[np.sort(best)]
    turns = np.zeros((len(beams), 3, 3))
    for k, name in enumerate(beams):
        if name in placed:
            matrix, intensity = placed[name]
            kept[room + k, :3] = matrix[:3, 3] + origin
            kept[room + k, 6:9] = intensity
            kept[room + k, 11] = np.mean(intensity) * _BEAM_MEAN
            turns[k] = matrix[:3, :3]
    return Sources(
        places=kept[:, :3],
        axes=kept[:, 3:6],
        colours=kept[:, 6:9],
        lobes=kept[:, 9:11],
        mean=kept[:, 11],
        sizes=kept[:, 12],
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
