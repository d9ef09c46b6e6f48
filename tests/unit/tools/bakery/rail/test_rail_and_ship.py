"""Every baked train, tram, ship, aircraft and container, and the builder behind them."""

from __future__ import annotations

import numpy as np
import pytest
from alike import assert_outward
from bakery.bake import bake_vehicle
from bakery.rail.build import read_hull_vehicle

from sumo3dviz_pt.cast.bodies import build_body
from sumo3dviz_pt.cast.choice import Model, ModelChoice, choose, models_for
from sumo3dviz_pt.cast.fitting import fitted_model
from sumo3dviz_pt.catalog import find, names
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.library.materials import MATERIALS
from sumo3dviz_pt.library.vehicles.packed import BODIES
from sumo3dviz_pt.model.geometry import Mesh
from sumo3dviz_pt.model.traffic import VehicleType

HULLS = [name for name in names("vehicles") if find("vehicles", name).meta.get("build") == "hull"]
WAGONS = ["wagon_container", "wagon_covered", "wagon_last", "wagon_tank"]
TRAINS = ["cab_car", "carriage", "control_car", "locomotive", "tram_front", "tram_middle"]
RAIL = [*TRAINS, *WAGONS]
SHIPS = ["ship", "ship_bow", "ship_hold", "ship_stern"]
AIRCRAFT = ["airliner", "airliner_large", "light_aircraft", "quadcopter"]
OTHERS = [*AIRCRAFT, "boat", "cable_cabin", "container", "container_40", "ferry", "tram_rear"]
WHOLES = ["cargo_ship", "freight_train", "passenger_train", "tram", "urban_train"]
SIZE = (20.0, 2.9, 3.7)
"""Of a vType; what a model is stretched to does not count here."""


def meshes(name: str, level: str) -> dict[str, Mesh]:
    entry = find("vehicles", name)
    prototype = fitted_model(entry, {}, ModelChoice(Model.of(entry), "rail", SIZE)).units[0]
    parts = prototype.prototype.parts if level == "parts" else prototype.prototype.far
    return {part.material: part.mesh for part in parts}


def chosen(vclass: str, length: float, *, gui: str = "", width: float = 2.9) -> ModelChoice:
    kind = VehicleType("x", vclass, length, width, 3.7, gui)
    choice = choose(kind, name="a", models=models_for({}), own={}, seed=0)
    assert isinstance(choice, ModelChoice)
    return choice


def test_the_fleet_is_there_and_small():
    assert {*RAIL, *SHIPS, *OTHERS} == set(HULLS)
    files = [path for name in HULLS for path in find("vehicles", name).folder.glob("*")]
    assert sum(path.stat().st_size for path in files) < 0.95e6


@pytest.mark.parametrize("name", HULLS)
class TestEveryHull:
    def test_lists_exactly_its_files_in_known_materials(self, name):
        entry = find("vehicles", name)
        there = {path.name for path in entry.folder.glob("*.xz")}
        assert there == (set() if "turns" in entry.meta else {BODIES})
        for level in ("parts", "far"):
            held = {material: len(mesh.faces) for material, mesh in meshes(name, level).items()}
            assert entry.meta[level] == held and set(held) <= set(MATERIALS)
        assert entry.meta["licence"] == "BSD-3-Clause"
        assert "full" not in entry.meta

    def test_is_small_on_disk(self, name):
        files = find("vehicles", name).folder.glob("*")
        assert sum(path.stat().st_size for path in files) < 0.1e6

    @pytest.mark.parametrize("level", ["parts", "far"])
    def test_has_its_size_and_stands_on_rails_water_or_ground(self, name, level):
        meta, parts = find("vehicles", name).meta, meshes(name, level)
        bounds = np.stack([mesh.bounds for mesh in parts.values()])
        low, high = bounds[:, 0].min(axis=0), bounds[:, 1].max(axis=0)
        assert low[2] == pytest.approx(0.0, abs=0.03)
        assert high[0] == pytest.approx(0.0, abs=0.06)
        assert low[0] == pytest.approx(-meta["length"], abs=0.06)
        # Pantographs and masts reach over roofs; mirrors and fenders stick out.
        assert meta["height"] - 0.35 <= high[2] <= meta["height"] + 2.1
        assert meta["width"] / 2 - 0.06 <= high[1] <= meta["width"] / 2 + 0.25
        assert low[1] == pytest.approx(-high[1], abs=0.02)

    def test_keeps_its_budget(self, name):
        counts = [sum(len(m.faces) for m in meshes(name, key).values()) for key in ("parts", "far")]
        assert 1_500 <= counts[0] <= 12_500
        assert 80 <= counts[1] <= 1_250

    @pytest.mark.parametrize("level", ["parts", "far"])
    def test_normals_point_outward_and_faces_have_area(self, name, level):
        for mesh in meshes(name, level).values():
            assert_outward(mesh, smallest=1e-12)

    def test_lamps_shine_from_its_ends_in_pairs(self, name):
        meta = find("vehicles", name).meta
        for lamp in meta["lamps"]:
            x, y, _ = lamp["at"]
            behind = -x if np.cos(lamp["yaw"]) > 0 else x + meta["length"]
            if name in ("boat", "ferry", *SHIPS, *AIRCRAFT):
                assert -0.02 <= behind <= 0.95 * meta["length"]
                continue
            assert -0.02 <= behind <= 1.6
            assert (lamp["role"] in ("head", "sign")) == (np.cos(lamp["yaw"]) > 0)
            if lamp["role"] != "sign":
                assert [x, -y] in [other["at"][:2] for other in meta["lamps"]]


@pytest.mark.parametrize("name", RAIL)
def test_wheels_stand_on_both_rails(name):
    steel = meshes(name, "parts")["wheel_steel"]
    assert steel.bounds[0, 2] == pytest.approx(0.0, abs=2e-3)
    treads = np.abs(steel.vertices[steel.vertices[:, 2] < 0.02, 1])
    assert treads.min() > 0.66
    assert treads.max() < 0.86


@pytest.mark.parametrize("name", WHOLES)
def test_units_meet(name):
    meta = find("vehicles", name).meta
    place = 0.0
    for unit in meta["units"]:
        part = find("vehicles", unit["model"]).meta
        assert unit["at"] == pytest.approx(place)
        assert unit.get("pitch", part["length"]) == part["length"]
        place -= part["length"]
    assert -place == pytest.approx(meta["length"])


@pytest.mark.parametrize(
    "vclass", ["tram", "rail", "rail_electric", "rail_urban", "subway", "ship"]
)
@pytest.mark.parametrize("length", [20.0, 22.0, 36.5, 41.0, 67.5, 109.5, 135.0, 200.0, 250.0])
def test_units_fill_any_length(vclass, length):
    body = build_body(chosen(vclass, length), {})
    ends = [
        (unit.at * body.scale[0], min(p.mesh.bounds[0, 0] for p in unit.prototype.parts))
        for unit in body.assembly.units
    ]
    rears = [at + body.scale[0] * low for at, low in ends]
    gaps = [rear - at for rear, (at, _) in zip(rears, ends[1:], strict=False)]
    assert rears[-1] == pytest.approx(-length, abs=0.1)
    assert max(gaps, default=0.0) <= 0.8
    assert min(gaps, default=0.0) >= -0.3
    assert 0.75 < body.scale[0] < 1.32


@pytest.mark.parametrize(
    ("vclass", "length", "width", "name", "units"),
    [
        ("tram", 22.0, 2.4, "tram", 2),
        ("tram", 32.0, 2.4, "tram", 3),
        ("rail", 19.0, 2.84, "locomotive", 1),
        ("rail", 67.5, 2.84, "passenger_train", 3),
        ("rail_fast", 200.0, 2.95, "passenger_train", 8),
        ("subway", 109.5, 3.0, "urban_train", 4),
        ("rail_urban", 36.5, 3.0, "tram", 3),
        ("ship", 17.0, 4.0, "ship", 1),
        ("ship", 110.0, 11.4, "cargo_ship", 11),
        ("container", 6.1, 2.4, "container", 1),
    ],
)
def test_who_draws_sumos_classes(vclass, length, width, name, units):
    names_seen = set()
    for number in range(12):
        kind = VehicleType("x", vclass, length, width, 3.7)
        choice = choose(kind, name=str(number), models=models_for({}), own={}, seed=0)
        assert isinstance(choice, ModelChoice)
        names_seen.add(choice.model.name)
        if choice.model.name == name:
            assert len(build_body(choice, {}).assembly.units) == units
    assert name in names_seen


def small(**more: object) -> dict:
    """A box."""
    hull = {
        "nose": [[0.0, 0.0], [3.0, 0.0]],
        "tail": [[0.0, 4.0], [3.0, 4.0]],
        "half": 1.0,
        "top": [[0.0, 2.5], [4.0, 2.5]],
        "bottom": [[0.0, 0.9], [4.0, 0.9]],
        "spacing": 0.2,
        "faces": 200,
    }
    lamps = [
        {"role": "head", "view": "front", "at": [0.7, 1.5], "size": [0.1, 0.1]},
        {"role": "left", "view": "rear", "at": [0.6, 1.0], "size": [0.1, 0.1]},
    ]
    recipe = {"hulls": [hull], "lamps": lamps, **more}
    return {"length": 4.0, "width": 2.0, "height": 2.5, "build": "hull", "recipe": recipe}


def test_a_turned_vehicle_runs_backwards():
    mark = {"kind": "block", "material": "deck", "low": [0.5, 0.3, 1.2], "high": [1.0, 0.5, 1.4]}
    plain, turned = (
        bake_vehicle(small(pieces=[mark])),
        bake_vehicle(small(pieces=[mark], turned=True)),
    )
    low, high = plain.parts["deck"].bounds
    np.testing.assert_allclose(turned.parts["deck"].bounds[0, :2], [-4.0 - high[0], -high[1]])
    assert turned.parts["deck"].bounds[1, 2] == pytest.approx(high[2])
    found = {(lamp.role, round(lamp.at[1], 2)): lamp for lamp in turned.lamps}
    assert set(found) == {("tail", 0.7), ("tail", -0.7), ("left", 0.6), ("right", -0.6)}
    assert found["tail", 0.7].at[0] == pytest.approx(-4.0, abs=0.01)
    assert found["tail", 0.7].yaw == pytest.approx(np.pi)
    assert found["left", 0.6].yaw == pytest.approx(0.0)
    assert low[0] == pytest.approx(-1.0, abs=0.02)


def test_bogies_and_pantographs():
    gear = small(
        bogies=[{"at": 2.0, "base": 1.8}], pantographs=[{"at": 2.0, "foot": 2.5, "top": 4}]
    )
    parts = bake_vehicle(gear).parts
    wheels = parts["wheel_steel"]
    np.testing.assert_allclose(wheels.bounds[:, 0], [-3.36, -0.64], atol=0.02)
    assert parts["galvanised"].bounds[1, 2] == pytest.approx(4.0, abs=0.05)
    hidden = bake_vehicle(small(bogies=[{"at": 2.0, "base": 1.8, "hidden": True}])).parts
    assert len(hidden["bogie"].faces) < 0.6 * len(parts["bogie"].faces)


def test_recipe_errors_name_the_place():
    with pytest.raises(ConfigError, match=r"recipe\.bogies\[0\]: key 'at' is missing"):
        read_hull_vehicle(small(bogies=[{"base": 2.0}]))
    with pytest.raises(ConfigError, match=r"recipe\.pantographs\[0\].*foot"):
        read_hull_vehicle(small(pantographs=[{"at": 2.0, "hat": 2.0}]))
    with pytest.raises(ConfigError, match="wheels"):
        read_hull_vehicle(small(wheels=3))


def test_trams_have_one_pantograph():
    units = [find("vehicles", row["model"]) for row in find("vehicles", "tram").meta["units"]]
    raised = [
        any(part.mesh.bounds[1, 2] > 4.5 for part in body.prototype.parts)
        for entry in units
        for body in fitted_model(entry, {}, ModelChoice(Model.of(entry), "tram", SIZE)).units
    ]
    assert raised == [True, False, False]
