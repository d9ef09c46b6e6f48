"""Metering: what counts, to which key it is brought, and what other modes give."""

import numpy as np
import pytest

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.job.cameras import ExposureSettings
from sumo3dviz_pt.job.settings import EulerianCamera
from sumo3dviz_pt.pipeline.metering import (
    KEY,
    exposure_for,
    exposure_of,
    log_average,
    luminances,
    manual_exposure,
)


def grey(level, count=1000):
    return np.full((count, 3), level)


def camera(**more):
    return EulerianCamera(mode="eulerian", position=(0, 0, 5), heading=0, **more)


def test_the_sky_counts_only_where_hardly_anything_else_is_seen():
    radiance = np.concatenate([grey(0.1, 300), grey(4.0, 700)])
    surface = np.repeat([1.0, 0.0], [300, 700])
    assert log_average(luminances(radiance, surface)) == pytest.approx(0.1)
    assert log_average(luminances(radiance, np.zeros(1000))) > 1.0


def test_a_few_lamps_and_black_holes_do_not_count():
    radiance = np.concatenate([grey(0.2, 960), grey(1e4, 20), grey(0.0, 20)])
    levels = luminances(radiance, np.ones(1000))
    assert log_average(levels) == pytest.approx(0.2)
    assert exposure_for(levels) == exposure_for(np.full(1000, 0.2))


def test_what_is_bright_does_not_get_brighter_than_white():
    """A dark street with a sunlit wall on a tenth of it."""
    levels = luminances(np.concatenate([grey(0.01, 900), grey(0.5, 100)]), np.ones(1000))
    assert exposure_for(levels) == pytest.approx(1.0)
    assert exposure_for(levels[:900]) > 2.0


def test_a_sunny_street_comes_to_its_key():
    level = 3000 / 32_000
    assert level * 2.0 ** exposure_for(np.full(9, level)) == pytest.approx(KEY, rel=0.04)


def test_darker_streets_get_brighter_but_stay_darker():
    levels = 2.0 ** -np.arange(16.0)
    exposures = [exposure_for(np.full(9, level)) for level in levels]
    shown = levels * 2.0 ** np.array(exposures)
    steps = np.diff(np.log2(shown))
    assert (steps < 0.11).all() and -3.5 < np.log2(shown[-1] / shown[0]) < -1.0
    tenths = 10 * np.array(exposures)
    np.testing.assert_allclose(tenths, np.round(tenths), atol=1e-6)


@pytest.mark.parametrize(
    ("said", "ev"),
    [
        (None, 0.5),
        ({"ev": 1.0}, 1.5),
        ({"mode": "auto", "ev": 0.3}, 2.3),
        ({"mode": "manual"}, -3.0),
        ({"mode": "fixed", "ev": 7.0}, 7.0),
    ],
)
def test_modes_say_whose_exposure_counts(said, ev):
    settings = None if said is None else ExposureSettings(**said)
    found = exposure_of(settings, sky=0.5, metered=2.0, by_hand=-3.0)
    assert found == pytest.approx(ev)


def test_twice_the_time_is_one_stop_and_twice_the_f_number_two():
    def by_hand(time, f_number, iso=100):
        one = camera(
            exposure={"mode": "manual", "iso": iso},
            shutter={"time": time},
            lens={"f_number": f_number},
        )
        return manual_exposure(one, step=0.04, name="one")

    base = by_hand(0.01, 16)
    assert base == pytest.approx(0.06, abs=0.01)
    assert by_hand(0.02, 16) - base == pytest.approx(1.0)
    assert by_hand(0.01, 8) - base == pytest.approx(2.0)
    assert by_hand(0.01, 16, iso=400) - base == pytest.approx(2.0)


def test_a_manual_exposure_needs_a_shutter():
    with pytest.raises(ConfigError, match="f_number"):
        manual_exposure(camera(exposure="manual", lens={"f_number": 8}), step=0.04, name="one")
