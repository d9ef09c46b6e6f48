"""Quantities with units, as people write them: `200 m`, `10 mm/h`, `3 cm`."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from pydantic import PlainValidator, WithJsonSchema

_UNITS: Mapping[str, Mapping[str, float]] = MappingProxyType(
    {
        # what values are in    how else they may be written
        "m": {"m": 1.0, "km": 1000.0, "cm": 0.01, "mm": 0.001},
        "m/s": {"m/s": 1.0, "km/h": 1.0 / 3.6},
        "mm/h": {"mm/h": 1.0, "cm/h": 10.0},
        "s": {"s": 1.0, "ms": 0.001, "min": 60.0},
    }
)

_WRITTEN = re.compile(r"([+-]?[0-9.]+(?:[eE][+-]?[0-9]+)?)\s*([a-z/]+)")


class Quantity:
    """Marks a number with a unit: text such as `200 m`, or a plain number in the first unit.

    Attributes:
        unit: What values are in inside.
        low, high: Bounds, in that unit.
    """

    def __init__(self, unit: str, low: float, high: float) -> None:
        self.unit, self.low, self.high = unit, low, high

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> Any:
        """Return how values are read."""
        return PlainValidator(self._read).__get_pydantic_core_schema__(source, handler)

    def __get_pydantic_json_schema__(self, schema: Any, handler: Any) -> Any:
        """Return how values are written."""
        number = {"type": "number", "minimum": self.low, "maximum": self.high}
        text = {"type": "string", "pattern": rf"^[-+0-9.eE]+ ?({'|'.join(_UNITS[self.unit])})$"}
        written = WithJsonSchema({"anyOf": [number, text]})
        return written.__get_pydantic_json_schema__(schema, handler)

    def _read(self, value: Any) -> float:
        """Return a value in the unit, within bounds."""
        found = self._number(value)
        if not self.low <= found <= self.high:
            bounds = f"{self.low:g} to {self.high:g} {self.unit}"
            raise ValueError(f"this should lie in {bounds}, not {found:g} {self.unit}")
        return found

    def _number(self, value: Any) -> float:
        """Return a value in the unit."""
        if isinstance(value, int | float) and not isinstance(value, bool):
            if math.isfinite(value):
                return float(value)
        elif isinstance(value, str):
            written = _WRITTEN.fullmatch(value.strip())
            factor = _UNITS[self.unit].get(written[2]) if written else None
            if written and factor is not None:
                try:
                    return float(written[1]) * factor
                except ValueError:
                    factor = None
        units = ", ".join(_UNITS[self.unit])
        raise ValueError(f"this should be a number with one of the units {units}, not {value!r}")
