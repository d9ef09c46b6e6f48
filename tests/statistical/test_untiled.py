"""Untiled textures keep mean and variance, and do not repeat with their bitmap."""

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from sumo3dviz_pt import catalog
from sumo3dviz_pt.render.backend import choose_backend
from sumo3dviz_pt.render.convert import plugin
from sumo3dviz_pt.render.untiled import register_untiled
from sumo3dviz_pt.scene.materials import surface_bsdf

pytestmark = pytest.mark.slow

TILES, SIZE = 24, 900
SURFACES = [
    name
    for name in catalog.names("surfaces")
    if catalog.find("surfaces", name).meta["bsdf"].get("base_color", {}).get("type") == "untiled"
]


@pytest.fixture(scope="module", autouse=True)
def variant():
    backend = choose_backend()
    if not backend.jit:
        pytest.skip("scalar variants show the plain bitmap")
    register_untiled()


def word_of(name):
    """The texture of a surface, as built: even and unworn."""
    word = surface_bsdf(catalog.find("surfaces", name))["base_color"]
    return {**word, "uneven": 0.0, "wear": False}


def values_at(word, uv, *, distance=0.0):
    """Brightness at texture coordinates, (n, 2), seen from a distance [m]."""
    texture = mi.load_dict(plugin(word, tint={}))
    si = dr.zeros(mi.SurfaceInteraction3f, len(uv))
    si.uv = mi.Point2f(*(mi.Float(np.ascontiguousarray(c, np.float32)) for c in uv.T))
    si.t, si.wi = mi.Float(distance), mi.Vector3f(0, 0, 1)
    return np.array(texture.eval_3(si), dtype=np.float64).mean(axis=0)


def bitmap_of(word):
    picture = mi.Bitmap(word["filename"]).convert(
        mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, False
    )
    return np.array(picture, dtype=np.float64).mean(axis=-1)


def spots(seed=0, count=SIZE * SIZE):
    return np.random.default_rng(seed).uniform(0.0, TILES, (count, 2))


@pytest.mark.parametrize("name", SURFACES)
def test_mean_and_spread_are_the_bitmaps(name):
    word = word_of(name)
    seen, bitmap = values_at(word, spots()), bitmap_of(word)
    assert seen.mean() == pytest.approx(bitmap.mean(), rel=0.02)
    assert seen.var() == pytest.approx(bitmap.var(), rel=0.02)


@pytest.mark.parametrize("name", SURFACES)
def test_nothing_returns_after_a_tile(name):
    word, uv = word_of(name), spots(count=100_000)
    here = values_at(word, uv)
    for step in ((1.0, 0.0), (0.0, 1.0), (1.0, 1.0), (2.0, 0.0)):
        there = values_at(word, uv + np.array(step))
        assert abs(np.corrcoef(here, there)[0, 1]) < 0.05


def test_far_away_it_fades_to_its_mean():
    word, uv = word_of("asphalt"), spots(count=200_000)
    near, middle, far = (values_at(word, uv, distance=d) for d in (0.0, 60.0, 3000.0))
    assert far.std() < 0.5 * middle.std() < 0.5 * near.std()
    assert far.mean() == pytest.approx(near.mean(), rel=0.02)


def test_a_place_looks_the_same_every_time():
    word, uv = word_of("asphalt"), spots(count=1000)
    assert np.array_equal(values_at(word, uv), values_at(word, uv))
