"""Frame rates and speeds of films, exactly as they are written."""

from __future__ import annotations

import re
from fractions import Fraction

_WRITTEN = re.compile(r"\+?(\d{1,9}(\.\d{0,9})?|\.\d{1,9})(\s*/\s*\d{1,9})?")

Ratio = Fraction | float | str
"""A positive number, or a ratio such as `30000/1001`."""


def ratio_of(value: Ratio) -> Fraction:
    """Return a number exactly as it is written: 29.97 becomes 2997/100.

    Args:
        value: A number, a ratio, or text of one.

    Raises:
        ValueError: If it is no number, or not positive.
    """
    text = f"{value:.9f}" if isinstance(value, float) and abs(value) < 1e9 else str(value).strip()
    plain = not isinstance(value, bool) and _WRITTEN.fullmatch(text) is not None
    numerator, _, denominator = text.partition("/")
    if not plain or Fraction(denominator or 1) == 0 or Fraction(numerator) == 0:
        raise ValueError(f"write a positive number or a ratio such as 30000/1001, not {value!r}")
    return Fraction(numerator) / Fraction(denominator or 1)


def in_short(ratio: Fraction) -> int | float | str:
    """Return a ratio as a number where that is exact, else as text such as `30000/1001`."""
    if ratio.denominator == 1:
        return int(ratio)
    number = float(ratio)
    return number if Fraction(repr(number)) == ratio else str(ratio)
