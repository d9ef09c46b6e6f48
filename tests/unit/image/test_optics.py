"""Vignetting and grain."""

from dataclasses import asdict, replace

import numpy as np
import pytest

from sumo3dviz_pt.image.optics import Optics, grained
from sumo3dviz_pt.model.lens import Lens

EVEN = np.full((60, 100, 3), 0.4, np.float32)


def test_a_lens_without_faults_does_nothing():
    assert Optics.of(Lens(1.0), vignetting=0.0, grain=0.0) is None
    assert Optics.from_dict(None) is None


@pytest.mark.parametrize("degrees", [30.0, 90.0])
def test_light_falls_with_the_fourth_power_of_the_cosine(degrees):
    lens = Lens.of_degrees(degrees)
    seen = Optics.of(lens, vignetting=1.0, grain=0.0).on(EVEN, exposure=0.0, seed=1)
    cosine = lens.rays((100, 60))[..., 0]
    np.testing.assert_allclose(seen[..., 1], 0.4 * cosine**4, rtol=1e-5)


def test_each_eye_has_its_own_vignette():
    lens = replace(Lens.of_degrees(90.0), stereo="side_by_side")
    seen = Optics.of(lens, vignetting=1.0, grain=0.0).on(EVEN, exposure=0.0, seed=1)
    np.testing.assert_array_equal(seen[:, :50], seen[:, 50:])
    assert seen[30, 25, 0] > 0.99 * 0.4 > 2 * seen[0, 0, 0]


def test_an_account_gives_the_same_optics():
    optics = Optics.of(Lens(1.0, stereo="top_bottom"), vignetting=0.5, grain=0.2)
    said = asdict(optics)
    said["eyes"] = list(said["eyes"])
    assert Optics.from_dict(said) == optics


def test_grain_keeps_the_mean_and_is_a_function_of_the_seed():
    grey = np.full((400, 600, 3), 0.5, np.float32)
    one, again, other = (grained(grey, 0.5, seed) for seed in (1, 1, 2))
    np.testing.assert_array_equal(one, again)
    assert np.abs(one - other).max() > 0.01
    assert one.mean() == pytest.approx(0.5, abs=1e-3)
    assert one.std() == pytest.approx(0.5 * 0.5 * 0.12, rel=0.1)
    np.testing.assert_array_equal(one[..., 0], one[..., 2])
    for end in (0.0, 1.0):
        np.testing.assert_array_equal(grained(np.full_like(grey, end), 1.0, 3), end)
