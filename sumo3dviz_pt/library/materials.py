"""Materials in Mitsuba's words: by name, and by the key of a surface.

A surface's key is an asset's name, an image file, or `#rrggbb`.

Named materials are read from `assets/materials`. Base colours stay at or below 0.85, where
`principled` gives back no more than an even sky sends (only seen at less than 24 degrees over the
surface it gains, by up to a third: tests/statistical/test_furnace.py); roughness stays at or above
0.05, where path tracing finds the sun without fireflies. Windows are opaque and dark, because
`path` finds no sun through panes.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from sumo3dviz_pt import catalog
from sumo3dviz_pt.catalog import Entry, find
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.library.asset_files import AssetFile, RecipeValue, read_family
from sumo3dviz_pt.library.pictures import check_picture, read_linear
from sumo3dviz_pt.model.geometry import Colour, Floats, Mesh
from sumo3dviz_pt.model.layers import linear_from_srgb
from sumo3dviz_pt.model.scene import Bsdf, Part

TINT: Bsdf = {"type": "tint"}

_WORDS: Mapping[str, Bsdf] = {
    "tint": TINT,
    "rooms": {"type": "rooms", "tint": TINT},
    "cabin": {"type": "cabin"},
    "lens": {"type": "lens", "tint": TINT},
}
"""What stands for a colour in a file, and is none."""


def principled(
    colour: Colour | Bsdf, *, roughness: float, metallic: float = 0.0, specular: float = 0.5
) -> Bsdf:
    """Describe a material of Disney's kind.

    Args:
        colour: Linear reflectance, or a texture.
        roughness: [0, 1].
        metallic: 0 for plastics, paints and stone, 1 for bare metal.
        specular: Strength of the reflection that has no colour, [0, 1].
    """
    return {
        "type": "principled",
        "base_color": _texture(colour),
        "roughness": roughness,
        "metallic": metallic,
        "specular": specular,
    }


def coated(colour: Colour | Bsdf, *, roughness: float, under: float, flop: float = 0.0) -> Bsdf:
    """Describe a varnished paint.

    Args:
        colour: Linear reflectance, or a texture.
        roughness: Of the varnish, [0, 1].
        under: Roughness of the paint under it, [0, 1].
        flop: How much the paint darkens where one looks along it, [0, 1].
    """
    return {
        "type": "coated",
        "base_color": _texture(colour),
        "roughness": roughness,
        "under_roughness": under,
        "flop": flop,
    }


def _texture(colour: Colour | Bsdf) -> Bsdf:
    """Describe a colour, or copy the description of a texture."""
    return {"type": "rgb", "value": list(colour)} if isinstance(colour, tuple) else dict(colour)


def matt(colour: Colour | Bsdf) -> Bsdf:
    """Describe a perfectly diffuse material."""
    return {"type": "diffuse", "reflectance": _texture(colour)}


def two_sided(bsdf: Bsdf) -> Bsdf:
    """Make a material visible from behind, for open surfaces only: it costs shading time."""
    return {"type": "twosided", "bsdf": bsdf}


def translucent(colour: Colour | Bsdf, *, transmitted: float) -> Bsdf:
    """Describe leaves: transmitted / 2 of the light that they do not absorb goes through them.

    Seen from both sides; it costs as much as a two-sided matt material.
    """
    return {
        "type": "principledthin",
        "base_color": _texture(colour),
        "roughness": 0.5,
        "diff_trans": transmitted,
        "spec_trans": 0.0,
        "eta": 1.4,
    }


def mirror(colour: Colour) -> Bsdf:
    """Describe a perfect mirror that gives back a share of each colour."""
    return {"type": "conductor", "material": "none", "specular_reflectance": _texture(colour)}


@dataclass(frozen=True, slots=True, kw_only=True)
class MaterialRow(RecipeValue):
    """A material as numbers: a row of an `asset.yaml` in `assets/materials`.

    Attributes:
        colour: Linear reflectance, `tint` where every face has one of its own, or `rooms` for
            panes that show rooms whose walls have the face's, `cabin` for panes of cars, or
            `lens` for lamps that have the face's.
        roughness: [0, 1].
        metallic: 0 for plastics, paints and stone, 1 for bare metal.
        specular: Strength of the reflection that has no colour, [0, 1].
        under_roughness: Of what lies under a coat of varnish; None for what has no coat. Then
            `roughness` is that of the coat, and there is no other number but `flop`.
        flop: How much a coated paint darkens where one looks along it, as effect paints do,
            [0, 1]; road users bring their own.
        spec_tint: How far reflections take the colour; None leaves it to the renderer.
        transmitted: Twice the share of light that goes through a leaf, of what it does not
            absorb; None for what is no leaf. Leaves have no other numbers.
        two_sided: Whether its surfaces are open, and seen from behind.
        mirror: Whether it is a perfect mirror; it has no number but its colour.
    """

    colour: Colour | Literal["tint", "rooms", "cabin", "lens"]
    roughness: float = 0.5
    metallic: float = 0.0
    specular: float = 0.5
    under_roughness: float | None = None
    flop: float = 0.0
    spec_tint: float | None = None
    transmitted: float | None = None
    two_sided: bool = False
    mirror: bool = False

    def bsdf(self) -> Bsdf:
        """Describe the material in Mitsuba's words."""
        made = self._one_sided()
        return two_sided(made) if self.two_sided else made

    def _one_sided(self) -> Bsdf:
        """Describe it as it looks from outside."""
        if isinstance(self.colour, tuple):
            colour: Colour | Bsdf = self.colour
        else:
            colour = _WORDS[self.colour]
        if self.mirror and isinstance(colour, tuple):
            return mirror(colour)
        if self.transmitted is not None:
            return translucent(colour, transmitted=self.transmitted)
        if self.under_roughness is not None:
            return coated(
                colour, roughness=self.roughness, under=self.under_roughness, flop=self.flop
            )
        plain = principled(
            colour, roughness=self.roughness, metallic=self.metallic, specular=self.specular
        )
        return plain if self.spec_tint is None else {**plain, "spec_tint": self.spec_tint}


@dataclass(frozen=True, slots=True, kw_only=True)
class _MaterialsFile(AssetFile):
    """Content of an `asset.yaml` with materials: what belongs together, by name."""

    kind: Literal["materials"]
    recipe: Mapping[str, MaterialRow]


def _read_materials() -> dict[str, Bsdf]:
    """Read the materials of all files.

    Raises:
        ConfigError: If two files have a material of the same name.
    """
    materials: dict[str, Bsdf] = {}
    for group, file in read_family("materials", _MaterialsFile).items():
        for name, finish in file.recipe.items():
            if name in materials:
                raise ConfigError(f"{name!r} is in another file, too", key=f"materials/{group}")
            materials[name] = finish.bsdf()
    return materials


MATERIALS: Mapping[str, Bsdf] = _read_materials()
"""All named materials; a part says which one it is made of."""


def surface_bsdf(entry: Entry) -> Bsdf:
    """Describe the material of a surface asset, with absolute texture paths."""

    def resolved(value: Any) -> Any:
        """Copy a description with the places of its files."""
        if not isinstance(value, Mapping):
            return value
        own = {
            key: str(entry.folder / item) if key == "filename" else resolved(item)
            for key, item in value.items()
        }
        if value.get("type") == "untiled":
            own |= {"tile": float(entry.meta["scale"]), "mean": tuple(entry.meta["albedo"])}
        return own

    bsdf: Bsdf = resolved(entry.meta["bsdf"])
    return bsdf


def surface_scale(name: str) -> float:
    """Return the metres per tile of a surface asset."""
    return float(find("surfaces", name).meta["scale"])


KERB = "kerb"
"""The material of kerbs, walls and verges; not a surface asset."""

_FILE_SCALE = 10.0
"""Metres per tile of a user's image."""


def material_name(key: str) -> str:
    """Name the material that shows a surface."""
    return f"surface:{key}"


def colour_of(text: str) -> Colour:
    """Read `#rrggbb` as linear reflectance, at most 0.85.

    References:
        IEC 61966-2-1 (sRGB), inverse of the transfer function.

    Raises:
        ConfigError: If it is not six hexadecimal digits after `#`.
    """
    try:
        if len(text) != 7:
            raise ValueError
        red, green, blue = (int(text[k : k + 2], 16) / 255.0 for k in (1, 3, 5))
    except ValueError:
        raise ConfigError(f"a colour is written #rrggbb, not {text!r}") from None
    return _linear(red), _linear(green), _linear(blue)


def surface_material(key: str, *, textured: bool) -> Bsdf:
    """Describe the material of a surface.

    Args:
        key: An asset's name, an image file, or `#rrggbb`.
        textured: False gives a matt constant colour.

    Raises:
        ConfigError: If there is no such surface or file, or an image reflects more than all.
        InputError: If an .exr or .hdr file cannot be read.
    """
    if key.startswith("#"):
        return matt(colour_of(key))
    if _is_file(key):
        path = Path(key).resolve()
        _check_reflectance(path)
        return matt({"type": "bitmap", "filename": str(path)} if textured else (0.2, 0.2, 0.2))
    entry = catalog.find("surfaces", key)
    if textured:
        return surface_bsdf(entry)
    red, green, blue = entry.meta["albedo"]
    return matt((float(red), float(green), float(blue)))


def check_surface(key: str) -> None:
    """Refuse a surface that is not there.

    Raises:
        ConfigError: If there is no such asset or file, or it is no colour.
    """
    if key.startswith("#"):
        colour_of(key)
    elif _is_file(key):
        check_picture(Path(key))
    else:
        catalog.find("surfaces", key)


def shows_wear(key: str) -> bool:
    """Tell whether a surface's material needs meshes that say how worn and painted they are."""
    if key == KERB or key.startswith("#") or _is_file(key):
        return False
    colour = catalog.find("surfaces", key).meta["bsdf"].get("base_color", {})
    return isinstance(colour, dict) and bool(colour.get("wear"))


def metres_per_tile(key: str) -> float:
    """Return how large a surface's texture is in the world [m]."""
    if key == KERB or key.startswith("#") or _is_file(key):
        return _FILE_SCALE
    return surface_scale(key)


def planar_uvs(points: Floats, *, tile: float, near: tuple[float, float]) -> Floats:
    """Lay texture coordinates on the world's plane, shifted by whole tiles so that they stay small.

    Args:
        points: (n, 2) or (n, 3) [m].
        tile: Metres per tile, > 0.
        near: A point of the network [m]; it gets coordinates in [0, 1).

    Returns:
        (n, 2).
    """
    shift = [float(value // tile) for value in near]
    # (x / tile) - shift and not (x - x0) / tile: the shift is then an exact integer.
    return points[:, :2] / tile - shift


def _is_file(key: str) -> bool:
    """Tell whether a key means an image file.

    Raises:
        ConfigError: If it looks like one that does not exist.
    """
    path = Path(key)
    if path.suffix.lower() in {".png", ".jpg", ".jpeg", ".exr", ".hdr", ".tga", ".bmp"}:
        if not path.is_file():
            raise ConfigError(f"there is no image file {key!r}")
        return True
    return False


def _check_reflectance(path: Path) -> None:
    """Refuse images that reflect more light than falls on them.

    Images of 8 bits end at 1, which a matt material stands; those of linear floats do not.

    Raises:
        ConfigError: If a texel is brighter than 1.
    """
    if path.suffix.lower() not in {".exr", ".hdr"}:
        return
    brightest = float(read_linear(path).max(initial=0.0))
    if brightest > 1.0:
        raise ConfigError(
            f"{path.name} holds reflectances up to {brightest:.3g}; a surface has at most 1"
        )


def _linear(value: float) -> float:
    """Inverse sRGB transfer function, capped where materials conserve energy."""
    return min(linear_from_srgb(value), 0.85)


def mean_reflectance(texture: str) -> Floats:
    """Return the mean linear reflectance of a ground, (3,); grey for a user's image."""
    if texture.startswith("#"):
        return np.array(colour_of(texture))
    if texture not in catalog.names("surfaces"):
        return np.array([0.2, 0.2, 0.2])
    return np.array([float(v) for v in find("surfaces", texture).meta["albedo"]])


def coloured(mesh: Mesh, colour: Colour) -> Part:
    """Paint a mesh in one colour."""
    return Part(mesh, "sign", np.tile(colour, (len(mesh.faces), 1)))
