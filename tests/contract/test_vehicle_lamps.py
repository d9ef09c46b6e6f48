"""Whatever moves by night is lit: every vehicle of the catalogue has the lamps that it needs."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pytest

from sumo3dviz_pt import catalog
from sumo3dviz_pt.cast.choice import Model

CYCLES = frozenset(["bicycle", "scooter"])
TWO_WHEELED = CYCLES | {"motorcycle", "moped"}
RAIL = frozenset(
    ["tram", "rail", "rail_urban", "rail_electric", "rail_fast", "subway", "cable_car"]
)
NO_VEHICLE = frozenset(["container", "ship", "aircraft", "drone", "wheelchair"])
"""Classes that show other lights than those of the road, or none."""

NARROW = TWO_WHEELED | {"rickshaw"}
DRIVEN = {
    name: model
    for name in catalog.names("vehicles")
    if (model := Model.of(catalog.find("vehicles", name))).vclasses - NO_VEHICLE
}
"""Vehicles that somebody can get; the others are units of them."""


def units(name: str) -> list[Mapping[str, Any]]:
    """The pieces of a vehicle, from front to rear."""
    meta = catalog.find("vehicles", name).meta
    if "units" not in meta:
        return [meta]
    return [catalog.find("vehicles", str(row["model"])).meta for row in meta["units"]]


def roles(meta: Mapping[str, Any], *, ahead: bool) -> list[str]:
    """Of a piece's lamps that shine forward, or backward."""
    return [row["role"] for row in meta["lamps"] if (abs(float(row["yaw"])) < 1.0) == ahead]


def test_there_is_something_to_test() -> None:
    assert len(DRIVEN) > 20
    assert any(model.vclasses & TWO_WHEELED for model in DRIVEN.values())


@pytest.mark.parametrize("name", sorted(DRIVEN))
def test_head_lamps_shine_forward_and_tail_lamps_backward(name: str) -> None:
    pieces = units(name)
    first, last = roles(pieces[0], ahead=True), roles(pieces[-1], ahead=False)
    narrow = bool(DRIVEN[name].vclasses & NARROW)
    assert first.count("head") >= (1 if narrow else 2)
    assert last.count("tail") >= (1 if narrow else 2)
    for meta in pieces:
        assert "head" not in roles(meta, ahead=False)
        assert "tail" not in roles(meta, ahead=True)


@pytest.mark.parametrize(
    "name", sorted(n for n, model in DRIVEN.items() if not model.vclasses & (CYCLES | RAIL))
)
def test_motor_vehicles_show_that_they_brake_and_turn(name: str) -> None:
    pieces = units(name)
    last = roles(pieces[-1], ahead=False)
    assert "brake" in last
    every = [row["role"] for meta in pieces for row in meta["lamps"]]
    assert every.count("left") == every.count("right") >= 2
