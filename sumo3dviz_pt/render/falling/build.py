"""Lays what falls and flies over a finished picture."""

from __future__ import annotations

import numpy as np

from sumo3dviz_pt.model.falling import Falling
from sumo3dviz_pt.model.geometry import Image
from sumo3dviz_pt.model.layers import Layers
from sumo3dviz_pt.model.scene import View
from sumo3dviz_pt.render.falling import kinds
from sumo3dviz_pt.render.falling.drawn import strokes_of
from sumo3dviz_pt.render.falling.field import drops_before
from sumo3dviz_pt.render.falling.light import SkyLight
from sumo3dviz_pt.render.falling.strokes import draw
from sumo3dviz_pt.render.falling.veil import Veil


def with_falling(
    radiance: Image, seen: Layers, view: View, falling: Falling, light: SkyLight
) -> Image:
    """Return a picture with all that falls and flies before it, (h, w, 3).

    Args:
        radiance: Finished, (h, w, 3).
        seen: `depth` and `hit`.
        view: Of the camera.
        falling: What falls.
        light: Of the sky.
    """
    size = seen.size
    hit = seen["hit"]
    veil = Veil(seen["depth"] / np.maximum(hit, np.float32(1e-6)), hit)
    for matter, rate, flakes in (
        (kinds.rain, falling.rain, False),
        (kinds.snow, falling.snow, True),
    ):
        if rate > 0.0:
            drops, far = drops_before(falling, matter(), rate, lens=view.lens, size=size)
            strokes = strokes_of(
                drops, falling, far, light, lens=view.lens, size=size, flakes=flakes
            )
            draw(veil, strokes)
    return veil.over(radiance)
