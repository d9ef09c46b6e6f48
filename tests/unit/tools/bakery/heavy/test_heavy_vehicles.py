"""Every baked heavy vehicle of the catalogue, and the builder behind them."""

from __future__ import annotations

from copy import deepcopy
from functools import cache

import numpy as np
import pytest
from alike import assert_outward, level_of
from bakery.bake import bake_vehicle, completed_recipe, full_vehicle
from bakery.heavy.letters import letter_runs
from bakery.heavy.recipe import read_box

from sumo3dviz_pt.catalog import find, names
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.library.materials import MATERIALS
from sumo3dviz_pt.library.mesh.solids import bevelled

HEAVY = [name for name in names("vehicles") if find("vehicles", name).meta.get("build") == "box"]
WHOLES = ["articulated_bus", "semitrailer_truck", "tanker_truck"]
MIRRORS = 0.13
"""Mirrors and the like stick out of the declared width by no more than this share."""


meshes = cache(level_of)


def recipe(name: str) -> dict:
    return deepcopy(completed_recipe(find("vehicles", name).folder))


def small() -> dict:
    """A box on wheels."""
    flat = {"nose": [[0.0, 0.0], [3.0, 0.0]], "tail": [[0.0, 4.0], [3.0, 4.0]]}
    hull = {
        **flat,
        "half": 1.0,
        "top": [[0.0, 2.5], [4.0, 2.5]],
        "bottom": [[0.0, 0.5], [4.0, 0.5]],
        "spacing": 0.2,
        "faces": 200,
    }
    return {
        "length": 4.0,
        "width": 2.0,
        "height": 2.5,
        "build": "box",
        "recipe": {
            "wheel": {"radius": 0.4, "width": 0.25},
            "axles": [{"at": 0.8, "out": 0.95, "steered": True}, {"at": 3.0, "out": 0.95}],
            "hulls": [hull],
            "lamps": [{"role": "left", "view": "rear", "at": [0.7, 1.0], "size": [0.1, 0.1]}],
        },
    }


def test_the_fleet_is_there():
    wanted = {
        *("ambulance", "bus_front", "bus_rear", "city_bus", "coach", "delivery_van"),
        *("fire_engine", "minibus", "rigid_truck", "trailer_curtain", "trailer_tank"),
        "truck_tractor",
    }
    assert wanted <= set(HEAVY)
    size = sum(
        path.stat().st_size for name in HEAVY for path in find("vehicles", name).folder.glob("*")
    )
    assert size < 0.2e6 * len(HEAVY)


@pytest.mark.parametrize("name", HEAVY)
class TestEveryHeavyVehicle:
    def test_lists_exactly_its_files_in_known_materials(self, name):
        entry = find("vehicles", name)
        for level in ("parts", "far", "full", "wheel"):
            held = {material: len(mesh.faces) for material, mesh in meshes(name, level).items()}
            assert entry.meta[level] == held and set(held) <= set(MATERIALS)
        assert entry.meta["licence"] == "BSD-3-Clause"

    @pytest.mark.parametrize("level", ["parts", "far"])
    def test_has_its_size_and_stands_on_the_ground(self, name, level):
        meta, parts = find("vehicles", name).meta, meshes(name, level)
        bounds = np.stack([mesh.bounds for mesh in parts.values()])
        low, high = bounds[:, 0].min(axis=0), bounds[:, 1].max(axis=0)
        assert low[2] == pytest.approx(0.0, abs=1e-6)
        assert parts["rubber"].bounds[0, 2] == pytest.approx(0.0, abs=1e-6)
        # Mirrors reach ahead of buses, antennas over vans.
        assert -0.01 <= high[0] <= 0.35
        assert low[0] == pytest.approx(-meta["length"], abs=0.05)
        assert meta["height"] - 0.05 <= high[2] <= meta["height"] + 0.2
        assert meta["width"] / 2 - 0.06 <= high[1] <= (0.5 + MIRRORS) * meta["width"]
        assert low[1] == pytest.approx(-high[1], abs=0.12)

    @pytest.mark.parametrize(("level", "least", "most"), [("parts", 6e3, 17e3), ("far", 300, 1400)])
    def test_keeps_its_budget(self, name, level, least, most):
        assert least <= sum(len(mesh.faces) for mesh in meshes(name, level).values()) <= most

    @pytest.mark.parametrize("level", ["parts", "far"])
    def test_normals_point_outward_and_faces_have_area(self, name, level):
        for mesh in meshes(name, level).values():
            assert_outward(mesh, smallest=1e-12)

    def test_lamps_lie_on_it_in_pairs(self, name):
        meta = find("vehicles", name).meta
        corners = np.concatenate([m.vertices[m.faces] for m in meshes(name, "parts").values()])
        for lamp in meta["lamps"]:
            at = np.array(lamp["at"])
            sign = 1.0 if lamp["yaw"] == 0.0 else -1.0
            assert -meta["length"] - 0.05 <= at[0] <= 0.1
            # Nothing of the body lies before the lamp.
            near = (np.abs(corners[..., 1:] - at[1:]) < 0.4 * np.array(lamp["size"])).all((1, 2))
            assert (sign * (corners[near, :, 0] - at[0])).max(initial=-1.0) < 0.02
        roles = sorted(lamp["role"] for lamp in meta["lamps"] if abs(lamp["at"][1]) > 0.02)
        places = sorted(
            (round(abs(lamp["at"][1]), 3), round(lamp["at"][2], 3), lamp["yaw"])
            for lamp in meta["lamps"]
            if abs(lamp["at"][1]) > 0.02
        )
        assert places[::2] == places[1::2]
        assert roles.count("left") == roles.count("right")
        for lamp in meta["lamps"]:
            if lamp["role"] in ("left", "right"):
                assert (lamp["at"][1] > 0) == (lamp["role"] == "left")

    def test_wheels_stand_on_the_ground_and_tell_their_radius(self, name):
        meta = find("vehicles", name).meta
        assert len(meta["wheels"]) >= 2
        for wheel in meta["wheels"]:
            assert wheel["at"][2] == pytest.approx(wheel["radius"])
            assert -meta["length"] < wheel["at"][0] < 0


@pytest.mark.parametrize("name", WHOLES)
def test_a_whole_is_made_of_units_that_fit(name):
    meta = find("vehicles", name).meta
    ends = []
    for unit in meta["units"]:
        part = find("vehicles", unit["model"]).meta
        assert part["vclass"] == []
        assert part["width"] == meta["width"]
        ends.append(unit["at"] - part["length"])
    assert min(ends) == pytest.approx(-meta["length"], abs=1e-6)
    assert meta["units"][0]["at"] == 0.0
    heights = [find("vehicles", unit["model"]).meta["height"] for unit in meta["units"]]
    assert max(heights) == meta["height"]


def test_a_box_on_wheels_has_lamps_and_wheels():
    baked = bake_vehicle(small())
    assert set(baked.parts) == {"paint", "trim", "rubber", "rim", "chrome"}
    assert [lamp.role for lamp in baked.lamps] == ["left", "right"]
    np.testing.assert_allclose([lamp.at[0] for lamp in baked.lamps], -4.004, atol=1e-3)
    assert [wheel.steered for wheel in baked.wheels] == [True, True, False, False]


def test_close_views_have_wheels_of_their_own_with_two_faces():
    own = small()
    own["recipe"]["axles"][1] |= {"style": "concave", "twin": True}
    full, baked = full_vehicle(own), bake_vehicle(own)
    assert full is not None
    assert "rim" not in full.body
    # Inner tyres stay with the body, well inside.
    assert np.abs(full.body["rubber"].vertices[:, 1]).max() < 0.75
    low, high = full.wheel["rim"].bounds
    assert low[1] < -0.1 < 0.1 < high[1]
    assert full.wheel["rubber"].bounds[1, 2] == pytest.approx(0.4)
    assert [wheel.reversed for wheel in baked.wheels] == [False, False, True, True]


def test_doors_are_on_the_right_only():
    own = small()
    door = [[1.0, 0.7], [1.8, 0.7], [1.8, 2.2], [1.0, 2.2]]
    own["recipe"]["hulls"][0]["panels"] = [{"view": "right", "outline": door, "material": "glass"}]
    low, high = bake_vehicle(own).parts["glass"].bounds
    assert high[1] < -0.9
    np.testing.assert_allclose(
        [low[0], high[0], low[2], high[2]], [-1.8, -1.0, 0.7, 2.2], atol=0.02
    )


def test_repeated_panes_and_recesses():
    own = small()
    own["recipe"]["hulls"][0]["panels"] = [
        {
            "view": "side",
            "outline": [[0.5, 1.0], [0.9, 1.0], [0.9, 1.5], [0.5, 1.5]],
            "material": "pane",
            "radius": 0.0,
            "repeat": 3,
            "step": 0.8,
            "recess": 0.05,
        }
    ]
    mesh = bake_vehicle(own).parts["pane"]
    middles = mesh.vertices[mesh.faces].mean(axis=1)
    pushed = middles[np.abs(np.abs(middles[:, 1]) - 0.95) < 0.01]
    shares = [((pushed[:, 0] < -x) & (pushed[:, 0] > -x - 0.4)).sum() for x in (0.5, 1.3, 2.1)]
    assert min(shares) >= 4
    assert sum(shares) == len(pushed)


@pytest.mark.parametrize("view", ["front", "rear", "left", "right"])
def test_texts_look_along_their_view(view):
    own = small()
    low, high = (
        ([-0.01, -0.8, 1.0], [0.03, 0.8, 1.4])
        if view in ("front", "rear")
        else (
            [1.0, -0.01, 1.0],
            [3.0, 0.01, 1.4],
        )
    )
    own["recipe"]["pieces"] = [
        {"kind": "text", "material": "lamp_amber", "view": view, "cling": view}
        | {"low": low, "high": high, "text": "12 H"}
    ]
    mesh = bake_vehicle(own).parts["lamp_amber"]
    along = {"front": [1, 0, 0], "rear": [-1, 0, 0], "left": [0, 1, 0], "right": [0, -1, 0]}[view]
    np.testing.assert_allclose(mesh.normals @ np.array(along), 1.0, atol=1e-6)


@pytest.mark.parametrize(
    ("piece", "volume"),
    [
        ({"kind": "block", "low": [0, 0, 1], "high": [1, 0.5, 2], "round": 0.0}, 0.5),
        ({"kind": "plate", "outline": [[0, 1], [1, 1], [0, 2]], "span": [0.2, 0.6]}, 0.2),
        ({"kind": "turned", "view": "d", "outline": [[0, 0], [0.3, 0], [0.3, 1], [0, 1]]}, 0.275),
        ({"kind": "dome", "low": [0, 0, 1], "high": [1, 1, 2]}, 0.6),
        ({"kind": "rod", "outline": [[0, 0, 1], [1, 0, 1]], "round": 0.1}, 0.026),
        (
            {"kind": "mudguard", "span": [0.2, 0.5], "round": 0.5, "outline": [[0, 0], [180, 0]]},
            0.01,
        ),
    ],
    ids=lambda value: value["kind"] if isinstance(value, dict) else "",
)
def test_pieces_are_closed_and_outward(piece, volume):
    own = small()
    own["recipe"]["pieces"] = [{**piece, "material": "coat_grey", "outside": True}]
    mesh = bake_vehicle(own).parts["coat_grey"]
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    assert (a * np.cross(b, c)).sum() / 6.0 == pytest.approx(volume, rel=0.12)


def test_sheets_bulge_outwards_between_their_fixed_lines():
    own = small()
    sheet = {
        "kind": "sheet",
        "view": "left",
        "waves": {"height": 0.05, "along": 0.5, "upwards": 9.0},
        "outside": True,
    }
    own["recipe"]["pieces"] = [
        {**sheet, "material": "tarpaulin", "low": [0.5, 1.0, 1.0], "high": [3.5, 1.2, 2.0]}
    ]
    mesh = bake_vehicle(own).parts["tarpaulin"]
    assert (mesh.normals[:, 1] > 0.5).all()
    np.testing.assert_allclose(mesh.bounds[:, 1], [1.15, 1.2], atol=0.006)


def test_bevelled_boxes_are_closed():
    mesh = bevelled((0, 0, 0), (1, 2, 3), bevel=0.1)
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    assert (a * np.cross(b, c)).sum() / 6.0 == pytest.approx(6.0, rel=0.02)
    assert len(mesh.faces) == 44


def test_letters():
    runs, columns, rows = letter_runs("1-")
    assert (columns, rows) == (11, 7)
    assert (3, 6.0, 11.0) in runs
    with pytest.raises(KeyError):
        letter_runs("é")


def test_recipe_errors_name_the_place():
    wrong = small()
    wrong["recipe"]["hulls"][0]["panels"] = [{"view": "below", "outline": []}]
    with pytest.raises(ConfigError, match="below"):
        read_box(wrong)
    wrong = small()
    wrong["recipe"]["pieces"] = [{"kind": "cake"}]
    with pytest.raises(ConfigError, match="cake"):
        read_box(wrong)
    wrong = small()
    wrong["recipe"]["axles"][1]["hat"] = 3
    with pytest.raises(ConfigError, match=r"recipe\.axles\[1\]: unknown key 'hat'"):
        read_box(wrong)
    wrong = small()
    wrong["recipe"]["lamps"][0]["at"] = [3.0, 1.0]
    with pytest.raises(ConfigError, match="beside"):
        bake_vehicle(wrong)
    wrong = small()
    wrong["recipe"]["pieces"] = [
        {"kind": "block", "cling": "front", "low": [0, 2.0, 1], "high": [0.1, 2.1, 1.1]}
    ]
    with pytest.raises(ConfigError, match="clings to nothing"):
        bake_vehicle(wrong)
