"""Whatever is damaged that people give us, a command ends well or in one clear sentence."""

import pytest
from fuzzing import faults

USUAL = {
    # A simulation's files
    "network": 35, "log": 30, "signals": 13, "objects": 25, "types": 20, "configuration": 13,
    # Scene files and settings
    "scene": 75, "overrides": 40, "cameras": 12,
    # Models and pictures of users
    "models": 25, "images": 20,
    # Studies, tables, logs, frames and states
    "study": 10, "tables": 20, "csv": 8, "parquet": 8, "packed": 8, "frames": 12, "accounts": 20,
    "farm": 12, "special": 10, "words": 16,
}  # fmt: skip
"""How many cases of a kind are tried; `bench/fuzz.py` tries as many others as one likes."""


@pytest.mark.slow
@pytest.mark.parametrize("kind", USUAL)
def test_damaged_inputs(kind):
    assert faults(kind, USUAL[kind]) == []
