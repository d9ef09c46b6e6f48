"""What a lux meter on the ground would read, by rendering; and every unit is used once.

A matt plane of albedo rho that shows radiance L receives pi L / rho; one scene unit is
`CANDELAS_PER_UNIT` cd/m^2.

References:
    Janiczek and DeYoung 1987, Computer programs for sun and moon illuminance, US Naval
    Observatory Circular 171, subroutine ATMOS (clear sky and sun, 133,775 lx outside).
    IES 1984, Recommended practice for the calculation of daylight availability, J. IES
    13(4), doi:10.1080/00994480.1984.10748791 (clear and partly cloudy skies).
    Kasten and Czeplak 1980, Solar and terrestrial radiation dependent on the amount and
    type of cloud, Solar Energy 24(2), doi:10.1016/0038-092X(80)90391-6.
    Seidelmann (ed.) 1992, Explanatory Supplement to the Astronomical Almanac (twilight).
"""

from dataclasses import replace

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
    write_scenario,
)
from significance import sidak_z, standard_error

from sumo3dviz_pt import catalog
from sumo3dviz_pt.cli import main
from sumo3dviz_pt.image.exr import read_exr
from sumo3dviz_pt.image.tonemap import develop_float
from sumo3dviz_pt.job.settings import SkySettings
from sumo3dviz_pt.model.scene import CANDELAS_PER_UNIT, Sky
from sumo3dviz_pt.render.backend import choose_backend
from sumo3dviz_pt.render.sky.baked import bake_sky
from sumo3dviz_pt.render.sky.daylight import UNITS_PER_SUNSKY, directions
from sumo3dviz_pt.world.sky import NIGHT, build_sky

pytestmark = pytest.mark.slow

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
ALBEDO = 0.5


@pytest.fixture(autouse=True, scope="module")
def variant():
    choose_backend("llvm")


QUALITY = RAW.model_copy(update={"spp": 64, "pass_spp": 64})


def sun_at(azimuth, elevation):
    a, e = np.radians(azimuth), np.radians(elevation)
    return np.array([np.cos(e) * np.sin(a), np.cos(e) * np.cos(a), np.sin(e)])


def clear(elevation, **more):
    """The clear sky as a scene file asks for it."""
    return build_sky(SkySettings(sun={"azimuth": 200, "elevation": elevation}, **more))


def measured(sky):
    """Rendered and baked horizontal illuminance, and the rendered one's standard error [lx]."""
    scene = scene_of([static("g", plane(100), "g")], {"g": diffuse(ALBEDO)}, sky=sky)
    with session_of(scene, size=(24, 24), quality=QUALITY) as session:
        radiance = session.render(frame_of(view_at([0, 0, 5], pitch=-90))).radiance
        baked = session.sky.illuminance
    lux = radiance.astype(np.float64) @ LUMINANCE * np.pi / ALBEDO * CANDELAS_PER_UNIT
    return lux.mean(), baked, standard_error(lux)


def usno(elevation):
    """Horizontal illuminance of a clear sky and its sun [lx], after the US Naval Observatory."""
    height, scale = np.radians(elevation), 753.66156
    sine = np.sin(height)
    slant = np.arcsin(scale * np.cos(height) / (scale + 1))
    air = scale * (np.cos(slant) - sine) + np.cos(slant)
    direct = np.exp(-0.21 * air) * sine
    diffused = 0.0289 * np.exp(-0.042 * air) * (1 + (elevation + 90) * sine / 57.29577951)
    return 133_775.0 * (direct + diffused)


CLEAR = (0.21, 0.8, 15.5, 0.5)
"""The IES' constants of a clear sky: extinction, and base, slope and power of the sky [klx]."""


def ies(elevation, constants):
    """Horizontal illuminance of sun and sky [lx], after the IES."""
    sine = np.sin(np.radians(elevation))
    extinction, base, slope, power = constants
    return 127_500.0 * np.exp(-extinction / sine) * sine + 1000 * (base + slope * sine**power)


@pytest.mark.parametrize("elevation", [60.0])
@pytest.mark.parametrize("turbidity", [2.0, 3.0, 5.0])
def test_clear_noon_gives_100_klx(elevation, turbidity):
    lux, baked, error = measured(clear(elevation, turbidity=turbidity))
    assert 80e3 <= lux <= 120e3
    assert abs(lux - baked) <= 0.002 * baked + sidak_z(3) * error


@pytest.mark.parametrize("elevation", [90, 60, 45, 30, 20])
def test_a_clear_sky_follows_the_published_curves(elevation):
    """Within 15 % of the range of two of them."""
    lux, baked, error = measured(clear(elevation))
    curves = [usno(elevation), ies(elevation, CLEAR)]
    assert 0.85 * min(curves) <= lux <= 1.15 * max(curves)
    assert abs(lux - baked) <= 0.002 * baked + sidak_z(5) * error


@pytest.mark.parametrize("elevation", [15, 10, 5, 3])
def test_low_suns_lie_between_the_published_curves(elevation):
    """11 to 14 klx at 10 degrees."""
    lux, baked, error = measured(clear(elevation))
    assert 0.98 * usno(elevation) <= lux <= 1.02 * ies(elevation, CLEAR)
    assert abs(lux - baked) <= 0.002 * baked + sidak_z(4) * error


@pytest.mark.parametrize(("elevation", "lux"), [(2, 2270), (0, 732), (-4, 27.0), (-6, 3.4)])
def test_dusk_is_the_almanacs(elevation, lux):
    found, baked, error = measured(clear(elevation))
    assert found == pytest.approx(lux, rel=0.08)
    assert abs(found - baked) <= 0.002 * baked + sidak_z(4) * error


@pytest.mark.parametrize("elevation", [-18, -40])
def test_night_is_that_of_a_city(elevation):
    """NIGHT is 17.1 mag per square arc second, an inner city's; stars alone give 1e-3 lx.

    The conversion is Unihedron's, 108,000 cd/m^2 x 10^(-0.4 m).
    """
    lux, baked, error = measured(clear(elevation))
    sky = np.pi * float(np.array(NIGHT) @ LUMINANCE) * CANDELAS_PER_UNIT
    assert 1e-3 < lux < 0.1
    assert lux == pytest.approx(sky, rel=0.1)
    assert abs(lux - baked) <= 0.002 * baked + sidak_z(2) * error
    magnitude = -2.5 * np.log10(sky / np.pi / 108_000)
    assert 16.5 < magnitude < 18.5


DAY = [name for name in catalog.template_names("sky") if "night" not in name]


@pytest.mark.parametrize("name", DAY)
def test_cloudy_skies_are_as_bright_as_their_cover_says(name):
    """Kasten and Czeplak 1980: G = G(clear) (1 - 0.75 N^3.4), N the share of cloud.

    Days scatter by half of it; broken cumulus beside a free sun adds light.
    """
    sky = build_sky(SkySettings(preset=name))
    lux, baked, error = measured(sky)
    elevation = np.degrees(np.arcsin(sky.sun_direction[2]))
    known = bake_sky(clear(elevation), (256, 512)).illuminance * (1 - 0.75 * cover_of(sky) ** 3.4)
    assert 0.6 <= lux / known <= 1.5
    assert abs(lux - baked) <= 0.002 * baked + sidak_z(4) * error


def cover_of(sky):
    """Share of a horizontal plane's sky that is cloud."""
    if sky.clouds is None:
        return 0.0
    rows = len(sky.clouds.cover)
    high = np.pi / 2 * (1 - (np.arange(rows) + 0.5) / rows)
    weight = np.sin(high) * np.cos(high)
    return float(weight @ sky.clouds.cover.mean(axis=1) / weight.sum())


@pytest.mark.parametrize("elevation", [-3, 1, 5, 10, 25])
@pytest.mark.parametrize("name", [name for name in DAY if "cloud" in name or "overcast" in name])
def test_clouds_under_a_moved_sun_are_not_brighter_than_clear_air(name, elevation):
    sky = build_sky(SkySettings(preset=name, sun={"azimuth": 200, "elevation": elevation}))
    clear_lux = bake_sky(replace(sky, clouds=None), (128, 256)).illuminance
    lux = bake_sky(sky, (256, 512)).illuminance
    most = 1.15 * (1 - 0.75 * cover_of(sky) ** 3.4)
    assert 0.12 <= lux / clear_lux <= most


def test_overcast_is_5_to_25_klx():
    lux, baked, error = measured(build_sky(SkySettings(preset="sky_overcast")))
    assert 5e3 <= lux <= 25e3
    assert abs(lux - baked) <= 0.002 * baked + sidak_z(1) * error


@pytest.mark.parametrize("elevation", [60, 30])
def test_the_full_moon_gives_a_quarter_of_a_lux(elevation):
    sky = Sky(sun_at(0, -40), moon_direction=sun_at(150, elevation), turbidity=2.5)
    lux, baked, error = measured(sky)
    low, high = (0.2, 0.3) if elevation == 60 else (0.07, 0.2)
    assert low <= lux <= high
    assert abs(lux - baked) <= 0.002 * baked + sidak_z(2) * error


@pytest.mark.parametrize(
    ("name", "low", "high"), [("1", 0.005, 0.05), ("2", 0.1, 0.3), ("3", 0.02, 0.12)]
)
def test_nights_have_their_light(name, low, high):
    """Moonless, a full moon at 42 degrees, a city's glow on clouds (0.02 to 0.1 lx)."""
    assert low <= bake_sky(build_sky(SkySettings(preset=f"sky_night{name}"))).illuminance <= high


# Every factor once --------------------------------------------------------------------------


def pixel(sky, *, heading, pitch):
    """What the sky shows in one direction, (3,)."""
    view = view_at([0, 0, 5], heading=heading, pitch=pitch, fov=0.5)
    with session_of(scene_of([], {}, sky=sky), size=(4, 4)) as session:
        return session.render(frame_of(view)).radiance.mean(axis=(0, 1), dtype=np.float64)


@pytest.mark.parametrize("scale", [1.0, 3.0])
def test_a_picture_of_one_gives_one(scale):
    """The unit of a user's map is a scene unit, and its scale counts once."""
    sky = replace(constant_sky(1.0), image_scale=scale)
    np.testing.assert_allclose(pixel(sky, heading=70, pitch=40), scale, rtol=1e-5)
    scene = scene_of([static("g", plane(100), "g")], {"g": diffuse(ALBEDO)}, sky=sky)
    with session_of(scene, size=(24, 24), quality=QUALITY) as session:
        radiance = session.render(frame_of(view_at([0, 0, 5], pitch=-90))).radiance
        assert session.sky.illuminance == pytest.approx(np.pi * scale * CANDELAS_PER_UNIT, rel=1e-3)
    assert abs(radiance.mean() - ALBEDO * scale) < 0.001 * scale + 4 * standard_error(radiance)


@pytest.mark.parametrize(("heading", "pitch"), [(20, 30), (150, 60), (290, 12)])
def test_the_clear_sky_is_the_models_times_one_constant(heading, pitch):
    import drjit as dr
    import mitsuba as mi

    sun = sun_at(200, 40)
    seen = pixel(Sky(sun, turbidity=3.0), heading=heading, pitch=pitch)
    model = mi.load_dict(
        {
            "type": "sunsky",
            "sun_direction": sun.tolist(),
            "turbidity": 3.0,
            "sun_scale": 0.0,
            "albedo": {"type": "rgb", "value": 0.2},
        }
    )
    si = dr.zeros(mi.SurfaceInteraction3f, 1)
    si.wi = mi.Vector3f(*(-sun_at(heading, pitch)).tolist())
    known = np.array(model.eval(si)).ravel() * UNITS_PER_SUNSKY
    np.testing.assert_allclose(seen, known, rtol=0.01)


def test_the_sky_in_the_picture_is_the_one_that_lights():
    """What a map of all pixels adds up to is what the ground receives."""
    baked = bake_sky(Sky(sun_at(120, 35)), (256, 512))
    towards = directions((256, 512))
    solid = np.sin(np.arccos(towards[..., 2])) * (np.pi / 256) * (2 * np.pi / 512)
    air = (baked.radiance * (solid * np.maximum(towards[..., 2], 0))[..., None]).sum(axis=(0, 1))
    light = air + baked.sun.irradiance * np.sin(np.radians(35))
    assert light @ LUMINANCE * CANDELAS_PER_UNIT == pytest.approx(baked.illuminance, rel=1e-3)


def test_exposure_is_a_factor_of_development_only(tmp_path):
    """Frames hold radiance, whatever the film's exposure; pictures get it once."""
    scene = write_scenario(tmp_path, vehicles=2)
    frames = []
    for stops in (0, 3):
        target = tmp_path / f"{stops}.exr"
        command = ["still", str(scene), "--time", "4.5", "--camera", "post", "--size", "16x9"]
        command += ["--quality", "reference", "--spp", "4", "-o", str(target)]
        assert main([*command, "--set", f"output.exposure={stops}"]) == 0
        frames.append(read_exr(target)[0])
    np.testing.assert_array_equal(*frames)
    dim = 0.01 * frames[0] / frames[0].max()
    np.testing.assert_allclose(
        develop_float(dim, exposure=3.0), develop_float(8.0 * dim), rtol=1e-5
    )
