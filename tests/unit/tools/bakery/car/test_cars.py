"""Every baked car of the catalogue, and the builder behind them."""

from __future__ import annotations

from collections import Counter
from copy import deepcopy
from functools import cache

import numpy as np
import pytest
from alike import assert_outward, level_of
from bakery.bake import bake_folder, bake_vehicle, completed_recipe
from bakery.car.recipe import MATERIALS, read_recipe

from sumo3dviz_pt.catalog import find, names
from sumo3dviz_pt.errors import ConfigError

CARS = tuple(n for n in names("vehicles") if find("vehicles", n).meta.get("build") == "car")
DIRECTIONS = np.random.default_rng(3).normal(size=(160, 3))
DIRECTIONS /= np.linalg.norm(DIRECTIONS, axis=1, keepdims=True)


meshes = cache(level_of)


@cache
def completed(name: str):
    return completed_recipe(find("vehicles", name).folder)


def corners_of(parts):
    return np.concatenate([mesh.vertices[mesh.faces] for mesh in parts.values()])


def areas(mesh):
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    return np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2


def test_there_are_enough_and_they_are_small():
    assert len(CARS) >= 12
    assert {"taxi", "police"} <= set(CARS)
    for name in CARS:
        folder = find("vehicles", name).folder
        assert sum(path.stat().st_size for path in folder.iterdir()) < 560e3


def test_no_two_share_a_face():
    """Outlines of head lamps and grilles, and wheels differ from car to car."""
    own = [completed(n)["recipe"] for n in CARS if n not in ("taxi", "police")]
    for key in ("panels", "wheel", "nose"):
        assert len({str(recipe[key]) for recipe in own}) == len(own)


@pytest.mark.parametrize("name", CARS)
class TestEveryCar:
    def test_lists_exactly_what_its_files_hold(self, name):
        meta, body = find("vehicles", name).meta, completed(name)["recipe"].get("body", "paint")
        for level in ("parts", "far", "full", "wheel"):
            held = {material: len(mesh.faces) for material, mesh in meshes(name, level).items()}
            assert meta[level] == held and set(held) <= set(MATERIALS)
        for level in ("parts", "far"):
            assert {body, "glass", "trim", "rubber", "plate"} <= set(meta[level])
            assert ("cabin_pane" in meta[level]) == (level == "parts")

    def test_says_what_it_is(self, name):
        meta = find("vehicles", name).meta
        assert meta["kind"] == "vehicle"
        assert meta["licence"] == "BSD-3-Clause"
        x, y, z = meta["eye"]
        assert -meta["length"] < x < meta["cowl"] < 0
        assert 0 < y < meta["width"] / 2
        assert 0.7 * meta["height"] < z < meta["height"]

    def test_has_the_proportions_of_a_car(self, name):
        """Ranges of the classes A to J and of pick-ups on sale in Europe."""
        recipe = read_recipe(completed(name))
        front, rear = recipe.axles
        assert 0.57 <= 2 * recipe.wheel.radius <= 0.80
        assert 0.55 <= (rear - front) / recipe.length <= 0.68
        assert 0.17 <= front / recipe.length <= 0.225
        assert 0.30 <= recipe.wheel.radius * 2 / recipe.width <= 0.43
        belt = recipe.belt[len(recipe.belt) // 2][1]
        assert 0.28 <= (recipe.height - belt) / recipe.height <= 0.42

    @pytest.mark.parametrize("level", ["parts", "far"])
    def test_has_its_size_and_stands_on_the_ground(self, name, level):
        meta, parts = find("vehicles", name).meta, meshes(name, level)
        body = parts[completed(name)["recipe"].get("body", "paint")].bounds
        bounds = np.stack([mesh.bounds for mesh in parts.values()])
        low, high = bounds[:, 0].min(axis=0), bounds[:, 1].max(axis=0)
        assert low[2] == pytest.approx(0.0, abs=1e-6)
        assert parts["rubber"].bounds[0, 2] == pytest.approx(0.0, abs=1e-6)
        # Pipes, grilles and bumper ledges stand out by what real ones do.
        assert high[0] == pytest.approx(0.0, abs=0.05)
        assert low[0] == pytest.approx(-meta["length"], abs=0.06)
        assert meta["height"] - 0.07 <= body[1, 2] <= meta["height"] + 0.02
        assert meta["width"] / 2 - 0.01 <= high[1] <= meta["width"] / 2 + 0.22
        assert low[1] == pytest.approx(-high[1], abs=2e-3)

    @pytest.mark.parametrize(("level", "least", "most"), [("parts", 8e3, 18e3), ("far", 400, 2e3)])
    def test_keeps_its_budget(self, name, level, least, most):
        assert least <= sum(len(mesh.faces) for mesh in meshes(name, level).values()) < most

    @pytest.mark.parametrize("level", ["parts", "far"])
    def test_normals_point_outward_and_faces_have_area(self, name, level):
        for mesh in meshes(name, level).values():
            assert_outward(mesh)

    def test_nobody_looks_through_it(self, name):
        """Rays from all around meet a face first, and that face from its outside."""
        meta, parts = find("vehicles", name).meta, meshes(name, "parts")
        corners = corners_of(parts)
        size = np.array([meta["length"], meta["width"], meta["height"]])
        rng = np.random.default_rng(5)
        away = rng.normal(size=(40, 3)) * [1, 1, 0.5]
        away[:, 2] = np.abs(away[:, 2])
        away /= np.linalg.norm(away, axis=1, keepdims=True)
        targets = size * ([-0.5, 0, 0.45] + (rng.random((40, 3)) - 0.5) * [0.8, 0.6, 0.3])
        facing = np.array([first_facing(corners, t, a) for t, a in zip(targets, away, strict=True)])
        assert not np.isnan(facing).any()
        assert (facing > -0.02).mean() >= 0.97

    def test_lamps_lie_just_before_the_body_on_both_sides(self, name):
        lamps = find("vehicles", name).meta["lamps"]
        count = Counter(lamp["role"] for lamp in lamps)
        assert count["head"] == 2
        assert count["tail"] >= 2
        assert count["brake"] >= 3
        assert count["left"] == count["right"] >= 2
        assert count["reverse"] == 2
        equipment = {"taxi": (2, 0), "police": (0, 4)}.get(name, (0, 0))
        assert (count["sign"], count["blue"]) == equipment
        corners = corners_of(meshes(name, "parts"))
        for lamp in lamps:
            way = np.array([np.cos(lamp["yaw"]), np.sin(lamp["yaw"]), 0.0])
            assert -0.012 <= gap_behind(corners, np.array(lamp["at"]), way) <= 0.045, lamp
            assert 0.0 < lamp["size"][1] <= 0.3, lamp
            assert lamp["size"][0] <= 1.6, lamp

    def test_lamps_are_symmetric(self, name):
        swap = {"left": "right", "right": "left"}
        lamps = {(x["role"], *np.round(x["at"], 3)) for x in find("vehicles", name).meta["lamps"]}
        assert {(swap.get(r, r), x, -y, z) for r, x, y, z in lamps} == lamps

    def test_wheels_stand_where_the_body_says(self, name):
        meta = find("vehicles", name).meta
        recipe, wheels = read_recipe(completed(name)), meta["wheels"]
        places = {(w["at"][0], w["at"][1]) for w in wheels}
        assert len(wheels) == len(places) == 4
        assert {(x, -y) for x, y in places} == places
        for wheel in wheels:
            x, y, z = wheel["at"]
            assert z == wheel["radius"] == pytest.approx(recipe.wheel.radius)
            assert min(abs(-x - d) for d in recipe.axles) < 1e-3
            assert wheel["steered"] == (-x < recipe.length / 2)
            assert 0.72 < 2 * abs(y) / recipe.width < 0.92


@pytest.mark.parametrize("name", CARS)
def test_close_level_keeps_its_budget_and_has_the_same_outline(name):
    meta = find("vehicles", name).meta
    body, wheel = meshes(name, "full"), meshes(name, "wheel")
    faces = sum(len(mesh.faces) for mesh in body.values())
    faces += 4 * sum(len(mesh.faces) for mesh in wheel.values())
    assert 25_000 < faces < 80_000
    assert set(body) | set(wheel) <= set(MATERIALS)
    for mesh in (*body.values(), *wheel.values()):
        assert areas(mesh).min() > 0.0
    near = np.concatenate([mesh.vertices for mesh in body.values()])
    middle = np.concatenate([mesh.vertices for mesh in meshes(name, "parts").values()])
    # Only where the body is the outline: wheels are not in the close level.
    for way in DIRECTIONS[DIRECTIONS[:, 2] > 0.0]:
        assert (near @ way).max() == pytest.approx((middle @ way).max(), abs=0.02)
    tyre = wheel["rubber"].bounds
    assert tyre[1, 2] == pytest.approx(-tyre[0, 2]) == pytest.approx(meta["wheels"][0]["radius"])


@pytest.mark.parametrize("name", CARS)
def test_far_level_has_the_same_outline(name):
    """But for antennas, pipes and signs, which are too small to be seen so far away."""
    middle, far = (
        np.concatenate([mesh.vertices for mesh in meshes(name, level).values()])
        for level in ("parts", "far")
    )
    for way in DIRECTIONS:
        assert (far @ way).max() == pytest.approx((middle @ way).max(), abs=0.16)


def gap_behind(corners, at, way) -> float:
    """How far behind a point a ray first meets a face, looking from 5 cm before it [m]."""
    return first_hit(corners, at + 0.05 * way, -way)[0] - 0.05


def first_hit(corners, origin, way) -> tuple[float, int]:
    """Distance of the first face that a ray meets, and its number."""
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    across = np.cross(way, second)
    scale = (first * across).sum(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        offset = origin - corners[:, 0]
        u = (offset * across).sum(axis=1) / scale
        turned = np.cross(offset, first)
        v = turned @ way / scale
        t = (second * turned).sum(axis=1) / scale
        hit = (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0)
    if not hit.any():
        return float("nan"), -1
    nearest = np.flatnonzero(hit)[t[hit].argmin()]
    return float(t[nearest]), int(nearest)


def first_facing(corners, target, away) -> float:
    """Cosine between the first face that a ray from far away meets and the way back."""
    number = first_hit(corners, target + 20.0 * away, -away)[1]
    if number < 0:
        return float("nan")
    a, b, c = corners[number]
    normal = np.cross(b - a, c - a)
    return float(normal @ away / np.linalg.norm(normal))


def recipe() -> dict:
    return deepcopy(completed("sedan"))


@pytest.mark.slow
def test_side_and_top_panels_and_disc_wheels():
    own = recipe()
    own["recipe"]["panels"] = [
        {
            "view": "side",
            "outline": [[1.5, 0.5], [1.8, 0.5], [1.8, 0.6]],
            "material": "livery_cream",
        },
        {"view": "top", "outline": [[0.7, 0.0], [0.9, 0.0], [0.9, 0.2]], "material": "chrome"},
    ]
    own["recipe"].update(strips=[], discs=[])
    own["recipe"]["wheel"]["spokes"] = 0
    parts = bake_vehicle(own).parts
    assert "lamp_red" not in parts
    low, high = parts["livery_cream"].bounds
    np.testing.assert_allclose([low[0], high[0]], [-1.8, -1.5], atol=0.1)
    assert high[1] > 0.8
    assert high[2] == pytest.approx(0.6, abs=0.03)
    assert parts["chrome"].bounds[0, 2] > 0.7


def test_recipe_errors_name_the_place():
    wrong = recipe()
    wrong["recipe"]["wheel"]["radios"] = 1
    with pytest.raises(ConfigError, match=r"recipe\.wheel: unknown key 'radios'"):
        bake_vehicle(wrong)
    wrong = recipe()
    del wrong["recipe"]["panels"][1]["view"]
    with pytest.raises(ConfigError, match=r"recipe\.panels\[1\]: key 'view' is missing"):
        read_recipe(wrong)
    wrong = recipe()
    wrong["recipe"]["wheel"] = 3
    with pytest.raises(ConfigError, match=r"recipe\.wheel: must be a mapping"):
        read_recipe(wrong)
    wrong = recipe()
    wrong["recipe"]["panels"][0]["material"] = "jelly"
    with pytest.raises(ConfigError, match="jelly"):
        read_recipe(wrong)
    wrong = recipe()
    wrong["recipe"]["panels"][0]["view"] = "below"
    with pytest.raises(ConfigError, match="below"):
        read_recipe(wrong)
    wrong = recipe()
    wrong["recipe"]["axles"] = [1.0]
    with pytest.raises(ConfigError, match=r"recipe\.axles: too few values"):
        read_recipe(wrong)
    wrong["recipe"]["axles"] = ["front", "rear"]
    with pytest.raises(ConfigError, match=r"recipe\.axles\[0\]: .*valid number"):
        read_recipe(wrong)


def test_baking_names_the_file_at_fault(tmp_path):
    folder, recipes = tmp_path / "car", tmp_path / "recipes"
    folder.mkdir()
    recipes.mkdir()
    (folder / "asset.yaml").write_text("{length: 4.0, build: car}", encoding="utf-8")
    (recipes / "car.yaml").write_text("{hat: 3}", encoding="utf-8")
    with pytest.raises(ConfigError, match=r"car\.yaml: recipe: key"):
        bake_folder(folder, recipes)
