"""Aerial perspective in linear radiance, before the picture is stored.

Far things fade into the light of the horizon behind them: radiance x transmittance +
horizon radiance x (1 - transmittance). Sky and sun lie behind the haze model and are
left alone. The transmittance comes from a depth pass and its share of hit samples.
"""

from __future__ import annotations

import numpy as np

from sumo3dviz_pt.model.geometry import Floats, Image
from sumo3dviz_pt.model.scene import Haze, View
from sumo3dviz_pt.render.sky.map import horizon_towards


def apply_haze(radiance: Image, haze: Haze, *, depth: Image, hit: Image, behind: Floats) -> Image:
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
    distance = depth / np.maximum(hit, 1e-6)
    fade = -np.expm1(-distance[..., None] * np.asarray(haze.extinction))
    # In a pixel that sees far things and sky, both have the horizon's light. Without this, hazy
    # hills would have a dark outline.
    both = hit[..., None] + np.where(hit > 0, 1 - hit, 0)[..., None] * fade**3
    veil = both * fade
    return np.asarray(radiance * (1 - veil) + behind * veil, dtype=np.float32)


def horizon_behind(horizon: Image, view: View, size: tuple[int, int]) -> Floats:
    """Return the horizon's radiance in each pixel's direction, (h, w, 3).

    Args:
        horizon: Radiance by azimuth, (columns, 3), as in `SkyMap`.
        view: Of the camera.
        size: Width, height [px].
    """
    return horizon_towards(horizon, view.directions(size))
