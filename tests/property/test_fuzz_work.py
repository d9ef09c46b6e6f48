"""Damaged studies, tables, logs, frames and states end well, or in one clear sentence."""

import pytest
from fuzzing import faults

USUAL = {
    "study": 10,
    "tables": 20,
    "csv": 8,
    "parquet": 8,
    "packed": 8,
    "frames": 12,
    "accounts": 20,
    "farm": 12,
    "special": 10,
    "words": 16,
}


@pytest.mark.slow
@pytest.mark.parametrize("kind", USUAL)
def test_damaged_work(kind):
    assert faults(kind, USUAL[kind]) == []
