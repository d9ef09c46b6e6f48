"""What a scene does not have is not compiled: kernels are counted by their operations."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from builders import (
    LAMPS,
    RAW,
    ball,
    box,
    cube,
    diffuse,
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
from sumo3dviz_pt.model.geometry import Mesh
from sumo3dviz_pt.model.scene import Beam, RunningLights, Sky, Slots, VehicleLamp
from sumo3dviz_pt.model.swaying import Swaying
from sumo3dviz_pt.model.weather import Fog, Snow, Weather, WeatherCourse, Wind
from sumo3dviz_pt.render.backend import choose_backend
from sumo3dviz_pt.render.kernel.rows import OPERATIONS, features_of

pytestmark = [pytest.mark.usefixtures("compiled"), pytest.mark.slow]

ROAD = principled((0.2, 0.2, 0.2), roughness=0.9)
STEEL = principled((0.6, 0.6, 0.6), roughness=0.4, metallic=1.0)


def textured(mesh: Mesh) -> Mesh:
    return Mesh(mesh.vertices, mesh.faces, mesh.normals, 0.25 * mesh.vertices[:, :2])


def road(surface: str = "road") -> list:
    return [static("road", textured(plane(40.0)), surface)]


def scene(*more, surface: str = "road", **settings):
    asphalt = surface_bsdf(catalog.find("surfaces", "asphalt"))
    materials = {**MATERIALS, "road": ROAD, "asphalt": asphalt, "matt_tint": diffuse(0.5)}
    materials |= {"steel": STEEL, "pane": {"type": "thindielectric"}}
    return scene_of([*road(surface), *more], materials, **settings)


def heap(material: str):
    """A ball of a tinted material."""
    body = ball((4, 4, 2), 1.0)
    return static(material, body, material, np.tile((0.1, 0.4, 0.1), (len(body.faces), 1)))


def operations(shown, *, movers=(), lamps=None, layers=("radiance",), weather=None) -> int:
    """Operations of the largest kernel of a frame: the one that follows paths."""
    import drjit as dr

    quality = RAW.model_copy(update={"spp": 1, "pass_spp": 1})
    if weather is not None:
        shown = replace(shown, weather=WeatherCourse((0.0,), (weather,)))
    with session_of(shown, size=(8, 6), quality=quality, layers=layers) as session:
        state = frame_of(view_at((0, -9, 3), pitch=-15), movers=movers, lamps=lamps)
        state = replace(state, weather=weather)
        with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
            dr.kernel_history_clear()
            session.render(state)
            kernels = dr.kernel_history([dr.KernelType.JIT])
    return max(each["operation_count"] for each in kernels)


@pytest.fixture(scope="module")
def empty() -> int:
    """Of an empty road under an even sky."""
    choose_backend("llvm")
    return operations(scene())


def test_more_of_the_same_adds_nothing(empty: int) -> None:
    box_too = static("house", box((5, 5, 0), (9, 9, 6)), "road")
    unused = scene(box_too, prototypes=[cube("car")], slots=Slots())
    assert operations(unused) == empty


def test_weather_that_leaves_nothing_adds_nothing(empty: int) -> None:
    dry, wet, snowy = (
        operations(scene(), weather=weather)
        for weather in (Weather(), Weather(wetness=0.5), Weather(snow=Snow(depth=0.02)))
    )
    assert dry == empty
    assert wet > empty + 100
    assert snowy > wet + 100


LIT = {"lamps": np.full((1, 3), 1.0)}
HEADS = tuple(VehicleLamp("head", (0.0, y, 0.6), (0.2, 0.2), 0.0) for y in (-0.6, 0.6))
BEAM = Beam(np.ones((4, 4), np.float32), np.radians(30.0), (900.0, 900.0, 800.0))


def with_instances():
    return {
        "shown": scene(prototypes=[cube("cube")], slots=Slots(near={"cube": 1})),
        "movers": [mover("a", (0, 0, 0), (0.5, 0.1, 0.1))],
    }


def with_beams(beam: Beam | None = BEAM):
    """Far road users, so that nothing is instanced."""
    car = replace(cube("cube"), lamps=HEADS)
    shown = scene(prototypes=[car], slots=Slots(far={"cube": 1}))
    lights = RunningLights({"head": (1.0, 1.0, 1.0)}, beam, sampled=True)
    return {"shown": replace(shown, running=lights)}


ADDED = {
    "textures": lambda: {"shown": scene(surface="asphalt")},
    "leaves": lambda: {"shown": scene(heap("leaf"))},
    "coats": lambda: {"shown": scene(heap("paint"))},
    "metal": lambda: {"shown": scene(heap("steel"))},
    "foreign materials": lambda: {"shown": scene(heap("pane"))},
    "instances": with_instances,
    "lamps": lambda: {"shown": scene(lamps=[LAMPS]), "lamps": LIT},
    "beams": with_beams,
    "fog": lambda: {"shown": scene(), "weather": Weather(fog=Fog(0.01))},
    "wetness": lambda: {"shown": scene(), "weather": Weather(wetness=0.5)},
    "snow": lambda: {"shown": scene(), "weather": Weather(snow=Snow(depth=0.02))},
}
"""An empty road to which one thing was added, by that thing."""


@pytest.mark.parametrize("what", sorted(OPERATIONS))
def test_what_a_road_has_is_all_that_is_compiled(empty: int, what: str) -> None:
    """`check` tells what leaving a thing out saves: these operations, more or less."""
    added = ADDED[what]()
    # What carries beams shines, too.
    base = operations(**with_beams(None)) if what == "beams" else empty
    assert operations(**added) - base == pytest.approx(OPERATIONS[what], rel=0.2)


@pytest.mark.parametrize("what", sorted(OPERATIONS))
def test_what_a_kernel_has_is_known_before_it_is_compiled(what: str) -> None:
    added = ADDED[what]()
    weather = added.get("weather")
    course = None if weather is None else WeatherCourse((0.0,), (weather,))
    also = {"beams": {"lamps"}, "snow": {"snow"}}.get(what, set())
    assert features_of(scene()) == set()
    assert features_of(replace(added["shown"], weather=course)) == {what, *also}


@pytest.mark.parametrize(
    ("what", "least"),
    [("sun", 100), ("ids", 1)],
)
def test_sun_and_numbers_are_compiled_where_they_are_wanted(
    empty: int, what: str, least: int
) -> None:
    found = {
        "sun": lambda: operations(scene(sky=Sky(np.array([0.3, -0.4, 0.6])))),
        "ids": lambda: operations(scene(), layers=("radiance", "ids")),
    }[what]()
    assert found >= empty + least


def test_weather_without_anything_in_the_air_adds_nothing(empty: int) -> None:
    """Wind and a season are no business of the kernel that follows paths."""
    windy = Weather(wind=Wind(3.0, 0.0), season="winter")
    assert operations(scene(), weather=windy) == empty


def test_halos_are_for_lamps_that_paths_aim_at() -> None:
    """By day lamps in fog are only seen."""
    lit, fog = {"lamps": np.full((1, 3), 1.0)}, Weather(fog=Fog(0.01))
    night, day = (scene(lamps=[replace(LAMPS, sampled=sampled)]) for sampled in (True, False))
    added = [
        operations(each, lamps=lit, weather=fog) - operations(each, lamps=lit)
        for each in (night, day)
    ]
    assert added[0] > added[1] + 200


def test_lamps_that_are_only_seen_are_not_aimed_at() -> None:
    """By day the choice among emitters and its candidates would only add noise and time."""
    seen, aimed = (
        operations(
            scene(lamps=[replace(LAMPS, sampled=sampled)]), lamps={"lamps": np.full((1, 3), 1.0)}
        )
        for sampled in (False, True)
    )
    assert aimed > seen + 300


def test_plants_in_wind_add_what_any_moving_thing_adds() -> None:
    """Their vertices are other ones in every frame: rays ask what moves and what stands apart."""
    windy, leaves = Weather(wind=Wind(3.0, 0.0)), heap("leaf")
    count = len(leaves.part.mesh.vertices)
    plants = Swaying(
        np.zeros((1, 3)), np.array([3.0]), np.array([1]), np.ones(1), np.array([count]), True
    )
    moving = replace(scene(leaves), swaying={leaves.id: plants})
    still = operations(scene(leaves), weather=windy)
    assert still < operations(moving, weather=windy) < still + 50
