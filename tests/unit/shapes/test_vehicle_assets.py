"""Every baked car of the catalogue, and the builder behind them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import yaml

from sumo3dviz_pt.catalog import find, names
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.shapes.bake import bake_folder, bake_vehicle
from sumo3dviz_pt.shapes.car_recipe import MATERIALS, read_recipe
from sumo3dviz_pt.shapes.ply import read_ply

CARS = names("vehicles")


def meshes(name: str, level: str):
    entry = find("vehicles", name)
    return {part["material"]: read_ply(entry.folder / part["mesh"]) for part in entry.meta[level]}


def test_there_are_ten_and_they_are_small():
    assert len(CARS) >= 10
    folder = find("vehicles", CARS[0]).folder.parent
    assert sum(path.stat().st_size for path in folder.rglob("*.*")) < 12e6


@pytest.mark.parametrize("name", CARS)
class TestEveryCar:
    def test_lists_exactly_its_files(self, name):
        entry = find("vehicles", name)
        listed = {part["mesh"] for level in ("parts", "far") for part in entry.meta[level]}
        assert listed == {path.name for path in entry.folder.glob("*.ply")}
        for level in ("parts", "far"):
            assert {part["material"] for part in entry.meta[level]} <= set(MATERIALS)
            assert {"paint", "glass", "trim", "rubber"} <= set(meshes(name, level))

    def test_says_what_it_is(self, name):
        meta = find("vehicles", name).meta
        assert meta["kind"] == "vehicle"
        assert meta["vclass"] == "passenger"
        assert meta["licence"] == "BSD-3-Clause"
        x, y, z = meta["eye"]
        assert -meta["length"] < x < meta["cowl"] < 0
        assert 0 < y < meta["width"] / 2
        assert 0.7 * meta["height"] < z < meta["height"]

    @pytest.mark.parametrize("level", ["parts", "far"])
    def test_has_its_size_and_stands_on_the_ground(self, name, level):
        meta, parts = find("vehicles", name).meta, meshes(name, level)
        bounds = np.stack([mesh.bounds for mesh in parts.values()])
        low, high = bounds[:, 0].min(axis=0), bounds[:, 1].max(axis=0)
        assert low[2] == pytest.approx(0.0, abs=1e-6)
        assert parts["rubber"].bounds[0, 2] == pytest.approx(0.0, abs=1e-6)
        assert high[0] == pytest.approx(0.0, abs=0.01)
        assert low[0] == pytest.approx(-meta["length"], abs=0.01)
        assert high[2] == pytest.approx(meta["height"], abs=0.01)
        # Mirrors stick out by what real ones do.
        assert meta["width"] / 2 - 0.01 <= high[1] <= meta["width"] / 2 + 0.2
        assert low[1] == pytest.approx(-high[1], abs=1e-5)

    @pytest.mark.parametrize(("level", "least", "most"), [("parts", 12e3, 20e3), ("far", 200, 400)])
    def test_keeps_its_budget(self, name, level, least, most):
        assert least <= sum(len(mesh.faces) for mesh in meshes(name, level).values()) <= most

    @pytest.mark.parametrize("level", ["parts", "far"])
    def test_normals_point_outward(self, name, level):
        for mesh in meshes(name, level).values():
            a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
            normals = np.cross(b - a, c - a)
            solid = np.linalg.norm(normals, axis=1) > 1e-9
            agree = (normals[:, None] * mesh.normals[mesh.faces]).sum(axis=2)[solid] > 0
            assert agree.mean() > 0.99
            np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=1), 1.0, atol=1e-5)

    def test_nobody_looks_through_it(self, name):
        """Rays from all around meet a face first, and that face from its outside."""
        meta, parts = find("vehicles", name).meta, meshes(name, "parts")
        corners = np.concatenate([mesh.vertices[mesh.faces] for mesh in parts.values()])
        size = np.array([meta["length"], meta["width"], meta["height"]])
        rng = np.random.default_rng(5)
        away = rng.normal(size=(40, 3)) * [1, 1, 0.5]
        away[:, 2] = np.abs(away[:, 2])
        away /= np.linalg.norm(away, axis=1, keepdims=True)
        targets = size * ([-0.5, 0, 0.45] + (rng.random((40, 3)) - 0.5) * [0.8, 0.6, 0.3])
        facing = np.array([first_facing(corners, t, a) for t, a in zip(targets, away, strict=True)])
        assert not np.isnan(facing).any()
        assert (facing > -0.02).mean() >= 0.97


def first_facing(corners, target, away) -> float:
    """Cosine between the first face that a ray from far away meets and the way back."""
    origin, way = target + 20.0 * away, -away
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    across = np.cross(way, second)
    scale = (first * across).sum(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        offset = origin - corners[:, 0]
        u = (offset * across).sum(axis=1) / scale
        turned = np.cross(offset, first)
        v = turned @ way / scale
        t = (second * turned).sum(axis=1) / scale
        hit = (u >= 0) & (v >= 0) & (u + v <= 1)
    if not hit.any():
        return float("nan")
    nearest = np.flatnonzero(hit)[t[hit].argmin()]
    normal = np.cross(first[nearest], second[nearest])
    return float(normal @ away / np.linalg.norm(normal))


@pytest.mark.parametrize("name", ["estate", "pickup"])
def test_baked_files_are_what_the_recipe_says(tmp_path, name):
    entry = find("vehicles", name)
    (tmp_path / "asset.yaml").write_bytes((entry.folder / "asset.yaml").read_bytes())
    written = bake_folder(tmp_path)
    assert {path.name for path in written} == {p.name for p in entry.folder.glob("*.ply")}
    for path in written:
        new, old = read_ply(path), read_ply(entry.folder / path.name)
        np.testing.assert_allclose(new.bounds, old.bounds, atol=1e-3)
        assert len(new.faces) == pytest.approx(len(old.faces), rel=0.05, abs=8)


def test_baking_twice_gives_the_same_bytes(tmp_path):
    entry = find("vehicles", "city_car")
    contents = []
    for name in ("one", "two"):
        folder = tmp_path / name
        folder.mkdir()
        (folder / "asset.yaml").write_bytes((entry.folder / "asset.yaml").read_bytes())
        contents.append([path.read_bytes() for path in bake_folder(folder)])
    assert contents[0] == contents[1]


def recipe() -> dict:
    path = Path(find("vehicles", "sedan").folder) / "asset.yaml"
    content: dict = yaml.safe_load(path.read_text(encoding="utf-8"))
    return content


def test_side_and_top_panels_and_disc_wheels():
    own = recipe()
    own["recipe"]["panels"] = [
        {"view": "side", "outline": [[1.5, 0.5], [1.8, 0.5], [1.8, 0.6]], "material": "lamp_amber"},
        {"view": "top", "outline": [[0.7, 0.0], [0.9, 0.0], [0.9, 0.2]], "material": "chrome"},
    ]
    own["recipe"]["wheel"]["spokes"] = 0
    parts = bake_vehicle(own).parts
    assert "lamp_red" not in parts
    low, high = parts["lamp_amber"].bounds
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
