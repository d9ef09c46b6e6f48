"""What the numbers of a colour stand for.

References:
    Rec. ITU-R BT.709-6 (primaries and luminance); IEC 61966-2-1 (sRGB's transfer curve).
"""

from __future__ import annotations

from sumo3dviz_pt.model.geometry import frozen

LUMINANCE = frozen([0.2126, 0.7152, 0.0722])
"""Weights of linear red, green and blue in luminance; of encoded values, in BT.709's luma."""


def linear_from_srgb(value: float) -> float:
    """Undo sRGB's transfer curve for a value in [0, 1]."""
    return value / 12.92 if value <= 0.04045 else ((value + 0.055) / 1.055) ** 2.4
