"""Walls of all colours with one texture."""

import numpy as np
import pytest

from sumo3dviz_pt.library.buildings.palettes import CLADDINGS, cladding
from sumo3dviz_pt.model.scene import is_tinted
from sumo3dviz_pt.render.backend import choose_backend
from sumo3dviz_pt.render.convert import plugin
from sumo3dviz_pt.render.materials.stained import BRIGHTEST, register_stained
from sumo3dviz_pt.world.objects.houses import cladding_material

GREY = {"type": "rgb", "value": [0.2, 0.4, 0.8]}


@pytest.fixture
def scalar():
    yield choose_backend("scalar")
    choose_backend()


def word(tint, texture, mean):
    return plugin(
        {"type": "stained", "texture": texture, "tint": {"type": "tint"}, "mean": mean}, tint=tint
    )


@pytest.mark.parametrize("surface", sorted(CLADDINGS))
def test_claddings_take_the_colour_of_each_face(surface):
    textured = cladding_material(cladding(surface), textured=True)
    assert is_tinted(textured)
    assert is_tinted(cladding_material(cladding(surface), textured=False))
    assert textured["base_color"]["type"] == "stained"


def test_a_scalar_variant_shows_the_colour_alone(scalar):
    assert word(GREY, {"type": "uniform", "value": 0.5}, [0.5] * 3) == GREY


@pytest.mark.parametrize(("texture", "factor"), [(0.5, 1.0), (0.25, 0.5), (0.75, 1.5)])
def test_a_jit_variant_multiplies_colour_and_texture_over_its_mean(texture, factor):
    if not choose_backend().jit:
        pytest.skip("no JIT variant here")
    import mitsuba as mi

    register_stained()
    grey = {"type": "uniform", "value": 0.6}
    made = mi.load_dict(word(grey, {"type": "uniform", "value": texture}, [0.5] * 3))
    found = np.array(made.eval_3(mi.SurfaceInteraction3f())).ravel()[:3]
    assert found == pytest.approx(min(0.6 * factor, BRIGHTEST), abs=1e-3)
