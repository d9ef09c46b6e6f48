"""What a session holds between frames."""

from __future__ import annotations

import numpy as np
import pytest
from builders import (
    RAW,
    constant_sky,
    diffuse,
    frame_of,
    plane,
    scene_of,
    session_of,
    static,
    view_at,
)

from sumo3dviz_pt.render.backend import choose_backend
from sumo3dviz_pt.render.sky.baked import SkyMap


@pytest.fixture(autouse=True, scope="module")
def variant() -> None:
    choose_backend("llvm")


def test_no_session_keeps_a_map_that_mitsuba_has_copied() -> None:
    """That of a sky with clouds takes 160 MB, and is asked for once."""
    sky = constant_sky(0.5)
    scene = scene_of([static("ground", plane(20), "ground")], {"ground": diffuse(0.5)}, sky=sky)
    with session_of(scene, size=(16, 12), quality=RAW) as session:
        session.render(frame_of(view_at([0, 0, 5], pitch=-90)))
        assert not any(isinstance(value, SkyMap) for value in vars(session).values())
        large = [v for v in vars(session).values() if getattr(v, "nbytes", 0) > 1_000_000]
        assert not large
        # Whoever asks gets the same map again.
        np.testing.assert_array_equal(session.sky.radiance, session.sky.radiance)
