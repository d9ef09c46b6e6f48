"""Bitmaps over large areas without visible repetition, worn and painted by vertices.

The plane is cut into triangles; every corner of that lattice shifts the bitmap by a hash
of its own, and the three shifted copies are blended so that mean and variance stay. Texels
are picked from a pyramid by a ray's distance, one per copy, at random within the filter:
far surfaces neither sparkle nor crawl.

It works in JIT variants only; scalar ones show the plain bitmap.

References:
    Heitz and Neyret, "High-Performance By-Example Noise using a Histogram-Preserving
    Blending Operator", HPG 2018. Burley, "On Histogram-Preserving Blending for Randomized
    Texture Tiling", JCGT 2019 (sharper weights). Pharr et al., "Filtering After Shading
    With Stochastic Texture Filtering", I3D 2024.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from sumo3dviz_pt.model.geometry import UNWORN, Floats, Mesh
from sumo3dviz_pt.model.scene import Bsdf
from sumo3dviz_pt.render.fields import fields, patches
from sumo3dviz_pt.render.lattice import PERIOD, corners, mixed, unit

UNTILED = "untiled"
"""The word for this texture in a material's dict."""

WEAR_ATTRIBUTE = "vertex_wear"
"""A mesh's `wear`."""

_PLUGIN = "sumo3dviz_untiled"
_COLOUR_ATTRIBUTE = "vertex_colour"
_UNKNOWN = (0.12, 0.12, 0.12)  # reflectance
_GRID = 4  # lattice cells along a tile

PIXEL = 8e-4
"""Angle of a pixel where nothing better is known [rad]: 960 pixels over 45 degrees."""

_PAINTS = ((0.62, 0.62, 0.60), (0.60, 0.38, 0.05))  # white, yellow; linear reflectance
_PAINT_ROUGHNESS = 0.5
_BROAD = 8  # lattice cells of the fine grid along a cell of the broad unevenness


@dataclass(frozen=True, slots=True, eq=False)
class Pyramid:
    """A bitmap at all its halved sizes.

    Attributes:
        texels: All levels one after the other, (k, 4); the last channel pads.
        size: Texels along the finest level, a power of two.
        levels: How many there are.
        mean: Of each channel, (3,).
        spread: Standard deviation of the finest level's brightness.
    """

    texels: Floats
    size: int
    levels: int
    mean: Floats
    spread: float


def make_pyramid(image: Floats) -> Pyramid:
    """Halve an image down to eight texels.

    Args:
        image: Linear values, (n, n, 3); n is a power of two, at least 8.

    Raises:
        ValueError: If it is not square or n is no power of two.
    """
    size = len(image)
    if image.shape[:2] != (size, size) or size < 8 or size & (size - 1):
        raise ValueError("an untiled bitmap is square and its side a power of two")
    spread = float(image.mean(axis=-1).std())
    mean = image.reshape(-1, image.shape[-1]).mean(axis=0)
    levels = []
    while len(image) >= 8:
        levels.append(image.reshape(-1, image.shape[-1]))
        half = len(image) // 2
        image = image.reshape(half, 2, half, 2, -1).mean(axis=(1, 3))
    texels = np.concatenate(levels)
    padded = np.concatenate([texels, np.zeros((len(texels), 1))], axis=1)
    return Pyramid(padded, size, len(levels), mean, spread)


def untiled_texture(value: Mapping[str, Any], *, worn: bool = False) -> dict[str, Any]:
    """Our word as a plugin dict: of this texture, or of a plain one in scalar variants.

    Args:
        value: With `filename`, `tile` (metres along it), `mean` (reflectance), and maybe
            `wear` (the mesh says by vertex how worn and painted it is), `uneven`
            (relative amplitude of broad differences in brightness), `patches` (amount of
            dry and lush patches), `fields` (amount of crops) and `roughness` (the texture
            is then a roughness with this mean).
        worn: Whether it is for a worn or painted mesh: a scalar variant then shows
            the vertices' colours.
    """
    if "scalar" not in mi.variant():
        rest = {key: item for key, item in value.items() if key not in {"type", "mean"}}
        return {"type": _PLUGIN, **rest}
    if "roughness" in value:
        return {"type": "uniform", "value": float(value["roughness"])}
    if worn and value.get("wear"):
        return {"type": "mesh_attribute", "name": _COLOUR_ATTRIBUTE}
    return {"type": "bitmap", "filename": value["filename"]}


def is_worn(mesh: Mesh) -> bool:
    """Whether any vertex is worn or painted."""
    return mesh.wear is not None and bool((mesh.wear != UNWORN).any())


def wear_attributes(bsdf: Bsdf, mesh: Mesh) -> dict[str, Floats]:
    """What a mesh must tell a material about its wear, by attribute name, each (n, 3)."""
    word = _wearing(bsdf)
    if word is None:
        return {}
    wear = np.tile(UNWORN, (len(mesh.vertices), 1)) if mesh.wear is None else mesh.wear
    if "scalar" not in mi.variant():
        return {WEAR_ATTRIBUTE: wear}
    mean = np.array(word.get("mean", _UNKNOWN), dtype=np.float64)
    return {_COLOUR_ATTRIBUTE: worn_colours(wear, mean)} if is_worn(mesh) else {}


def worn_colours(wear: Floats, mean: Floats) -> Floats:
    """Reflectance of worn and painted vertices where no texture is possible.

    Args:
        wear: As in `Mesh`, (n, 3).
        mean: The surface's reflectance, (3,).

    Returns:
        (n, 3).
    """
    white, yellow = np.array(_PAINTS)
    paint = white + wear[:, 2:] * (yellow - white)
    return np.asarray(mean * wear[:, :1] * (1 - wear[:, 1:2]) + paint * wear[:, 1:2])


def _wearing(bsdf: Bsdf) -> Mapping[str, Any] | None:
    """The first word in a material that asks for wear."""
    words = [item for item in bsdf.values() if isinstance(item, Mapping)]
    if bsdf.get("type") == UNTILED and bsdf.get("wear"):
        return bsdf
    return next((found for word in words if (found := _wearing(word)) is not None), None)


def _read(filename: str) -> Floats:
    """A picture's linear reflectance, (n, n, 3)."""
    bitmap = mi.Bitmap(filename).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, False)
    return np.array(bitmap, dtype=np.float64)


def register_untiled(pixel: float = PIXEL) -> None:  # noqa: C901 - needs the variant to exist
    """Make the texture known to the active JIT variant.

    Args:
        pixel: Angle of a pixel of the textures that are made from now on [rad].
    """

    class UntiledTexture(mi.Texture):  # type: ignore[misc]
        """A bitmap's reflectance without its period."""

        def __init__(self, props: Any) -> None:
            mi.Texture.__init__(self, props)
            pyramid = make_pyramid(_read(str(props["filename"])))
            self.texels = mi.Float(np.ascontiguousarray(pyramid.texels, np.float32).ravel())
            self.size, self.levels = pyramid.size, pyramid.levels
            # Opaque, so that pictures of all sizes share their kernels.
            self.pixel = dr.opaque(mi.Float, pixel)
            self.average = [float(value) for value in pyramid.mean]
            self.spread = max(pyramid.spread, 1e-6)
            self.tile = float(props.get("tile", 4.0))
            self.uneven = float(props.get("uneven", 0.0))
            self.patches = float(props.get("patches", 0.0))
            self.fields = float(props.get("fields", 0.0))
            self.roughness = float(props.get("roughness", 0.0))
            worn = bool(props.get("wear", False))
            attribute = {"type": "mesh_attribute", "name": WEAR_ATTRIBUTE}
            self.wear: Any = mi.load_dict(attribute) if worn else None

        def _level(self, si: Any, dice: Any) -> Any:
            """Level whose texels are one to two pixels large; in between by chance."""
            slant = dr.rsqrt(dr.maximum(dr.abs(si.wi.z), 0.02))
            texels = si.t * slant * self.pixel * (self.size / self.tile)
            level = dr.log2(dr.clip(texels, 1.0, 1e6)) + dice
            return mi.UInt32(dr.clip(level, 0.0, self.levels - 1.0))

        def _pick(self, uv: Any, level: Any, shift: Any, active: Any) -> Any:
            """One texel of a shifted copy."""
            size = mi.UInt32(self.size) >> level
            scale = mi.Float(size)
            x = mi.Int32(dr.floor((uv.x + unit(shift << 16)) * scale))
            y = mi.Int32(dr.floor((uv.y + unit(shift & 0xFFFF0000)) * scale))
            # Levels before this one hold size^2 (1 + 1/4 + ...) texels.
            before = (mi.UInt32(self.size**2) - size * size) // 3 * 4
            index = before + (mi.UInt32(y) & (size - 1)) * size + (mi.UInt32(x) & (size - 1))
            return dr.gather(mi.Vector4f, self.texels, index, active)

        def _blended(self, si: Any, active: Any) -> tuple[Any, Any]:
            """Deviation of the three copies' blend from the mean, and broad noise."""
            bits = mixed(
                dr.reinterpret_array(mi.UInt32, si.uv.x)
                ^ mixed(dr.reinterpret_array(mi.UInt32, si.uv.y))
                ^ dr.reinterpret_array(mi.UInt32, si.t)
            )
            level = self._level(si, unit(bits))
            again = mixed(bits + 1)
            jitter = mi.Vector2f(unit(again << 16), unit(again & 0xFFFF0000)) - 0.5
            uv = si.uv + jitter / mi.Float(mi.UInt32(self.size) >> level)
            near = corners(si.uv, cells=_GRID, mask=_GRID * PERIOD - 1)
            # Cubed weights: narrow zones of blending keep stones crisp.
            sharp = [weight * weight * weight for weight in near.weights]
            total = sharp[0] + sharp[1] + sharp[2]
            length = dr.square(sharp[0]) + dr.square(sharp[1]) + dr.square(sharp[2])
            value = mi.Color3f(0.0)
            for weight, shift in zip(sharp, near.hashes, strict=True):
                texel = self._pick(uv, level, shift, active)
                value += weight * mi.Color3f(texel.x, texel.y, texel.z)
            # Sum(w x) / |w| has the bitmap's variance; its mean is put right.
            deviation = (value - mi.Color3f(self.average) * total) * dr.rsqrt(length)
            if self.uneven == 0:
                return deviation, mi.Float(0.0)
            far = corners(si.uv, cells=_GRID / _BROAD, mask=_GRID * PERIOD // _BROAD - 1)
            return deviation, 0.5 * near.unevenness + 0.5 * far.unevenness

        def _relief(self, deviation: Any) -> Any:
            """How much a stone stands out, about unit spread."""
            return (deviation.x + deviation.y + deviation.z) * (1.0 / (3.0 * self.spread))

        def _colour(self, si: Any, active: Any) -> Any:
            deviation, noise = self._blended(si, active)
            colour = (mi.Color3f(self.average) + deviation) * (1.0 + 2.0 * self.uneven * noise)
            if self.patches > 0:
                colour *= patches(si.uv, self.patches)
            if self.fields > 0:
                away = si.t * dr.rsqrt(dr.maximum(dr.abs(si.wi.z), 0.02))
                crops = fields(si.uv, self.tile, away)
                colour *= dr.lerp(mi.Color3f(1.0), crops, self.fields)
            if self.wear is not None:
                relief = self._relief(deviation)
                colour = self._worn(si, colour, relief=relief, noise=noise, active=active)
            return dr.clip(colour, 0.002, 0.85)

        def _rough(self, si: Any, active: Any) -> Any:
            """Roughness: broad differences, polish in tracks, smoother paint; no texels."""
            noise = mi.Float(0.0)
            if self.uneven > 0:
                near = corners(si.uv, cells=_GRID, mask=_GRID * PERIOD - 1)
                noise = near.unevenness
            value = self.roughness + 0.07 * noise
            if self.wear is not None:
                wear = self._wear_at(si, active)
                polish = 0.4 * dr.clip(1.0 - wear.x, 0.0, 0.3)
                share = self._share(wear, mi.Float(0.0), 0.5 * noise)
                value = dr.lerp(value - polish, _PAINT_ROUGHNESS, share)
            return dr.clip(value, 0.1, 1.0)

        def _wear_at(self, si: Any, active: Any) -> Any:
            """The mesh's wear, in [0, 1] each.

            Mitsuba solves for a vertex attribute's weights in single precision: in triangles
            1,000 times longer than wide they are 0/0. Only unworn asphalt has such triangles.
            """
            wear = self.wear.eval_3(si, active)
            sound = dr.isfinite(wear.x) & (wear.x > 0.0)
            return dr.clip(dr.select(sound, wear, mi.Color3f(*UNWORN)), 0.0, 1.0)

        def _share(self, wear: Any, relief: Any, noise: Any) -> Any:
            """Share of paint that is left; it goes first where stones stand out."""
            kept = 1.25 * wear.y - 0.10 * relief + 0.22 * noise - 0.42
            return dr.select(wear.y > 0.0, dr.clip(kept * (1.0 / 0.4), 0.0, 1.0), 0.0)

        def _worn(self, si: Any, colour: Any, *, relief: Any, noise: Any, active: Any) -> Any:
            """A colour with its wear and paint."""
            wear = self._wear_at(si, active)
            white, yellow = (mi.Color3f(paint) for paint in _PAINTS)
            paint = (white + wear.z * (yellow - white)) * (1.0 + 0.035 * relief + 0.06 * noise)
            return dr.lerp(colour * wear.x, paint, self._share(wear, relief, noise))

        def eval(self, si: Any, active: Any = True) -> Any:
            return self._colour(si, active)

        def eval_3(self, si: Any, active: Any = True) -> Any:
            return self._colour(si, active)

        def eval_1(self, si: Any, active: Any = True) -> Any:
            if self.roughness > 0:
                return self._rough(si, active)
            return mi.luminance(self._colour(si, active))

        def mean(self) -> Any:
            return mi.Float(sum(self.average) / 3.0)

        def is_spatially_varying(self) -> bool:
            return True

        def traverse(self, callback: Any) -> None:
            callback.put("texels", self.texels, mi.ParamFlags.NonDifferentiable)

        def to_string(self) -> str:
            return "UntiledTexture[]"

    mi.register_texture(_PLUGIN, lambda props: UntiledTexture(props))
