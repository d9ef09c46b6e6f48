"""Bicycles whose riders pedal."""

import numpy as np
import pytest

from sumo3dviz_pt.catalog import find
from sumo3dviz_pt.library.vehicles.cycles.pedalling import PHASES, pedalling, pedals

BICYCLES = ("bicycle", "bicycle_sport", "bicycle_step", "bicycle_summer")


@pytest.fixture(scope="module", params=BICYCLES)
def made(request):
    return pedalling(find("vehicles", request.param).meta)


def spans(parts):
    """Where each part's vertices are among those of the poses."""
    ends = np.cumsum([len(part.mesh.vertices) for part in parts])
    return [slice(end - len(p.mesh.vertices), end) for p, end in zip(parts, ends, strict=True)]


def test_rest_and_one_turn_with_unit_normals(made):
    parts, poses = made
    count = sum(len(part.mesh.vertices) for part in parts)
    assert poses.vertices.shape == poses.normals.shape == (PHASES + 1, count, 3)
    np.testing.assert_allclose(np.linalg.norm(poses.normals, axis=2), 1.0, atol=1e-6)
    at_rest = np.concatenate([part.mesh.vertices for part in parts])
    np.testing.assert_allclose(poses.vertices[0], at_rest)


def test_frame_and_wheels_stay_and_shoes_go_round(made):
    parts, poses = made
    places = spans(parts)
    for part, where in zip(parts, places, strict=True):
        if part.material == "rubber":
            assert np.ptp(poses.vertices[:, where], axis=0).max() == 0.0
    leather = [w for p, w in zip(parts, places, strict=True) if p.material == "leather"]
    low = np.concatenate([poses.vertices[1:, where] for where in leather], axis=1)
    low = low[:, (low[0, :, 2] < 0.7) & (low[0, :, 1] > 0.0)].mean(axis=1)
    way = np.linalg.norm(np.diff(low[:, [0, 2]], axis=0, append=low[:1, [0, 2]]), axis=1)
    assert way.sum() == pytest.approx(2.0 * np.pi * 0.17, rel=0.12)


def test_everything_stays_on_the_ground_and_in_shape(made):
    _, poses = made
    assert poses.vertices[..., 2].min() > -0.01
    height = poses.vertices[..., 2].max(axis=1)
    assert np.ptp(height) < 0.03


@pytest.mark.parametrize(
    ("name", "does"), [("bicycle", True), ("e_scooter", False), ("suv", False)]
)
def test_who_pedals(name, does):
    assert pedals(find("vehicles", name).meta) is does
