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
from sumo3dviz_pt.model.geometry import Colour
from sumo3dviz_pt.model.scene import Bsdf

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


def translucent(colour: Colour | Bsdf, *, transmitted: float) -> Bsdf:
    """Leaves: of what they do not absorb, transmitted / 2 goes through them, spread evenly.

    Seen from both sides; it costs as much as a two-sided matt material.
    """
    base = {"type": "rgb", "value": list(colour)} if isinstance(colour, tuple) else dict(colour)
    return {
        "type": "principledthin",
        "base_color": base,
        "roughness": 0.5,
        "diff_trans": transmitted,
        "spec_trans": 0.0,
        "eta": 1.4,
    }


MATERIALS: Mapping[str, Bsdf] = {
    # Vehicles
    "paint": {**principled(TINT, roughness=0.07), "clearcoat": 1.0, "clearcoat_gloss": 0.99},
    "glass": principled((0.012, 0.014, 0.014), roughness=0.06, specular=0.6),
    "trim": principled((0.018, 0.018, 0.019), roughness=0.55, specular=0.35),
    "rubber": principled((0.02, 0.02, 0.021), roughness=0.75, specular=0.3),
    "rim": principled((0.48, 0.49, 0.51), roughness=0.28, metallic=1.0),
    "chrome": principled((0.7, 0.71, 0.73), roughness=0.15, metallic=1.0),
    "lamp_white": principled((0.75, 0.77, 0.8), roughness=0.12, specular=0.6),
    "lamp_red": principled((0.4, 0.008, 0.01), roughness=0.1),
    "lamp_amber": principled((0.6, 0.2, 0.01), roughness=0.1),
    "plate": principled((0.75, 0.75, 0.72), roughness=0.4),
    "gloss_black": principled((0.008, 0.008, 0.009), roughness=0.09),
    "gap": principled((0.005, 0.005, 0.005), roughness=0.9, specular=0.2),
    "lamp_clear": principled((0.03, 0.031, 0.034), roughness=0.06),
    "lamp_bowl": principled((0.5, 0.51, 0.53), roughness=0.2, metallic=1.0),
    "lamp_dark_red": principled((0.12, 0.003, 0.004), roughness=0.06),
    "lamp_blue": principled((0.01, 0.04, 0.42), roughness=0.1),
    "lamp_sign": principled((0.75, 0.62, 0.2), roughness=0.3),
    "plate_ink": principled((0.012, 0.012, 0.014), roughness=0.4),
    "disc": principled((0.26, 0.26, 0.27), roughness=0.4, metallic=1.0),
    "glass_seat": principled((0.058, 0.066, 0.069), roughness=0.06, specular=0.6),
    "glass_face": principled((0.034, 0.0255, 0.0215), roughness=0.06, specular=0.6),
    "glass_coat": principled((0.032, 0.037, 0.046), roughness=0.06, specular=0.6),
    "livery_cream": principled((0.62, 0.5, 0.26), roughness=0.16),
    "livery_white": principled((0.68, 0.69, 0.7), roughness=0.16),
    "livery_blue": principled((0.012, 0.035, 0.2), roughness=0.18),
    "interior": principled((0.018, 0.018, 0.019), roughness=0.9, specular=0.2),
    "cloth": principled(TINT, roughness=0.9, specular=0.2),
    "skin": principled((0.45, 0.28, 0.2), roughness=0.55, specular=0.35),
    # A driver's own cabin
    "dash_pad": principled((0.026, 0.025, 0.024), roughness=0.62, specular=0.35),
    "leather_rim": principled((0.016, 0.015, 0.015), roughness=0.45),
    "mirror": principled((0.8, 0.81, 0.82), roughness=0.05, metallic=1.0),
    "screen_map": principled((0.09, 0.14, 0.2), roughness=0.2),
    # People and two-wheelers
    "complexion": principled(TINT, roughness=0.55, specular=0.35),
    "hair": principled(TINT, roughness=0.5, specular=0.35),
    "leather": principled(TINT, roughness=0.42, specular=0.4),
    "skin_dark": principled((0.15, 0.085, 0.055), roughness=0.5, specular=0.35),
    "lips": principled((0.32, 0.12, 0.1), roughness=0.5, specular=0.35),
    "hair_dark": principled((0.025, 0.018, 0.013), roughness=0.5, specular=0.35),
    "hair_fair": principled((0.26, 0.17, 0.09), roughness=0.5, specular=0.35),
    "denim": principled((0.035, 0.055, 0.1), roughness=0.9, specular=0.2),
    "fabric_black": principled((0.018, 0.018, 0.02), roughness=0.7, specular=0.3),
    "fabric_grey": principled((0.11, 0.11, 0.115), roughness=0.9, specular=0.2),
    "fabric_pale": principled((0.5, 0.48, 0.45), roughness=0.7, specular=0.3),
    "fabric_beige": principled((0.3, 0.235, 0.16), roughness=0.9, specular=0.2),
    "leather_brown": principled((0.075, 0.04, 0.022), roughness=0.45, specular=0.4),
    "helmet_black": principled((0.015, 0.015, 0.016), roughness=0.15),
    "helmet_white": principled((0.62, 0.62, 0.61), roughness=0.2),
    "enamel_black": principled((0.016, 0.016, 0.018), roughness=0.25),
    "enamel_green": principled((0.02, 0.06, 0.04), roughness=0.25),
    "enamel_red": principled((0.22, 0.014, 0.012), roughness=0.25),
    "engine": principled((0.22, 0.22, 0.225), roughness=0.45, metallic=0.8),
    # Heavy vehicles
    "pane_dark": principled((0.050, 0.056, 0.058), roughness=0.05),
    "bellows_dark": principled((0.045, 0.046, 0.048), roughness=0.8),
    "chassis": principled((0.030, 0.030, 0.032), roughness=0.6),
    "aluminium": principled((0.60, 0.61, 0.62), roughness=0.32, metallic=0.9),
    "coat_white": principled((0.60, 0.60, 0.585), roughness=0.28),
    "coat_grey": principled((0.16, 0.165, 0.17), roughness=0.4),
    "coat_red": principled((0.42, 0.012, 0.010), roughness=0.22),
    "coat_blue": principled((0.012, 0.06, 0.26), roughness=0.28),
    "coat_yellow": principled((0.66, 0.46, 0.02), roughness=0.35),
    "coat_orange": principled((0.62, 0.16, 0.015), roughness=0.35),
    "tarpaulin": principled(TINT, roughness=0.5),
    # Trains and ships
    "bogie": principled((0.042, 0.036, 0.031), roughness=0.75, specular=0.3),
    "wheel_steel": principled((0.42, 0.41, 0.40), roughness=0.35, metallic=0.9),
    "deck": principled((0.15, 0.045, 0.035), roughness=0.7, specular=0.3),
    # Streets
    "line_white": principled((0.62, 0.62, 0.6), roughness=0.5, specular=0.4),
    "line_yellow": principled((0.6, 0.38, 0.05), roughness=0.5, specular=0.4),
    "steel": two_sided(principled((0.45, 0.46, 0.47), roughness=0.4, metallic=0.9)),
    "kerb_stone": principled(TINT, roughness=0.8, specular=0.3),
    "kerb_joint": principled((0.1, 0.098, 0.092), roughness=0.9),
    "kerb": principled((0.36, 0.355, 0.34), roughness=0.8, specular=0.3),
    "signal_housing": principled((0.02, 0.022, 0.02), roughness=0.5, specular=0.35),
    "signal_lens": principled(TINT, roughness=0.12),
    # Scenery
    "bark": principled(TINT, roughness=0.9, specular=0.2),
    "leaf": translucent(TINT, transmitted=1.0),
    # `spec_tint` keeps it out of the compound material, whose gloss ground has not.
    "far_ground": {**principled(TINT, roughness=0.9, specular=0.15), "spec_tint": 0.0},
    "wall": principled(TINT, roughness=0.85, specular=0.25),
    "roof": principled(TINT, roughness=0.8, specular=0.25),
    "window": principled((0.02, 0.024, 0.028), roughness=0.06, specular=0.7),
    # Buildings: panes take the colour of what lies behind them.
    "glazing": principled(TINT, roughness=0.06, specular=0.7),
    "coated_glass": principled(TINT, roughness=0.05, metallic=1.0),
    "joinery": principled(TINT, roughness=0.5, specular=0.4),
    "sheet": principled(TINT, roughness=0.42, metallic=0.35),
    "frame": principled((0.55, 0.55, 0.53), roughness=0.5, specular=0.4),
    "sign": principled(TINT, roughness=0.45, specular=0.4),
    "metal_sheet": principled((0.42, 0.43, 0.44), roughness=0.5, metallic=0.5),
    "signal_pole": principled((0.09, 0.1, 0.1), roughness=0.5, specular=0.4),
    "signal_border": principled((0.62, 0.62, 0.6), roughness=0.4),
    # Street furniture
    "galvanised": principled((0.36, 0.37, 0.38), roughness=0.45, metallic=0.6),
    "street_wood": principled((0.15, 0.1, 0.062), roughness=0.6),
    "pane": principled((0.075, 0.092, 0.09), roughness=0.06),
    "lamp_lens": principled((0.6, 0.6, 0.58), roughness=0.3),
}
"""By name; a part says which one it is made of."""


def surface_bsdf(entry: Entry) -> Bsdf:
    """The material of a surface asset, with absolute texture paths."""

    def resolved(value: Any) -> Any:
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
    """Metres per tile of a surface asset."""
    return float(find("surfaces", name).meta["scale"])
