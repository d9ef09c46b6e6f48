"""Dirt on painted bodies."""

import numpy as np
import pytest
from bakery.grime import MOST, Dirt, grimed

from sumo3dviz_pt.model.geometry import Mesh

DIRT = Dirt(length=4.5, low=0.16, axles=(0.9, 3.6), radius=0.33)


def dirt(*points, normal=(0.0, 1.0, 0.0)):
    vertices = np.array(points, dtype=float)
    normals = np.tile(np.array(normal, dtype=float), (len(points), 1))
    mesh = Mesh(vertices, np.zeros((0, 3), np.int64), normals)
    return grimed(mesh, DIRT).uvs[:, 1]


def around(x, z, **given):
    """The mean about a place, without patches."""
    steps = np.linspace(-0.05, 0.05, 7)
    return dirt(*[(x + a, 0.9, z + b) for a in steps for b in steps], **given).mean()


def test_sills_are_dirtier_than_doors_and_roofs_are_clean():
    assert around(-2.2, 0.25) > 3.0 * around(-2.2, 0.8)
    assert around(-2.2, 1.4) < 0.02
    assert around(-2.2, 0.9, normal=(0.0, 0.0, 1.0)) < around(-2.2, 0.9)


def test_spray_lies_behind_wheels():
    assert around(-1.35, 0.4) > 1.5 * around(-0.4, 0.4)
    assert around(-4.3, 0.5, normal=(-1.0, 0.0, 0.0)) > around(-0.1, 0.5, normal=(1.0, 0.0, 0.0))


@pytest.mark.parametrize("seed", range(3))
def test_dirt_is_a_share(seed):
    points = np.random.default_rng(seed).uniform([-4.5, -0.9, 0.1], [0, 0.9, 1.5], (400, 3))
    covered = dirt(*points)
    assert covered.min() >= 0.0 and covered.max() <= MOST
