"""What a scene does not have is not compiled: kernels are counted by their operations."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from builders import (
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
from sumo3dviz_pt.library.materials.named import MATERIALS, principled, surface_bsdf
from sumo3dviz_pt.model.geometry import Mesh
from sumo3dviz_pt.model.lamps import LampSet
from sumo3dviz_pt.model.scene import Sky, Slots
from sumo3dviz_pt.model.swaying import Swaying
from sumo3dviz_pt.model.weather import Fog, Snow, Weather, WeatherCourse, Wind
from sumo3dviz_pt.render.backend import choose_backend

ROAD = principled((0.2, 0.2, 0.2), roughness=0.9)
LAMPS = LampSet(
    "lamps",
    "signals",
    Mesh(np.array([[-1, 9, 1], [1, 9, 1], [1, 9, 2]]), np.array([[0, 1, 2]])),
    np.zeros(1, int),
    ("one",),
    sampled=True,
)


@pytest.fixture(autouse=True)
def compiled() -> Iterator[None]:
    if not choose_backend("llvm").jit:
        pytest.skip("only our own kernel is compiled")
    yield
    choose_backend("llvm")


def textured(mesh: Mesh) -> Mesh:
    return Mesh(mesh.vertices, mesh.faces, mesh.normals, 0.25 * mesh.vertices[:, :2])


def road(surface: str = "road") -> list:
    return [static("road", textured(plane(40.0)), surface)]


def scene(*more, surface: str = "road", **settings):
    asphalt = surface_bsdf(catalog.find("surfaces", "asphalt"))
    materials = {**MATERIALS, "road": ROAD, "asphalt": asphalt, "matt_tint": diffuse(0.5)}
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


@pytest.mark.parametrize(
    ("what", "least"),
    [
        ("texture", 300),
        ("leaves", 20),
        ("coats", 60),
        ("instances", 60),
        ("lamps", 400),
        ("sun", 100),
        ("ids", 1),
        ("fog", 30),
    ],
)
def test_what_a_road_has_is_all_that_is_compiled(empty: int, what: str, least: int) -> None:
    found = {
        "texture": lambda: operations(scene(surface="asphalt")),
        "leaves": lambda: operations(scene(heap("leaf"))),
        "coats": lambda: operations(scene(heap("paint"))),
        "instances": lambda: operations(
            scene(prototypes=[cube("cube")], slots=Slots(near={"cube": 1})),
            movers=[mover("a", (0, 0, 0), (0.5, 0.1, 0.1))],
        ),
        "lamps": lambda: operations(scene(lamps=[LAMPS]), lamps={"lamps": np.full((1, 3), 1.0)}),
        "sun": lambda: operations(scene(sky=Sky(np.array([0.3, -0.4, 0.6])))),
        "ids": lambda: operations(scene(), layers=("radiance", "ids")),
        "fog": lambda: operations(scene(), weather=Weather(fog=Fog(0.01))),
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


def test_plants_in_wind_add_nothing_to_the_kernel() -> None:
    """Their vertices are other ones in every frame, and that is all."""
    windy, leaves = Weather(wind=Wind(3.0, 0.0)), heap("leaf")
    count = len(leaves.part.mesh.vertices)
    plants = Swaying(
        np.zeros((1, 3)), np.array([3.0]), np.array([1]), np.ones(1), np.array([count]), True
    )
    moving = replace(scene(leaves), swaying={leaves.id: plants})
    assert operations(moving, weather=windy) == operations(scene(leaves), weather=windy)
