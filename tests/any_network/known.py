"""Laws that are broken today, by law and number of the network, and why."""

from __future__ import annotations

import pytest

KNOWN: dict[tuple[str, int], str] = {}
"""Whoever mends one takes it out of this table; until then its test is expected to fail."""

TOWN = "monaco_west_hills"

EXAMPLES_KNOWN: dict[tuple[str, str], str] = {
    ("floating_users", TOWN): "a piece of one lane is cut where a hairpin lies 5 m below",
    ("overlaps", TOWN): "one pair of lanes is 2.46 m apart, another crosses at 1.2 m",
}
"""The same of networks of the real world, by law and name."""


def expect(request: pytest.FixtureRequest, law: str, number: int) -> None:
    """Mark a running test as expected to fail where its law is known to be broken."""
    if (law, number) in KNOWN:
        request.applymarker(pytest.mark.xfail(reason=KNOWN[law, number], strict=True))
