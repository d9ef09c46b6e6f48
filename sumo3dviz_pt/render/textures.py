"""Bitmaps over large areas without visible repetition: noise, sizes, fields, wear and paint.

The plane is cut into triangles; every corner of that lattice shifts the bitmap by a hash of its
own, and the three shifted copies are blended so that mean and variance stay. The lattice repeats
after whole periods. Texels are picked from a pyramid, which holds the bitmap at many sizes, each
half of the one before: by a ray's distance, one per copy, at random within the filter. So far
surfaces neither sparkle nor crawl.

Land as seen from a height has dry and lush patches, and fields of different crops. Both are factors
on the ground's reflectance with a mean of about one. They depend on the place alone and repeat with
the lattice's period. Wear and paint change the colour or roughness that a ray sees.

All of it works in JIT variants only, where everything is an array of Dr.Jit; scalar ones show the
plain bitmap.

References:
    Hash: Wellons, "Prospecting for Hash Functions", 2018 (lowbias32). Simplex lattice:
    Perlin, "Noise hardware", SIGGRAPH course 2001.
    Heitz and Neyret, "High-Performance By-Example Noise using a Histogram-Preserving
    Blending Operator", HPG 2018. Burley, "On Histogram-Preserving Blending for Randomized
    Texture Tiling", JCGT 2019 (sharper weights). Pharr et al., "Filtering After Shading
    With Stochastic Texture Filtering", I3D 2024.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any
from weakref import WeakValueDictionary

import drjit as dr
import mitsuba as mi
import numpy as np

from sumo3dviz_pt.model.geometry import PAINTS, UNWORN, Floats, Image, Mesh, worn_colours
from sumo3dviz_pt.model.scene import Bsdf
from sumo3dviz_pt.render.kernels import aligned_zeros, in_place, load

PERIOD = 1024
"""After so many tiles the hashes repeat, so that whole periods can be dropped."""


def mixed(value: Any) -> Any:
    """Scramble the bits of an integer (Wellons' lowbias32)."""
    value = (value ^ (value >> 16)) * 0x7FEB352D
    value = (value ^ (value >> 15)) * 0x846CA68B
    return value ^ (value >> 16)


def unit(bits: Any) -> Any:
    """Return bits as a number in [0, 1)."""
    return mi.Float(bits >> 8) * (1.0 / (1 << 24))


@dataclass(frozen=True, slots=True)
class Corners:
    """Three corners of the lattice around a point: hashes and linear weights."""

    hashes: tuple[Any, Any, Any]
    weights: tuple[Any, Any, Any]

    @property
    def unevenness(self) -> Any:
        """Smooth noise in [-1, 1]."""
        return self.noise(77)

    def noise(self, salt: int) -> Any:
        """Return smooth noise in [-1, 1], another one for each salt."""
        rows = zip(self.hashes, self.weights, strict=True)
        return sum(weight * (2.0 * unit(mixed(bits + salt)) - 1.0) for bits, weight in rows)


def hashed(a: Any, b: Any, mask: int) -> Any:
    """Return random bits of a cell.

    Args:
        a: Its column, an integer.
        b: Its row, an integer.
        mask: Cells after which rows and columns repeat, a power of two, less one.
    """
    return mixed((a & mask) * 0x9E3779B1 ^ mixed((b & mask) + 0x85EBCA6B))


def corners(uv: Any, *, cells: float, mask: int) -> Corners:
    """Return the corners of the triangle that a point lies in.

    The lattice is sheared by whole half cells, so that it repeats with the tile. One
    period up is half a period of cells to the left: columns repeat after half of them.

    Args:
        uv: Texture coordinates [tiles].
        cells: Cells along a tile.
        mask: Cells in a period, less one.
    """
    x, y = cells * (uv.x - 0.5 * uv.y), cells * uv.y
    column, row = dr.floor(x), dr.floor(y)
    fx, fy = x - column, y - row
    lower = fx + fy < 1.0
    i, j = mi.UInt32(mi.Int32(column)), mi.UInt32(mi.Int32(row))
    step = dr.select(lower, mi.UInt32(0), mi.UInt32(1))
    half = mask >> 1
    return Corners(
        (
            hashed((i + step) & half, j + step, mask),
            hashed((i + 1) & half, j, mask),
            hashed(i & half, j + 1, mask),
        ),
        (
            dr.abs(1.0 - fx - fy),
            dr.select(lower, fx, 1.0 - fy),
            dr.select(lower, fy, 1.0 - fx),
        ),
    )


@dataclass(frozen=True, slots=True, eq=False, weakref_slot=True)
class Pyramid:
    """A bitmap at many sizes, each half of the one before.

    Attributes:
        texels: All levels one after the other, (k, 4), in single precision and aligned, as all
            materials that show them read them in place; the last channel pads.
        size: Texels along the finest level, a power of two.
        levels: How many there are.
        mean: Of each channel, (3,).
        spread: Standard deviation of the finest level's brightness, above 0.
    """

    texels: Image
    size: int
    levels: int
    mean: Floats
    spread: float


def make_pyramid(image: Floats | Image) -> Pyramid:
    """Halve an image down to eight texels.

    Args:
        image: Linear values, (n, n, 3); n is a power of two, at least 8.

    Raises:
        ValueError: If it is not square or n is no power of two.
    """
    size = len(image)
    if image.shape[:2] != (size, size) or size < 8 or size & (size - 1):
        raise ValueError("an untiled bitmap is square and its side a power of two")
    grey = (image[..., 0] + image[..., 1] + image[..., 2]) / 3.0
    spread = max(float(grey.std(dtype=np.float64)), 1e-6)
    mean = image.reshape(-1, 3).mean(axis=0, dtype=np.float64)
    sides = [size >> level for level in range(size.bit_length() - 3)]
    texels, begin = aligned_zeros((sum(side * side for side in sides), 4), np.float32), 0
    for side in sides:
        texels[begin : begin + side * side, :3] = image.reshape(-1, 3)
        begin += side * side
        rows = image[::2] + image[1::2]
        image = (rows[:, ::2] + rows[:, 1::2]) / 4.0
    return Pyramid(texels, size, len(sides), mean, spread)


FIELD = (32.0, 16.0)
"""Length and width of fields by sqrt(5) [tiles]; world/plants/trees.py has hedgerows there."""

_DRY = (0.88, 0.42, 0.66)  # change of reflectance where grass dries
_LUSH = (-0.46, -0.10, -0.22)  # where clover and nettles grow
_CROPS = (
    (1.0, 1.0, 1.0),
    (1.22, 1.13, 1.10),  # mown
    (0.66, 0.84, 0.70),  # a young crop
    (1.36, 1.12, 1.26),  # hay
    (1.75, 1.24, 1.52),  # stubble
    (0.86, 1.04, 0.74),
)
_SWATH = 7.2  # width of what a machine passes over at once [m]
_PIXEL = 8e-4  # angle of a pixel that is assumed [rad]


def patches(uv: Any, amount: float) -> Any:
    """Return the factor of dry and lush patches, from half a tile to four tiles wide.

    Args:
        uv: Texture coordinates [tiles].
        amount: 0 gives one everywhere.
    """
    askew = _turned(uv)
    broad = corners(uv, cells=0.25, mask=PERIOD // 4 - 1)
    middle = corners(askew, cells=0.25, mask=PERIOD // 4 - 1)
    small = corners(askew, cells=1.0, mask=PERIOD - 1)
    dry = 0.42 * broad.noise(5) + 0.42 * middle.noise(6) + 0.3 * small.noise(7)
    lush = 0.35 * broad.noise(8) + 0.45 * middle.noise(9) + 0.4 * small.noise(10)
    # Dry spots get an edge; without one they would look like the shadows of clouds.
    dry = 1.5 * dry / dr.sqrt(0.35 + dry * dry)
    change = mi.Color3f(*_DRY) * (0.3 * dry) + mi.Color3f(*_LUSH) * (0.9 * lush)
    return mi.Color3f(1.0) + amount * change


def fields(uv: Any, tile: float, away: Any) -> Any:
    """Return the factor of fields with strips of grass between them.

    Args:
        uv: Texture coordinates [tiles].
        tile: [m].
        away: Distance over the cosine of the ray's angle to the ground's normal [m].
    """
    askew = _turned(uv)
    wobble = 0.15 * corners(uv, cells=0.5, mask=PERIOD // 2 - 1).noise(21)
    a, b = (askew.x + wobble) / FIELD[0], (askew.y + wobble) / FIELD[1]
    column, row = dr.floor(a), dr.floor(b)
    bits = hashed(mi.UInt32(mi.Int32(column)), mi.UInt32(mi.Int32(row)), PERIOD // 16 - 1)
    pick = mi.UInt32(unit(bits) * len(_CROPS))
    crop = mi.Color3f(1.0)
    for number, colour in enumerate(_CROPS):
        crop = dr.select(pick == number, mi.Color3f(*colour), crop)
    # Swaths differ in turn, because machines cut every other one in the opposite direction.
    turns = (b - row) * (FIELD[1] * tile / 5.0**0.5 / _SWATH)
    fade = dr.clip(1.5 - away * (2.0 * _PIXEL / _SWATH), 0.0, 1.0)
    stripes = 0.09 * fade * dr.clip(3.0 * dr.sin(3.14159 * turns), -1.0, 1.0)
    inside = dr.minimum(
        dr.minimum(a - column, 1.0 - (a - column)) * FIELD[0],
        dr.minimum(b - row, 1.0 - (b - row)) * FIELD[1],
    )
    share = dr.clip(inside * (tile / 5.0**0.5 / 3.0) - 0.5, 0.0, 1.0)
    return dr.lerp(mi.Color3f(1.0), crop * (1.0 + stripes), share)


def _turned(uv: Any) -> Any:
    """Turn coordinates by 27 degrees and enlarge them by sqrt(5); whole periods stay whole."""
    return mi.Vector2f(2.0 * uv.x + uv.y, 2.0 * uv.y - uv.x)


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
        painted = 1.25 * wear.y - 0.12 * relief + noise - 0.42
        return dr.select(wear.y > 0.0, dr.clip(painted * (1.0 / 0.4), 0.0, 1.0), 0.0)

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
        share = self._share(wear, relief, loss) * (1.0 - 0.9 * crack)
        return dr.lerp(colour, paint, share) * wear.x * (1.0 - 0.45 * crack)


UNTILED = "untiled"
"""The word for this texture in a material's dict."""

ROOMS = "rooms"
"""The word for what is seen through panes, in a material's dict; see `render/rooms.py`."""

CABIN = "cabin"
"""The word for what is seen through panes of cars; see `render/cabins.py`."""

WEAR_ATTRIBUTE = "vertex_wear"
"""Name of the attribute that holds a mesh's `wear`."""

_PLUGIN = "sumo3dviz_untiled"
_COLOUR_ATTRIBUTE = "vertex_colour"
PLAIN = {
    "tile": 4.0,
    "uneven": 0.0,
    "patches": 0.0,
    "fields": 0.0,
    "roughness": 0.0,
    "regular": 0.0,
}
"""Numbers that a texture's dict leaves out."""

_UNKNOWN = (0.12, 0.12, 0.12)  # reflectance

PIXEL = 8e-4
"""Angle of a pixel where nothing better is known [rad]: 960 pixels over 45 degrees."""


def untiled_texture(value: Mapping[str, Any], *, worn: bool = False) -> dict[str, Any]:
    """Return the dict of this plugin, or of a plain texture in scalar variants.

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
        rest = {key: item for key, item in value.items() if key not in {"type", "mean", "gain"}}
        return {"type": _PLUGIN, **rest}
    if "roughness" in value:
        return {"type": "uniform", "value": float(value["roughness"])}
    if worn and value.get("wear"):
        return {"type": "mesh_attribute", "name": _COLOUR_ATTRIBUTE}
    return {"type": "bitmap", "filename": value["filename"]}


def is_worn(mesh: Mesh) -> bool:
    """Return whether any vertex is worn or painted."""
    return mesh.wear is not None and bool((mesh.wear != UNWORN).any())


def wear_attributes(bsdf: Bsdf, mesh: Mesh) -> dict[str, Floats]:
    """Return what a mesh must tell a material about its wear, by attribute name, each (n, 3)."""
    word = _wearing(bsdf)
    if word is None:
        return {}
    wear = np.tile(UNWORN, (len(mesh.vertices), 1)) if mesh.wear is None else mesh.wear
    if "scalar" not in mi.variant():
        return {WEAR_ATTRIBUTE: wear}
    if word.get("type") in (ROOMS, CABIN, "stained"):
        return {}
    mean = np.array(word.get("mean", _UNKNOWN), dtype=np.float64)
    return {_COLOUR_ATTRIBUTE: worn_colours(wear, mean)} if is_worn(mesh) else {}


def _wearing(bsdf: Bsdf) -> Mapping[str, Any] | None:
    """Return the first texture of ours in a material that shows wear; None if there is none."""
    words = [item for item in bsdf.values() if isinstance(item, Mapping)]
    if bsdf.get("type") in (ROOMS, CABIN) or bsdf.get("weathered"):
        return bsdf
    if bsdf.get("type") == UNTILED and bsdf.get("wear"):
        return bsdf
    return next((wearing for word in words if (wearing := _wearing(word)) is not None), None)


_PYRAMIDS: WeakValueDictionary[str, Pyramid] = WeakValueDictionary()
"""Those that some texture holds, so that others of the same file need not read it again."""


def pyramid_of(filename: str) -> Pyramid:
    """Return a picture's linear reflectance at all sizes."""
    pyramid = _PYRAMIDS.get(filename)
    if pyramid is None:
        pyramid = _PYRAMIDS[filename] = _read_pyramid(filename)
    return pyramid


def _read_pyramid(filename: str) -> Pyramid:
    """Read a picture and halve it."""
    bitmap = mi.Bitmap(filename).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, False)
    return make_pyramid(np.asarray(bitmap))


def register_untiled(pixel: float = PIXEL) -> None:  # noqa: C901 - needs the variant to exist
    """Make the texture known to the active JIT variant.

    Args:
        pixel: Angle of a pixel of the textures that are made from now on [rad].
    """

    class UntiledTexture(mi.Texture):  # type: ignore[misc]
        """A bitmap's reflectance without its period."""

        def __init__(self, props: Any) -> None:
            mi.Texture.__init__(self, props)
            self.untiled = _untiled(props, pixel)

        def eval(self, si: Any, active: Any = True) -> Any:
            return self.untiled.colour(si, active)

        def eval_3(self, si: Any, active: Any = True) -> Any:
            return self.untiled.colour(si, active)

        def eval_1(self, si: Any, active: Any = True) -> Any:
            if self.untiled.roughness > 0:
                return self.untiled.rough(si, active)
            return mi.luminance(self.untiled.colour(si, active))

        def mean(self) -> Any:
            return mi.Float(sum(self.untiled.average) / 3.0)

        def is_spatially_varying(self) -> bool:
            return True

        def traverse(self, callback: Any) -> None:
            callback.put("texels", self.untiled.texels, mi.ParamFlags.NonDifferentiable)

        def to_string(self) -> str:
            return "UntiledTexture[]"

    mi.register_texture(_PLUGIN, lambda props: UntiledTexture(props))


def _untiled(props: Any, pixel: float) -> Untiled:
    """Make the texture that a plugin's properties describe."""
    pyramid = pyramid_of(str(props["filename"]))
    attribute = {"type": "mesh_attribute", "name": WEAR_ATTRIBUTE}
    worn = bool(props.get("wear", False))
    return Untiled(
        pyramid,
        mi.Float(in_place(pyramid.texels, np.float32)),
        dr.opaque(mi.Float, pixel),
        wear=load(attribute) if worn else None,
        **{name: float(props.get(name, plain)) for name, plain in PLAIN.items()},
    )
