"""Chooses vehicles to ride in: those that last a shot, drive most of it, and pass the place."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.traffic import GAP_FACTOR, Trace, VehicleType, unique_ids
from sumo3dviz_pt.pipeline.proposals.busiest import Busiest

_CARS = frozenset({"passenger", "taxi", "evehicle", "hov", "private", "custom1", "custom2"})
_TRAINS = frozenset({"rail", "rail_electric", "rail_fast", "rail_urban", "subway"})

_MOST, _MOST_LATER = 1200, 150  # traces of a kind that are looked at, then and at other times
_MOST_WINDOWS = 24  # of one trace
_MOVES = 0.5  # speed from which a vehicle drives [m/s]
_MOVING = 2.0 / 3.0  # share of the time that it must drive
_SHIFT = 5.0  # between windows that are tried where no vehicle lasts the first [s]
_TURN = 30.0  # what a turn of 90 degrees is worth [m]
_PASSES = 60.0  # and passing the place [m]
_LEAST = 15.0  # a ride leads farther than this [m]


@dataclass(frozen=True, slots=True)
class _RideKind:
    """What can be ridden in.

    Attributes:
        camera: Name of its camera.
        classes: Its vClasses.
        view: A name of `scene_templates/camera`: `driver` where the body has an interior.
    """

    camera: str
    classes: frozenset[str]
    view: str


_KINDS = (
    _RideKind("driver", _CARS, "driver"),
    _RideKind("bus", frozenset({"bus", "coach"}), "chase"),
    _RideKind("tram", frozenset({"tram", "cable_car"}), "chase"),
    _RideKind("train", _TRAINS, "chase"),
    _RideKind("bicycle", frozenset({"bicycle"}), "chase"),
)


@dataclass(frozen=True, slots=True)
class Ride:
    """A camera that rides.

    Attributes:
        camera: Its name.
        vehicle: Id of the vehicle.
        view: A name of `scene_templates/camera`.
        start: First time of its shot [s].
        end: Time after its last frame [s].
        metres: How far it drives [m].
    """

    camera: str
    vehicle: str
    view: str
    start: float
    end: float
    metres: float


def choose_rides(
    traces: Iterable[Trace], types: Mapping[str, VehicleType], found: Busiest
) -> tuple[list[Ride], list[str]]:
    """Return one ride of each kind of vehicle that the log has, and notes about the others.

    Args:
        traces: Of the log.
        types: Vehicle types by id.
        found: The moment, which rides keep where they can, and the place.
    """
    by_class: dict[str, list[Trace]] = {}
    traces = list(traces)
    for name, trace in zip(unique_ids(traces), traces, strict=True):
        kind = types.get(trace.type_id)
        if trace.kind == "vehicle" and kind is not None:
            named = trace if name == trace.id else replace(trace, id=name)
            by_class.setdefault(kind.vclass, []).append(named)
    rides, notes = [], []
    for ride in _KINDS:
        some = [trace for name in sorted(ride.classes) for trace in by_class.get(name, ())]
        if not some:
            continue
        best = _best(ride, some, found)
        if best is None:
            notes.append(
                f"no camera `{ride.camera}`: none of {len(some)} such vehicles drives two thirds"
                f" of {found.end - found.start:g} s without a gap"
            )
        else:
            rides.append(best)
    return rides, notes


def _best(kind: _RideKind, traces: list[Trace], found: Busiest) -> Ride | None:
    """The best ride while the other shots last; else at any other time."""
    length = found.end - found.start
    there = [t for t in traces if t.times[0] <= found.start and t.times[-1] >= found.end]
    for later, some, most in ((False, there, _MOST), (True, traces, _MOST_LATER)):
        best: tuple[float, Ride] | None = None
        for trace in some[:: max(1, -(-len(some) // most))]:
            starts = _windows(trace, length) if later else [found.start]
            for start in starts:
                value, metres = _worth(trace, start, start + length, found.place)
                if value > 0.0 and (best is None or value > best[0] + 1e-6):
                    ride = Ride(kind.camera, trace.id, kind.view, start, start + length, metres)
                    best = (value, ride)
        if best is not None:
            return best[1]
    return None


def _windows(trace: Trace, length: float) -> list[float]:
    """Begins of windows of a length [s] in which a road user is there, evenly spread."""
    starts = np.arange(np.ceil(trace.times[0] + 0.5), trace.times[-1] - length, _SHIFT)
    return [float(start) for start in starts[:: max(1, -(-len(starts) // _MOST_WINDOWS))]]


def _worth(trace: Trace, start: float, end: float, place: Floats) -> tuple[float, float]:
    """How good a ride is, 0 for one that cannot be filmed, and how far it leads [m].

    Args:
        trace: Of the vehicle.
        start: Of the shot [s].
        end: Of the shot [s].
        place: That it should pass, (3,) [m].
    """
    inside = slice(
        max(0, int(np.searchsorted(trace.times, start + 1e-6, side="right")) - 1),
        int(np.searchsorted(trace.times, end - 1e-6)) + 1,
    )
    times, places, yaws = trace.times[inside], trace.positions[inside], trace.yaws[inside]
    if len(times) < 2 or times[0] > start + 1e-6 or times[-1] < end - 1e-6:
        return 0.0, 0.0
    gaps = np.diff(times)
    if gaps.max() > GAP_FACTOR * float(np.median(gaps)) + 1e-6:
        return 0.0, 0.0
    steps = np.hypot(*np.diff(places[:, :2], axis=0).T)
    metres = float(steps.sum())
    drives = steps > _MOVES * gaps
    if float(gaps[drives].sum()) < _MOVING * float(gaps.sum()) or metres < _LEAST:
        return 0.0, metres
    turned = float(np.abs(np.angle(np.exp(1j * np.diff(yaws)))[drives].sum()))
    near = float(np.hypot(*(places[:, :2] - place[:2]).T).min())
    value = min(metres, 140.0) + _TURN * min(turned / (np.pi / 2.0), 1.5)
    return value + _PASSES * float(np.exp(-near / 30.0)), metres
