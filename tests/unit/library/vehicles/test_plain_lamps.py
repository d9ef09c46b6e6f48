"""Lamps of bodies that stand for classes without models."""

import numpy as np
import pytest

from sumo3dviz_pt.library.vehicles.plain_bodies import (
    NARROW,
    UNBRAKED,
    UNLIT,
    plain_body,
    plain_lamps,
)
from sumo3dviz_pt.sumo.types import CLASS_DEFAULTS

SIZES = [1.0, 1.7]
"""Factors on the length."""


def lamps_of(vclass, factor):
    size = CLASS_DEFAULTS[vclass]
    length = factor * size.length
    body = plain_body(vclass, length=length, width=size.width, height=size.height)
    return plain_lamps(vclass, [part.mesh for part in body.parts]), length


@pytest.mark.parametrize("factor", SIZES)
@pytest.mark.parametrize("vclass", sorted(set(CLASS_DEFAULTS) - UNLIT))
def test_everybody_has_lamps_that_shine_away_from_the_body(vclass, factor):
    lamps, length = lamps_of(vclass, factor)
    front = "sign" if vclass == "ship" else "head"
    count = 1 if vclass in NARROW else 2
    wanted = (front, "tail") if vclass in UNBRAKED else (front, "tail", "brake")
    assert [lamp.role for lamp in lamps] == [role for role in wanted for _ in range(count)]
    for lamp in lamps:
        ahead = lamp.role == front
        assert np.cos(lamp.yaw) == pytest.approx(1.0 if ahead else -1.0)
        assert (lamp.at[0] > -0.5 * length) == ahead
        assert -length - 0.02 < lamp.at[0] < 0.02
    assert sum(lamp.at[1] for lamp in lamps) == pytest.approx(0.0)


@pytest.mark.parametrize("height", [0.1, 1.5, 50.0])
@pytest.mark.parametrize("width", [0.1, 2.0, 300.0])
@pytest.mark.parametrize("vclass", ["bicycle", "passenger", "ship"])
def test_bodies_of_any_size_have_lamps(vclass, width, height):
    """Brake lamps of wide, low ones lay above them, and no scene with such a vType was drawn."""
    for length in (0.1, 5000.0):
        body = plain_body(vclass, length=length, width=width, height=height)
        lamps = plain_lamps(vclass, [part.mesh for part in body.parts])
        assert all(0.0 < lamp.at[2] < height and abs(lamp.at[1]) < width / 2 for lamp in lamps)
        roles = 2 if vclass in UNBRAKED else 3
        assert len(lamps) == (roles if vclass in NARROW else 2 * roles)


@pytest.mark.parametrize("vclass", sorted(UNLIT))
def test_walkers_and_boxes_have_none(vclass):
    assert lamps_of(vclass, 1.0)[0] == ()
