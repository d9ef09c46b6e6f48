"""Skies that are kept in the user's cache."""

from dataclasses import replace

import numpy as np
import pytest

from sumo3dviz_pt.model.scene import Sky
from sumo3dviz_pt.model.weather import CloudLayer, StoredClouds
from sumo3dviz_pt.render.backend import choose_backend
from sumo3dviz_pt.render.sky import baked as skies
from sumo3dviz_pt.render.sky.baked import bake_dome, sky_of_dome

SIZE = (64, 128)
SUN = np.array([0.6, 0.0, 0.8])


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch):
    choose_backend("llvm")
    monkeypatch.setenv("SUMO3DVIZ_PT_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(skies, "_CACHED_LEAST", 0)
    return tmp_path / "cache" / "skies"


@pytest.fixture
def baked(monkeypatch):
    """Lists the skies that are really baked."""
    found = []
    original = skies.bake_dome

    def listed(sky, size):
        found.append(sky)
        return original(sky, size)

    monkeypatch.setattr(skies, "bake_dome", listed)
    return found


def plain_sky(sky, size):
    """What is baked without any cache; it is not listed."""
    return sky_of_dome(*bake_dome(sky, (size[0] // 2, size[1])))


def cloudy(share=0.5, sun=SUN):
    cover = np.full((16, 64), share, np.float32)
    return Sky(sun, clouds=CloudLayer(cover, cover, cover, 0.9))


def assert_same(one, other):
    np.testing.assert_array_equal(one.radiance, other.radiance)
    np.testing.assert_array_equal(one.horizon, other.horizon)
    assert one.illuminance == other.illuminance
    assert (one.sun is None) == (other.sun is None)
    if one.sun is not None:
        np.testing.assert_array_equal(one.sun.direction, other.sun.direction)
        np.testing.assert_array_equal(one.sun.irradiance, other.sun.irradiance)
        assert one.sun.moon == other.sun.moon


@pytest.mark.parametrize(
    "sky",
    [
        cloudy(),
        cloudy(sun=None),
        Sky(None, stars=3, moon_direction=SUN, night=(1e-6, 2e-6, 3e-6)),
    ],
    ids=["clouds", "clouds without a sun", "moon and stars"],
)
def test_a_sky_is_baked_once_and_read_to_the_bit(sky, baked):
    plain = plain_sky(sky, SIZE)
    assert_same(skies.cached_sky(sky, SIZE), plain)
    assert_same(skies.cached_sky(sky, SIZE), plain)
    assert len(baked) == 1


def test_stored_clouds_are_read_once_where_a_sky_is_baked(baked):
    layer, read = cloudy().clouds, []
    found = StoredClouds("one", layer.lit_from, lambda: read.append(1) or layer)
    sky = Sky(SUN, clouds=found)
    assert_same(skies.cached_sky(sky, SIZE), plain_sky(cloudy(), SIZE))
    assert_same(skies.cached_sky(replace(sky, clouds=replace(found)), SIZE), plain_sky(sky, SIZE))
    assert len(baked) == len(read) == 1
    skies.cached_sky(replace(sky, clouds=replace(found, key="other")), SIZE)
    assert len(baked) == len(read) == 2


@pytest.mark.parametrize(
    "other", [cloudy(0.6), cloudy(sun=np.array([0.0, 0.6, 0.8]))], ids=["clouds", "sun"]
)
def test_another_sky_is_another(other, baked):
    skies.cached_sky(cloudy(), SIZE)
    assert_same(skies.cached_sky(other, SIZE), plain_sky(other, SIZE))
    skies.cached_sky(cloudy(), (32, 64))
    assert len(baked) == 3


def test_a_damaged_sky_is_baked_anew(cache, baked):
    skies.cached_sky(cloudy(), SIZE)
    (dome,) = cache.rglob("dome.f32")
    dome.write_bytes(dome.read_bytes()[:-4] + b"\0\0\0\0")
    assert_same(skies.cached_sky(cloudy(), SIZE), plain_sky(cloudy(), SIZE))
    assert len(baked) == 2


def test_small_skies_and_pictures_are_not_kept(cache, monkeypatch):
    image = np.ones((32, 64, 3), np.float32)
    assert skies.cached_sky(Sky(None, image=image), SIZE).radiance.shape == (*SIZE, 3)
    monkeypatch.setattr(skies, "_CACHED_LEAST", SIZE[0] * SIZE[1] + 1)
    skies.cached_sky(cloudy(), SIZE)
    assert not cache.exists()


def test_where_nothing_can_be_written_the_sky_is_there_all_the_same(cache, baked):
    cache.parent.mkdir(parents=True)
    cache.write_text("no folder")
    for _ in range(2):
        assert_same(skies.cached_sky(cloudy(), SIZE), plain_sky(cloudy(), SIZE))
    assert len(baked) == 2
