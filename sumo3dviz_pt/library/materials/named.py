"""Named materials in Mitsuba's words, from `assets/materials`.

Base colours stay at or below 0.85, where `principled` gives back no more than an even
sky sends (only seen at less than 24 degrees over the surface it gains, by up to a third:
tests/statistical/test_furnace.py); roughness stays at or above 0.05, where path tracing
finds the sun without fireflies. Windows are opaque and dark, because `path` finds no sun
through panes.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

from sumo3dviz_pt.catalog import Entry, find
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.library.asset_files import AssetFile, RecipeValue, read_family
from sumo3dviz_pt.model.geometry import Colour
from sumo3dviz_pt.model.scene import Bsdf

TINT: Bsdf = {"type": "tint"}


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
        colour: Linear reflectance, or `tint` where every face has one of its own.
        roughness: [0, 1].
        metallic: 0 for plastics, paints and stone, 1 for bare metal.
        specular: Strength of the reflection that has no colour, [0, 1].
        clearcoat: Strength of a coat of varnish; None for none.
        clearcoat_gloss: Of this coat.
        spec_tint: How far reflections take the colour; None leaves it to the renderer.
        transmitted: Twice the share of light that goes through a leaf, of what it does not
            absorb; None for what is no leaf. Leaves have no other numbers.
        two_sided: Whether its surfaces are open, and seen from behind.
        mirror: Whether it is a perfect mirror; it has no number but its colour.
    """

    colour: Colour | Literal["tint"]
    roughness: float = 0.5
    metallic: float = 0.0
    specular: float = 0.5
    clearcoat: float | None = None
    clearcoat_gloss: float | None = None
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
        if self.mirror and self.colour != "tint":
            return mirror(self.colour)
        colour = TINT if self.colour == "tint" else self.colour
        if self.transmitted is not None:
            return translucent(colour, transmitted=self.transmitted)
        plain = principled(
            colour, roughness=self.roughness, metallic=self.metallic, specular=self.specular
        )
        more = {name: getattr(self, name) for name in ("clearcoat", "clearcoat_gloss", "spec_tint")}
        return {**plain, **{name: value for name, value in more.items() if value is not None}}


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
    found: dict[str, Bsdf] = {}
    for group, file in read_family("materials", _MaterialsFile).items():
        for name, finish in file.recipe.items():
            if name in found:
                raise ConfigError(f"{name!r} is in another file, too", key=f"materials/{group}")
            found[name] = finish.bsdf()
    return found


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
