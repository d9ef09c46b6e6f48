"""A texture in the colour of each face: one material for walls of all colours.

It works in JIT variants only; scalar ones, where a texture of ours would be slow, show
the faces' plain colours.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import drjit as dr
import mitsuba as mi

BRIGHTEST = 0.85
"""Highest reflectance of a wall."""

_PLUGIN = "sumo3dviz_stained"


def register_stained() -> None:  # noqa: C901 - the plugin's class needs the variant to exist
    """Make the texture known to the active JIT variant."""

    class StainedTexture(mi.Texture):  # type: ignore[misc]
        """A tint times a texture over its mean."""

        def __init__(self, props: Any) -> None:
            mi.Texture.__init__(self, props)
            self.tint, self.texture = props["tint"], props["texture"]
            self.gain = mi.Color3f([float(props[f"gain_{k}"]) for k in range(3)])

        def eval(self, si: Any, active: Any = True) -> Any:
            return self.eval_3(si, active)

        def eval_3(self, si: Any, active: Any = True) -> Any:
            both = self.tint.eval_3(si, active) * self.texture.eval_3(si, active) * self.gain
            return dr.minimum(both, BRIGHTEST)

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

    mi.register_texture(_PLUGIN, lambda props: StainedTexture(props))


def stained_texture(value: Mapping[str, Any], *, tint: Mapping[str, Any], texture: Any) -> Any:
    """Return the texture as a plugin dict.

    Args:
        value: Our own word for it, with the texture's `mean` reflectance.
        tint: Stands for the colour.
        texture: What stains it, as a plugin dict.
    """
    if "scalar" in mi.variant():
        return dict(tint)
    gains = {f"gain_{k}": 1.0 / max(float(mean), 0.01) for k, mean in enumerate(value["mean"])}
    return {"type": _PLUGIN, "tint": dict(tint), "texture": texture, **gains}
