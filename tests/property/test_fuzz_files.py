"""Damaged models and pictures of users end well, or in one clear sentence."""

import pytest
from fuzzing import faults


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "usual"), [("models", 50), ("images", 40)])
def test_damaged_files(kind, usual):
    assert faults(kind, usual) == []
