"""Tiny pictures that must go on to look as they do; shared by the test and `refresh.py`."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from sumo3dviz_pt.pipeline.production import Request, example, opened, prepare
from sumo3dviz_pt.pipeline.scene_file import load_job

DATA = Path(__file__).parent / "data"

SIZE = (64, 36)
RUNS = 4

PICTURES = {
    "crossing_corner": ("crossing", "corner", 456.0, {}),
    "ronda_driver": ("ronda", "driver", 460.0, {}),
    "crossing_abstract": ("crossing", "corner", 456.0, {"template": "abstract"}),
}
"""Example, camera, time [s] and overrides by name."""


def render(name: str) -> tuple[np.ndarray, np.ndarray]:
    """Mean and variance over a few seeds of noise, (36, 64, 3) each, in white = 1.

    The scene's own seed stays, because colours and trees come from it.
    """
    scene, camera, time, overrides = PICTURES[name]
    job = load_job(example(scene), overrides)
    request = Request(camera=camera, quality="draft", size=SIZE, spp=16)
    production = prepare(job, request, np.array([time]))
    quality = production.quality.model_copy(update={"denoise": "none", "pass_spp": 16})
    white = 2.0**production.exposure
    pictures = []
    with opened(production, film=False) as session:
        frame = production.shot.frame_at(time)
        for seed in range(RUNS):
            session.settings = type(session.settings)(
                SIZE, quality, seed, white=session.settings.white
            )
            pictures.append(np.minimum(session.render(frame).radiance * white, 4.0))
    stack = np.array(pictures, dtype=np.float64)
    return stack.mean(axis=0), stack.var(axis=0, ddof=1)
