"""What falls before a stored frame, as text."""

from dataclasses import fields, is_dataclass, replace

import numpy as np
import pytest
from raining import falling_at

from sumo3dviz_pt.model.falling import Cabin, Glows, Puffs, SkyLight, Throws, Windscreen
from sumo3dviz_pt.pipeline.films.traced import read_text, text_of


def same(one, other):
    """Compare values to the bit, whatever is in them."""
    if is_dataclass(one):
        assert type(one) is type(other)
        for field in fields(one):
            same(getattr(one, field.name), getattr(other, field.name))
    elif isinstance(one, np.ndarray):
        np.testing.assert_array_equal(one, other)
        assert one.shape == other.shape
    else:
        assert one == other


def test_text_keeps_all_bits():
    rng = np.random.default_rng(1)
    full = replace(
        falling_at(0.1 + 0.2, rain=12.5, snow=0.1, wind=(1 / 3, -2.0), drift=(1e5 / 3, 7.0)),
        glows=Glows(rng.random((4, 3)), rng.random((4, 3)), rng.random((4, 3)), rng.random((4, 2))),
        throws=Throws(rng.random((2, 4, 4)), rng.random((2, 3)), rng.random((8, 8)), 1.3),
        puffs=Puffs(rng.random((5, 3)), rng.random(5), rng.random(5)),
        cabin=Cabin(rng.random((4, 4)), rng.random(3)),
        windscreen=Windscreen(
            rng.random((4, 4)), (1.4, 0.7), rng.random((2, 2)), (0.1, 0.7), 3.7, 2.0, 99.0
        ),
    )
    light = SkyLight((0.1, 0.2, 0.3), (1.0, 0.9, 0.8), (0.0, 0.6, 0.8))
    for falling in (full, falling_at()):
        found, lit = read_text(text_of(falling, light))
        same(found, falling)
        same(lit, light)


@pytest.mark.parametrize("text", ["", "{}", '{"falling": {"time": 1}, "light": {}}', "[1]"])
def test_damaged_text_is_told(text):
    with pytest.raises(ValueError, match=r"."):
        read_text(text)
