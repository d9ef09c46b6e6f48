"""Finds persons who ride: SUMO logs them at their vehicle's reference point."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import fields, replace
from typing import Any

import numpy as np

from sumo3dviz_pt.model.geometry import Bools, Ints
from sumo3dviz_pt.model.traffic import Trace

_MILLI = 1000.0
"""Times and coordinates are compared in thousandths: logs have two or more decimals."""


def without_riders(traces: Iterable[Trace]) -> tuple[Trace, ...]:
    """Drop the samples of persons that coincide with a vehicle at the same time.

    Returns:
        The traces in their order; a person who only rides is left out, and one who
        rides for a while has a gap.
    """
    traces = tuple(traces)
    places = [_places(trace) for trace in traces if trace.kind == "vehicle"]
    if not places or all(trace.kind == "vehicle" for trace in traces):
        return traces
    vehicles = np.unique(np.concatenate(places), axis=0)
    known = {tuple(row) for row in vehicles.tolist()}
    return tuple(_walking(traces, known))


def _places(trace: Trace) -> Ints:
    """Time, x and y as whole thousandths, (n, 3)."""
    places = np.column_stack([trace.times, trace.positions[:, :2]])
    return np.round(places * _MILLI).astype(np.int64)


def _walking(traces: Iterable[Trace], known: set[tuple[int, ...]]) -> Iterator[Trace]:
    """Vehicles as they are, others without the known places."""
    for trace in traces:
        if trace.kind == "vehicle":
            yield trace
            continue
        apart = np.array([tuple(row) not in known for row in _places(trace).tolist()], dtype=bool)
        if apart.all():
            yield trace
        elif apart.any():
            yield replace(trace, **_rows(trace, apart))


def _rows(trace: Trace, chosen: Bools) -> dict[str, Any]:
    """The arrays of a trace at the chosen samples, by field name."""
    arrays = {field.name: getattr(trace, field.name) for field in fields(trace)}
    return {name: array[chosen] for name, array in arrays.items() if not isinstance(array, str)}
