"""Drops and flakes against what was measured of them."""

import numpy as np
import pytest

from sumo3dviz_pt.model.falling import (
    drop_speed,
    flake_diameter,
    flake_speed,
    rain_sizes,
    snow_sizes,
)

GUNN_KINZER = {0.5: 2.06, 1.0: 4.03, 2.0: 6.49, 3.0: 8.06, 4.0: 8.83, 5.0: 9.09}
"""Diameters [mm] and speeds [m/s] in their table of 1949."""


@pytest.mark.parametrize(("diameter", "speed"), GUNN_KINZER.items())
def test_drops_fall_as_they_were_measured_to(diameter, speed):
    assert float(drop_speed(diameter)) == pytest.approx(speed, rel=0.04)


def carried(sizes, speed):
    """Water that falls through a level [mm/h]."""
    diameter = np.linspace(0.12, 12.0, 4000)
    number = sizes.most * np.exp(-sizes.slope * diameter)
    water = np.pi / 6.0 * diameter**3 * number * speed(diameter)  # mm^3 / (m^2 s) per mm
    return np.trapezoid(water, diameter) * 1e-6 * 3600.0


@pytest.mark.parametrize("rate", [1.0, 5.0, 20.0, 50.0])
def test_drops_bring_the_rain_that_is_said(rate):
    assert carried(rain_sizes(rate), drop_speed) == pytest.approx(rate, rel=0.25)


@pytest.mark.parametrize("rate", [0.5, 1.5, 3.0])
def test_flakes_bring_the_snow_that_is_said(rate):
    assert carried(snow_sizes(rate), flake_speed) == pytest.approx(rate, rel=0.35)


def test_heavier_rain_has_more_and_larger_drops():
    light, heavy = rain_sizes(2.0), rain_sizes(40.0)
    assert heavy.above(0.0) > light.above(0.0) and heavy.slope < light.slope


def test_shares_are_spread_as_the_distribution_is():
    sizes = rain_sizes(10.0)
    found = sizes.share_at((np.arange(10_000) + 0.5) / 10_000, 1.0, 5.0)
    assert found.min() >= 1.0 and found.max() <= 5.0
    larger = float(sizes.above(2.0) - sizes.above(5.0)) / float(sizes.above(1.0) - sizes.above(5.0))
    assert (found > 2.0).mean() == pytest.approx(larger, abs=0.002)


def test_flakes_are_wide_and_slow():
    assert 5.0 < float(flake_diameter(2.0)) < 9.0
    assert 0.7 < float(flake_speed(1.0)) < 1.4
