"""Plain bodies of all classes."""

from __future__ import annotations

import numpy as np
import pytest

from sumo3dviz_pt.library.vehicles.plain_bodies import plain_body
from sumo3dviz_pt.sumo.types import CLASS_DEFAULTS

SIZES = {name: (c.length, c.width, c.height) for name, c in CLASS_DEFAULTS.items()}
CASES = [
    *((name, size) for name, size in SIZES.items()),
    ("bus", (18.0, 2.55, 3.0)),
    ("truck", (12.0, 2.5, 3.8)),
    ("rail", (400.0, 2.9, 4.0)),
    ("tram", (8.0, 2.4, 3.2)),
    ("pedestrian", (0.2, 0.5, 1.7)),
    ("unheard of", (3.0, 2.0, 1.0)),
]


def checked(parts, size):
    vertices = np.concatenate([part.mesh.vertices for part in parts])
    length, width, height = size
    np.testing.assert_allclose(vertices.min(axis=0), [-length, -width / 2, 0], atol=1e-6)
    np.testing.assert_allclose(vertices.max(axis=0), [0, width / 2, height], atol=1e-6)
    for part in parts:
        mesh = part.mesh
        a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
        normals = np.cross(b - a, c - a)
        assert ((normals[:, None] * mesh.normals[mesh.faces]).sum(2) > 0).mean() > 0.99
    return sum(len(part.mesh.faces) for part in parts)


@pytest.mark.parametrize(("vclass", "size"), CASES, ids=lambda v: str(v))
def test_size_normals_and_budget(vclass, size):
    length, width, height = size
    body = plain_body(vclass, length=length, width=width, height=height)
    assert body.name == vclass
    assert checked(body.parts, size) <= 1500
    assert checked(body.far, size) <= 200


def test_what_rolls_has_wheels():
    def materials(vclass):
        length, width, height = SIZES[vclass]
        body = plain_body(vclass, length=length, width=width, height=height)
        return {part.material for part in body.parts}

    for vclass in ("bus", "trailer", "tram", "bicycle"):
        assert materials(vclass) == {"paint", "rubber"}
    for vclass in ("container", "aircraft", "ship"):
        assert materials(vclass) == {"paint"}
