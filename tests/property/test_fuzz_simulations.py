"""Damaged files of a simulation end well, or in one clear sentence."""

import pytest
from fuzzing import faults

USUAL = {
    "network": 70,
    "log": 60,
    "signals": 25,
    "objects": 50,
    "types": 40,
    "configuration": 25,
}


@pytest.mark.slow
@pytest.mark.parametrize("kind", USUAL)
def test_damaged_simulations(kind):
    assert faults(kind, USUAL[kind]) == []
