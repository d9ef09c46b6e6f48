"""Named materials in Mitsuba's words.

Base colours stay at or below 0.85, where `principled` gives back no more than an even
sky sends (only seen at less than 24 degrees over the surface it gains, by up to a third:
tests/statistical/test_furnace.py); roughness stays at or above 0.05, where path tracing
finds the sun without fireflies. Windows are opaque and dark, because `path` finds no sun
through panes.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from sumo3dviz_pt.catalog import Entry, find
from sumo3dviz_pt.model.scene import Bsdf, Colour

TINT: Bsdf = {"type": "tint"}


def principled(
    colour: Colour | Bsdf, *, roughness: float, metallic: float = 0.0, specular: float = 0.5
) -> Bsdf:
    """A Disney-style material with a colour (linear reflectance) or a texture."""
    base = {"type": "rgb", "value": list(colour)} if isinstance(colour, tuple) else dict(colour)
    return {
        "type": "principled",
        "base_color": base,
        "roughness": roughness,
        "metallic": metallic,
        "specular": specular,
    }


def matt(colour: Colour | Bsdf) -> Bsdf:
    """A perfectly diffuse material."""
    base = {"type": "rgb", "value": list(colour)} if isinstance(colour, tuple) else dict(colour)
    return {"type": "diffuse", "reflectance": base}


def two_sided(bsdf: Bsdf) -> Bsdf:
    """For open surfaces that are seen from behind; it makes a third of all shading dearer."""
    return {"type": "twosided", "bsdf": bsdf}


MATERIALS: Mapping[str, Bsdf] = {
    # Vehicles
    "paint": {**principled(TINT, roughness=0.25), "clearcoat": 1.0, "clearcoat_gloss": 0.95},
    "glass": principled((0.012, 0.014, 0.014), roughness=0.06, specular=0.6),
    "trim": principled((0.018, 0.018, 0.019), roughness=0.55, specular=0.35),
    "rubber": principled((0.02, 0.02, 0.021), roughness=0.75, specular=0.3),
    "rim": principled((0.48, 0.49, 0.51), roughness=0.28, metallic=1.0),
    "chrome": principled((0.7, 0.71, 0.73), roughness=0.15, metallic=1.0),
    "lamp_white": principled((0.75, 0.77, 0.8), roughness=0.12, specular=0.6),
    "lamp_red": principled((0.4, 0.008, 0.01), roughness=0.1),
    "lamp_amber": principled((0.6, 0.2, 0.01), roughness=0.1),
    "plate": principled((0.75, 0.75, 0.72), roughness=0.4),
    "interior": principled((0.012, 0.012, 0.013), roughness=0.85, specular=0.25),
    "cloth": principled(TINT, roughness=0.9, specular=0.2),
    "skin": principled((0.45, 0.28, 0.2), roughness=0.55, specular=0.35),
    # Streets
    "line_white": principled((0.62, 0.62, 0.6), roughness=0.5, specular=0.4),
    "line_yellow": principled((0.6, 0.38, 0.05), roughness=0.5, specular=0.4),
    "steel": two_sided(principled((0.45, 0.46, 0.47), roughness=0.4, metallic=0.9)),
    "kerb": principled((0.36, 0.355, 0.34), roughness=0.8, specular=0.3),
    "signal_housing": principled((0.02, 0.022, 0.02), roughness=0.5, specular=0.35),
    "signal_lens": principled((0.03, 0.03, 0.03), roughness=0.2),
    # Scenery
    "bark": principled((0.11, 0.085, 0.06), roughness=0.9, specular=0.2),
    "leaf": two_sided(matt(TINT)),
    "wall": principled(TINT, roughness=0.85, specular=0.25),
    "roof": principled(TINT, roughness=0.8, specular=0.25),
    "window": principled((0.02, 0.024, 0.028), roughness=0.06, specular=0.7),
    "frame": principled((0.55, 0.55, 0.53), roughness=0.5, specular=0.4),
    "sign": principled(TINT, roughness=0.45, specular=0.4),
    "bark_pale": principled((0.5, 0.48, 0.44), roughness=0.85, specular=0.25),
    "metal_sheet": principled((0.42, 0.43, 0.44), roughness=0.5, metallic=0.5),
    "signal_pole": principled((0.09, 0.1, 0.1), roughness=0.5, specular=0.4),
}
"""By name; a part says which one it is made of."""


def surface_bsdf(entry: Entry) -> Bsdf:
    """The material of a surface asset, with absolute texture paths."""

    def resolved(value: Any) -> Any:
        if not isinstance(value, Mapping):
            return value
        return {
            key: str(entry.folder / item) if key == "filename" else resolved(item)
            for key, item in value.items()
        }

    bsdf: Bsdf = resolved(entry.meta["bsdf"])
    return bsdf


def surface_scale(name: str) -> float:
    """Metres per tile of a surface asset."""
    return float(find("surfaces", name).meta["scale"])
