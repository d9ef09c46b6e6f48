"""Examples look as they did: a z-test against stored pictures, never a test of bytes."""

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))

from pictures import DATA, PICTURES, RUNS, render

pytestmark = pytest.mark.slow

RELATIVE = 0.03
"""Differences below this share are let go: other machines round otherwise."""


def blocks(picture):
    """Means of 4 x 4 pixels, (9, 16, 3)."""
    return picture.reshape(9, 4, 16, 4, 3).mean(axis=(1, 3))


@pytest.mark.parametrize("name", PICTURES)
def test_looks_as_it_did(name):
    path = DATA / f"{name}.npz"
    assert path.stat().st_size < 100_000
    with np.load(path) as stored:
        old, old_deviation = stored["mean"].astype(float), stored["deviation"].astype(float)
    new, new_variance = render(name)
    # The mean of a block is as uncertain as its pixels' mean, root of 16 times less.
    variance = blocks(old_deviation**2 + new_variance) / (RUNS * 16)
    slack = RELATIVE * blocks(old) + 0.003
    z = np.abs(blocks(new) - blocks(old)) / np.sqrt(variance + slack**2)
    assert np.quantile(z, 0.9) < 2.0 and np.quantile(z, 0.99) < 5.0
    assert abs(new.mean() / old.mean() - 1) < 0.03
