"""Lamps of every vehicle can be seen, on the detailed body and on its stand-in."""

from __future__ import annotations

from dataclasses import replace

import mitsuba as mi
import numpy as np
import pytest

from sumo3dviz_pt import catalog
from sumo3dviz_pt.cast.fitting import read_vehicle
from sumo3dviz_pt.model.geometry import Mesh
from sumo3dviz_pt.model.scene import Part, VehicleLamp
from sumo3dviz_pt.render.backend import choose_backend
from sumo3dviz_pt.render.lights.running import clear_lamps

SHINING = [
    name for name in catalog.names("vehicles") if catalog.find("vehicles", name).meta.get("lamps")
]
AROUND = np.radians([0.0, 20.0, -20.0])
AIRLINERS = {"airliner", "airliner_large"}
SHIPS = {"boat", "ferry", "ship"}
"""Landing lights in the roots of wings are hidden by the hull from the side, and the lanterns of
ships lie in the merged walls of stand-ins, which are seen from hundreds of metres only."""


def read(name, level):
    body = read_vehicle(catalog.find("vehicles", name))
    return body.lamps, getattr(body, level)


def scene_of(parts):
    """The parts as a scene that rays can be cast into."""
    shapes = {}
    for k, part in enumerate(parts):
        mesh = mi.Mesh(f"m{k}", len(part.mesh.vertices), len(part.mesh.faces))
        values = mi.traverse(mesh)
        values["vertex_positions"] = part.mesh.vertices.ravel().astype(np.float32)
        values["faces"] = part.mesh.faces.ravel().astype(np.uint32)
        values.update()
        shapes[f"m{k}"] = mesh
    return mi.load_dict({"type": "scene", **shapes})


def seen(scene, lamps, towards):
    """Share of each lamp that an eye far away sees, (lamps,)."""
    rng = np.random.default_rng(1)
    radius, turn = np.sqrt(rng.random(150)) * 0.92, rng.random(150) * 2 * np.pi
    starts, ways = [], []
    for lamp in lamps:
        forward = np.array([np.cos(lamp.yaw), np.sin(lamp.yaw), 0.0])
        left = np.array([-forward[1], forward[0], 0.0])
        across = 0.5 * lamp.size[0] * (radius * np.cos(turn))[:, None] * left
        up = 0.5 * lamp.size[1] * (radius * np.sin(turn))[:, None] * np.array([0.0, 0.0, 1.0])
        starts.append(np.array(lamp.at) + across + up + 1e-4 * forward)
        yaw = towards + (0.0 if abs(lamp.yaw) < np.pi / 2 else np.pi)
        ways.append(np.tile([np.cos(yaw), np.sin(yaw), 0.0], (150, 1)))
    rays = [np.concatenate(some).T.astype(np.float32) for some in (starts, ways)]
    hidden = np.array(scene.ray_test(mi.Ray3f(mi.Point3f(rays[0]), mi.Vector3f(rays[1]))))
    return 1.0 - hidden.reshape(len(lamps), -1).mean(axis=1)


@pytest.mark.parametrize("level", ["parts", "far"])
@pytest.mark.parametrize("name", SHINING)
def test_the_lamps_of_a_vehicle_are_seen(name, level):
    choose_backend("llvm")
    lamps, parts = read(name, level)
    cleared = clear_lamps(lamps, parts)
    scene = scene_of(parts)
    for towards in AROUND:
        shares = seen(scene, cleared, towards)
        for lamp, share in zip(cleared, shares, strict=True):
            if lamp.role == "sign" and level == "far" and name in SHIPS:
                continue
            if lamp.role == "head" and towards and name in AIRLINERS:
                continue
            # Corner indicators look to their own side; the body may hide them from the other.
            least = 0.5 if lamp.role in ("left", "right") and towards else 0.8
            assert share >= least, (lamp, round(float(np.degrees(towards))))
    moved = [np.subtract(a.at, b.at) for a, b in zip(lamps, cleared, strict=True)]
    assert np.linalg.norm(moved, axis=1).max() < 0.14


def wall(x):
    corners = np.array([[x, -1, 0], [x, 1, 0], [x, 1, 2], [x, -1, 2]], float)
    return Part(Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]])), "m")


@pytest.mark.parametrize("yaw", [0.0, np.pi])
def test_a_buried_lamp_comes_out_where_it_shines(yaw):
    way = np.cos(yaw)
    lamp = VehicleLamp("head", (0.0, 0.3, 1.0), (0.2, 0.1), yaw)
    (out,) = clear_lamps([lamp], [wall(0.05 * way), wall(1.0 * way)])
    assert out.at == pytest.approx((0.054 * way, 0.3, 1.0), abs=1e-6)
    assert replace(out, at=lamp.at) == lamp


@pytest.mark.parametrize("x", [-0.05, 0.3])
def test_a_free_lamp_stays(x):
    lamp = VehicleLamp("head", (0.0, 0.3, 1.0), (0.2, 0.1), 0.0)
    assert clear_lamps([lamp], [wall(x)]) == (lamp,)
    assert clear_lamps([lamp], []) == (lamp,)
