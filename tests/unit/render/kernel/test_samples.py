"""Any number of samples can be asked for; samplers with a pattern take some more."""

from __future__ import annotations

import numpy as np
import pytest
from builders import LAMPS, RAW, diffuse, frame_of, plane, scene_of, session_of, static, view_at

from sumo3dviz_pt.library.materials import MATERIALS
from sumo3dviz_pt.render.kernel.integrator import Limits

pytestmark = pytest.mark.usefixtures("compiled")


@pytest.mark.parametrize("sampler", ["independent", "multijitter"])
def test_any_number_of_samples_is_traced(sampler: str) -> None:
    """An exposure shares samples out among its moments: 64 of lamps become 13 of each of five."""
    scene = scene_of(
        [static("road", plane(40.0), "grey")], {**MATERIALS, "grey": diffuse(0.4)}, lamps=[LAMPS]
    )
    quality = RAW.model_copy(update={"sampler": sampler, "cap": 40.0})
    with session_of(scene, size=(16, 12), quality=quality) as session:
        view = view_at((0, -9, 3), pitch=-15)
        session.render(frame_of(view, lamps={"lamps": np.full((1, 3), 1.0)}))
        kernel = session.by_kernel.followed()
        sensor = session.loaded.scene.sensors()[0]
        eye = kernel.eye(sensor, view)
        for spp in (1, 2, 3, 5, 7, 13, 22, 32):
            glow = kernel.glow(sensor, view, spp=spp, few=spp, seed=spp)
            assert np.isfinite(glow).all() and glow.max() <= 1.0 + 1e-5
            layers = kernel.trace(sensor, eye, spp=spp, seed=spp, limits=Limits(2, 2))
            assert layers["hit"].max() == 1.0
