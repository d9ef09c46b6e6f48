import math

import pytest
from measurements import ladder

from sumo3dviz_pt.report.convergence.table import equal_spp, gains

FLIP = {1: 0.4, 4: 0.2, 16: 0.1}
PSNR = {1: 10.0, 4: 20.0, 16: 30.0}


@pytest.mark.parametrize(
    ("curve", "value", "spp"),
    [
        (FLIP, 0.2, "4"),
        (FLIP, 0.2 / 2**0.5, "8"),
        (FLIP, 0.09, "> 16"),
        (FLIP, 0.5, "< 1"),
        (PSNR, 25.0, "8"),
        (PSNR, 31.0, "> 16"),
        (PSNR, 9.0, "< 1"),
        ({**FLIP, 8: 0.3}, 0.2, "4"),
        ({1: 0.4}, 0.2, "-"),
        (FLIP, math.nan, "-"),
    ],
)
def test_equal_spp(curve, value, spp):
    assert equal_spp(curve, value) == spp


def test_gains_follow_from_the_ladder():
    head, _, *lines = gains(ladder(0.0))
    assert len(lines) == 4 and head.count("equal raw spp") == 2
    cells = [cell.strip() for cell in lines[0].strip("|").split("|")]
    assert cells[:3] == ["multijitter", "high", "1"]
    # 0.06 is what 0.2 spp^-0.6 leaves at this many.
    assert float(cells[5]) == pytest.approx((0.2 / 0.06) ** (1 / 0.6), rel=0.05)


def test_nothing_denoised_gains_nothing():
    assert gains([row for row in ladder() if row["denoise"] == "none"]) == []
