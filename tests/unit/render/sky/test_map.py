"""Skies as radiance maps: light, directions, twilight."""

import numpy as np
import pytest

from sumo3dviz_pt.model.scene import CANDELAS_PER_UNIT, Sky
from sumo3dviz_pt.model.weather import CloudLayer
from sumo3dviz_pt.render.backend import choose_backend
from sumo3dviz_pt.render.sky.baked import bake_sky, horizon_towards
from sumo3dviz_pt.render.sky.daylight import (
    UNITS_PER_SUNSKY,
    agreement,
    directions,
    twilight_factor,
)
from sumo3dviz_pt.render.sky.weathered import sky_entry

SMALL = (256, 512)
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


@pytest.fixture(autouse=True, scope="module")
def variant():
    choose_backend("llvm")


def sun_at(azimuth, elevation):
    a, e = np.radians(azimuth), np.radians(elevation)
    return np.array([np.cos(e) * np.sin(a), np.cos(e) * np.cos(a), np.sin(e)])


def solid_angles(size=SMALL):
    rows, columns = size
    theta = (np.arange(rows) + 0.5) / rows * np.pi
    each = np.sin(theta) * (np.pi / rows) * (2 * np.pi / columns)
    return np.repeat(each[:, None], columns, axis=1)


def texel(azimuth, elevation, size=SMALL):
    return int((90 - elevation) / 180 * size[0]), int(azimuth / 360 * size[1]) % size[1]


def test_directions_cover_the_sphere_clockwise_from_north():
    towards = directions(SMALL)
    np.testing.assert_allclose(np.linalg.norm(towards, axis=-1), 1)
    for azimuth in (10, 100, 190, 280):
        row, column = texel(azimuth, 20)
        assert towards[row, column] @ sun_at(azimuth, 20) > np.cos(np.radians(1))
    assert solid_angles().sum() == pytest.approx(4 * np.pi, rel=1e-4)


@pytest.mark.parametrize(("azimuth", "elevation"), [(0, 20), (90, 45), (200, 60), (359.9, 5)])
def test_the_sky_is_brightest_around_the_sun(azimuth, elevation):
    sky = bake_sky(Sky(sun_at(azimuth, elevation)), SMALL)
    np.testing.assert_allclose(sky.sun.direction, sun_at(azimuth, elevation))
    brightest = np.unravel_index(np.argmax(sky.radiance.sum(axis=-1)), SMALL)
    towards = directions(SMALL)[brightest]
    level = towards[:2] / np.linalg.norm(towards[:2])
    assert level @ sun_at(azimuth, 0)[:2] > np.cos(np.radians(10))


def test_mitsuba_has_the_map_that_it_would_make_of_a_picture():
    """To the bit: what it shows, and how it is sampled."""
    import drjit as dr
    import mitsuba as mi

    sky = bake_sky(Sky(sun_at(200, 30)), SMALL)
    plain = {
        "type": "envmap",
        "bitmap": mi.Bitmap(np.ascontiguousarray(sky.radiance)),
        "sampling_weight": 2.0,
        "to_world": mi.ScalarTransform4f().rotate([1, 0, 0], 90),
    }
    found = []
    for entry in (mi.load_dict(plain), sky_entry(sky, 2.0)):
        emitter = mi.load_dict({"type": "scene", "sky": entry}).environment()
        numbers = mi.PCG32(1 << 14)
        point = dr.zeros(mi.Interaction3f, 1 << 14)
        square = mi.Point2f(numbers.next_float32(), numbers.next_float32())
        drawn, weight = emitter.sample_direction(point, square)
        density = emitter.pdf_direction(point, drawn)
        weighs = mi.Float(emitter.sampling_weight())
        texels = mi.traverse(emitter)["data"]
        found.append([np.array(value) for value in (drawn.d, weight, density, texels, weighs)])
    for one, other in zip(*found, strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("elevation", [10, 35, 60, 89])
def test_the_sun_carries_the_models_irradiance(elevation):
    """Against Mitsuba's own sun, sampled through its emitter interface."""
    import drjit as dr
    import mitsuba as mi

    direction = sun_at(130, elevation)
    sky = bake_sky(Sky(direction, turbidity=3.0), SMALL)
    model = mi.load_dict(
        {
            "type": "sunsky",
            "sun_direction": direction.tolist(),
            "turbidity": 3.0,
            "sky_scale": 0.0,
            "albedo": {"type": "rgb", "value": 0.2},
        }
    )
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(1, 20000)
    si = dr.zeros(mi.SurfaceInteraction3f, 20000)
    _, weight = model.sample_direction(si, sampler.next_2d())
    known = agreement(np.radians(elevation))[1]
    expected = np.array(weight).mean(axis=1) * UNITS_PER_SUNSKY * known
    np.testing.assert_allclose(sky.sun.irradiance, expected, rtol=0.05)


@pytest.mark.parametrize("turbidity", [2.0, 3.0, 5.0])
def test_noon_is_as_bright_as_outdoors(turbidity):
    lux = bake_sky(Sky(sun_at(180, 60), turbidity=turbidity), SMALL).illuminance
    assert 80e3 <= lux <= 120e3


def test_illuminance_is_that_of_the_map():
    sky = bake_sky(Sky(sun_at(45, 30)), SMALL)
    cosine = np.maximum(directions(SMALL)[..., 2], 0)
    irradiance = (sky.radiance * (solid_angles() * cosine)[..., None]).sum(axis=(0, 1))
    irradiance = irradiance + sky.sun.irradiance * np.sin(np.radians(30))
    lux = float(irradiance @ LUMINANCE) * CANDELAS_PER_UNIT
    assert sky.illuminance == pytest.approx(lux, rel=1e-4)


@pytest.mark.parametrize("elevation", [-90, -18, -12, -6, -1, -0.2, 0, 0.2, 1, 2, 15, 45, 90])
def test_every_sun_gives_a_finite_sky(elevation):
    sky = bake_sky(Sky(sun_at(77, elevation), night=(2.5e-8, 3.1e-8, 4.7e-8)), SMALL)
    if elevation != -0.2:  # half a disc, which haze may hide
        assert (sky.sun is None) == (elevation < -0.3)
    for values in (sky.radiance, sky.horizon):
        assert np.isfinite(values).all() and (values >= 0).all()
    assert sky.radiance.max() > 0


@pytest.mark.slow
def test_light_grows_with_the_sun():
    elevations = [-18, -6, -1, 0, 2, 10, 60, 90]
    lux = [bake_sky(Sky(sun_at(90, e)), SMALL).illuminance for e in elevations]
    assert (np.diff(lux) > 0).all()
    # Seidelmann 1992: sunset about 700 lx, end of civil twilight 3.4 lx.
    assert 300 < lux[elevations.index(0)] < 1500
    assert 1.5 < lux[elevations.index(-6)] < 7


def test_twilight_is_continuous():
    degrees = np.linspace(-18, 2, 2001)
    factors = np.array([twilight_factor(np.radians(d)) for d in degrees])
    assert (np.diff(factors) > 0).all() and factors[-1] == pytest.approx(1)
    assert np.diff(np.log(factors)).max() < 0.02


def test_no_sun_is_night():
    sky = bake_sky(Sky(None, night=(1e-6, 2e-6, 3e-6)), SMALL)
    np.testing.assert_allclose(sky.radiance[10, 10], (1e-6, 2e-6, 3e-6), rtol=1e-5)


# Clouds and pictures -----------------------------------------------------------------------


def clouds(cover, *, sunlit=0.5, skylit=0.5, shape=(64, 256)):
    values = np.broadcast_to(np.asarray(cover, dtype=np.float32), shape)
    return CloudLayer(values, np.full(shape, sunlit), np.full(shape, skylit))


def test_full_clouds_hide_the_sun():
    sun = sun_at(100, 40)
    clear, covered = Sky(sun), Sky(sun, clouds=clouds(1.0))
    assert bake_sky(clear, SMALL).sun is not None
    dull = bake_sky(covered, SMALL)
    assert dull.sun is None
    upper = dull.radiance[: SMALL[0] // 2 - 2]
    assert np.ptp(upper, axis=(0, 1)).max() < 0.02 * upper.max()


def test_no_clouds_change_nothing():
    sun = sun_at(100, 40)
    clear = bake_sky(Sky(sun), SMALL).radiance
    np.testing.assert_allclose(
        bake_sky(Sky(sun, clouds=clouds(0.0)), SMALL).radiance, clear, rtol=1e-5
    )


def test_clouds_turn_clockwise():
    cover = np.zeros((64, 256), dtype=np.float32)
    cover[:, :8] = 1.0  # a stripe just east of north
    plain = Sky(sun_at(180, 40), clouds=clouds(cover, sunlit=5.0))
    turned = Sky(sun_at(180, 40), clouds=plain.clouds, rotation=np.pi / 2)
    row, _ = texel(0, 60)
    north, east = texel(5, 60)[1], texel(95, 60)[1]
    before, after = bake_sky(plain, SMALL).radiance[row], bake_sky(turned, SMALL).radiance[row]
    assert before[north].max() > 3 * before[east].max()
    assert after[east].max() > 3 * after[north].max()


def test_a_picture_keeps_its_columns_and_scale():
    image = np.zeros((16, 32, 3), dtype=np.float32)
    image[:, 8] = 1.0  # east
    sky = bake_sky(Sky(None, image=image, image_scale=3.0), SMALL)
    assert sky.radiance[100, texel(95.6, 0)[1], 0] == pytest.approx(3.0, rel=0.05)
    assert sky.radiance[100, texel(275, 0)[1]].max() == 0
    turned = bake_sky(Sky(None, image=image, rotation=np.pi / 2), SMALL)
    assert turned.radiance[100, texel(185.6, 0)[1], 0] == pytest.approx(1.0, rel=0.05)


def test_the_horizon_is_the_skys_and_holds_no_sun():
    sky = bake_sky(Sky(sun_at(90, 1.0)), SMALL)
    assert sky.horizon.shape == (SMALL[1], 3)
    assert sky.horizon.max() < 20 * np.median(sky.horizon)
    behind = horizon_towards(sky.horizon, directions(SMALL)[120])
    np.testing.assert_allclose(behind, sky.horizon, rtol=1e-5)


def test_below_the_horizon_it_stays_as_bright_at_its_edge():
    sky = bake_sky(Sky(sun_at(180, 50)), SMALL).radiance
    middle = SMALL[0] // 2
    np.testing.assert_allclose(sky[middle].mean(axis=0), sky[middle - 1].mean(axis=0), rtol=0.25)
    assert sky[-1].max() < sky[middle].max()


def test_the_disc_is_as_bright_as_its_irradiance_says():
    sun = bake_sky(Sky(sun_at(90, 30)), SMALL).sun
    solid_angle = 2 * np.pi * (1 - np.cos(np.radians(0.2666)))
    np.testing.assert_allclose(sun.radiance * solid_angle, sun.irradiance, rtol=1e-3)
