"""No pixel of a dark crown flashes, whatever its few samples see through gaps between leaves.

A crown of near leaves stands before hills five kilometres away. Of a pixel's two samples one may
pass a gap, and see a hill in its haze, which is ten times as bright as the crown.
"""

from __future__ import annotations

import numpy as np
import pytest
from builders import view_at
from scipy.ndimage import median_filter

from sumo3dviz_pt import catalog
from sumo3dviz_pt.job.settings import SkySettings
from sumo3dviz_pt.model.geometry import Image
from sumo3dviz_pt.model.layers import LUMINANCE, Layers
from sumo3dviz_pt.model.scene import Haze
from sumo3dviz_pt.model.traced import TracedFrame
from sumo3dviz_pt.render.averaging.average import accumulated
from sumo3dviz_pt.render.backend import choose_backend
from sumo3dviz_pt.render.passes.finish import Finishing, apply_haze, finished, horizon_behind
from sumo3dviz_pt.render.sky.baked import bake_sky
from sumo3dviz_pt.world.sky import build_sky

SIZE = (128, 96)
GAPS = 0.004
"""Share of a crown's pixels of which a sample passes a gap."""

NEAR, FAR = 30.0, 5_500.0
FRAMES = 5
DAYS = ("highway_day", "highway_golden_hour", "city_day", "village_day", "overcast", "abstract")

MOST = 30.0
"""How far a pixel may lie above its neighbours, in their standard deviations.

Shading of leaves, which `high` gives back, reaches 20; haze of single samples reached 120 to 380.
"""


@pytest.fixture(scope="module", autouse=True)
def variant() -> None:
    choose_backend("llvm")


def horizon_of(template: str) -> Image:
    """Radiance above the horizon under a template's sky, (columns, 3)."""
    settings = SkySettings(**catalog.template("scene", template)["sky"])
    return bake_sky(build_sky(settings), (64, 128)).horizon


def crown(horizon: Image, seed: int) -> Layers:
    """Two samples a pixel of a crown in the shade that fills the picture, as they are traced."""
    rng = np.random.default_rng(seed)
    shape = SIZE[::-1]
    level = float(horizon.mean())
    # What the first surface is stays; light and gaps are found anew in every frame.
    leaf = np.random.default_rng(0)
    normal = leaf.normal(size=(*shape, 3)).astype(np.float32)
    albedo = np.float32([0.10, 0.16, 0.05]) * leaf.uniform(0.7, 1.3, (*shape, 1))
    light = 0.02 * level * rng.gamma(1.5, 1 / 1.5, shape)
    through = rng.random(shape) < GAPS
    depth = np.where(through, 0.5 * (NEAR + FAR), NEAR + rng.uniform(-2, 2, shape))
    light = np.where(through, 0.5 * light + 0.5 * 0.05 * level, light)
    ones = np.ones(shape, np.float32)
    return Layers(
        {
            "radiance": (light[..., None] * np.float32([0.8, 1.2, 0.6])).astype(np.float32),
            "albedo": albedo.astype(np.float32),
            "normal": normal / np.linalg.norm(normal, axis=-1, keepdims=True),
            "hit": ones,
            "depth": depth.astype(np.float32),
            "first_depth": np.where(through & (rng.random(shape) < 0.5), FAR, NEAR) * ones,
            "ids": 0 * ones,
        }
    )


def light_of(picture: Image) -> Image:
    return np.asarray(picture @ LUMINANCE.astype(np.float32))


def highest(picture: Image) -> float:
    """How far a picture's most outstanding pixel lies above its neighbours [their deviations]."""
    light = light_of(picture)
    middle = median_filter(light, 5)
    spread = 1.4826 * median_filter(np.abs(light - middle), 15)
    return float(((light - middle) / (spread + 0.02 * middle)).max())


@pytest.mark.parametrize("denoiser", ["fast", "high"])
@pytest.mark.parametrize("template", DAYS)
def test_no_pixel_of_a_crown_flashes(template: str, denoiser: str) -> None:
    horizon, view = horizon_of(template), view_at([0.0, 0.0, 1.2])
    frames = [
        TracedFrame(crown(horizon, seed), view, white=float(horizon.mean()), samples=2)
        for seed in range(FRAMES)
    ]
    how = Finishing(denoiser, True, 0.2, Haze(), horizon)
    behind = horizon_behind(horizon, view, SIZE)
    for frame in (frames[0], frames[2]):
        others = [other for other in frames if other is not frame]
        helped = accumulated(frame, others).layers
        plain = apply_haze(
            helped["radiance"], Haze(), depth=helped["depth"], hit=helped["hit"], behind=behind
        )
        made = finished(helped, view, how)
        assert highest(made) < MOST
        # What is taken from specks is given to the pixels around: crowns get no darker.
        assert light_of(made).mean() == pytest.approx(light_of(plain).mean(), rel=0.025)
