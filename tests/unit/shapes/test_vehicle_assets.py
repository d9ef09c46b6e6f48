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
        """Rays from the side, front, rear and above meet the outside of some face first."""
        trimesh = pytest.importorskip("trimesh")
        meta, parts = find("vehicles", name).meta, meshes(name, "parts")
        whole = trimesh.util.concatenate(
            [trimesh.Trimesh(m.vertices, m.faces, process=False) for m in parts.values()]
        )
        rng = np.random.default_rng(5)
        low, high = whole.bounds
        middle, reach = np.array([-meta["length"] / 2, 0, meta["height"] / 2]), 20.0
        targets = middle + (rng.random((60, 3)) - 0.5) * np.array([0.8, 0.5, 0.3]) * (high - low)
        away = rng.normal(size=(60, 3)) * [1, 1, 0.5]
        away[:, 2] = np.abs(away[:, 2])
        away /= np.linalg.norm(away, axis=1, keepdims=True)
        faces = whole.ray.intersects_first(targets + reach * away, -away)
        assert (faces >= 0).all()
        facing = (whole.face_normals[faces] * away).sum(axis=1)
        assert (facing > -0.02).mean() > 0.98


def test_baked_files_are_what_the_recipe_says(tmp_path):
    entry = find("vehicles", "hatchback")
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
