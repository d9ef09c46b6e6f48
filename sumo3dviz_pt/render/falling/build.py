"""Lays what falls and flies over a finished picture."""

from __future__ import annotations

import numpy as np

from sumo3dviz_pt.model.falling import Falling, SkyLight
from sumo3dviz_pt.model.geometry import Image
from sumo3dviz_pt.model.layers import Layers
from sumo3dviz_pt.model.lens import Lens
from sumo3dviz_pt.model.scene import View
from sumo3dviz_pt.render.falling import kinds
from sumo3dviz_pt.render.falling.drawn import strokes_of
from sumo3dviz_pt.render.falling.field import drops_before
from sumo3dviz_pt.render.falling.pane import through_pane
from sumo3dviz_pt.render.falling.plumes import draw_puffs
from sumo3dviz_pt.render.falling.splashes import splashes
from sumo3dviz_pt.render.falling.strokes import draw
from sumo3dviz_pt.render.falling.veil import Veil

_SPLASHING = 2.0
"""Rain from which on it splashes [mm/h]."""


def with_falling(
    radiance: Image, seen: Layers, view: View, falling: Falling, light: SkyLight
) -> Image:
    """Return a picture with all that falls and flies before it, (h, w, 3).

    Args:
        radiance: Finished, (h, w, 3).
        seen: `depth` and `hit`, and perhaps `albedo`.
        view: Of the camera.
        falling: What falls.
        light: Of the sky.
    """
    lens, size = view.lens, seen.size
    if lens.stereo == "none":
        return _laid(radiance, seen, lens, falling, light)
    whole = np.array(radiance, dtype=np.float32)
    for part, eye in lens.halves(size):
        half = Layers({name: layer[part] for name, layer in seen.items()})
        whole[part] = _laid(radiance[part], half, eye, falling, light)
    return whole


def _laid(radiance: Image, seen: Layers, lens: Lens, falling: Falling, light: SkyLight) -> Image:
    """Return one eye's picture with all that falls and flies before it."""
    size, hit = seen.size, seen["hit"]
    veil = Veil(np.asarray(seen["depth"] / np.maximum(hit, np.float32(1e-6)), np.float32), hit)
    if len(falling.puffs.at):
        draw_puffs(veil, falling, light, lens=lens, size=size)
    if falling.rain > _SPLASHING:
        crowns = splashes(falling, light, seen, lens=lens, size=size)
        if crowns is not None:
            draw(veil, crowns)
    for matter, rate in ((kinds.rain(), falling.rain), (kinds.snow(), falling.snow)):
        if rate > 0.0:
            drops, far = drops_before(falling, matter, rate, lens=lens, size=size)
            draw(veil, strokes_of(drops, falling, far, light, lens=lens, size=size))
    laid = veil.over(radiance)
    if falling.windscreen is None:
        return laid
    return through_pane(laid, seen, falling, light, lens)
