"""What a second, short pass sees: distance and hits for haze and cap, guides for the denoiser."""

from __future__ import annotations

from typing import Any

import numpy as np

from sumo3dviz_pt.job.settings import Quality
from sumo3dviz_pt.model.geometry import Bools, Image
from sumo3dviz_pt.render.sky.entries import SUN_DISTANCE


def is_guided(quality: Quality) -> bool:
    """Whether a denoiser asks for albedo and normals."""
    return quality.guides and quality.denoise != "none"


def is_needed(quality: Quality, *, hazy: bool) -> bool:
    """Whether a frame needs the pass at all."""
    return (hazy and quality.haze) or quality.denoise != "none" or quality.cap is not None


def guide_spp(quality: Quality) -> int:
    """Samples of the pass: a quarter of the picture's, between 4 and 16.

    With fewer, haze is noisy where far ground meets the sky.
    """
    return min(max(quality.spp // 4, 4), 16)


LAMP_SPP = 16
"""Samples of a pass over lamps that are seen directly; more at once would take more memory."""


def lamp_passes(quality: Quality) -> int:
    """Passes over such lamps: up to eight times as many samples as the picture has.

    They cost little: paths end at the first surface.
    """
    return min(max(quality.spp // 4, 1), 4)


def guide_plugin(quality: Quality, *, jit: bool, lamps: bool = False) -> dict[str, Any]:
    """The integrator of the pass, as a plugin dict.

    Args:
        quality: Says what is needed.
        jit: Whether the variant compiles. Others only see distances: every `aov` sample waits
            for Python's lock there, and the pass took five times as long as the picture.
        lamps: Whether it also looks where lamps are seen directly.
    """
    depth = {"type": "depth"}
    if not jit or not (is_guided(quality) or lamps):
        return depth
    found = {"type": "aov", "aovs": "albedo:albedo,normal:sh_normal", "depth": depth}
    return {**found, "lamps": LAMP_PLUGIN} if lamps else found


LAMP_PLUGIN = {"type": "path", "max_depth": 1}
"""Sees what emits, and only that: paths end at the first surface."""


def with_lamps(seen: dict[str, Image], image: Image) -> dict[str, Image]:
    """Guides and where lamps are seen, by a pass over what emits, (h, w, 3)."""
    lit = image[..., :3].max(axis=-1) > 0.0
    return {**seen, "lamp": (lit & (seen["hit"] >= 1.0)).astype(np.float32)}


def as_guides(image: Image) -> dict[str, Image]:
    """The pass by name.

    Args:
        image: Channels of the integrator on an `rgba` film, (h, w, 4, 10 or 14).

    Returns:
        `depth` x share of hits [m] and `hit` in [0, 1], (h, w) each; `albedo` and
        `normal`, (h, w, 3) each, if they were asked for; `lamp`, 1 where one is seen, (h, w).
    """
    depth, hit = image[..., 0], np.clip(image[..., 3], 0.0, 1.0)
    # What sees the sun sees no surface; the sun is a disc only to the renderer.
    guides = {"depth": depth, "hit": np.where(depth > 0.1 * SUN_DISTANCE, 0.0, hit)}
    if image.shape[-1] > 4:
        guides |= {"albedo": image[..., -6:-3], "normal": image[..., -3:]}
    return with_lamps(guides, image[..., 4:7]) if image.shape[-1] > 10 else guides


def uncapped(seen: dict[str, Image]) -> Bools | None:
    """Where emitters are seen directly, as guides tell, (h, w); None if they do not."""
    if "hit" not in seen:
        return None
    return np.asarray((seen["hit"] < 1.0) | (seen.get("lamp", np.zeros(1)) > 0.0))


def excess(lost: Image, seen: dict[str, Image]) -> Image:
    """Of lamps that are seen directly: what they emit, or what the cap took, (h, w, 3)."""
    if "glow" in seen:
        return seen["glow"]
    lamp = seen.get("lamp")
    return np.zeros_like(lost) if lamp is None else lost * lamp[..., None]
