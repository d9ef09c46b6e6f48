"""A picture of the land from above, seen from near: cars and shadows in it fade, grain comes in.

From afar the picture is shown as it is. Near a camera its pixels would be seen as such, and cars
and shadows of another day lie flat on the ground. There it gives the colour of places 8 m wide
alone, and noise stands for what grows or is paved.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from sumo3dviz_pt.model.scene import Bsdf
from sumo3dviz_pt.render.textures import PERIOD, corners

DRAPED = "draped"
"""Word for it: `{"type": "draped", "filename": ..., "metres": (across, up)}`."""

_PLUGIN = "sumo3dviz_draped"
_NEAR, _FAR = 15.0, 70.0  # where nothing else, and nothing, of the picture's detail is lost [m]
_COARSE = 8.0  # what is left of it near the camera [m]
_GRAINS = ((0.06, 0.16), (0.35, 0.14), (2.3, 0.12))  # size [m] and amplitude of noise


def draped_texture(value: Mapping[str, Any]) -> dict[str, Any]:
    """Return the dict of this plugin, or of the plain picture in scalar variants."""
    if "scalar" in mi.variant():
        return {"type": "bitmap", "filename": value["filename"]}
    across, up = value["metres"]
    return {"type": _PLUGIN, "filename": value["filename"], "across": across, "up": up}


def is_draped(value: Bsdf) -> bool:
    """Tell whether a texture's look depends on how far it is."""
    return bool(value.get("type") == DRAPED)


class Draped:
    """The picture, and what is left of it near a camera.

    Args:
        filename: The picture.
        metres: Across and up.
    """

    def __init__(self, filename: str, metres: tuple[float, float]) -> None:
        # Opaque, so that pictures of all sizes share kernels.
        self._metres = mi.Vector2f(*(dr.opaque(mi.Float, length) for length in metres))
        self._fine: Any = mi.load_dict({"type": "bitmap", "filename": filename})
        image = mi.Bitmap(filename).convert(
            mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, False
        )
        coarse = _halved(np.array(image, dtype=np.float32), metres)
        self._coarse: Any = mi.load_dict(
            {"type": "bitmap", "bitmap": mi.Bitmap(coarse), "raw": True, "wrap_mode": "clamp"}
        )

    def colour(self, si: Any, active: Any) -> Any:
        """Return the reflectance, three channels."""
        place = mi.Vector2f(si.uv.x * self._metres.x, si.uv.y * self._metres.y)
        grain = mi.Float(1.0)
        for size, amount in _GRAINS:
            grain += amount * corners(place / size, cells=1.0, mask=PERIOD - 1).noise(3)
        near = mi.Color3f(self._coarse.eval(si, active)) * grain
        share = dr.clip((si.t - _NEAR) * (1.0 / (_FAR - _NEAR)), 0.0, 1.0)
        share = dr.square(share) * (3.0 - 2.0 * share)
        return dr.lerp(near, mi.Color3f(self._fine.eval(si, active)), share)

    @property
    def mean(self) -> Any:
        """Mean reflectance."""
        return self._fine.mean()


def _halved(image: Any, metres: tuple[float, float]) -> Any:
    """Return the means of blocks of a picture, about as large as what is left of it."""
    means = image
    for axis, length in enumerate(reversed(metres)):
        count = max(min(round(length / _COARSE), image.shape[axis]), 1)
        edges = np.round(np.linspace(0, image.shape[axis], count + 1)).astype(int)
        sums = np.add.reduceat(means, edges[:-1], axis=axis, dtype=np.float64)
        means = sums / np.expand_dims(np.diff(edges), 1 if axis == 0 else 0)[..., None]
    return np.ascontiguousarray(means, dtype=np.float32)


def register_draped() -> None:
    """Make the texture known to the active JIT variant."""

    class DrapedTexture(mi.Texture):  # type: ignore[misc]
        """A picture whose detail fades near the camera."""

        def __init__(self, props: Any) -> None:
            mi.Texture.__init__(self, props)
            metres = (float(props["across"]), float(props["up"]))
            self.draped = Draped(str(props["filename"]), metres)

        def eval(self, si: Any, active: Any = True) -> Any:
            return self.draped.colour(si, active)

        def eval_3(self, si: Any, active: Any = True) -> Any:
            return self.draped.colour(si, active)

        def eval_1(self, si: Any, active: Any = True) -> Any:
            return mi.luminance(self.draped.colour(si, active))

        def mean(self) -> Any:
            return self.draped.mean

        def is_spatially_varying(self) -> bool:
            return True

        def to_string(self) -> str:
            return "DrapedTexture[]"

    mi.register_texture(_PLUGIN, lambda props: DrapedTexture(props))
