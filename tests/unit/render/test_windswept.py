"""Plants in wind, rendered: shadows move, frames hang on their time alone, places are followed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from builders import RAW, diffuse, frame_of, plane, scene_of, session_of, static, view_at

from sumo3dviz_pt.library.materials import MATERIALS
from sumo3dviz_pt.library.plants.tree import tree
from sumo3dviz_pt.model.geometry import belonging
from sumo3dviz_pt.model.scene import FrameState, Part, SceneData, Sky, StaticPart
from sumo3dviz_pt.model.swaying import Sway, Swaying
from sumo3dviz_pt.model.weather import Weather, WeatherCourse, Wind
from sumo3dviz_pt.render.kernel.integrator import RAYS
from sumo3dviz_pt.render.session import Session, carried, points_of

pytestmark = pytest.mark.usefixtures("compiled")

SIZE = (64, 48)
QUALITY = RAW.model_copy(update={"spp": 2, "pass_spp": 2, "max_depth": 2})
WIND = Weather(wind=Wind(9.0, 0.0))


def scene(*, windy: bool = True, z: float = 0.0) -> SceneData:
    """A maple on a plane under the sun."""
    parts: list[StaticPart] = [static("ground", plane(30.0, z=z), "grey")]
    swaying = {}
    for number, material in enumerate(("bark", "leaf")):
        one = tree("maple", seed=3, level=4, height=9.0)[number]
        mesh = belonging(
            replace(one.mesh, vertices=one.mesh.vertices + np.array([0.0, 0.0, z])), "tree:a"
        )
        parts.append(StaticPart(f"trees/{material}", "trees", Part(mesh, material, one.tint)))
        swaying[f"trees/{material}"] = Swaying(
            np.array([[0.0, 0.0, z]]),
            np.array([9.0]),
            np.array([5]),
            np.ones(1),
            np.array([len(mesh.vertices)]),
            material == "leaf",
        )
    sky = Sky(np.array([0.3, -0.4, 0.6]))
    data = scene_of(parts, {**MATERIALS, "grey": diffuse(0.4)}, sky=sky)
    course = WeatherCourse((0.0,), (WIND,))
    return replace(data, weather=course, swaying=swaying if windy else {})


def at(time: float, weather: Weather | None = WIND, *, down: bool = False) -> FrameState:
    eye = view_at((4.0, 9.0, 14.0), heading=180.0, pitch=-75.0) if down else None
    view = eye or view_at((0.0, -14.0, 4.0), heading=0.0, pitch=5.0)
    return replace(frame_of(view, time=time), weather=weather)


def picture(session: Session, state: FrameState) -> np.ndarray:
    return session.render(state).radiance


@pytest.mark.slow
def test_a_frame_is_the_same_alone_and_after_others() -> None:
    with session_of(scene(), size=SIZE, quality=QUALITY) as session:
        alone = picture(session, at(3.2))
    with session_of(scene(), size=SIZE, quality=QUALITY) as session:
        others = [picture(session, at(time)) for time in (2.0, 3.0, 9.9)]
        calm = picture(session, at(3.2, Weather(wind=Wind(0.0, 0.0))))
        np.testing.assert_array_equal(picture(session, at(3.2)), alone)
        np.testing.assert_array_equal(picture(session, at(3.2, Weather(wind=None))), calm)
    assert all(not np.array_equal(other, alone) for other in (*others, calm))


@pytest.mark.slow
def test_in_a_lull_all_is_as_where_nothing_moves() -> None:
    """Also after it has moved, and where the renderer's origin has gone elsewhere."""
    far = replace(at(5.0, None), view=view_at((700.0, -14.0, 4.0)))
    with session_of(scene(windy=False), size=SIZE, quality=QUALITY) as session:
        still = picture(session, at(3.2, None))
    with session_of(scene(), size=SIZE, quality=QUALITY) as session:
        for state in (at(2.0), at(3.1, None), far):
            session.render(state)
        np.testing.assert_allclose(picture(session, at(3.2, None)), still, rtol=1e-4, atol=1e-5)


def shadows_moved_by_wind(*, windy: bool) -> int:
    """Pixels of the ground where the sun comes or goes; noise is the same at the same time."""
    pictures, grounds = [], []
    with session_of(scene(windy=windy), size=SIZE, quality=QUALITY) as session:
        for weather in (WIND, None):
            pictures.append(picture(session, at(0.5, weather, down=True)))
            albedo = session.facts({"albedo"}).layers["albedo"]
            grounds.append(np.abs(albedo - 0.4).max(axis=-1) < 1e-3)
    ground = grounds[0] & grounds[1]
    assert ground.mean() > 0.3
    first, second = (each[ground].mean(axis=-1) for each in pictures)
    return int((np.abs(second - first) > 0.3 * np.median(first)).sum())


@pytest.mark.slow
def test_shadows_move_with_the_crown() -> None:
    assert shadows_moved_by_wind(windy=False) == 0
    assert shadows_moved_by_wind(windy=True) > 20


@pytest.mark.parametrize("layers", [("radiance", "ids", "first_depth")])
def test_leaves_get_no_help_from_other_frames(layers: tuple[str, ...]) -> None:
    """They are parts that change their shape."""
    with session_of(scene(), size=SIZE, quality=QUALITY, layers=layers) as session:
        rendered = session.render(at(3.2))
    ids = rendered.layers["ids"].astype(int)
    assert set(np.unique(ids)) == {0, 1, 2}
    assert [part.name for part in rendered.movers] == ["windswept_0", "windswept_1"]
    assert all(part.world_from_part is None for part in rendered.movers)


def test_flow_follows_leaves() -> None:
    before, after = at(3.2), at(3.24)
    data = scene(z=2.0)
    with session_of(data, size=SIZE, quality=QUALITY) as session:
        session.samples(before)
        facts, loaded = session.facts(set(RAYS)), session.loaded
    points = points_of(facts, before, SIZE)
    moved, known = carried(facts, loaded, (before, after), points)
    assert known.all() and facts.owner is not None
    own = facts.owner == facts.names.index("tree:a")
    steps = np.linalg.norm(moved - points, axis=-1)
    assert own.sum() > 100 and (steps[~own] == 0.0).all()
    assert 0.003 < np.median(steps[own]) < 0.05
    # What pixels show lies where the leaf is, before and after.
    assert WIND.wind is not None
    for time, places in ((before.time, points), (after.time, moved)):
        meshes = []
        for part in data.static:
            if part.id in data.swaying:
                sway = Sway(part.part.mesh, data.swaying[part.id])
                meshes.append((sway.at(time, WIND.wind)[0], part.part.mesh.faces))
        for place in places[own][:: max(1, int(own.sum()) // 40)]:
            assert min(_off(place, *mesh) for mesh in meshes) < 5e-4


def _off(place: np.ndarray, vertices: np.ndarray, faces: np.ndarray) -> float:
    """How far a place is from the nearest triangle that it lies over [m]."""
    a, b, c = np.moveaxis(vertices[faces], 1, 0)
    normal = np.cross(b - a, c - a)
    normal = normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    away = np.abs(((place - a) * normal).sum(axis=1))
    foot = place - ((place - a) * normal).sum(axis=1, keepdims=True) * normal
    sides = [
        (np.cross(q - p, foot - p) * normal).sum(axis=1) / np.linalg.norm(q - p, axis=1)
        for p, q in ((a, b), (b, c), (c, a))
    ]
    inside = np.min(sides, axis=0) > -1e-3
    return float(away[inside].min()) if inside.any() else np.inf
