"""What a ray sees of an untiled bitmap: its colour or roughness with wear and paint.

JIT variants only: everything is an array of Dr.Jit. See `render/materials/untiled.py` for sources.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi

from sumo3dviz_pt.model.geometry import UNWORN
from sumo3dviz_pt.render.materials.fields import fields, patches
from sumo3dviz_pt.render.materials.lattice import PERIOD, corners, hashed, mixed, unit
from sumo3dviz_pt.render.materials.pyramid import Pyramid

PAINTS = ((0.62, 0.62, 0.60), (0.60, 0.38, 0.05))
"""White and yellow; linear reflectance."""

_PAINT_ROUGHNESS = 0.5
_GRID = 4  # lattice cells along a tile
_FLAKES = 32  # lattice cells of flaking paint along a tile
_CRACK = 0.025  # half the width of cracks, as noise
_BROAD = 8  # lattice cells of the fine grid along a cell of the broad unevenness


def slide(uv: Any) -> Any:
    """Return by what bits a row of slabs slides, so the joints between rows stay straight."""
    row = mi.UInt32(mi.Int32(dr.floor(uv.y)))
    return hashed(row, mi.UInt32(0), PERIOD - 1) & 0xFFFF


@dataclass(frozen=True, slots=True, eq=False)
class Untiled:
    """A bitmap laid without its period.

    Attributes:
        pyramid: The bitmap's sizes and statistics.
        texels: Its values, four for each texel.
        pixel: Angle of a pixel [rad]; opaque, so that pictures of all sizes share kernels.
        tile: Length of the bitmap [m].
        uneven: Relative amplitude of broad differences in brightness.
        patches: Amount of dry and lush patches.
        fields: Amount of crops.
        roughness: Mean roughness, where this is one; else 0.
        wear: Tells a mesh's wear, if it has any.
        regular: Not 0 where copies may slide by whole rows only: slabs.
        first: Where its values begin in `texels`.
    """

    pyramid: Pyramid
    texels: Any
    pixel: Any
    tile: float
    uneven: float
    patches: float
    fields: float
    roughness: float
    wear: Any
    regular: float = 0.0
    first: Any = 0

    @property
    def average(self) -> list[Any]:
        """Mean of each channel."""
        return [float(value) for value in self.pyramid.mean]

    def has(self, what: str) -> bool:
        """Return whether one of the amounts, by its name, is above 0."""
        return bool(getattr(self, what) > 0)

    def _level(self, si: Any, dice: Any) -> Any:
        """Return the level whose texels are one to two pixels large; chance decides in between."""
        slant = dr.rsqrt(dr.maximum(dr.abs(si.wi.z), 0.02))
        texels = si.t * slant * self.pixel * (self.pyramid.size / self.tile)
        level = dr.log2(dr.clip(texels, 1.0, 1e6)) + dice
        return mi.UInt32(dr.clip(level, 0.0, self.pyramid.levels - 1.0))

    def _pick(self, uv: Any, level: Any, shift: Any, active: Any) -> Any:
        """Return one texel of a shifted copy."""
        size = mi.UInt32(self.pyramid.size) >> level
        scale = mi.Float(size)
        x = mi.Int32(dr.floor((uv.x + unit(shift << 16)) * scale))
        y = mi.Int32(dr.floor((uv.y + unit(shift & 0xFFFF0000)) * scale))
        # Levels before this one hold size^2 (1 + 1/4 + ...) texels.
        before = (mi.UInt32(self.pyramid.size**2) - size * size) // 3 * 4
        index = before + (mi.UInt32(y) & (size - 1)) * size + (mi.UInt32(x) & (size - 1))
        return dr.gather(mi.Vector4f, self.texels, self.first + index, active)

    def _blended(self, si: Any, active: Any) -> tuple[Any, Any]:
        """Return how the blend of three copies deviates from the mean, and broad noise."""
        bits = mixed(
            dr.reinterpret_array(mi.UInt32, si.uv.x)
            ^ mixed(dr.reinterpret_array(mi.UInt32, si.uv.y))
            ^ dr.reinterpret_array(mi.UInt32, si.t)
        )
        level = self._level(si, unit(bits))
        again = mixed(bits + 1)
        jitter = mi.Vector2f(unit(again << 16), unit(again & 0xFFFF0000)) - 0.5
        uv = si.uv + jitter / mi.Float(mi.UInt32(self.pyramid.size) >> level)
        near = corners(si.uv, cells=_GRID, mask=_GRID * PERIOD - 1)
        sharp, shifts = self._copies(si.uv, near)
        total = sum(sharp[1:], sharp[0])
        length = sum((dr.square(weight) for weight in sharp[1:]), dr.square(sharp[0]))
        value = mi.Color3f(0.0)
        for weight, shift in zip(sharp, shifts, strict=True):
            texel = self._pick(uv, level, shift, active)
            value += weight * mi.Color3f(texel.x, texel.y, texel.z)
        # Sum(w x) / |w| has the bitmap's variance; subtracting the mean's part corrects the mean.
        deviation = (value - mi.Color3f(self.average) * total) * dr.rsqrt(length)
        return deviation, self._noise(si.uv, near)

    def _copies(self, uv: Any, near: Any) -> tuple[list[Any], list[Any]]:
        """Return how much each shifted copy counts, and by what bits each is shifted.

        Args:
            uv: Texture coordinates [tiles].
            near: The lattice's corners around them.
        """
        if self.regular > 0:
            return [mi.Float(1.0)], [slide(uv)]
        # Cubed weights make the zones of blending narrow, so that most stones stay sharp.
        return [weight * weight * weight for weight in near.weights], list(near.hashes)

    def _noise(self, uv: Any, near: Any) -> Any:
        """Return broad noise in [-1, 1]; 0 on an even surface."""
        if not self.has("uneven"):
            return mi.Float(0.0)
        far = corners(uv, cells=_GRID / _BROAD, mask=_GRID * PERIOD // _BROAD - 1)
        return 0.5 * near.unevenness + 0.5 * far.unevenness

    def _relief(self, deviation: Any) -> Any:
        """Return how much a stone stands out, about unit spread."""
        return (deviation.x + deviation.y + deviation.z) * (1.0 / (3.0 * self.pyramid.spread))

    def colour(self, si: Any, active: Any) -> Any:
        """Return the reflectance, three channels."""
        deviation, noise = self._blended(si, active)
        colour = (mi.Color3f(self.average) + deviation) * (1.0 + 2.0 * self.uneven * noise)
        if self.has("patches"):
            colour *= patches(si.uv, self.patches)
        if self.has("fields"):
            away = si.t * dr.rsqrt(dr.maximum(dr.abs(si.wi.z), 0.02))
            crops = fields(si.uv, self.tile, away)
            colour *= dr.lerp(mi.Color3f(1.0), crops, self.fields)
        if self.wear is not None:
            relief = self._relief(deviation)
            colour = self._worn(si, colour, relief=relief, noise=noise, active=active)
        return dr.clip(colour, 0.002, 0.85)

    def rough(self, si: Any, active: Any) -> Any:
        """Return the roughness: it differs broadly, and is less in wheel tracks and on paint."""
        noise = mi.Float(0.0)
        if self.has("uneven"):
            near = corners(si.uv, cells=_GRID, mask=_GRID * PERIOD - 1)
            noise = near.unevenness
        value = self.roughness + 0.07 * noise
        if self.wear is not None:
            value = self._polished(si, value, noise=noise, active=active)
        return dr.clip(value, 0.1, 1.0)

    def _polished(self, si: Any, rough: Any, *, noise: Any, active: Any) -> Any:
        """Return a roughness with its wear and paint."""
        wear = self._wear_at(si, active)
        polish = 0.4 * dr.clip(1.0 - wear.x, 0.0, 0.3)
        share = self._share(wear, mi.Float(0.0), 0.1 * noise)
        return dr.lerp(rough - polish, _PAINT_ROUGHNESS, share)

    def _wear_at(self, si: Any, active: Any) -> Any:
        """Return the mesh's wear, in [0, 1] each.

        Mitsuba solves for a vertex attribute's weights in single precision: in triangles
        1,000 times longer than wide they are 0/0. Only unworn asphalt has such triangles.
        """
        wear = self.wear.eval_3(si, active)
        sound = dr.isfinite(wear.x) & (wear.x > 0.0)
        return dr.clip(dr.select(sound, wear, mi.Color3f(*UNWORN)), 0.0, 1.0)

    def _share(self, wear: Any, relief: Any, noise: Any) -> Any:
        """Return the share of paint that is left; it goes first where stones stand out."""
        kept = 1.25 * wear.y - 0.12 * relief + noise - 0.42
        return dr.select(wear.y > 0.0, dr.clip(kept * (1.0 / 0.4), 0.0, 1.0), 0.0)

    def _worn(self, si: Any, colour: Any, *, relief: Any, noise: Any, active: Any) -> Any:
        """Return a colour with its wear and paint."""
        wear = self._wear_at(si, active)
        white, yellow = (mi.Color3f(paint) for paint in PAINTS)
        blots = corners(si.uv, cells=2 * _GRID, mask=2 * _GRID * PERIOD - 1)
        flakes = corners(si.uv, cells=_FLAKES, mask=_FLAKES * PERIOD - 1)
        # Cracks run where the noise is 0; in each cell of the lattice that is a straight line.
        line = dr.abs(blots.noise(9) + 0.02 * relief) * (1.0 / _CRACK)
        crack = dr.clip(1.3 - line, 0.0, 1.0) * dr.clip(3.0 * noise - 0.2, 0.0, 1.0)
        loss = 0.14 * noise + 0.22 * flakes.noise(3) + 0.16 * blots.noise(5)
        dirt = 1.0 + 0.035 * relief + 0.09 * noise + 0.05 * blots.noise(5)
        paint = (white + wear.z * (yellow - white)) * dirt
        kept = self._share(wear, relief, loss) * (1.0 - 0.9 * crack)
        return dr.lerp(colour, paint, kept) * wear.x * (1.0 - 0.45 * crack)
