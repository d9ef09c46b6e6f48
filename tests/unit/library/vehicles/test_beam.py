"""The low beam against what UN Regulation No. 112 asks of class B lamps."""

from __future__ import annotations

import numpy as np
import pytest

from sumo3dviz_pt.library.vehicles.lamps import HALF_ANGLE, PEAK, beam_pattern, low_beam

# Point: degrees to the right, degrees up, lowest and highest illuminance at 25 m [lx].
POINTS = {
    "B50L": (-3.43, 0.57, 0.0, 0.56),
    "75R": (1.15, -0.57, 12.0, np.inf),
    "75L": (-3.43, -0.57, 0.0, 12.0),
    "50L": (-3.43, -0.86, 0.0, 18.0),
    "50R": (1.72, -0.86, 12.0, np.inf),
    "50V": (0.0, -0.86, 6.0, np.inf),
    "25L": (-9.0, -1.72, 2.0, np.inf),
    "25R": (9.0, -1.72, 2.0, np.inf),
    "high above": (-3.0, 6.0, 0.0, 0.7),
}


@pytest.mark.parametrize("name", POINTS)
def test_the_beam_is_legal(name):
    across, up, least, most = POINTS[name]
    lux = float(low_beam(np.array(across), np.array(up))) / 25.0**2
    assert least <= lux <= most


def test_the_pattern_shows_the_beam_upright():
    pattern = beam_pattern(256)
    rows, columns = np.indices(pattern.shape)
    middle = (256 - 1) / 2
    bright = pattern > 0.3
    assert 0.7 < pattern.max() <= 1.0 + 200 / PEAK
    assert (rows[bright] > middle).mean() > 0.75, "light falls on the road"
    above = pattern[: 256 // 2 - 8]
    assert above.max() < 0.02
    assert columns[bright].mean() > middle, "more light on the kerb's side"


def test_left_hand_traffic_mirrors_it():
    np.testing.assert_allclose(beam_pattern(64, left_hand=True), beam_pattern(64)[:, ::-1])


def test_the_pattern_is_even_in_the_tangent():
    pattern = beam_pattern(400)
    edge = np.tan(HALF_ANGLE)
    across, down = np.degrees(np.arctan(edge * 0.2525)), 1.5
    row = round(200 + 200 * np.tan(np.radians(down)) / edge - 0.5)
    up = -np.degrees(np.arctan2(edge * (row + 0.5 - 200) / 200, np.hypot(1.0, edge * 0.2525)))
    expected = float(low_beam(np.array(across), np.array(up))) / PEAK
    assert pattern[row, 250] == pytest.approx(expected, rel=0.03)
