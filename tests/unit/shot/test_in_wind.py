"""Which plants move in wind: near ones, within a budget, all others as they were."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from builders import plane, static

from sumo3dviz_pt.library.plants.tree import tree
from sumo3dviz_pt.model.camera import CameraPath
from sumo3dviz_pt.model.geometry import belonging, merge_meshes
from sumo3dviz_pt.model.scene import Part, StaticPart
from sumo3dviz_pt.model.weather import Weather, WeatherCourse, Wind
from sumo3dviz_pt.shot import in_wind as windy
from sumo3dviz_pt.shot.in_wind import Windswept, in_wind

PLACES = {"tree:near": 20.0, "tree:middle": 45.0, "tree:far": 900.0}
EYE = CameraPath(np.array([[0.0, 0.0, 2.0]]), np.array([[1.0, 0.0, 0.0]]), np.array([0.5]))


def course(*speeds: float) -> WeatherCourse:
    moments = tuple(Weather(wind=Wind(speed, 0.0)) for speed in speeds)
    return WeatherCourse(tuple(10.0 * k for k in range(len(speeds))), moments)


def standing() -> list[StaticPart]:
    """Three maples ahead of the camera, as objects are merged, and the ground."""
    parts = [static("ground", plane(10.0), "grass")]
    for number, material in enumerate(("bark", "leaf")):
        one = tree("maple", seed=3, level=4, height=10.0)[number]
        meshes = []
        for name, x in PLACES.items():
            moved = replace(one.mesh, vertices=one.mesh.vertices + np.array([x, 0.0, 1.0]))
            meshes.append(belonging(moved, name))
        assert one.tint is not None
        tint = np.concatenate([one.tint * (k + 1) / 3 for k in range(len(PLACES))])
        part = Part(merge_meshes(meshes), material, tint)
        parts.append(StaticPart(f"trees/{material}", "trees", part))
    return parts


def found(weather: WeatherCourse | None, *, eye: CameraPath = EYE, seed: int = 1) -> Windswept:
    return in_wind(standing(), weather, eye, pixels=734.0, seed=seed)


def names(part: StaticPart) -> list[str]:
    return [name for name, _ in part.part.mesh.things]


@pytest.mark.parametrize("weather", [None, course(0.0), course(0.0, 0.0)])
def test_without_wind_nothing_is_touched(weather: WeatherCourse | None) -> None:
    parts = standing()
    same = in_wind(parts, weather, EYE, pixels=734.0, seed=1)
    assert all(one is other for one, other in zip(same.static, parts, strict=True))
    assert same.swaying == {}


def test_near_plants_move_and_the_others_stand() -> None:
    windswept = found(course(0.0, 6.0))
    by_id = {part.id: part for part in windswept.static}
    assert set(windswept.swaying) == {"trees/bark/wind", "trees/leaf/wind"}
    for material in ("bark", "leaf"):
        assert names(by_id[f"trees/{material}/wind"]) == ["tree:near", "tree:middle"]
        assert names(by_id[f"trees/{material}"]) == ["tree:far"]
    bark, leaves = (windswept.swaying[f"trees/{each}/wind"] for each in ("bark", "leaf"))
    np.testing.assert_allclose(bark.feet, [[20.0, 0.0, 1.0], [45.0, 0.0, 1.0]], atol=0.15)
    np.testing.assert_allclose(bark.heights, 10.0, atol=0.05)
    # A crown goes where its trunk goes.
    for each in ("feet", "heights", "seeds", "shares"):
        np.testing.assert_array_equal(getattr(bark, each), getattr(leaves, each))
    assert leaves.leaves and not bark.leaves


def test_nothing_is_lost_or_changed() -> None:
    """All triangles are there, with their colours, and no other part is touched."""
    before, after = standing(), found(course(6.0)).static
    assert after[0].id == "ground"
    for material in ("bark", "leaf"):
        whole = next(p.part for p in before if p.part.material == material)
        pieces = [p.part for p in after if p.part.material == material]

        def corners(part: Part) -> np.ndarray:
            assert part.tint is not None
            flat = part.mesh.vertices[part.mesh.faces].reshape(len(part.mesh.faces), 9)
            return np.hstack([flat, part.tint])

        rows = np.concatenate([corners(piece) for piece in pieces])
        wanted = corners(whole)
        np.testing.assert_array_equal(rows[np.lexsort(rows.T)], wanted[np.lexsort(wanted.T)])


def test_stronger_wind_is_seen_farther_away() -> None:
    counts = [
        len(found(course(speed)).swaying["trees/bark/wind"].heights) for speed in (2.0, 6.0, 20.0)
    ]
    assert counts == [1, 2, 2]
    shares = found(course(6.0)).swaying["trees/bark/wind"].shares
    assert shares[0] == 1.0 >= shares[1] > 0.0


def test_the_nearest_come_first_where_not_all_may_move(monkeypatch: pytest.MonkeyPatch) -> None:
    one = sum(len(part.part.mesh.faces) for part in standing()[1:]) // 3
    monkeypatch.setattr(windy, "BUDGET", one + 10)
    swaying = found(course(6.0)).swaying
    assert len(swaying["trees/leaf/wind"].heights) == 1
    monkeypatch.setattr(windy, "BUDGET", one - 10)
    assert found(course(6.0)).swaying == {}


def test_chance_hangs_on_the_seed_and_the_plant() -> None:
    first, again, other = (
        found(course(6.0), seed=seed).swaying["trees/leaf/wind"].seeds for seed in (1, 1, 2)
    )
    np.testing.assert_array_equal(first, again)
    assert len(set(first.tolist())) == 2 and not np.array_equal(first, other)
