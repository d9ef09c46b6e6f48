"""Fog as physics says: contrast at the visibility, Mitsuba's own fog, and daylight through it."""

from dataclasses import replace

import numpy as np
import pytest
from builders import RAW, box, constant_sky, diffuse, frame_of, plane, scene_of, session_of, static
from builders import view_at as view

from sumo3dviz_pt.library.materials import MATERIALS
from sumo3dviz_pt.model.geometry import Mesh
from sumo3dviz_pt.model.scene import LampSet, Sky
from sumo3dviz_pt.model.weather import ASYMMETRY, CONTRAST, Fog, Rain, Snow, Weather, WeatherCourse
from sumo3dviz_pt.render.sky.weathered import WeatheredSky

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("compiled")]

SUN = Sky(np.array([0.3, -0.4, 0.6]))
SIZE = (48, 24)


def always(weather):
    """A weather that does not change."""
    return WeatherCourse((0.0,), (weather,))


def seen(scene, weather, camera, *, spp=64, lamps=None, cap=None, size=SIZE):
    """The radiance of a scene in a weather, (h, w, 3)."""
    quality = RAW.model_copy(update={"spp": spp, "pass_spp": min(spp, 256), "cap": cap})
    state = replace(frame_of(camera, lamps=lamps), weather=weather)
    shown = replace(scene, weather=None if weather is None else always(weather))
    with session_of(shown, size=size, quality=quality) as session:
        return session.render(state).radiance


# Contrast -----------------------------------------------------------------------------------


def black_wall(distance):
    """A black wall to the north, higher and wider than the picture."""
    wall = box((-distance, distance, -distance), (distance, distance + 1.0, distance))
    return scene_of([static("wall", wall, "black")], {"black": diffuse(0.0)}, sky=SUN)


@pytest.mark.parametrize(
    ("visibility", "height"), [(50.0, np.inf), (200.0, 60.0), (2000.0, np.inf), (2000.0, 60.0)]
)
def test_a_black_wall_at_the_visibility_keeps_two_per_cent(visibility, height):
    fog = Weather(fog=Fog(CONTRAST / visibility, height, base=10.0))
    camera = view((0.0, 0.0, 1.2), fov=2.0)
    near, far = (
        seen(black_wall(share * visibility), fog, camera, spp=4).mean() for share in (1.0, 8.0)
    )
    assert 1.0 - near / far == pytest.approx(0.02, rel=0.1)


def test_rain_takes_as_much_as_was_measured():
    """Half of the light of a wall is left after ln 2 over .312 R^.67 kilometres."""
    rain = Weather(rain=Rain(10.0))
    half = 1000.0 * np.log(2.0) / (0.312 * 10.0**0.67)
    camera = view((0.0, 0.0, 1.2), fov=2.0)
    near, far = (seen(black_wall(d), rain, camera, spp=4).mean() for d in (half, 60.0 * half))
    assert near / far == pytest.approx(0.5, rel=0.01)


def test_guides_are_as_pale_and_flat_as_the_fog_before_them():
    """Else the denoiser would look for textures that nobody sees, and neighbours scale fog."""
    fog = Weather(fog=Fog(CONTRAST / 200.0))
    scene = replace(black_wall(100.0), weather=always(fog))
    with session_of(scene, size=SIZE, quality=RAW, layers=("albedo", "normal")) as session:
        state = replace(frame_of(view((0.0, 0.0, 1.2), fov=2.0)), weather=fog)
        layers = session.render(state).layers
    assert layers["albedo"] == pytest.approx(1.0 - np.sqrt(0.02), abs=2e-3)
    lengths = np.linalg.norm(layers["normal"], axis=-1)
    assert lengths == pytest.approx(np.sqrt(0.02), abs=2e-3)


def test_fog_is_thinner_above():
    """Straight up, no more is in the way than extinction times the height in which it falls."""
    fog = Weather(fog=Fog(0.02, 30.0))
    roof = Mesh(plane(2000.0, z=900.0).vertices, np.array([[0, 2, 1], [0, 3, 2]]))
    scene = scene_of([static("roof", roof, "black")], {"black": diffuse(0.0)}, sky=SUN)
    up, level = (seen(scene, fog, view((0, 0, 0), pitch=p, fov=1.0), spp=4) for p in (90.0, 0.1))
    with session_of(replace(scene, weather=always(fog)), size=SIZE, quality=RAW) as session:
        session.render(replace(frame_of(view((0, 0, 0))), weather=fog))
        assert session.loaded.veil is not None
        diffuse_part = session.loaded.veil.diffuse
    assert up.mean(axis=(0, 1)) == pytest.approx(
        diffuse_part * -np.expm1(-0.6) + _forward(session, up) * -np.expm1(-0.6), rel=0.15
    )
    assert level.mean() > up.mean()


def _forward(session, picture):
    """What droplets scatter of the sun straight down."""
    veil = session.loaded.veil
    g, cosine = ASYMMETRY, float(veil.towards[2])
    phase = (1 - g * g) / (4 * np.pi) / (1 + g * g - 2 * g * cosine) ** 1.5
    return veil.direct * phase


# Mitsuba's own fog --------------------------------------------------------------------------

BOARDS = {"near": (-1.0, 10.0), "middle": (0.0, 30.0), "far": (1.0, 60.0)}
"""Which third of the picture a board fills, and how far away it is [m]."""

EYE, FOV = (0.0, 0.0, 0.0), 40.0


def board(third, distance):
    """A wall across a third of the picture."""
    half = distance * np.tan(np.radians(FOV / 2))
    x0, x1 = (third - 0.5) * half * 2 / 3, (third + 0.5) * half * 2 / 3
    corners = [[x0, distance, -half], [x1, distance, -half], [x1, distance, half]]
    return Mesh(np.array([*corners, [x0, distance, half]]), np.array([[0, 1, 2], [0, 2, 3]]))


def panel(centre, side, *, north):
    """A square lamp that shines to the north or to the south."""
    x, y, z = centre
    h = side / 2
    corners = np.array([[x - h, y, z - h], [x + h, y, z - h], [x + h, y, z + h], [x - h, y, z + h]])
    faces = np.array([[0, 2, 1], [0, 3, 2]]) if north else np.array([[0, 1, 2], [0, 2, 3]])
    return Mesh(corners, faces)


def lamp_of(mesh):
    """A lamp that paths aim at."""
    return LampSet("lamp", "signals", mesh, np.zeros(2, int), ("one",), sampled=True)


def by_mitsuba(walls, lamp, extinction, *, radiance, spp, size=SIZE):
    """The same by `volpath`, with all scatterings, (h, w, 3)."""
    import mitsuba as mi

    def shape(mesh, **more):
        made = mi.Mesh("m", len(mesh.vertices), len(mesh.faces), props=_props(more))
        parameters = mi.traverse(made)
        parameters["vertex_positions"] = mesh.vertices.astype(np.float32).ravel()
        parameters["faces"] = mesh.faces.astype(np.uint32).ravel()
        parameters.update()
        return made

    def _props(more):
        properties = mi.Properties()
        for key, value in more.items():
            properties[key] = mi.load_dict(value)
        return properties

    fog = {
        "type": "homogeneous",
        "sigma_t": extinction,
        "albedo": 1.0,
        "phase": {"type": "hg", "g": ASYMMETRY},
    }
    matt = {"type": "twosided", "bsdf": diffuse(0.5)}
    light = {"type": "area", "radiance": {"type": "rgb", "value": [radiance] * 3}}
    black = {"type": "diffuse", "reflectance": {"type": "rgb", "value": [0.0] * 3}}
    scene = mi.load_dict(
        {
            "type": "scene",
            "fog": fog,
            **{f"w{k}": shape(wall, bsdf=matt) for k, wall in enumerate(walls)},
            "lamp": shape(lamp, bsdf=black, emitter=light),
            "sensor": {
                "type": "perspective",
                "fov": FOV,
                "fov_axis": "x",
                "to_world": mi.ScalarTransform4f().look_at(EYE, [0, 1, 0], [0, 0, 1]),
                "medium": {"type": "ref", "id": "fog"},
                "film": {
                    "type": "hdrfilm",
                    "width": size[0],
                    "height": size[1],
                    "rfilter": {"type": "box"},
                    "component_format": "float32",
                    "pixel_format": "rgb",
                },
                "sampler": {"type": "independent"},
            },
        }
    )
    integrator = mi.load_dict({"type": "volpath", "max_depth": 24, "rr_depth": 24})
    parts = [
        np.array(mi.render(scene, integrator=integrator, spp=256, seed=seed))
        for seed in range(spp // 256)
    ]
    return np.mean(parts, axis=0)


def ours(walls, lamp, extinction, *, radiance, spp, size=SIZE):
    """The picture by our own kernel, (h, w, 3)."""
    parts = [static(f"wall{k}", wall, "wall") for k, wall in enumerate(walls)]
    materials = {**MATERIALS, "wall": {"type": "twosided", "bsdf": diffuse(0.5)}}
    scene = scene_of(parts, materials, sky=constant_sky(1e-9), lamps=[lamp_of(lamp)])
    lit = {"lamp": np.full((1, 3), radiance)}
    weather = Weather(fog=Fog(extinction))
    return seen(scene, weather, view(EYE, fov=FOV), spp=spp, lamps=lit, size=size)


@pytest.mark.parametrize(
    ("extinction", "differences"),
    [
        # [1/m]   near, middle, far
        (0.0005, (0.0, -0.01, -0.03)),
        (0.005, (-0.04, -0.14, -0.25)),
    ],
)
def test_boards_look_as_by_mitsubas_fog(extinction, differences):
    """Light goes from a lamp through fog to three walls, and from there to the eye.

    Single scattering holds within 5 % where the way to the eye takes up to a twentieth of the
    light; elsewhere what is missing is what the manual says.
    """
    walls = [board(*place) for place in BOARDS.values()]
    lamp = panel((0.0, 2.0, 3.0), 1.0, north=True)
    mine = ours(walls, lamp, extinction, radiance=100.0, spp=256)
    theirs = by_mitsuba(walls, lamp, extinction, radiance=100.0, spp=1024)
    third = SIZE[0] // 3
    for number, (known, (_, away)) in enumerate(zip(differences, BOARDS.values(), strict=True)):
        part = np.s_[4:-4, number * third + 2 : (number + 1) * third - 2]
        found = mine[part].mean() / theirs[part].mean() - 1.0
        assert found == pytest.approx(known, abs=0.02)
        assert abs(found) < 0.05 or extinction * away > 0.05


@pytest.mark.parametrize(("extinction", "most"), [(0.002, 0.05)])
def test_halos_look_as_by_mitsubas_fog(extinction, most):
    """A lamp shines at the eye; what is seen around it is scattered light alone."""
    lamp = panel((0.0, 30.0, 0.0), 0.3, north=False)
    mine = ours([], lamp, extinction, radiance=100.0, spp=1024)
    theirs = by_mitsuba([], lamp, extinction, radiance=100.0, spp=8192)
    rows, columns = np.indices(SIZE[::-1])
    away = np.hypot(rows - 11.5, columns - 23.5)
    for low, high in ((2.0, 5.0), (5.0, 10.0), (10.0, 24.0)):
        ring = (away >= low) & (away < high)
        assert mine[ring].mean() == pytest.approx(theirs[ring].mean(), rel=most)


# Daylight -----------------------------------------------------------------------------------


def lux(weather, sky):
    """Light on the ground [lx]."""
    return WeatheredSky(sky, always(weather), (128, 256)).at(weather)[0].illuminance


NOON = Sky(np.array([0.0, -0.5, 0.87]))


def overcast(sky):
    """The same sky with clouds that rain falls from."""
    from sumo3dviz_pt.world.weather import in_weather

    return in_weather(sky, always(Weather(rain=Rain(5.0))))


def test_clear_noon_is_as_bright_as_without_weather():
    assert 80e3 < lux(Weather(wetness=1.0), NOON) < 120e3


@pytest.mark.parametrize(
    ("weather", "low", "high"),
    [
        (Weather(rain=Rain(0.5)), 15e3, 32e3),
        (Weather(rain=Rain(5.0)), 5e3, 25e3),
        (Weather(rain=Rain(40.0)), 2e3, 15e3),
        (Weather(snow=Snow(0.05, falling=1.5)), 10e3, 45e3),
    ],
)
def test_light_under_rain_clouds_is_that_of_overcast_days(weather, low, high):
    assert low < lux(weather, overcast(NOON)) < high


NIGHT = Sky(np.array([0.0, -0.5, -0.87]), night=(1e-7, 1e-7, 1e-7), glow=(8e-6, 5e-6, 4e-6))


def test_rain_clouds_show_a_citys_light_from_below():
    """They take light away that comes from above, and not that of the lamps below them."""
    rain = [lux(Weather(rain=Rain(rate)), overcast(NIGHT)) for rate in (0.5, 5.0, 40.0)]
    assert rain == pytest.approx([rain[1]] * 3, rel=0.05)
    assert rain[1] > 0.95 * lux(Weather(), NIGHT)
    dark = replace(NIGHT, glow=(0.0, 0.0, 0.0))
    assert lux(Weather(rain=Rain(5.0)), overcast(dark)) < 0.3 * lux(Weather(), dark)


@pytest.mark.parametrize(("visibility", "height"), [(1000.0, 60.0), (200.0, 60.0), (50.0, 80.0)])
def test_fog_passes_what_a_layer_of_droplets_passes(visibility, height):
    """Two-stream theory, with what ground and fog send to and fro."""
    depth = CONTRAST / visibility * height
    found = lux(Weather(fog=Fog(CONTRAST / visibility, height)), NOON) / lux(Weather(), NOON)
    sine = float(NOON.sun_direction[2])
    beam = (2 + 3 * sine + (2 - 3 * sine) * np.exp(-0.2775 * depth / sine)) / (4 + 0.45 * depth)
    even = 1 / (1 + 0.1125 * depth)
    echo = 1 / (1 - 0.2 * (1 - even))
    assert min(beam, even) * echo * 0.98 < found < max(beam, even) * echo * 1.02


def test_the_sun_is_dimmed_along_its_slant_way():
    fog = Weather(fog=Fog(0.01, 60.0))
    dry = WeatheredSky(NOON, always(Weather()), (128, 256)).at(Weather())[0].sun
    sun = WeatheredSky(NOON, always(fog), (128, 256)).at(fog)[0].sun
    sine = float(NOON.sun_direction[2])
    assert sun.irradiance == pytest.approx(dry.irradiance * np.exp(-0.6 / sine), rel=1e-6)


def test_the_horizon_in_fog_has_the_light_of_the_air():
    fog = Weather(fog=Fog(0.02, 60.0))
    sky, veil = WeatheredSky(NOON, always(fog), (256, 512)).at(fog)
    azimuth = (np.arange(512) + 0.5) / 512 * 2 * np.pi
    away = np.stack([np.sin(azimuth), np.cos(azimuth), np.zeros(512)], axis=-1)
    g, cosine = ASYMMETRY, away @ veil.towards
    phase = (1 - g * g) / (4 * np.pi) / (1 + g * g - 2 * g * cosine) ** 1.5
    air = veil.diffuse + phase[:, None] * veil.direct
    assert sky.radiance[127] == pytest.approx(air.astype(np.float32), rel=0.05)


def test_thin_fog_changes_little():
    """There is no step between a clear day and the first droplets."""
    clear = WeatheredSky(NOON, always(Weather()), (128, 256)).at(Weather())[0]
    thin = Weather(fog=Fog(1e-6, 60.0))
    sky = WeatheredSky(NOON, always(thin), (128, 256)).at(thin)[0]
    assert sky.illuminance == pytest.approx(clear.illuminance, rel=1e-3)
    assert sky.radiance[:64] == pytest.approx(clear.radiance[:64], rel=0.01)


def test_a_lamp_is_dimmed_on_its_way():
    """Light on a wall falls by its ways from the lamp and to the eye; near the lamp air shines."""
    wall, lamp = board(0.0, 30.0), panel((0.0, 2.0, 3.0), 1.0, north=True)
    pictures = [ours([wall], lamp, e, radiance=100.0, spp=64) for e in (1e-9, 0.01)]
    dry, wet = (picture[10:14, 20:28].mean() for picture in pictures)
    passes = np.exp(-0.01 * (30.0 + (1.0 - ASYMMETRY**2) * np.hypot(28.0, 3.0)))
    assert passes < wet / dry < 1.12 * passes
