"""Laws that are broken today, by law and number of the network, and why."""

from __future__ import annotations

import pytest

KNOWN: dict[tuple[str, int], str] = {}
"""Whoever mends one takes it out of this table; until then its test is expected to fail."""

TOWN = "monaco_west_hills"

EXAMPLES_KNOWN: dict[tuple[str, str], str] = {
    ("floating_users", TOWN): "SUMO puts a motorcycle 7 m beside the upper arm of a hairpin",
}
"""The same of networks of the real world, by law and name."""


def expect(request: pytest.FixtureRequest, law: str, number: int) -> None:
    """Mark a running test as expected to fail where its law is known to be broken."""
    if (law, number) in KNOWN:
        request.applymarker(pytest.mark.xfail(reason=KNOWN[law, number], strict=True))
