"""Aerial perspective in linear radiance, before the picture is stored.

Far things fade into the light of the horizon behind them: radiance x transmittance +
horizon radiance x (1 - transmittance). Sky and sun lie behind the haze model and are
left alone. The transmittance comes from a depth pass and its share of hit samples.

By day rain and snow in the same air have the horizon's light, too. By night lamps light them, and
then they count with the haze: of what far things fade into, haze gives its share of the extinction
alone, and what lamps give is in the picture already.
"""

from __future__ import annotations

import numpy as np

from sumo3dviz_pt.model.geometry import Image
from sumo3dviz_pt.model.ray_planes import planes_of_rays
from sumo3dviz_pt.model.scene import Haze, View
from sumo3dviz_pt.render.sky.map import horizon_towards


def apply_haze(radiance: Image, haze: Haze, *, depth: Image, hit: Image, behind: Image) -> Image:
    """Lay haze between the camera and what it sees.

    Args:
        radiance: (h, w, 3).
        haze: Extinction.
        depth: Mean distance of the samples, 0 where they miss, (h, w) [m].
        hit: Share of samples that hit something, (h, w) in [0, 1].
        behind: Horizon radiance in each pixel's direction, (h, w, 3).

    Returns:
        Radiance with haze, (h, w, 3).
    """
    distance = depth / np.maximum(hit, np.float32(1e-6))
    # In a pixel that sees far things and sky, both have the horizon's light. Without this, hazy
    # hills would have a dark outline.
    sky = np.where(hit > 0, 1 - hit, np.float32(0.0))
    hazed = np.empty(radiance.shape, dtype=np.float32)
    for channel, extinction in enumerate(haze.extinction):
        fade = -np.expm1(distance * -(extinction + haze.falls))
        fade *= extinction / max(extinction + haze.falls, 1e-12)
        veil = (hit + sky * (fade * fade * fade)) * fade
        plain = radiance[..., channel]
        hazed[..., channel] = plain + (behind[..., channel] - plain) * veil
    return hazed


def horizon_behind(horizon: Image, view: View, size: tuple[int, int]) -> Image:
    """Return the horizon's radiance in each pixel's direction, (h, w, 3).

    Args:
        horizon: Radiance by azimuth, (columns, 3), as in `SkyMap`.
        view: Of the camera.
        size: Width, height [px].
    """
    rays = planes_of_rays(view.lens, size).reshape(3, -1)
    turn = view.world_from_camera.matrix[:3, :3].astype(np.float32)
    towards = (turn @ rays).reshape(3, size[1], size[0])
    return horizon_towards(horizon, np.moveaxis(towards, 0, -1))
