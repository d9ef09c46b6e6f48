"""A thin pane: what it reflects and what it lets through is never more than there was."""

from __future__ import annotations

import numpy as np
import pytest

from sumo3dviz_pt.model.falling import GLASS, Pane, reflectance, reflected_share, reflection_samples
from sumo3dviz_pt.model.geometry import Transform

COSINES = np.linspace(0.0, 1.0, 1001)


def test_reflectance_is_a_share_and_grows_towards_grazing():
    found = reflectance(COSINES)
    assert ((found >= 0.0) & (found <= 1.0)).all()
    assert found[0] == pytest.approx(1.0)
    # Of both faces of a pane that is seen straight on: 8 %.
    one = ((GLASS - 1.0) / (GLASS + 1.0)) ** 2
    assert found[-1] == pytest.approx(2.0 * one / (1.0 + one)) == pytest.approx(0.082, abs=1e-3)
    assert (np.diff(found) <= 1e-12).all()


def test_reflectance_is_that_of_a_series_of_reflections():
    """Light to and fro between both faces: r + t^2 r (1 + r^2 + r^4 ...)."""
    cosine = np.array([0.3, 0.6, 0.9])
    whole = reflectance(cosine)
    one = whole / (2.0 - whole)
    series = one + (1.0 - one) ** 2 * one * sum(one ** (2 * k) for k in range(60))
    np.testing.assert_allclose(series, whole, rtol=1e-9)


def upright(at, *, size=(2.0, 1.0)):
    """A pane across the x axis, its foot at a place."""
    frame = np.eye(4)
    frame[:3, 0], frame[:3, 1] = (0, 1, 0), (0, 0, 1)
    frame[:3, 2] = np.cross(frame[:3, 0], frame[:3, 1])
    frame[:3, 3] = at
    return Pane(Transform(frame), size)


def share(pane, directions, distance=np.inf):
    directions = np.array([directions], dtype=float)
    directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
    far = np.full(directions.shape[:2], distance)
    return reflected_share(pane, np.zeros(3), directions, far)[0]


def test_a_pane_reflects_where_it_is_before_the_eye():
    pane = upright((2.0, 0.0, -0.5))
    ahead, aside, back, over = share(pane, [(1, 0, 0), (1, 2, 0), (-1, 0, 0), (1, 0, 0.5)])
    assert ahead == pytest.approx(reflectance(np.ones(1))[0], rel=1e-6)
    assert aside == back == over == 0.0


def test_what_is_nearer_than_the_pane_hides_it():
    pane = upright((2.0, 0.0, -0.5))
    assert share(pane, [(1, 0, 0)], 1.9)[0] == 0.0 < share(pane, [(1, 0, 0)], 2.1)[0]


def test_a_pane_fades_at_its_edges():
    pane = upright((2.0, 0.0, -0.5))
    inner, outer = share(pane, [(1, 0, 0.2), (1, 0, 0.245)])
    assert 0.0 < outer < 0.5 * inner


def test_a_reflection_takes_a_quarter_of_the_samples():
    assert [reflection_samples(count) for count in (1, 4, 64)] == [2, 2, 16]
