"""What weather leaves on surfaces: where, how dark and smooth, and only where it is wanted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from builders import (
    RAW,
    ball,
    box,
    constant_sky,
    cube,
    frame_of,
    mover,
    plane,
    scene_of,
    session_of,
    static,
    view_at,
)

from sumo3dviz_pt import catalog
from sumo3dviz_pt.library.materials import MATERIALS, principled, surface_bsdf
from sumo3dviz_pt.model.geometry import UNWORN, Mesh
from sumo3dviz_pt.model.scene import Sky, Slots
from sumo3dviz_pt.model.trajectory import TyreTracks
from sumo3dviz_pt.model.weather import Rain, Snow, Weather, WeatherCourse

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("compiled")]

SIZE = (48, 32)
WET = Weather(wetness=1.0)
WHITE = Weather(snow=Snow(depth=0.08, roads="covered"), season="winter")
ABOVE = view_at((0.0, 0.0, 30.0), pitch=-90, fov=40)
"""Looks straight down on the ground: left is west here, and up is north."""


def textured(mesh: Mesh) -> Mesh:
    wear = np.tile(UNWORN, (len(mesh.vertices), 1))
    return Mesh(mesh.vertices, mesh.faces, mesh.normals, 0.25 * mesh.vertices[:, :2], wear)


def scene(weather=None, *more, tracks=None, **settings):
    """A road of asphalt under an even sky."""
    asphalt = surface_bsdf(catalog.find("surfaces", "asphalt"))
    materials = {
        **MATERIALS,
        "asphalt": asphalt,
        "stone": principled((0.5, 0.5, 0.5), roughness=0.8),
        "matt_tint": principled((0.5, 0.5, 0.5), roughness=0.8),
    }
    parts = [static("road", textured(plane(60.0)), "asphalt"), *more]
    made = scene_of(parts, materials, sky=constant_sky(), **settings)
    if weather is None:
        return made
    course = WeatherCourse((0.0,), (weather,)) if isinstance(weather, Weather) else weather
    return replace(made, weather=course, tracks=tracks)


def seen(shown, *, time=0.0, view=ABOVE, layers=("radiance", "albedo", "normal"), movers=()):
    """Layers of a frame."""
    with session_of(shown, size=SIZE, quality=RAW, layers=layers) as session:
        return session.render(state_of(shown, time, view, movers)).layers


def state_of(shown, time, view=ABOVE, movers=()):
    state = frame_of(view, time=time, movers=movers)
    return state if shown.weather is None else replace(state, weather=shown.weather.at(time))


# The cited model --------------------------------------------------------------------------


@pytest.mark.parametrize("wet", [0.0, 0.3, 1.0])
@pytest.mark.parametrize("rough", [0.2, 0.64, 0.9])
def test_reflectance_and_gloss_follow_lagarde(wet: float, rough: float) -> None:
    import mitsuba as mi

    from sumo3dviz_pt.render.kernel.deposits import porosity, wetted

    porous = min(max(((1 - (1 - rough)) - 0.5) / 0.4, 0.0), 1.0)
    assert float(np.array(porosity(mi.Float(rough)))[0]) == pytest.approx(porous, abs=1e-6)
    factor = 1 + (0.2 - 1) * porous
    gloss = 1 - rough
    expected_gloss = 1 + (gloss - 1) * (1 + (factor - 1) * wet / 2)
    found, smoother = wetted(mi.Color3f(0.3), mi.Float(rough), mi.Float(porous), mi.Float(wet))
    assert np.array(found)[0] == pytest.approx(0.3 * (1 + (factor - 1) * wet), rel=1e-5)
    assert np.array(smoother)[0] == pytest.approx(1 - expected_gloss, rel=1e-5)


def test_wet_asphalt_is_as_dark_as_the_model_says() -> None:
    """Ground of a texture is three quarters porous: 1 + (.2 - 1) .75 = .4 of the light is left."""
    dry, wet = seen(scene()), seen(scene(WET))
    assert wet["albedo"].mean() == pytest.approx(0.4 * dry["albedo"].mean(), rel=0.01)
    np.testing.assert_array_equal(dry["normal"], wet["normal"])


@pytest.mark.parametrize(("surface", "shines"), [("asphalt", True), ("ground_grass", False)])
def test_wet_roads_shine_before_a_bright_horizon_and_wet_grass_does_not(surface, shines) -> None:
    """Water runs between blades of grass: no film of it mirrors what is behind."""
    image = np.full((16, 32, 3), 0.02, np.float32)
    image[7] = 20.0
    side = view_at((0.0, 0.0, 1.5), pitch=-14, fov=25)
    ground = static("ground", textured(plane(60.0)), surface)
    shown = replace(scene(), sky=Sky(None, image=image), static=(ground,))
    bsdf = surface_bsdf(catalog.find("surfaces", surface))
    shown = replace(shown, materials={**shown.materials, surface: bsdf})
    course = WeatherCourse((0.0,), (WET,))
    dry, wet = (seen(replace(shown, weather=weather), view=side) for weather in (None, course))
    share = wet["radiance"].mean() / dry["radiance"].mean()
    assert share > 3.0 if shines else share < 1.0


def test_half_wet_is_in_between_and_patchy() -> None:
    dry, half, wet = (
        seen(scene(weather))["albedo"] for weather in (None, Weather(wetness=0.5), WET)
    )
    assert wet.mean() < half.mean() < dry.mean()
    assert (half / dry).std() > 2.0 * (wet / dry).std()


# Where ------------------------------------------------------------------------------------


def test_below_a_roof_it_is_dry() -> None:
    roof = static("roof", box((5.0, -30.0, 20.0), (40.0, 30.0, 20.5)), "stone")
    side = view_at((-3.0, -12.0, 9.0), heading=45.0, pitch=-40.0, fov=70)
    dry, wet = (seen(scene(weather, roof), view=side)["albedo"] for weather in (None, WET))
    share = (wet / np.maximum(dry, 1e-6)).mean(axis=-1)
    assert share[-4:, :4].mean() == pytest.approx(0.4, abs=0.02)
    assert (np.abs(share - 1.0) < 1e-6).sum() > 50


def test_a_pole_keeps_no_rain_off() -> None:
    from sumo3dviz_pt.render.kernel.grounds import heights_from_above, shelter

    arm = box((-20.0, -0.3, 5.0), (20.0, 0.3, 5.2))
    hall = box((5.0, 10.0, 0.0), (15.0, 20.0, 8.0))
    heights = heights_from_above([plane(60.0), arm, hall], np.zeros(3))
    assert heights.max() == pytest.approx(8.0, abs=1e-3)
    assert (np.abs(heights - 5.2) < 1e-3).any()
    found = shelter(heights)
    assert not (np.abs(found - 5.2) < 1e-3).any() and (np.abs(found - 8.0) < 1e-3).any()


def test_beside_a_kerb_the_ground_is_low() -> None:
    from sumo3dviz_pt.render.kernel.grounds import lowness

    heights = np.zeros((80, 80), np.float32)
    heights[:, 40:] = 0.12
    low = lowness(heights)
    assert low[40, 39] > 0.4 and low[40, 40] < -0.4
    assert abs(low[40, 22]) < 1e-6 and abs(low[40, 57]) < 1e-6


def test_walls_and_what_lies_under_a_roof_have_no_snow() -> None:
    white = static("white", ball((0.0, 0.0, 3.0), 3.0), "stone")
    side = view_at((0.0, -20.0, 3.0), heading=0.0, fov=25)
    dry, snow = (seen(scene(weather, white), view=side)["albedo"] for weather in (None, WHITE))
    middle = SIZE[0] // 2
    column = snow[:, middle, 1]
    ball_rows = np.flatnonzero(np.abs(dry[:, middle, 1] - 0.5) < 1e-3)
    assert column[ball_rows[1]] > 0.75
    assert column[ball_rows[-2]] == pytest.approx(0.5, abs=0.02)


def test_what_drives_has_little_snow() -> None:
    shown = scene(WHITE, prototypes=[cube("cube", side=9.0)], slots=Slots(near={"cube": 1}))
    bare = scene(None, prototypes=[cube("cube", side=9.0)], slots=Slots(near={"cube": 1}))
    cars = [mover("a", (4.5, 0.0, 0.0), (0.1, 0.1, 0.5))]
    with_snow, without = (seen(each, movers=cars)["albedo"] for each in (shown, bare))
    car = np.abs(without[..., 2] - 0.5) < 1e-3
    assert car.sum() > 4
    assert with_snow[~car].mean() > 0.6 > with_snow[car].mean()


def test_who_is_parked_all_the_time_is_snowed_in() -> None:
    """As what stands; and whoever drives beside it, in the same body, is not."""
    shown, bare = (
        scene(weather, prototypes=[cube("cube", side=4.0)], slots=Slots(near={"cube": 2}))
        for weather in (WHITE, None)
    )
    east = mover("a", (4.5, 0.0, 0.0), (0.1, 0.1, 0.5))
    west = mover("b", (-0.5, 0.0, 0.0), (0.1, 0.1, 0.5))
    cars = np.abs(seen(bare, movers=[east, west])["albedo"][..., 2] - 0.5) < 1e-3
    sides = cars & (np.arange(SIZE[0]) >= SIZE[0] // 2), cars & (np.arange(SIZE[0]) < SIZE[0] // 2)
    assert min(side.sum() for side in sides) > 20
    for pair in ([replace(east, parked=True), west], [east, replace(west, parked=True)]):
        albedo = seen(shown, movers=pair)["albedo"]
        parked, drives = sides if pair[0].parked else sides[::-1]
        assert albedo[parked].mean() > 0.75 and albedo[drives].mean() < 0.65


def test_wheels_leave_tracks() -> None:
    from sumo3dviz_pt.render.kernel.grounds import TRACK_CELL, TRACK_CELLS, trodden

    ways = TyreTracks(np.array([[-20.0, 3.0]] * 6), np.array([[20.0, 3.0]] * 6))
    gone, dirty = trodden(ways, np.zeros(3))
    row = int((3.0 / TRACK_CELL) + TRACK_CELLS / 2)
    middle = TRACK_CELLS // 2
    assert gone[row, middle] > 0.8 and gone[row + 10, middle] < 0.01
    assert dirty[row + 3, middle] > gone[row + 3, middle]
    tracked = replace(WHITE, snow=Snow(depth=0.08, roads="tracked"))
    plain, marked = (seen(scene(tracked, tracks=t))["albedo"] for t in (None, ways))
    assert marked.mean() < plain.mean() - 0.02


@pytest.mark.parametrize("roads", ["cleared", "tracked", "covered"])
def test_roads_are_as_the_settings_say(roads: str) -> None:
    ways = TyreTracks(np.zeros((0, 2)), np.zeros((0, 2)))
    weather = replace(WHITE, snow=Snow(depth=0.08, roads=roads))
    albedo = seen(scene(weather, tracks=ways))["albedo"].mean()
    assert albedo < 0.2 if roads == "cleared" else albedo > 0.7


# Puddles and rings ------------------------------------------------------------------------


def test_puddles_mirror_and_lie_level() -> None:
    flooded = seen(scene(Weather(wetness=1.0, puddles=1.0)))
    assert flooded["normal"][..., 2].min() > 0.999
    wet = seen(scene(WET))
    assert flooded["albedo"].mean() < wet["albedo"].mean()


def test_ruts_are_flooded_before_the_rest_of_a_lane() -> None:
    """Two ruts run to the east, 4 m apart, each a pixel or two wide."""
    begins = np.array([[-20.0, -2.0], [-20.0, 2.0]])
    worn = TyreTracks(begins, begins * [-1.0, 1.0])
    weather = Weather(wetness=1.0, puddles=0.35)
    near = view_at((0.0, 0.0, 14.0), pitch=-90, fov=50)
    even, rutted = (
        seen(replace(scene(weather), ruts=each), view=near)["albedo"].mean(axis=(1, 2))
        for each in (None, worn)
    )
    wetter = even - rutted
    # A row is 27 cm, so the ruts lie in rows 8 and 23.
    north, south = (int(np.argmax(part)) for part in (wetter[:16], wetter[16:]))
    assert abs(north - 8) <= 1 and abs(south - 7) <= 1
    beside = np.ones(SIZE[1], dtype=bool)
    beside[5:12] = beside[20:27] = False
    assert wetter.max() > 0.002 and np.abs(wetter[beside]).max() < 1e-4


def test_rings_move_with_time_alone() -> None:
    rain = WeatherCourse((0.0,), (Weather(rain=Rain(40.0), wetness=1.0, puddles=1.0),))
    near = view_at((0.0, 0.0, 1.5), pitch=-90, fov=40)
    shown = scene(rain)
    with session_of(shown, size=SIZE, quality=RAW, layers=("radiance", "normal")) as session:
        first = session.render(state_of(shown, 3.0, near)).layers
        other = session.render(state_of(shown, 3.2, near)).layers
        again = session.render(state_of(shown, 3.0, near)).layers
    assert np.abs(first["normal"] - other["normal"]).max() > 0.01
    for name in ("radiance", "normal"):
        np.testing.assert_array_equal(first[name], again[name])


def test_slopes_are_those_of_the_noise() -> None:
    import mitsuba as mi

    from sumo3dviz_pt.render.kernel.deposits import REPEAT, bumps

    rng = np.random.default_rng(5)
    x, y = rng.uniform(0, 50, (2, 200)).astype(np.float32)
    step = 1e-2

    def at(x, y):
        return bumps(mi.Float(x), mi.Float(y), cells=1, per=2, salt=9)

    here = at(x, y)
    east = (np.array(at(x + step, y).value) - np.array(at(x - step, y).value)) / (2 * step)
    north = (np.array(at(x, y + step).value) - np.array(at(x, y - step).value)) / (2 * step)
    np.testing.assert_allclose(np.array(here.dx), east, atol=5e-3)
    np.testing.assert_allclose(np.array(here.dy), north, atol=5e-3)
    far = np.array(at(x + REPEAT, y).value)
    np.testing.assert_allclose(far, np.array(here.value), atol=1e-3)


# Where it is not wanted -------------------------------------------------------------------


def test_dry_weather_changes_no_surface() -> None:
    plain, dry = seen(scene()), seen(scene(Weather()))
    for name in ("albedo", "normal"):
        np.testing.assert_array_equal(plain[name], dry[name])


def test_a_changing_wetness_compiles_once() -> None:
    import drjit as dr

    course = WeatherCourse((0.0, 10.0), (Weather(wetness=0.0), Weather(wetness=1.0)))
    shown = scene(course)
    with session_of(shown, size=SIZE, quality=RAW, layers=("albedo",)) as session:
        # The sky's first change compiles what copies its seam; nothing compiles after that.
        session.render(state_of(shown, 0.0))
        session.render(state_of(shown, 3.0))
        with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
            dr.kernel_history_clear()
            late = session.render(state_of(shown, 7.0)).layers["albedo"]
            kernels = dr.kernel_history([dr.KernelType.JIT])
    assert kernels and all(each["cache_hit"] for each in kernels)
    np.testing.assert_array_equal(late, seen(shown, time=7.0)["albedo"])
