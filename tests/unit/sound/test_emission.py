"""Power levels against the directive's formulas, worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sumo3dviz_pt.model.traffic import VehicleType
from sumo3dviz_pt.sound.emission import A_WEIGHTS, BANDS, CATEGORIES, category_of, emission_of


def kind(vclass, length=5.0, **params):
    return VehicleType("t", vclass, length, 1.8, 1.5, params=params)


def weighted(levels):
    return 10.0 * np.log10((10.0 ** (0.1 * (levels + A_WEIGHTS))).sum(axis=-1))


def test_a_car_at_50_is_the_directives_in_every_band():
    found = emission_of(kind("passenger"), np.array([50 / 3.6]), np.zeros(1))
    # 1 kHz, by hand: 100.1 + 32.5 lg(50/70) and 84.7 + 8.0 (50 - 70) / 70.
    assert found.rolling[0, 4] == pytest.approx(95.351, abs=0.001)
    assert found.propulsion[0, 4] == pytest.approx(82.414, abs=0.001)
    assert weighted(found.total)[0] == pytest.approx(98.4, abs=0.1)


@pytest.mark.parametrize(
    ("vclass", "length", "category"),
    [("passenger", 5, "1"), ("delivery", 6.5, "1"), ("bus", 12, "2"), ("bus", 18, "3"),
     ("truck", 7.1, "2"), ("trailer", 16.5, "3"), ("moped", 2, "4a"), ("motorcycle", 2.2, "4b"),
     ("tram", 22, "rail"), ("bicycle", 1.6, "bicycle"), ("pedestrian", 0.2, "silent")],
)  # fmt: skip
def test_classes_have_categories(vclass, length, category):
    assert category_of(kind(vclass, length)) == category


@pytest.mark.parametrize(
    "type_",
    [kind("evehicle"), kind("passenger", emissionClass="Energy/unknown"),
     kind("bus", **{"has.battery.device": "true"})],
)  # fmt: skip
def test_electric_vehicles_have_tyres_alone(type_):
    found = emission_of(type_, np.array([10.0]), np.array([2.0]))
    assert (found.propulsion < -100).all() and found.firing[0] == 0.0
    assert weighted(found.rolling)[0] > 80


def test_accelerating_is_louder_and_standing_softer():
    levels = [
        weighted(emission_of(kind("passenger"), np.array([v]), np.array([a])).total)[0]
        for v, a in ((0.0, 0.0), (8.0, 0.0), (8.0, 2.0))
    ]
    assert 75 < levels[0] < levels[1] - 5 and levels[2] > levels[1] + 2


@given(st.floats(0, 60), st.sampled_from([*CATEGORIES, "tram", "bicycle"]))
def test_levels_have_no_steps(speed, name):
    vclass = {"1": "passenger", "2": "bus", "3": "trailer", "4a": "moped", "4b": "motorcycle"}
    speeds = np.array([speed, speed + 0.001])
    found = emission_of(kind(vclass.get(name, name)), speeds, np.zeros(2))
    audible = weighted(found.total).max() > 60
    assert np.isfinite(found.total).all()
    assert not audible or np.abs(np.diff(weighted(found.total))).max() < 0.5


def test_a_tram_grows_louder_by_speed_as_wheels_on_rails_do():
    slow, fast = weighted(
        emission_of(kind("tram", 30), np.array([40, 80]) / 3.6, np.zeros(2)).rolling
    )
    # The level goes with 30 lg(v), within what roughness by wavelength adds or takes.
    assert fast - slow == pytest.approx(30 * np.log10(2), abs=4)
    # A tram of 30 m at 40 km/h, at 7.5 m: measured ones have 72 to 82 dB(A).
    assert 72 < slow - 20 * np.log10(7.5) - 8 < 82


def test_bands_are_octaves():
    assert np.diff(np.log2(BANDS)) == pytest.approx(1.0, abs=0.02)
