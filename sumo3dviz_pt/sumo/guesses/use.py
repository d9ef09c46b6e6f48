"""Guess the vClass of types from a whole log: ids of vehicles, lanes driven, speeds.

The result depends on the part of the log that is read. So only the proposal of a scene file,
which reads all of it, guesses in this way, and writes the result into the scene file.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from sumo3dviz_pt.model.network import Network
from sumo3dviz_pt.model.scenario import Scenario, TypeGuess
from sumo3dviz_pt.model.traffic import Trace
from sumo3dviz_pt.sumo.classes import ALL_CLASSES
from sumo3dviz_pt.sumo.guesses.words import class_of_vehicle
from sumo3dviz_pt.sumo.types import default_vehicle_type

_MOST = 0.9
"""Share of vehicles, or of their rows, that makes evidence."""

_LEAST_ROWS = 20
"""Smallest number of rows on lanes that can tell something."""

_LEAST_VEHICLES = 5
"""Smallest number of vehicles whose speeds can tell something."""

_CYCLING = 8.0
"""Top speed that cyclists seldom exceed and cars on free roads do [m/s]."""

_DRIVING = 11.0
"""Speed limit, and top speed of other vehicles, beside which cyclists are slow [m/s]."""

_LIKELY = (
    # Classes in the order in which lanes that are closed to cars are theirs.
    *("bus", "tram", "subway", "rail_urban", "rail", "rail_electric", "rail_fast"),
    *("bicycle", "taxi", "delivery", "truck", "motorcycle", "emergency", "ship", "pedestrian"),
)


@dataclass(frozen=True, slots=True, eq=False)
class _TypeUse:
    """How the vehicles of a type were driven.

    Attributes:
        traces: All of them.
        lanes: Number of rows by lane id, lanes of the network outside junctions only.
    """

    traces: Sequence[Trace]
    lanes: Counter[str]

    def top_speeds(self) -> list[float]:
        """Return the largest logged speed of each vehicle [m/s]."""
        logged = [t.speeds for t in self.traces if t.kind == "vehicle"]
        return [float(np.nanmax(each)) for each in logged if np.isfinite(each).any()]


def with_use(scenario: Scenario) -> Scenario:
    """Return a scenario with what a whole log tells of the types whose names tell nothing.

    Args:
        scenario: As read without a window.
    """
    uses = {each.type_id: _use_of(each.type_id, scenario) for each in scenario.guesses}
    tops = _TypeUse(scenario.traffic.traces, Counter()).top_speeds()
    fast = max(tops, default=0.0) >= _DRIVING
    guesses = tuple(
        each if each.vclass else _with_use(each, uses[each.type_id], scenario.network, fast=fast)
        for each in scenario.guesses
    )
    types = {
        each.type_id: default_vehicle_type(each.type_id, "vehicle", vclass=each.vclass)
        for each in guesses
        if each.type_id and each.vclass
    }
    return replace(scenario, vehicle_types={**scenario.vehicle_types, **types}, guesses=guesses)


def _use_of(type_id: str, scenario: Scenario) -> _TypeUse:
    """Return how the vehicles of a type were driven."""
    log = scenario.traffic
    traces = [t for t in log.traces if t.kind == "vehicle" and t.type_id == type_id]
    lanes: Counter[str] = Counter()
    for trace in traces:
        numbers, counts = np.unique(trace.lanes[trace.lanes >= 0], return_counts=True)
        for number, count in zip(numbers.tolist(), counts.tolist(), strict=True):
            name = log.lane_names[number]
            if name in scenario.network.lanes and not name.startswith(":"):
                lanes[name] += count
    return _TypeUse(traces, lanes)


def _with_use(guess: TypeGuess, use: _TypeUse, network: Network, *, fast: bool) -> TypeGuess:
    """Return a guess with the first evidence that there is.

    Args:
        guess: One whose class nothing tells.
        use: How its vehicles were driven.
        network: The roads.
        fast: Whether some vehicles of the log are as fast as cars.
    """
    said = _by_ids(use)
    if said:
        return replace(guess, vclass=said, why="the ids of the vehicles say so")
    own = _by_lanes(use, network)
    if own:
        return replace(guess, vclass=own, why="the vehicles keep to lanes that are closed to cars")
    if fast and _cycles(use, network):
        why = f"the vehicles stay below {_CYCLING:g} m/s where bicycles may go"
        return replace(guess, vclass="bicycle", why=why)
    return guess


def _by_ids(use: _TypeUse) -> str | None:
    """Return the class that almost all ids of vehicles say, or None."""
    said = Counter(class_of_vehicle(trace.id, trace.kind) for trace in use.traces)
    if not said:
        return None
    vclass, count = said.most_common(1)[0]
    return vclass if vclass and count >= _MOST * len(use.traces) else None


def _by_lanes(use: _TypeUse, network: Network) -> str | None:
    """Return the likeliest class where almost all rows lie on lanes without cars, or None."""
    rows = use.lanes.total()
    if rows < _LEAST_ROWS:
        return None
    allowed = Counter(
        {
            vclass: sum(n for lane, n in use.lanes.items() if vclass in network.lanes[lane].allowed)
            for vclass in ALL_CLASSES
        }
    )
    if allowed["passenger"] > (1.0 - _MOST) * rows:
        return None
    # Only lanes that carry a class all the way can be its own.
    return next((vclass for vclass in _LIKELY if allowed[vclass] >= _MOST * rows), None)


def _cycles(use: _TypeUse, network: Network) -> bool:
    """Return whether vehicles are as slow as bicycles where they could be faster."""
    tops = use.top_speeds()
    lanes = [network.lanes[lane] for lane in use.lanes]
    open_lanes = all("bicycle" in lane.allowed for lane in lanes)
    if len(tops) < _LEAST_VEHICLES or not lanes or not open_lanes:
        return False
    rows = use.lanes.total()
    faster = sum(n for lane, n in use.lanes.items() if network.lanes[lane].speed >= _DRIVING)
    return faster >= 0.5 * rows and float(np.quantile(tops, _MOST)) < _CYCLING
