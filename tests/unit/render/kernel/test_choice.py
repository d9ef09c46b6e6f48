"""Which emitter a path aims at, by the place that is lit."""

from __future__ import annotations

import numpy as np
import pytest

pytestmark = pytest.mark.usefixtures("compiled")

COUNT, SAMPLES = 5, 200_000


def choice(*, placed: bool = True, dark: bool = False):
    import drjit as dr
    import mitsuba as mi

    from sumo3dviz_pt.render.kernel.lights import CELLS, EmitterChances

    rng = np.random.default_rng(3)
    given = np.zeros((COUNT, CELLS**2)) if dark else rng.exponential(size=(COUNT, CELLS**2)) ** 4
    given[2] = 0.0
    made = EmitterChances(COUNT, placed=placed)
    table = mi.Float(given.astype(np.float32).ravel())

    def power(number, column, line):
        return dr.gather(mi.Float, table, (number * CELLS + line) * CELLS + column)

    made.follow(np.array([1.0, 2.0, 0.5, 0.0, 0.5]), power, np.array([-20.0, -10.0, 0.5]))
    return made


@pytest.mark.parametrize(("placed", "dark"), [(True, False), (True, True), (False, True)])
@pytest.mark.parametrize("at", [(-19.0, -9.0), (30.0, 75.0), (500.0, -500.0)])
def test_what_is_picked_has_the_chance_that_is_said(placed, dark, at) -> None:
    import drjit as dr
    import mitsuba as mi

    made = choice(placed=placed, dark=dark)
    place = mi.Point3f(*at, 1.0)
    chances = np.array([made.chance(mi.UInt32(k), place, mi.Bool(True))[0] for k in range(COUNT)])
    assert chances.sum() == pytest.approx(1.0, abs=1e-5)
    assert chances[2] > 0.0  # what the table leaves out is aimed at, too
    sample = mi.Point2f((dr.arange(mi.Float, SAMPLES) + 0.5) / SAMPLES, 0.5)
    number, chance, left = made.pick(sample, place, mi.Bool(True))
    shares = np.bincount(np.array(number), minlength=COUNT) / SAMPLES
    np.testing.assert_allclose(shares, chances, atol=2e-5)
    np.testing.assert_allclose(np.array(chance), chances[np.array(number)], rtol=1e-6)
    rest = np.array(left.x)
    assert rest.min() >= 0.0
    assert rest.max() < 1.0
    often = np.array(number) == shares.argmax()
    assert rest[often].mean() == pytest.approx(0.5, abs=0.01)
