"""What a street lamp gives to the ground, by rendering, against its closed form."""

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

from sumo3dviz_pt.library.materials import MATERIALS
from sumo3dviz_pt.world.placement.surroundings import Surroundings
from sumo3dviz_pt.world.street.lamps import FLUX, HIGH, LOBE, LOW, Lamp, lamp_sets

pytestmark = pytest.mark.slow

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
CANDELAS = 32_000.0
ALBEDO = 0.5


AROUND = Surroundings(None, None, np.zeros((0, 3)), 0)


@pytest.mark.parametrize("away", [0.0, 6.0, 15.0])
@pytest.mark.parametrize("height", [LOW, HIGH])
def test_a_lamp_gives_the_light_of_its_flux(height, away):
    """E = I c h / r^3 beside the spot below the lens, by its lobe's integral I = F / flux."""
    lamps = lamp_sets([Lamp((0.0, 0.0, 0.0), 0.0, height)], AROUND)
    materials = {"g": diffuse(ALBEDO), "signal_lens": MATERIALS["signal_lens"]}
    ground = static("g", plane(60), "g")
    scene = scene_of([ground], materials, sky=constant_sky(0.0), lamps=lamps)
    quality = RAW.model_copy(update={"spp": 256, "pass_spp": 64})
    with session_of(scene, size=(8, 8), quality=quality) as session:
        view = view_at([1.5, away, 5.0], pitch=-90, fov=3)
        radiance = session.render(frame_of(view)).radiance.mean(axis=(0, 1), dtype=np.float64)
    lux = float(radiance @ LUMINANCE) * np.pi / ALBEDO * CANDELAS
    square = height**2 + away**2
    intensity = FLUX[height] / LOBE.flux * LOBE.at(height / np.sqrt(square))
    known = intensity * height**2 / square**2
    assert lux == pytest.approx(known, rel=0.03)
