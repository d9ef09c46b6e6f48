"""Few materials for many parts: textures that look colours up by instance or by face.

By instance, every vehicle has its own colour with one BSDF and one kernel. By face, walls of all
colours share one material. Both work in JIT variants only; in scalar ones a texture of ours would
be slow. There each (body, colour) is a shape group of its own, and walls show the faces' plain
colours.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import drjit as dr
import mitsuba as mi
import numpy as np

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.render.textures import PERIOD, WEAR_ATTRIBUTE, corners
from sumo3dviz_pt.render.weathering import CONTRAST, weathering

TABLE_SIZE = 1024
"""Entries of the colour table; a scene has fewer shapes."""

_PLUGIN = "sumo3dviz_paint"

BRIGHTEST = 0.85
"""Highest reflectance of walls and paints."""

_DUST = (0.125, 0.112, 0.094)
"""Reflectance of dirt; a mesh's v coordinate says how much of it there is, in [0, 1]."""


def register_paint() -> None:  # noqa: C901 - the plugin's class needs the variant to exist
    """Make the texture known to the active JIT variant."""

    class PaintTexture(mi.Texture):  # type: ignore[misc]
        """Reflectance of the instance that was hit, or the flop of its paint."""

        def __init__(self, props: Any) -> None:
            mi.Texture.__init__(self, props)
            self.table = dr.opaque(mi.Float, 0.5, 4 * TABLE_SIZE)
            self.flop = bool(props.get("flop", False))

        def _row(self, si: Any, active: Any) -> Any:
            index = dr.reinterpret_array(mi.UInt32, si.instance) & (TABLE_SIZE - 1)
            return dr.gather(mi.Vector4f, self.table, index, active)

        def _colour(self, si: Any, active: Any) -> Any:
            row = self._row(si, active)
            return dusty(mi.Color3f(row.x, row.y, row.z), told_grime(si.uv))

        def eval(self, si: Any, active: Any = True) -> Any:
            return self._colour(si, active)

        def eval_3(self, si: Any, active: Any = True) -> Any:
            return self._colour(si, active)

        def eval_1(self, si: Any, active: Any = True) -> Any:
            if self.flop:
                return self._row(si, active).w
            return mi.luminance(self._colour(si, active))

        def mean(self) -> Any:
            return mi.Float(0.5)

        def is_spatially_varying(self) -> bool:
            return True

        def traverse(self, callback: Any) -> None:
            callback.put("table", self.table, mi.ParamFlags.Differentiable)

        def to_string(self) -> str:
            return "PaintTexture[]"

    mi.register_texture(_PLUGIN, lambda props: PaintTexture(props))


def dusty(paint: Any, grime: Any) -> Any:
    """Return a paint with so much dirt on it, [0, 1]."""
    return dr.lerp(paint, mi.Color3f(*_DUST), grime)


def told_grime(uv: Any) -> Any:
    """Return how much dirt a mesh's texture coordinates tell on average, [0, 1]."""
    # Mitsuba's v is ours, negated; meshes without uvs have positive coordinates.
    return dr.clip(-uv.y, 0.0, 1.0)


def soiled(uv: Any, own: Any, use: Any) -> tuple[Any]:
    """Return how much dirt lies on a point of a road user, [0, 1].

    Some are washed and some are not; where dirt lies it is uneven, and rain has run down in streaks
    where the mesh's u says so.

    Args:
        uv: Texture coordinates.
        own: The point in the body's frame [m].
        use: What is random in the road user, [0, 1).
    """
    amount = _CLEANEST + _DIRTIEST * use * dr.sqrt(use)
    shift = 17.0 * use
    fine = corners(
        mi.Vector2f(own.x + own.y + shift, own.z + 0.5 * own.y), cells=21.0, mask=PERIOD - 1
    )
    broad = corners(mi.Vector2f(own.x - own.y - shift, own.z), cells=3.0, mask=PERIOD - 1)
    mottled = 1.0 + 0.25 * broad.noise(1) + 0.2 * fine.noise(2)
    across = own.y + 0.6 * own.x + shift
    run = corners(mi.Vector2f(34.0 * across, 1.3 * own.z), cells=1.0, mask=PERIOD - 1)
    wide = corners(mi.Vector2f(11.0 * across, 0.7 * own.z), cells=1.0, mask=PERIOD - 1)
    streak = dr.clip(0.1 + 0.6 * run.noise(3) + 0.4 * wide.noise(4), 0.0, 1.0)
    there = -uv.y >= 0.0
    share = told_grime(uv) * dr.maximum(mottled, 0.0) + 0.09 * uv.x * streak
    return (dr.select(there, dr.clip(amount * share, 0.0, 0.8), 0.0),)


_CLEANEST, _DIRTIEST = 0.25, 1.4
"""How dirty the cleanest road user is against what a mesh tells, and how much more the others."""


class Paint(NamedTuple):
    """What an instance is painted with, as arrays of Dr.Jit.

    Attributes:
        colour: Linear reflectance.
        flop: Of an effect paint, [0, 1].
        use: What is random in a road user, such as how dirty it is, [0, 1); 0 of who stands.
    """

    colour: Any
    flop: Any
    use: Any


_FACING, _AWAY = 1.6, 0.37  # brightness of effect paints, seen from ahead and along
_FLAKES = 0.6  # share of their light that flakes mirror


def effect(colour: Any, metallic: Any, cosine: Any, flop: Any) -> tuple[Any, Any]:
    """Return colour and metal of an effect paint, whose flakes lie flat: bright as one faces it.

    Args:
        colour: Its reflectance on average.
        metallic: What it is without flakes, [0, 1].
        cosine: Between the normal and where it is seen from.
        flop: How much of this it shows, [0, 1].
    """
    facing = dr.square(dr.maximum(cosine, 0.0))
    seen = dr.minimum(colour * dr.lerp(1.0, dr.lerp(_AWAY, _FACING, facing), flop), BRIGHTEST)
    metal = dr.maximum(metallic, _FLAKES * flop)
    return dr.select(flop > 0.0, seen, colour), metal


def paint_texture(*, flop: bool = False) -> dict[str, Any]:
    """Return the texture as a plugin dict.

    Args:
        flop: Whether it tells the flop of paints rather than their colours.
    """
    return {"type": _PLUGIN, "flop": True} if flop else {"type": _PLUGIN}


def flop_of_tint(tint: Mapping[str, Any]) -> dict[str, Any] | None:
    """Return the texture of flops that belongs to one of colours, or None if that has none."""
    return paint_texture(flop=True) if tint.get("type") == _PLUGIN else None


def table_index(shape: Any) -> int:
    """Return the row of an instance's colour in the table."""
    pointer = dr.reinterpret_array(mi.UInt32, mi.ShapePtr(shape))
    return int(pointer[0]) & (TABLE_SIZE - 1)


def colour_table(colours: dict[int, Floats]) -> Floats:
    """Return the table's content from linear reflectances and flops by index, (4,) each."""
    table = np.full((TABLE_SIZE, 4), 0.5)
    for index, colour in colours.items():
        table[index] = colour
    return table


_STAINED_PLUGIN = "sumo3dviz_stained"


def register_stained() -> None:  # noqa: C901 - the plugin's class needs the variant to exist
    """Make the texture known to the active JIT variant."""

    class StainedTexture(mi.Texture):  # type: ignore[misc]
        """A tint times a texture over its mean."""

        def __init__(self, props: Any) -> None:
            mi.Texture.__init__(self, props)
            self.tint, self.texture = props["tint"], props["texture"]
            self.place = props["place"] if "place" in props else None  # noqa: SIM401 - no dict
            self.gain = mi.Color3f([float(props[f"gain_{k}"]) for k in range(3)])

        def eval(self, si: Any, active: Any = True) -> Any:
            return self.eval_3(si, active)

        def eval_3(self, si: Any, active: Any = True) -> Any:
            share = self.texture.eval_3(si, active) * self.gain
            if self.place is not None:
                place = dr.clip(self.place.eval_3(si, active), 0.0, 1.0)
                share = aged(share, weathering(si.uv, place)[0])
            return dr.minimum(self.tint.eval_3(si, active) * share, BRIGHTEST)

        def eval_1(self, si: Any, active: Any = True) -> Any:
            return mi.luminance(self.eval_3(si, active))

        def mean(self) -> Any:
            return mi.Float(0.5)

        def is_spatially_varying(self) -> bool:
            return True

        def traverse(self, callback: Any) -> None:
            callback.put("tint", self.tint, mi.ParamFlags.Differentiable)
            callback.put("texture", self.texture, mi.ParamFlags.Differentiable)

        def to_string(self) -> str:
            return "StainedTexture[]"

    mi.register_texture(_STAINED_PLUGIN, lambda props: StainedTexture(props))


def aged(share: Any, factor: Any) -> Any:
    """Return a texture over its mean where a wall has weathered."""
    return dr.maximum(1.0 + CONTRAST * (share - 1.0), 0.05) * factor


def stained_texture(value: Mapping[str, Any], *, tint: Mapping[str, Any], texture: Any) -> Any:
    """Return the texture as a plugin dict.

    Args:
        value: Our own word for it, with the texture's `mean` reflectance, and maybe `weathered`
            for walls whose corners tell how.
        tint: Stands for the colour.
        texture: What stains it, as a plugin dict.
    """
    if "scalar" in mi.variant():
        return dict(tint)
    gains = {f"gain_{k}": 1.0 / max(float(mean), 0.01) for k, mean in enumerate(value["mean"])}
    own = {"type": _STAINED_PLUGIN, "tint": dict(tint), "texture": texture, **gains}
    if value.get("weathered"):
        own["place"] = {"type": "mesh_attribute", "name": WEAR_ATTRIBUTE}
    return own
