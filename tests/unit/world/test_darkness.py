"""When lamps are lit."""

import numpy as np
import pytest

from sumo3dviz_pt.model.scene import Sky
from sumo3dviz_pt.world.sky import is_dark


@pytest.mark.parametrize(("elevation", "dark"), [(5.0, False), (-0.9, False), (-1.1, True)])
def test_lamps_are_lit_a_degree_after_sunset(elevation, dark):
    up = np.radians(elevation)
    sky = Sky(np.array([np.cos(up), 0.0, np.sin(up)]))
    assert is_dark(sky) == dark
    assert is_dark(sky, "on") and not is_dark(sky, "off")


def test_a_sky_without_a_sun_counts_as_day():
    assert not is_dark(Sky(None, image=np.ones((8, 16, 3), np.float32)))
