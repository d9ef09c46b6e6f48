"""Walls of all colours with one texture."""

import numpy as np
import pytest
from PIL import Image

from sumo3dviz_pt.library.buildings.palettes import CLADDINGS, cladding
from sumo3dviz_pt.model.scene import is_tinted
from sumo3dviz_pt.render.backend import choose_backend
from sumo3dviz_pt.render.convert import plugin
from sumo3dviz_pt.render.paint import BRIGHTEST, register_stained
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


@pytest.mark.parametrize("mean", [(0.5, 0.25, 0.1), (0.1, 0.3, 0.5)])
def test_a_texture_that_is_its_mean_leaves_each_channel_of_the_colour(mean):
    if not choose_backend().jit:
        pytest.skip("no JIT variant here")
    import drjit as dr
    import mitsuba as mi

    register_stained()
    colour = (0.2, 0.4, 0.7)
    tint, texture = (
        {"type": "bitmap", "raw": True, "data": mi.TensorXf(np.full((2, 2, 3), value))}
        for value in (colour, mean)
    )
    made = mi.load_dict(word(tint, texture, mean))
    found = np.array(made.eval_3(dr.zeros(mi.SurfaceInteraction3f))).ravel()[:3]
    assert found == pytest.approx(colour, abs=1e-3)


@pytest.mark.parametrize("surface", sorted(CLADDINGS))
def test_the_mean_of_a_cladding_is_that_of_its_picture(surface):
    """So walls have the colour of their coat, on average, in every channel."""
    stained = cladding_material(cladding(surface), textured=True)["base_color"]
    picture = np.asarray(Image.open(stained["texture"]["filename"]).convert("RGB")) / 255.0
    linear = np.where(picture > 0.04045, ((picture + 0.055) / 1.055) ** 2.4, picture / 12.92)
    assert linear.mean(axis=(0, 1)) == pytest.approx(stained["mean"], rel=0.05)
