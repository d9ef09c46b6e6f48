"""Vehicles around a rider: the baked files of the catalogue and their builder."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from alike import assert_outward, level_of
from bakery.bake import completed_recipe
from bakery.cycles import build
from coincident import shared_area

from sumo3dviz_pt.catalog import find, names
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.library.materials import MATERIALS
from sumo3dviz_pt.library.people.people import measures
from sumo3dviz_pt.library.people.posture import BONES, joints, matrices
from sumo3dviz_pt.library.vehicles.cycles.rider import CLOTHES, PALM, posture

CYCLES = tuple(
    name for name in names("vehicles") if find("vehicles", name).meta.get("build") == "cycle"
)
CLASSES = {"bicycle", "moped", "motorcycle", "scooter", "rickshaw", "wheelchair"}
SEATED = {"rickshaw", "wheelchair"}
"""Those with two rear wheels, whose riders bend their hips by a right angle."""


files = cache(level_of)


@cache
def completed(name: str):
    return completed_recipe(find("vehicles", name).folder)


@cache
def full(name: str):
    return build.full(completed(name))


def faces_of(meshes) -> int:
    return sum(len(mesh.faces) for mesh in meshes.values())


def bounds_of(meshes):
    bounds = np.stack([mesh.bounds for mesh in meshes.values()])
    return bounds[:, 0].min(axis=0), bounds[:, 1].max(axis=0)


def test_every_class_has_one_and_they_are_small():
    assert {find("vehicles", name).meta["vclass"] for name in CYCLES} == CLASSES
    folders = [find("vehicles", name).folder for name in CYCLES]
    assert sum(path.stat().st_size for f in folders for path in f.iterdir()) < 2.0e6


@pytest.mark.parametrize("name", CYCLES)
class TestEveryCycle:
    @pytest.mark.parametrize(("level", "most"), [("parts", 12_000), ("far", 1000)])
    def test_keeps_its_budget(self, name, level, most):
        assert most / 4 < faces_of(files(name, level)) < most

    def test_its_full_detail_has_a_wheel_of_its_own(self, name):
        made = full(name)
        assert faces_of(made.body) + 2 * faces_of(made.wheel) < 80_000
        low, high = bounds_of(made.wheel)
        radius = find("vehicles", name).meta["wheels"][0]["radius"]
        np.testing.assert_allclose([low[2], high[2]], [-radius, radius], atol=0.004)
        assert abs(low[1] + high[1]) < 0.08

    @pytest.mark.parametrize("level", ["parts", "far"])
    def test_is_as_large_as_it_says(self, name, level):
        meta = find("vehicles", name).meta
        low, high = bounds_of(files(name, level))
        slack = 0.02 if level == "parts" else 0.09
        assert low[2] == pytest.approx(0.0, abs=0.012)
        assert high[0] == pytest.approx(0.0, abs=slack)
        assert low[0] == pytest.approx(-meta["length"], abs=slack)
        assert high[2] == pytest.approx(meta["height"], abs=slack)
        assert high[1] - low[1] <= meta["width"] + slack

    @pytest.mark.parametrize("level", ["parts", "far", "body", "wheel"])
    def test_has_no_empty_faces_and_normals_point_outward(self, name, level):
        meshes = files(name, level) if level in ("parts", "far") else getattr(full(name), level)
        assert set(meshes) <= set(MATERIALS)
        for mesh in meshes.values():
            least = 0.85 if level == "far" else 0.93 if name in SEATED else 0.95
            assert_outward(mesh, least=least, smallest=1e-11)

    def test_no_two_materials_have_faces_in_one_place(self, name):
        shared = shared_area(files(name, "parts"))
        assert max(shared.values(), default=0.0) < 1e-5, shared

    def test_closed_pieces_are_not_inside_out(self, name):
        for material in ("rubber", "trim"):
            mesh = files(name, "parts")[material]
            a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
            assert (a * np.cross(b, c)).sum() > 0

    def test_wheels_stand_on_the_ground(self, name):
        meta = find("vehicles", name).meta
        *front, rear = meta["wheels"]
        if name in SEATED:
            left = front.pop()
            assert rear["at"] == [left["at"][0], -left["at"][1], left["at"][2]]
        assert all(place["steered"] for place in front) and not rear["steered"]
        assert all(place["at"][0] > rear["at"][0] for place in front)
        for place in meta["wheels"]:
            assert place["at"][2] == place["radius"]

    def test_lamps_are_where_light_comes_from(self, name):
        meta = find("vehicles", name).meta
        roles = {lamp["role"] for lamp in meta["lamps"]}
        assert {"head", "tail"} <= roles or meta["vclass"] == "wheelchair"
        if meta["vclass"] in ("moped", "motorcycle", "rickshaw"):
            assert {"brake", "left", "right"} <= roles
        for lamp in meta["lamps"]:
            x, ahead = lamp["at"][0], abs(lamp["yaw"]) < 1.0
            assert -meta["length"] - 0.02 < x < 0.0
            assert ahead == (x > -0.5 * meta["length"])

    def test_the_rider_sits_and_holds(self, name):
        """Hips, hands and feet are within 4 cm of saddle, grips and pedals."""
        machine = build.machine_of(completed(name))
        body = measures(completed(name)["recipe"]["rider"])
        rest, grasp = joints(body), machine.grasp
        posed = dict(zip(BONES, matrices(body, posture(grasp)), strict=True))

        def carried(bone: str, point):
            return posed[bone][:, :3] @ point + posed[bone][:, 3]

        np.testing.assert_allclose(carried("pelvis", rest["pelvis"]), grasp.hips, atol=0.001)
        for side, s in (("l", 1.0), ("r", -1.0)):
            wrist, finger = rest[f"hand_{side}"], rest[f"finger_{side}"]
            along = (finger - wrist) / np.linalg.norm(finger - wrist)
            palm = np.array([0.0, -s, 0.0])
            palm -= (palm @ along) * along
            held = (
                carried(f"forearm_{side}", wrist),
                wrist + PALM[0] * along + PALM[1] * palm / np.linalg.norm(palm),
            )
            assert np.linalg.norm(held[0] - carried(f"hand_{side}", wrist)) < 0.02
            grip = np.array(grasp.grip) * [1.0, s, 1.0]
            assert np.linalg.norm(carried(f"hand_{side}", held[1]) - grip) < 0.04
            ball = rest[f"toes_{side}"] * [1.0, 1.0, 0.0]
            foot = grasp.feet[0 if side == "l" else 1]
            assert np.linalg.norm((carried(f"foot_{side}", ball) - foot)[[0, 2]]) < 0.04
            ankle = rest[f"foot_{side}"]
            reach = carried(f"shank_{side}", ankle) - carried(f"foot_{side}", ankle)
            assert np.linalg.norm(reach) < 0.02


def test_clothes_have_the_colours_that_riders_are_sorted_by():
    for name, colour in CLOTHES.items():
        assert tuple(MATERIALS[name]["base_color"]["value"]) == colour


def test_recipe_errors_name_the_place():
    with pytest.raises(ConfigError, match=r"recipe\.model: .*unicycle"):
        build.machine_of({"recipe": {"model": "unicycle"}})
    with pytest.raises(ConfigError, match=r"recipe: unknown key 'wings'"):
        build.machine_of({"recipe": {"model": "bicycle", "wings": 2}})
    moped = completed("moped")["recipe"]
    cone = {"kind": "cone", "material": "paint"}
    with pytest.raises(ConfigError, match=r"recipe\.pieces\[0\]: .*cone"):
        build.machine_of({"recipe": {**moped, "pieces": [cone]}})
