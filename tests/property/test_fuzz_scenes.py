"""Damaged scene files and odd settings end well, or in one clear sentence."""

import pytest
from fuzzing import faults


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "usual"), [("scene", 150), ("overrides", 80), ("cameras", 24)])
def test_damaged_scenes(kind, usual):
    assert faults(kind, usual) == []
