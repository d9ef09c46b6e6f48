"""Concrete and noise barriers, wire and wooden fences."""

import numpy as np
import pytest

from sumo3dviz_pt.library.street.barriers import MODELS, concrete, noise, resampled, swept

LINE = resampled(np.array([(0.0, 0, 0), (40.0, 0, 0), (80.0, 6.0, 1.0)]))
SQUARE = np.array([(-0.5, 0.0), (0.5, 0.0), (0.5, 1.0), (-0.5, 1.0)])


def volume(mesh):
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    return float((a * np.cross(b, c)).sum() / 6.0)


@pytest.mark.parametrize("level", [0, 1, 2])
@pytest.mark.parametrize("name", MODELS)
def test_faces_have_an_area_and_agree_with_their_normals(name, level):
    for part in MODELS[name](LINE, level=level):
        mesh = part.mesh
        a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
        flat = np.cross(b - a, c - a)
        assert np.linalg.norm(flat, axis=1).min() > 1e-9
        assert ((flat * mesh.normals[mesh.faces[:, 0]]).sum(axis=1) > 0).all()


@pytest.mark.parametrize("name", MODELS)
def test_far_levels_are_cheaper(name):
    counts = [sum(len(p.mesh.faces) for p in MODELS[name](LINE, level=k)) for k in (0, 1, 2)]
    assert counts[0] > counts[1] > counts[2]
    assert counts[0] < 7000


@pytest.mark.parametrize("turn", [1, -1])
def test_a_swept_square_is_a_closed_box(turn):
    line = np.array([(0.0, 0, 0), (2, 0, 0), (4, 0, 0)])
    assert volume(swept(line, SQUARE[::turn])) == pytest.approx(4.0)


def test_closed_barriers_have_the_volume_of_their_profile():
    straight = np.column_stack([np.arange(0, 42, 2.0), np.zeros((21, 2))])
    (part,) = concrete(straight, ends=(False, False))
    assert 0.25 * 40 < volume(part.mesh) < 0.5 * 40
    foot, panels, _ = noise(straight)
    assert volume(foot.mesh) == pytest.approx(0.14 * 0.75 * 40)
    assert 0.2 * 40 < volume(panels.mesh) < 0.12 * 2.6 * 40


def test_concrete_comes_down_at_its_ends_only():
    (whole,), (middle,) = concrete(LINE), concrete(LINE, ends=(False, False))
    first = [mesh.vertices[np.abs(mesh.vertices[:, 0]) < 0.01, 2].max()
             for mesh in (whole.mesh, middle.mesh)]  # fmt: skip
    assert first[0] < 0.25 and first[1] == pytest.approx(0.81)


def test_heights():
    straight = np.column_stack([np.arange(0, 42, 2.0), np.zeros((21, 2))])
    tall = {
        name: max(part.mesh.vertices[:, 2].max() for part in make(straight))
        for name, make in MODELS.items()
    }
    wanted = {"concrete_barrier": 0.81, "noise_barrier": 3.04, "chain_link": 1.55, "wooden": 1.2}
    assert tall == pytest.approx(wanted)
