"""Whether two meshes show the same, and whether one is sound: its faces, normals and surfaces."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import shapely
import yaml
from matplotlib.image import imread

from sumo3dviz_pt.catalog import find
from sumo3dviz_pt.image.exr import read_exr
from sumo3dviz_pt.library.vehicles.packed import BODIES, FULL, read_levels
from sumo3dviz_pt.model.geometry import Floats, Mesh

NEAR = 1e-3
"""Surfaces nearer than this are the same [m]."""

MORE = 0.02
"""By what share the counts of faces and vertices may differ."""


def assert_alike(new: Mesh, old: Mesh) -> None:
    """Both have about as many faces, and no point of one lies off the other."""
    for one, other in ((len(new.faces), len(old.faces)), (len(new.vertices), len(old.vertices))):
        assert abs(one - other) <= MORE * other, (one, other)
    for one, other in ((new, old), (old, new)):
        away = distances(samples(one), other, reach=NEAR)
        assert np.isfinite(away).all(), f"{(~np.isfinite(away)).mean():.2%} of the samples lie off"


def assert_outward(mesh: Mesh, *, least: float = 0.99, smallest: float = 0.0) -> None:
    """All faces have an area, and normals of length 1 point to where their faces look.

    Args:
        mesh: What is looked at.
        least: Share of corners whose normals do; slivers of a square tenth of a millimetre aside.
        smallest: Every face has more than half of this [m2].
    """
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    flat = np.cross(b - a, c - a)
    size = np.linalg.norm(flat, axis=1)
    assert size.min() > smallest
    agree = (flat[:, None] * mesh.normals[mesh.faces]).sum(axis=2)[size > 1e-8] > 0
    assert agree.mean() > least
    np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=1), 1.0, atol=1e-5)


def level_of(name: str, level: str) -> Mapping[str, Mesh]:
    """Meshes of a vehicle of the catalogue by material: `parts`, `far`, `full` or `wheel`."""
    file = FULL if level in ("full", "wheel") else BODIES
    return read_levels(find("vehicles", name).folder / file)[level]


def assert_files_alike(new: Path, old: Path) -> None:
    """Two folders of a baked vehicle hold the same meshes, lamps and wheels."""
    names = {path.name for path in old.glob("*.xz")}
    assert {path.name for path in new.glob("*.xz")} == names
    for name in sorted(names):
        made, there = read_levels(new / name), read_levels(old / name)
        assert {level: [*made[level]] for level in made} == {lv: [*there[lv]] for lv in there}
        for level, meshes in there.items():
            for material, mesh in meshes.items():
                assert_alike(made[level][material], mesh)
    one, other = (
        yaml.safe_load((folder / "baked.yaml").read_text(encoding="utf-8")) for folder in (new, old)
    )
    assert set(one) == set(other)
    for level in {"parts", "far", "full", "wheel"} & set(other):
        assert [*one[level]] == [*other[level]]
    for kind in ("lamps", "wheels"):
        assert len(one[kind]) == len(other[kind])
        for row, same in zip(one[kind], other[kind], strict=True):
            _assert_near(row, same)


def assert_assets_alike(new: Path, old: Path) -> None:
    """Two folders of an asset hold the same, whatever its family; pictures to a code of 255."""
    names = {path.name for path in old.iterdir()}
    assert {path.name for path in new.iterdir()} == names
    assert (new / "asset.yaml").read_bytes() == (old / "asset.yaml").read_bytes()
    for name in sorted(names):
        if name.endswith(".exr"):
            one, other = (read_exr(folder / name)[0] for folder in (new, old))
            np.testing.assert_allclose(one, other, rtol=2e-3, atol=1e-4)
        if name.endswith(".png"):
            one, other = (255 * imread(folder / name) for folder in (new, old))
            assert one.shape == other.shape and np.abs(one - other).max() < 1.5, name
    if "baked.yaml" in names:
        assert_files_alike(new, old)


def _assert_near(one: Mapping[str, Any], other: Mapping[str, Any]) -> None:
    """Two rows of a listing say the same, their numbers within a millimetre."""
    assert set(one) == set(other)
    for key, value in one.items():
        if isinstance(value, float | list):
            np.testing.assert_allclose(value, other[key], atol=NEAR)
        else:
            assert value == other[key], key


def samples(mesh: Mesh) -> Floats:
    """Corners of all faces, and points on them, (n, 3) [m]."""
    corners = mesh.vertices[mesh.faces]
    return np.concatenate([mesh.vertices[np.unique(mesh.faces)], corners.mean(axis=1)])


def distances(points: Floats, mesh: Mesh, *, reach: float) -> Floats:
    """Distances of points, (n, 3), from a mesh, (n,) [m]; infinite beyond a reach."""
    corners = mesh.vertices[mesh.faces]
    low, high = corners.min(axis=1)[:, :2] - reach, corners.max(axis=1)[:, :2] + reach
    tree = shapely.STRtree(shapely.box(*low.T, *high.T))
    which, face = tree.query(shapely.points(points[:, :2]))
    found = np.full(len(points), np.inf)
    np.minimum.at(found, which, _from_triangles(points[which], corners[face]))
    return np.where(found <= reach, found, np.inf)


def _from_triangles(points: Floats, corners: Floats) -> Floats:
    """Distances of points, (k, 3), each from a triangle of its own, (k, 3, 3), (k,) [m]."""
    found = np.min([_from_sides(points, corners[:, k], corners[:, k - 2]) for k in range(3)], 0)
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normal = np.cross(first, second)
    area = np.maximum((normal * normal).sum(axis=1), 1e-30)
    offset = points - corners[:, 0]
    u = (np.cross(offset, second) * normal).sum(axis=1) / area
    v = (np.cross(first, offset) * normal).sum(axis=1) / area
    above = np.abs((offset * normal).sum(axis=1)) / np.sqrt(area)
    return np.where((u >= 0) & (v >= 0) & (u + v <= 1), np.minimum(above, found), found)


def _from_sides(points: Floats, starts: Floats, ends: Floats) -> Floats:
    """Distances of points, (k, 3), each from a line of its own, (k,) [m]."""
    along = ends - starts
    length = np.maximum((along * along).sum(axis=1), 1e-30)
    share = np.clip(((points - starts) * along).sum(axis=1) / length, 0.0, 1.0)
    return np.linalg.norm(points - starts - share[:, None] * along, axis=1)
