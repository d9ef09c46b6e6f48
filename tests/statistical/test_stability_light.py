"""Every sun from deep night to the zenith, and twenty stops of exposure."""

from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from builders import RAW, ball, diffuse, frame_of, plane, scene_of, session_of, static, view_at

from sumo3dviz_pt.image.tonemap import develop, develop_float, tone_names
from sumo3dviz_pt.library.materials import MATERIALS
from sumo3dviz_pt.model.scene import CANDELAS_PER_UNIT, Sky
from sumo3dviz_pt.render.sky.baked import bake_sky
from sumo3dviz_pt.render.sky.daylight import SUN_RADIUS
from sumo3dviz_pt.world.sky import NIGHT, base_exposure

pytestmark = pytest.mark.slow

ELEVATIONS = tuple(range(-18, 91, 3))  # 0 is among them
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
ALBEDO = 0.4
CAPPED = RAW.model_copy(update={"cap": 40.0})

# Horizontal illuminance [lx] by the sun's elevation [deg]: Seidelmann (ed.), Explanatory
# Supplement to the Astronomical Almanac, 1992; by day the round values of a clear sky.
KNOWN_AT = (-18, -12, -6, -4, -2, 0, 5, 10, 20, 30, 45, 60, 90)
KNOWN = (6.5e-4, 8.3e-3, 3.4, 27, 154, 732, 4.8e3, 1.1e4, 2.7e4, 4.5e4, 7.4e4, 1e5, 1.2e5)


def towards(elevation, azimuth=0.0):
    """Unit vector to the sun; angles in degrees, azimuth clockwise from north."""
    e, a = np.radians((elevation, azimuth))
    return np.array([np.cos(e) * np.sin(a), np.cos(e) * np.cos(a), np.sin(e)])


def sky_of(elevation):
    """A clear sky with the sun in the north."""
    exposure = base_exposure(float(np.radians(elevation)))
    return Sky(towards(elevation), night=NIGHT, exposure=exposure)


def views(elevation):
    """Down on matt ground; into the sun; at its mirror image in a chrome ball."""
    return {
        "ground": view_at([150, 0, 2], pitch=-90, fov=40),
        "sun": view_at([0, 0, 2], pitch=elevation, fov=4),
        "mirror": view_at([0, 0, 2], heading=180, pitch=-4, fov=20),
    }


@cache
def shown(elevation, quality=RAW):
    """The baked sky, without its map, and what each view shows, in scene units."""
    parts = [
        static("ground", plane(400), "grey"),
        static("ball", ball((0, -12, 1.5), 1.5), "chrome"),
    ]
    sky = sky_of(elevation)
    materials = {"grey": diffuse(ALBEDO), "chrome": MATERIALS["chrome"]}
    scene = scene_of(parts, materials, sky=sky)
    white = 2.0**-sky.exposure
    with session_of(scene, size=(32, 18), quality=quality, white=white) as session:
        pictures = {name: session.render(frame_of(view)) for name, view in views(elevation).items()}
        top = session.sky.radiance.max(axis=(0, 1), keepdims=True)
        return replace(session.sky, closed=np.repeat(top, 3, axis=1)), pictures


def luminance(name, elevation, quality=RAW):
    """Mean luminance of a view, in scene units."""
    return float(shown(elevation, quality)[1][name].radiance.mean(axis=(0, 1)) @ LUMINANCE)


@pytest.mark.parametrize("elevation", ELEVATIONS)
def test_every_sun_gives_clean_pictures_of_bounded_energy(elevation):
    """No pixel is brighter than the brightest emitter: no material makes light.

    On average a frame holds at most what the eye gets from the map, the share of the sun's
    disc in it (irradiance over the frame's solid angle), and what ground and mirror throw
    back: each less than all that a matt white does, E / pi, times the two of them.
    """
    sky, pictures = shown(elevation)
    sun = np.zeros(3) if sky.sun is None else sky.sun.irradiance
    disc = 0.0 if sky.sun is None else float(sky.sun.radiance.max())
    brightest = float(sky.radiance.max())  # of the whole map
    for name, rendered in pictures.items():
        image = rendered.radiance
        assert np.isfinite(image).all() and (image >= 0).all()
        assert (rendered.tally.nonfinite, rendered.tally.negative) == (0, 0)
        assert image.max() <= 1.01 * (disc + brightest)
        half = views(elevation)[name].lens.half_width
        frame = (2 * half) ** 2 * 18 / 32
        bound = brightest + sun.max() * (1.3 / frame if name == "sun" else 0.0)
        assert 0 < image.mean() <= bound + 2 * sun.max() / np.pi + 1e-12


@pytest.mark.parametrize("elevation", ELEVATIONS)
def test_matt_ground_returns_albedo_times_the_light_on_it(elevation):
    """The closed form L = albedo x E / pi, of whatever sun."""
    sky, _ = shown(elevation)
    expected = ALBEDO * sky.illuminance / CANDELAS_PER_UNIT / np.pi
    assert luminance("ground", elevation) == pytest.approx(expected, rel=0.05)


@pytest.mark.parametrize(("low", "high"), tuple(pairwise(ELEVATIONS)))
@pytest.mark.parametrize("view", ["ground", "mirror"])
def test_no_jump_between_neighbours(view, low, high):
    """Light grows as in nature, by a factor of 20 per 3 degrees at dusk, within 3."""
    night = np.pi * float(np.dot(NIGHT, LUMINANCE)) * CANDELAS_PER_UNIT
    known = [night + np.exp(np.interp(e, KNOWN_AT, np.log(KNOWN))) for e in (low, high)]
    step = luminance(view, high) / luminance(view, low)
    assert 1 / 3 < step / (known[1] / known[0]) < 3
    if view == "ground":
        assert step > 0.98, "more sun, more light"


def test_the_sun_rises_without_a_step():
    """From minute to minute (a quarter of a degree) light changes by less than a half.

    Nature's steepest dusk is a factor of 2.7 per degree; the change itself changes by less
    than 5 % from one quarter of a degree to the next.
    """
    fine = np.arange(-20.0, 12.01, 0.25)
    light = np.log([bake_sky(sky_of(e), (32, 64)).illuminance for e in fine])
    steps = np.diff(light)
    assert steps.max() < np.log(1.5) and steps.min() > -1e-6
    assert np.abs(np.diff(steps)).max() < 0.05


@pytest.mark.parametrize("elevation", [0, 2, 3, 6, 45, 90])
def test_the_cap_spares_the_disc_and_tames_its_mirror_image(elevation):
    sky, plain = shown(elevation)
    _, capped = shown(elevation, CAPPED)
    disc = sky.sun.radiance
    for pictures in (plain, capped):
        # A pixel is an eighth of a degree wide: some lie wholly within the disc.
        sun = pictures["sun"].radiance
        above = sun.reshape(-1, 3).max(axis=0)
        np.testing.assert_allclose(above, disc, rtol=0.02, atol=sky.radiance.max())
        # At 0 degrees haze leaves a disc no brighter than the sky around it.
        assert disc[1] > 2 * sky.radiance[..., 1].max() or elevation == 0
        if elevation > 0:
            share = (sun[..., 1] > 0.5 * disc[1]).sum() * (4.0 / 32) ** 2
            whole = np.pi * np.degrees(SUN_RADIUS) ** 2
            assert 0.8 * sky.sun.risen * whole < share < 1.25 * sky.sun.risen * whole
    limit = CAPPED.cap * 2.0 ** -sky_of(elevation).exposure
    assert capped["mirror"].radiance.max() <= limit * (1 + 1e-4)
    # A low sun's glint is what the cap is for; a setting one is too dim for it.
    assert plain["mirror"].radiance.max() > 2 * limit or elevation not in (3, 6)
    assert luminance("mirror", elevation, CAPPED) <= 1.001 * luminance("mirror", elevation)


# Exposure ----------------------------------------------------------------------------------

STOPS = np.arange(-10.0, 10.01, 1.0)


@pytest.mark.parametrize("tone", tone_names())
@pytest.mark.parametrize("elevation", [-18, 0, 45])
def test_twenty_stops_develop_in_range_and_in_order(tone, elevation):
    """The darkest picture is nearly black, the brightest nearly white, none goes back."""
    base = sky_of(elevation).exposure
    image = np.concatenate([shown(elevation)[1][name].radiance for name in ("ground", "sun")])
    means = []
    for stop in STOPS:
        picture = develop_float(image, exposure=base + stop, tone=tone)
        assert np.isfinite(picture).all() and picture.min() >= 0 and picture.max() <= 1
        assert develop(image, exposure=base + stop, tone=tone).dtype == np.uint8
        means.append(float(picture[:18].mean()))
    assert (np.diff(means) >= -1e-6).all()
    if elevation >= 0:
        assert means[0] < 0.1 and means[-1] > 0.9


@pytest.mark.parametrize("stop", [-10, 0, 10])
def test_the_cap_scales_with_white(stop):
    """A mirror of a small hot patch: at every exposure it is cut at 40 x white."""
    image = np.full((16, 32, 3), 0.2, dtype=np.float32)
    image[4, 8] = 1e9
    parts = [static("ground", plane(40), "grey")]
    scene = scene_of(parts, {"grey": diffuse(ALBEDO)}, sky=Sky(None, image=image))
    white = 2.0**-stop
    with session_of(scene, quality=CAPPED, white=white, size=(32, 18)) as session:
        ground = session.render(frame_of(view_at([0, 0, 5], pitch=-80, fov=40))).radiance
    assert ground.max() == pytest.approx(CAPPED.cap * white, rel=1e-3)
