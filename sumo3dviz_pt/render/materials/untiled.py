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
from typing import Any
from weakref import WeakValueDictionary

import drjit as dr
import mitsuba as mi
import numpy as np

from sumo3dviz_pt.model.geometry import UNWORN, Floats, Mesh
from sumo3dviz_pt.model.scene import Bsdf
from sumo3dviz_pt.render.kernels import aligned, load
from sumo3dviz_pt.render.materials.pyramid import Pyramid, make_pyramid
from sumo3dviz_pt.render.materials.untiled_shading import PAINTS, Untiled

UNTILED = "untiled"
"""The word for this texture in a material's dict."""

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
    mean = np.array(word.get("mean", _UNKNOWN), dtype=np.float64)
    return {_COLOUR_ATTRIBUTE: worn_colours(wear, mean)} if is_worn(mesh) else {}


def worn_colours(wear: Floats, mean: Floats) -> Floats:
    """Return the reflectance of worn and painted vertices where no texture is possible.

    Args:
        wear: As in `Mesh`, (n, 3).
        mean: The surface's reflectance, (3,).

    Returns:
        (n, 3).
    """
    white, yellow = np.array(PAINTS)
    paint = white + wear[:, 2:] * (yellow - white)
    return np.asarray(wear[:, :1] * (mean * (1 - wear[:, 1:2]) + paint * wear[:, 1:2]))


def _wearing(bsdf: Bsdf) -> Mapping[str, Any] | None:
    """Return the first texture of ours in a material that shows wear; None if there is none."""
    words = [item for item in bsdf.values() if isinstance(item, Mapping)]
    if bsdf.get("type") == UNTILED and bsdf.get("wear"):
        return bsdf
    return next((found for word in words if (found := _wearing(word)) is not None), None)


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
    return make_pyramid(np.array(bitmap, dtype=np.float32))


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
        mi.Float(aligned(pyramid.texels, np.float32)),
        dr.opaque(mi.Float, pixel),
        wear=load(attribute) if worn else None,
        **{name: float(props.get(name, plain)) for name, plain in PLAIN.items()},
    )
