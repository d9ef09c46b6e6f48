"""Makes finished pictures of traced ones: denoised, mixed, with lamps, haze and what falls."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sumo3dviz_pt.model.falling import Falling, SkyLight
from sumo3dviz_pt.model.geometry import Image
from sumo3dviz_pt.model.layers import Layers
from sumo3dviz_pt.model.scene import Haze, View
from sumo3dviz_pt.render.passes.denoise import denoise, mixed, noisy_box
from sumo3dviz_pt.render.passes.haze import apply_haze, horizon_behind


@dataclass(frozen=True, slots=True, eq=False)
class Finishing:
    """How traced pictures are finished; what a film's frames share.

    Attributes:
        denoiser: `none`, `fast`, `balanced` or `high`.
        guided: Whether albedo and normals guide it.
        raw_share: Share of the raw picture that textures keep.
        haze: Aerial perspective, or None.
        horizon: Radiance by azimuth, (columns, 3), as in `SkyMap`.
        grainy_sky: Whether the open sky has noise, too: that of lamps' light in fog before it.
        falling: What falls and flies before the camera, or None.
        light: Of the sky, on what falls.
    """

    denoiser: str
    guided: bool
    raw_share: float
    haze: Haze | None
    horizon: Image
    grainy_sky: bool = False
    falling: Falling | None = None
    light: SkyLight | None = None


def finished(seen: Layers, view: View, how: Finishing) -> Image:
    """Denoise a picture, then lay haze over it, and what falls and flies.

    Args:
        seen: `radiance`, without the light of lamps that are seen directly if that is there as
            `excess`; `hit`, and what guides and haze need.
        view: Of the camera.
        how: What is to be done.

    Returns:
        Radiance, (h, w, 3).
    """
    radiance = seen["radiance"] if how.denoiser == "none" else _denoised(seen, how)
    if "excess" in seen:
        # Lamps are so bright that the denoiser would smear them.
        radiance = radiance + seen["excess"]
    return hazed(seen | {"radiance": radiance}, view, how)


def _denoised(seen: Layers, how: Finishing) -> Image:
    """Return the radiance of a picture without noise; only the part that has any is touched."""
    radiance = seen["radiance"]
    hit = np.ones_like(seen["hit"]) if how.grainy_sky else seen["hit"]
    box = noisy_box(hit)
    # Layers may be here because they are wanted, not as guides.
    known = seen if how.guided else Layers()
    guides = {name: known[name][box] for name in ("albedo", "normal") if name in known}
    raw = radiance[box]
    if not raw.size:
        return radiance
    smooth = denoise(raw, quality=how.denoiser, **guides)
    picture = radiance.copy()
    picture[box] = mixed(smooth, raw, hit=hit[box], share=how.raw_share)
    return picture


def hazed(seen: Layers, view: View, how: Finishing) -> Image:
    """Return the radiance of a picture with haze and with what falls, if there is any.

    Args:
        seen: `radiance`; `depth` and `hit` where there is haze, or anything falls.
        view: Of the camera.
        how: What is to be done.
    """
    radiance = _hazed(seen, view, how)
    if how.falling is not None and how.light is not None:
        # Without weather nothing of it is loaded.
        from sumo3dviz_pt.render.falling.build import with_falling

        radiance = with_falling(radiance, seen, view, how.falling, how.light)
    if "reflected" not in seen:
        return radiance
    return np.asarray(radiance * seen["passed"][..., None] + seen["reflected"])


def _hazed(seen: Layers, view: View, how: Finishing) -> Image:
    """Return the radiance of a picture with haze, if there is any."""
    if how.haze is None:
        return seen["radiance"]
    behind = horizon_behind(how.horizon, view, seen.size)
    return apply_haze(
        seen["radiance"], how.haze, depth=seen["depth"], hit=seen["hit"], behind=behind
    )
