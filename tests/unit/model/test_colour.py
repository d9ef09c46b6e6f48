"""What the numbers of a colour stand for."""

import pytest

from sumo3dviz_pt.model.layers import LUMINANCE, linear_from_srgb


def test_transfer_curve():
    assert linear_from_srgb(0.04045) == pytest.approx(0.0031308, rel=1e-3)
    assert linear_from_srgb(0.5) == pytest.approx(0.21404, rel=1e-4)
    assert linear_from_srgb(1.0) == 1.0


def test_white_has_luminance_one():
    assert LUMINANCE.sum() == pytest.approx(1.0)
    assert not LUMINANCE.flags.writeable
