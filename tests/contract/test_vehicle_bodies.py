"""Bodies of vehicles are those that were approved: bit by bit as read, to a nanometre as fitted.

`vehicle_bodies.json` lists them. After a change that is meant,
`python tests/contract/test_vehicle_bodies.py` writes it anew; what differs is then in the diff.
"""

from __future__ import annotations

import ast
import hashlib
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sumo3dviz_pt.cast.choice import Model, ModelChoice
from sumo3dviz_pt.cast.fitting import fitted_model
from sumo3dviz_pt.catalog import find, names
from sumo3dviz_pt.library.vehicles.packed import BODIES, FULL, read_levels
from sumo3dviz_pt.model.scene import Part

ROOT = Path(__file__).resolve().parents[2]
LISTED = Path(__file__).with_name("vehicle_bodies.json")
BAKERS = {"bakers", "bakery", "tools"}
SIZES = ((0.9, 1.1, 0.95), (1.2, 0.95, 1.15))
"""Of vTypes, as shares of the model's own length, width and height."""


def digests(name: str) -> dict[str, str]:
    """Digests of all levels of a vehicle that has bodies of its own."""
    found = {}
    for file in (BODIES, FULL):
        path = find("vehicles", name).folder / file
        for level, meshes in (read_levels(path) if path.is_file() else {}).items():
            digest = hashlib.blake2b(digest_size=8)
            for material, mesh in meshes.items():
                digest.update(material.encode())
                for values in (mesh.vertices, mesh.faces, mesh.normals, mesh.uvs):
                    digest.update(b"" if values is None else values.tobytes())
            found[level] = digest.hexdigest()
    return found


def fitted(name: str) -> list[list[float]]:
    """Sums over all corners of a vehicle's units when it is fitted to vTypes."""
    entry = find("vehicles", name)
    model = Model.of(entry)
    vclass = next(iter(sorted(model.vclasses)), "passenger")
    found = []
    for shares in SIZES:
        length, width, height = (s * own for s, own in zip(shares, model.size, strict=True))
        made = fitted_model(entry, {}, ModelChoice(model, vclass, (length, width, height)))
        near = [part for unit in made.units for part in unit.prototype.parts]
        far = [part for unit in made.units for part in unit.prototype.far]
        found.append([*made.scale.tolist(), *_sums(near), *_sums(far)])
    return found


def _sums(parts: list[Part]) -> list[float]:
    """Count of faces, and mean place and normal of all corners."""
    corners = [part.mesh.vertices[part.mesh.faces].reshape(-1, 3) for part in parts]
    normals = [
        part.mesh.normals[part.mesh.faces].reshape(-1, 3)
        for part in parts
        if part.mesh.normals is not None
    ]
    means = [np.concatenate(some).mean(axis=0).tolist() for some in (corners, normals)]
    return [float(sum(map(len, corners)) // 3), *means[0], *means[1]]


def approved() -> dict[str, Any]:
    """What is listed."""
    listed: dict[str, Any] = json.loads(LISTED.read_text(encoding="utf-8"))
    return listed


PACKED = [n for n in names("vehicles") if (find("vehicles", n).folder / BODIES).is_file()]


def test_every_vehicle_is_listed() -> None:
    assert list(approved()["levels"]) == PACKED
    assert list(approved()["fitted"]) == list(names("vehicles"))


@pytest.mark.parametrize("name", PACKED)
def test_levels_are_the_approved_ones(name: str) -> None:
    assert digests(name) == approved()["levels"][name]


@pytest.mark.parametrize("name", names("vehicles"))
def test_fitted_bodies_are_the_approved_ones(name: str) -> None:
    np.testing.assert_allclose(fitted(name), approved()["fitted"][name], rtol=0.0, atol=1e-9)


def imported(path: Path) -> set[str]:
    """First words of all modules that a module imports, anywhere in it."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            found.add(node.module.split(".")[0])
    return found


def test_nothing_of_the_package_imports_a_bakery() -> None:
    """No wheel holds it. Late imports count too."""
    modules = sorted((ROOT / "sumo3dviz_pt").rglob("*.py"))
    assert modules
    assert not {str(path): imported(path) & BAKERS for path in modules if imported(path) & BAKERS}


def test_bodies_of_all_levels_are_read_without_a_bakery(tmp_path: Path) -> None:
    """From elsewhere, where no folder of tools is in reach."""
    code = (
        "import sys; sys.path.insert(0, sys.argv[1])\n"
        "from sumo3dviz_pt.cast.drawing import full_prototypes\n"
        "from sumo3dviz_pt.cast.fitting import read_vehicle\n"
        "from sumo3dviz_pt.catalog import find\n"
        "assert full_prototypes(['e_scooter'])\n"
        "assert read_vehicle(find('vehicles', 'tram_rear')).far\n"
        "print(sorted({'bakery', 'bakers'} & {name.split('.')[0] for name in sys.modules}))"
    )
    ran = subprocess.run(
        [sys.executable, "-I", "-c", code, str(ROOT)],
        cwd=tmp_path, capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert ran.stdout.strip() == "[]"


if __name__ == "__main__":
    LISTED.write_text(
        json.dumps(
            {
                "levels": {name: digests(name) for name in PACKED},
                "fitted": {name: fitted(name) for name in names("vehicles")},
            },
            indent=1,
        )
        + "\n",
        encoding="utf-8",
    )
