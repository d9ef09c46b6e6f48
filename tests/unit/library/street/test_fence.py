"""Guard rails."""

import numpy as np
import pytest

from sumo3dviz_pt.library.street.barriers import STEP, end_drop, fence, resampled

LINE = np.array([(0.0, 0, 0), (40.0, 0, 0), (80.0, 6.0, 1.0)])


def test_the_curve_goes_through_its_points_without_kinks():
    line = resampled(LINE)
    for point in LINE:
        assert np.linalg.norm(line - point, axis=1).min() < 1.1
    turns = np.diff(np.unwrap(np.arctan2(*np.diff(line[:, :2], axis=0).T[::-1])))
    assert np.abs(turns).max() < 0.03
    steps = np.linalg.norm(np.diff(line, axis=0), axis=1)
    assert steps == pytest.approx(np.full(len(steps), STEP), rel=0.1)
    assert len(line) % 2 == 1


def test_straight_lines_stay_straight():
    assert np.abs(resampled(LINE[:2])[:, 1]).max() < 1e-12


def test_repeated_points_do_no_harm_and_a_point_is_no_fence():
    doubled = np.repeat(LINE, 2, axis=0)
    assert np.allclose(resampled(doubled), resampled(LINE))
    with pytest.raises(ValueError, match="two different points"):
        resampled(np.zeros((3, 3)))


def test_ends_come_down_to_the_ground():
    line = resampled(LINE)
    drop = end_drop(line)
    assert drop[0] == drop[-1] > 0.76
    assert drop[len(drop) // 2] == 0.0
    mesh = fence(line, drop)
    start = mesh.vertices[np.abs(mesh.vertices[:, 0]) < 0.06]
    assert start[:, 2].max() < 0.0, "the end of the beam is in the ground"
    assert mesh.vertices[:, 2].min() < -0.4


@pytest.mark.parametrize(("level", "most"), [(0, 60), (1, 20), (2, 3)])
def test_triangles_per_four_metres(level, most):
    line = resampled(LINE)
    mesh = fence(line, end_drop(line), level=level)
    assert len(mesh.faces) / 20 <= most
    assert np.allclose(np.linalg.norm(mesh.normals, axis=1), 1.0)


@pytest.mark.parametrize("side", [1, -1])
def test_beams_stand_on_their_side_and_faces_agree_with_normals(side):
    line = resampled(LINE[:2])
    mesh = fence(line, np.zeros(len(line)), sides=(side,), level=0)
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    flat = np.cross(b - a, c - a)
    assert ((flat * mesh.normals[mesh.faces[:, 0]]).sum(axis=1) > -1e-6).all()
    assert side * mesh.vertices[np.argmax(np.abs(mesh.vertices[:, 1])), 1] > 0.1


def test_pieces_join():
    line = resampled(LINE)
    drop = end_drop(line)
    whole = fence(line, drop, level=2).vertices
    first, second = fence(line[:21], drop[:21], level=2), fence(line[20:], drop[20:], level=2)
    joint = [
        m.vertices[np.argsort(np.linalg.norm(m.vertices - (*line[20, :2], 0.6), axis=1))[:2]]
        for m in (first, second)
    ]
    assert np.abs(np.sort(joint[0], axis=0) - np.sort(joint[1], axis=0)).max() < 0.02
    assert len(whole) > 0
