"""Ways around buildings against ones that are worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest

from sumo3dviz_pt.sound.emission import BANDS
from sumo3dviz_pt.sound.propagation import SPEED_OF_SOUND, Building, detours, screening

HOUSE = Building(np.array([[4.0, -5.0], [6.0, -5.0], [6.0, 3.0], [4.0, 3.0]]), 50.0)
EYE = np.array([[0.0, 0.0, 1.5]])


def test_the_way_leads_around_the_nearer_side():
    found = detours(EYE, np.array([[10.0, 0.0, 1.5]]), [HOUSE])[0]
    # Around (6, 3), the corner that makes the way over one corner longest: 3-4-5 twice, at 4 and 6.
    assert found == pytest.approx(np.hypot(4, 3) + np.hypot(6, 3) - 10, abs=1e-9)


def test_the_way_leads_over_a_low_roof():
    low = Building(HOUSE.outline, 2.5)
    found = detours(EYE, np.array([[10.0, 0.0, 1.5]]), [low])[0]
    assert found == pytest.approx(2 * np.hypot(4, 1) + 2 - 10, abs=1e-9)
    over = detours(EYE + np.array([0, 0, 20]), np.array([[10.0, 0.0, 20.0]]), [low])[0]
    assert over == 0.0


@pytest.mark.parametrize("place", [(3.0, 0.0), (0.0, 8.0), (10.0, 9.0), (-5.0, 0.0)])
def test_what_is_seen_is_not_screened(place):
    assert detours(EYE, np.array([[*place, 1.5]]), [HOUSE])[0] == 0.0


def test_the_longest_detour_counts_and_grows_steadily_behind_a_corner():
    behind = np.column_stack([np.full(50, 10.0), np.linspace(9.0, 0.0, 50), np.full(50, 1.5)])
    eyes = np.tile(EYE, (50, 1))
    found = detours(eyes, behind, [HOUSE])
    seen = found == 0.0
    assert seen[0] and not seen[-1]
    assert np.abs(np.diff(found)).max() < 0.2 and (np.diff(found) >= -1e-9).all()
    more = Building(HOUSE.outline + np.array([0.5, 0.0]), 50.0)
    assert (detours(eyes, behind, [HOUSE, more]) >= found).all()


def test_screens_follow_the_law_of_diffraction_and_fade():
    lengths = np.array([0.0] * 10 + [0.3] * 20)
    taken = screening(lengths, over=2)
    wanted = 10 * np.log10(3 + 40 * 0.3 * BANDS / SPEED_OF_SOUND)
    assert taken[-1] == pytest.approx(np.minimum(wanted, 25.0))
    assert taken[0] == pytest.approx(0.0)
    assert np.diff(taken[:, 3]).max() < 0.5 * taken[-1, 3]
