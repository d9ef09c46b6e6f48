"""What a second, short pass sees: distance and hits for haze and cap, guides for the denoiser."""

from __future__ import annotations

from typing import Any

import numpy as np

from sumo3dviz_pt.job import Quality
from sumo3dviz_pt.model.geometry import Image
from sumo3dviz_pt.render.entries import SUN_DISTANCE


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


def guide_plugin(quality: Quality) -> dict[str, Any]:
    """The integrator of the pass, as a plugin dict."""
    depth = {"type": "depth"}
    if not is_guided(quality):
        return depth
    return {"type": "aov", "aovs": "albedo:albedo,normal:sh_normal", "depth": depth}


def as_guides(image: Image) -> dict[str, Image]:
    """The pass by name.

    Args:
        image: Channels of the integrator on an `rgba` film, (h, w, 4 or 10).

    Returns:
        `depth` x share of hits [m] and `hit` in [0, 1], (h, w) each; `albedo` and
        `normal`, (h, w, 3) each, if they were asked for.
    """
    depth, hit = image[..., 0], np.clip(image[..., 3], 0.0, 1.0)
    # What sees the sun sees no surface; the sun is a disc only to the renderer.
    guides = {"depth": depth, "hit": np.where(depth > 0.1 * SUN_DISTANCE, 0.0, hit)}
    if image.shape[-1] > 4:
        guides |= {"albedo": image[..., 4:7], "normal": image[..., 7:10]}
    return guides
