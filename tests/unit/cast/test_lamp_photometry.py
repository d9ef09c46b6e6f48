"""Lamps of vehicles have the light and the colour that regulations and their bulbs allow.

References:
    UN Regulations 6, 7, 23, 38 and 65: limits on the axis [cd].
    UN Regulation 37: light of bulbs [lm]. What a lamp throws cannot be more than that, and
        reflectors and lenses lose at least a fifth of it.
    UN Regulation 48, 2.29: colours of lamps, (CIE 1931); those outside of sRGB are judged
        by their dominant wavelength.
"""

from __future__ import annotations

import colour
import numpy as np
import pytest

from sumo3dviz_pt.cast.lamps import running_lights
from sumo3dviz_pt.model.layers import LUMINANCE
from sumo3dviz_pt.model.scene import CANDELAS_PER_UNIT, Prototype, VehicleLamp
from sumo3dviz_pt.model.weather import CONTRAST, Fog, Weather, WeatherCourse

_RED = 110.0 / 460.0
"""Share of a clear bulb's light that a red one gives (PR21W against P21W)."""

# fmt: off
LIMITS = {
    # role          cd at least, at most    lm of its bulb
    "tail":        (4.0,    17.0,           125.0 * _RED),  # R10W
    "brake":       (60.0,   260.0,          110.0),         # PR21W
    "left":        (175.0,  500.0,          280.0),         # PY21W; in front and behind
    "right":       (175.0,  500.0,          280.0),
    "reverse":     (80.0,   300.0,          460.0),         # P21W
    "fog":         (150.0,  300.0,          600.0 * _RED),  # H21W
    "blue":        (120.0,  1700.0,         1550.0),        # H1
}
HUES = {"tail": (600.0, 625.0), "brake": (600.0, 625.0), "fog": (600.0, 625.0),
        "left": (583.0, 600.0), "right": (583.0, 600.0), "blue": (460.0, 480.0)}
"""Dominant wavelengths [nm]."""
# fmt: on
WHITE = ("head", "reverse", "front_fog", "dials")
CCT = (3000.0, 9000.0)

ROLES = (*LIMITS, "head", "front_fog", "dials", "screen", "sign")


@pytest.fixture(scope="module")
def lights():
    lamps = tuple(VehicleLamp(role, (0.0, 0.0, 0.7), (0.1, 0.1), 0.0) for role in ROLES)
    fog = WeatherCourse((0.0,), (Weather(fog=Fog(CONTRAST / 50.0)),))
    made = running_lights(
        [Prototype("all", (), (), lamps)], dark=True, left_hand=False, weather=fog
    )
    assert made is not None and set(made.intensity) == set(ROLES)
    return made


def candelas(lights, role):
    return float(np.array(lights.intensity[role]) @ LUMINANCE) * CANDELAS_PER_UNIT


@pytest.mark.parametrize("role", sorted(LIMITS))
def test_lamps_keep_to_the_limits_and_to_the_light_of_their_bulbs(lights, role):
    least, most, bulb = LIMITS[role]
    axis = candelas(lights, role)
    assert least <= axis <= most
    thrown = axis * lights.lobes[role].flux
    assert 0.1 * bulb < thrown < 0.8 * bulb


def test_both_sides_indicate_alike(lights):
    assert lights.intensity["left"] == lights.intensity["right"]
    assert lights.lobes["left"] == lights.lobes["right"]


def chromaticity(light):
    """CIE 1931 x, y of linear sRGB."""
    space = colour.RGB_COLOURSPACES["sRGB"]
    return colour.XYZ_to_xy(space.matrix_RGB_to_XYZ @ np.array(light))


@pytest.mark.parametrize("role", sorted(HUES))
def test_coloured_lamps_have_the_hue_of_their_regulation(lights, role):
    low, high = HUES[role]
    equal = [1 / 3, 1 / 3]
    found, *_ = colour.dominant_wavelength(chromaticity(lights.intensity[role]), equal)
    assert low < float(found) < high


@pytest.mark.parametrize("role", WHITE)
def test_white_lamps_are_as_white_as_incandescent_light_and_day(lights, role):
    """To eyes that are set to daylight (D65)."""
    xy = chromaticity(lights.intensity[role])
    assert CCT[0] < float(colour.temperature.xy_to_CCT(xy, method="McCamy 1992")) < CCT[1]
    red, green, blue = lights.intensity[role]
    assert red >= green >= blue, "no lamp of a road vehicle is bluish"
