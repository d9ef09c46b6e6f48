"""Compare the angles, speeds and times of a log with the way that its vehicles go."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sumo3dviz_pt.errors import cut
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.traffic import FASTEST, GAP_FACTOR, Trace, TrafficLog
from sumo3dviz_pt.sumo.plausibility.places import LEAST
from sumo3dviz_pt.sumo.plausibility.sample import Finding, LogSample

_TURNED = 30.0
"""Median angle between logged and true direction from which on it is said [deg]."""

_EXPLAINED = 10.0
"""Largest median angle that is left when the true meaning of the angles is found [deg]."""

_FAR = 1.0
"""Length of a step whose direction and speed can be told [m]."""

_RATIOS = (0.75, 1.33)
"""Logged speeds over true ones that pass; values between steps differ a little."""

_UNITS = {3.6: "km/h", 2.237: "mph", 3.281: "feet per second", 100.0: "cm/s"}
"""Units of speed by their number in 1 m/s."""

_STRAY = 100.0
"""How much longer a step must be than any vehicle can go in its time for a row to be astray [m]."""

_COARSE = 2.0
"""Time between rows of a vehicle from which on its motion has to be guessed [s]."""

_LEAPS = 0.1
"""Share of steps faster than any vehicle from which on a log is doubted."""


def movement_findings(sample: LogSample) -> tuple[Finding, ...]:
    """Return what is wrong with the angles and speeds of a log.

    Args:
        sample: Steps of the log.
    """
    sure = sample.where(sample.lengths > _FAR)
    if len(sure) < LEAST:
        return ()
    leaping = float((sure.lengths > FASTEST * sure.spans).mean())
    if leaping > _LEAPS:
        text = (
            f"in {100 * leaping:.0f} % of the steps vehicles are faster than {FASTEST:g} m/s: ids,"
            " places or times are mixed up; write the log again"
        )
        return (Finding("leaps", text),)
    return tuple(each for each in (_angles(sure), _speeds(sure)) if each is not None)


def _angles(sample: LogSample) -> Finding | None:
    """Return what is wrong with angles."""
    ways = np.degrees(np.arctan2(sample.moves[:, 0], sample.moves[:, 1]))
    angles = (90.0 - np.degrees(sample.yaws) + 180.0) % 360.0 - 180.0
    off = _median_turn(angles, ways)
    if off < _TURNED:
        return None
    meanings = {
        "they seem to be radians; SUMO's are degrees": np.degrees(angles),
        "they seem to count counter-clockwise from east; SUMO's count clockwise from north": 90.0
        - angles,
        "they seem to be radians from east; SUMO's are degrees clockwise from north": 90.0
        - np.degrees(angles),
        "they seem to point backwards": angles + 180.0,
    }
    found = [why for why, meant in meanings.items() if _median_turn(meant, ways) < _EXPLAINED]
    why = found[0] if found else "they are not those of the vehicles"
    text = (
        f"the angles are typically {off:.0f} degrees off the way that vehicles go: {why};"
        " convert the column angle"
    )
    return Finding("angles", text, hopeless=True)


def _median_turn(angles: Floats, ways: Floats) -> float:
    """Return the median turn between directions [deg]."""
    return float(np.median(np.abs((angles - ways + 180.0) % 360.0 - 180.0)))


def _speeds(sample: LogSample) -> Finding | None:
    """Return what is wrong with speeds."""
    logged = np.isfinite(sample.speeds)
    if logged.sum() < LEAST:
        return None
    some = sample.where(logged)
    ratio = float(np.median(some.speeds * some.spans / some.lengths))
    if _RATIOS[0] <= ratio <= _RATIOS[1]:
        return None
    if abs(ratio / 1e3 - 1.0) < 0.05:
        return Finding("times", "the times seem to be milliseconds; convert them to seconds")
    units = [unit for factor, unit in _UNITS.items() if abs(ratio / factor - 1.0) < 0.05]
    what = "one of the two has another unit; positions must be metres, times seconds"
    if units:
        what = f"it seems to be {units[0]}; convert it to m/s"
    return Finding(
        "speeds",
        f"the column speed is typically {ratio:.3g} times the distance that is driven in a second:"
        f" {what}",
    )


# Single rows -------------------------------------------------------------------------------


def stray_findings(log: TrafficLog) -> tuple[Finding, ...]:
    """Return which single rows lie far from the rows before and after them, if any do.

    A vehicle that SUMO teleports does not come back, and is not meant.

    Args:
        log: The log.
    """
    found = [(trace, row) for trace in log.traces for row in _strays(trace)]
    if not found:
        return ()
    trace, row = found[0]
    beside = row - 1 if row else 1
    away = float(np.linalg.norm(trace.positions[row, :2] - trace.positions[beside, :2]))
    around = trace.times[max(row - 1, 0) : row + 2]
    before, after = around[0], around[-1]
    rows, many = ("a row lies", "") if len(found) == 1 else (f"{len(found)} rows lie", "first ")
    text = (
        f'{rows} far from the rows before and after: {many}{trace.kind} "{cut(trace.id)}" at'
        f" {trace.times[row]:.12g} s, {away:,.0f} m away, so it is not drawn from {before:.12g} to"
        f" {after:.12g} s; mend the row, or write the log again"
    )
    return (Finding("strays", text),)


def _strays(trace: Trace) -> list[int]:
    """Return the rows to which and from which nobody can go, though past them one can.

    A first or last row from which, or to which, nobody can go is one, too.
    """
    if len(trace.times) < 3:
        return []
    places, times = trace.positions[:, :2], trace.times
    jumps = np.linalg.norm(np.diff(places, axis=0), axis=1) > _STRAY + FASTEST * np.diff(times)
    past = np.linalg.norm(places[2:] - places[:-2], axis=1) <= FASTEST * (times[2:] - times[:-2])
    inside: list[int] = (np.flatnonzero(jumps[:-1] & jumps[1:] & past) + 1).tolist()
    first = [0] if jumps[0] and not jumps[1] else []
    last = [len(times) - 1] if jumps[-1] and not jumps[-2] else []
    return [*first, *inside, *last]


# Times -------------------------------------------------------------------------------------


def time_findings(log: TrafficLog) -> tuple[Finding, ...]:
    """Return what is wrong with the times of a log's rows.

    Args:
        log: The log.
    """
    traces = [trace for trace in log.traces if trace.kind == "vehicle" and len(trace.times) > 1]
    if not traces:
        return ()
    found = (_coarse(traces), _hole(traces, log.step))
    return tuple(each for each in found if each is not None)


def _coarse(traces: Sequence[Trace]) -> Finding | None:
    """Return whether rows of one vehicle are too far apart for smooth motion."""
    step = float(np.median([np.median(np.diff(trace.times)) for trace in traces]))
    if step <= _COARSE:
        return None
    return Finding(
        "steps",
        f"each vehicle has a row every {step:g} s only, and what it does between is guessed; log"
        " every 1 s or less (sumo --step-length, --device.fcd.period)",
    )


def _hole(traces: Sequence[Trace], step: float) -> Finding | None:
    """Return the longest time without rows, if vehicles are on the road before and after it."""
    times = np.unique(np.concatenate([trace.times for trace in traces]))
    spans = np.diff(times)
    wide = np.flatnonzero(spans > max(GAP_FACTOR * step, 2.0 * float(np.median(spans)), 1.0))
    holes = []
    for number in wide.tolist():
        begin, end = times[number], times[number + 1]
        there = sum(trace.times[0] <= begin and end <= trace.times[-1] for trace in traces)
        if there:
            holes.append((float(end - begin), float(begin), there))
    if not holes:
        return None
    longest, begin, there = max(holes)
    many = f"{len(holes)} holes; the longest is" if len(holes) > 1 else "a hole"
    return Finding(
        "holes",
        f"the log has {many} from {begin:.12g} to {begin + longest:.12g} s, in which its"
        f" {there} vehicles are not drawn; write the log again, or film before or after it",
    )
