"""Which lamps of a vehicle are lit, and how bright they are.

What the log says (SUMO's signal bits) counts. Where it says nothing, lamps are derived from how the
vehicle moves. All is decided once for a whole stretch of motion, as spans of time, so that no lamp
flickers from frame to frame: brake lamps with two thresholds and a shortest time, indicators for
turns that lie ahead on the path and for lane changes.

After sunset all vehicles have head and tail lamps on, and by day where weather hides much. In dense
fog, fog lamps at both ends are lit, too.

References:
    Luminous intensities on the axis, between the limits of UN Regulations 7 (tail 4-17
    cd, brake 60-260 cd), 6 (indicators 175-1000 cd in front, 50-500 behind), 23
    (reversing 80-300 cd), 38 (rear fog lamps, 150-300 cd) and 65 (blue, 120-1700 cd). To the
    sides they fall as far as the standard light distribution of Regulation 7 lets them (annex 4:
    a tenth at 20 degrees).
    Front fog lamps: Regulation 19 (class F3), which caps their light above the horizon; some 60 cd
    reach an oncoming eye. They throw no beam of their own here.
    Head lamps towards oncoming eyes: Regulation 112, point B50L, at most 350 cd; a lens
    gives 25 cd in all directions, beside the 170 cd of stray light that are in the beam.
    Bicycles: German type approval (StVZO section 67, technical requirements no. 23) asks
    for 10 lx at 10 m, which are 1000 cd; lamps on the market give more.
    UN Regulation 13-H, 5.2.22.4: retarders light brake lamps above 1.3 m/s^2 and do not
    below 0.7 m/s^2. At speed, SUMO's own rule asks for more (MSVehicle, pseudo friction): its
    drivers dawdle, and every second car of a motorway would flash.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache

import numpy as np

from sumo3dviz_pt.library.vehicles.lamps import HALF_ANGLE, PEAK, beam_pattern
from sumo3dviz_pt.model.geometry import Bools, Colour, Floats, Ints
from sumo3dviz_pt.model.layers import LUMINANCE
from sumo3dviz_pt.model.random import share_of
from sumo3dviz_pt.model.scene import (
    CANDELAS_PER_UNIT,
    Beam,
    Lobe,
    Prototype,
    RunningLights,
    VehicleLamp,
)
from sumo3dviz_pt.model.traffic import Trace, unique_ids
from sumo3dviz_pt.model.trajectory import Motion, MotionPiece, Remark
from sumo3dviz_pt.model.weather import WeatherCourse

_STEP = 0.1  # [s]
_MEAN = 9
"""Steps over which speeds are averaged before they are differentiated."""

_BRAKES, _RELEASES = 1.3, 0.55
"""Slowing down harder than the one lights brake lamps [m/s^2]; less than this share of what
lights them puts them out."""

_FRICTION = (0.05, 0.005)
"""Without brakes, SUMO's vehicles lose this much by speed and speed squared [1/s, 1/m]."""

_STANDS, _GOES = 0.1, 0.4
"""Slower than the one is standing, with a foot on the brake; faster than the other is not [m/s]."""

_SHORTEST = 0.4
"""Lamps are not lit, and not put out, for less [s]."""

_WAY = 1.0  # between points of the path [m]
_ARC = 4.0
"""Of path over which its curvature is taken [m]."""

_WIDEST = 32.0
"""Bends of a larger radius are the road's own [m]."""

_LEAST_TURN = float(np.radians(35.0))
"""Smaller changes of direction are no turns [rad]."""

_WARNING_TIME, _WARNING_WAY = 3.0, 30.0
"""Indicators are set this long, or on this way, before a turn, whichever is earlier [s, m]."""

_LANE_CHANGE = 2.0
"""Indicators are set this long before a lane change [s]."""

Spans = tuple[tuple[float, float], ...]
"""Begins and ends [s], in order."""


@dataclass(frozen=True, slots=True)
class DerivedLamps:
    """When the lamps of a stretch of motion shine.

    Attributes:
        spans: By role: `brake`, `left`, `right`, `reverse`.
    """

    spans: Mapping[str, Spans]

    def roles_at(self, time: float) -> frozenset[str]:
        """Return roles that shine at a time [s]; indicators between their blinks, too."""
        return frozenset(
            role
            for role, spans in self.spans.items()
            if any(begin <= time <= end for begin, end in spans)
        )


def derived_lamps(
    piece: MotionPiece, remarks: Sequence[Remark] = (), *, steers: bool = True
) -> DerivedLamps:
    """Find when the lamps of a vehicle would shine.

    Args:
        piece: A stretch of its motion.
        remarks: On its trajectory; `reversing`, `lane change` and `parking` count.
        steers: Whether it chooses its way, and so shows it; not on rails.
    """
    count = max(2, int(np.ceil((piece.end - piece.begin) / _STEP)) + 1)
    times = np.linspace(piece.begin, piece.end, count)
    motion = piece.sample(times)
    parked = _during(remarks, "parking")
    spans = {
        "brake": _without(_spans(times, _braking(times, motion.speeds)), parked),
        "reverse": _during(remarks, "reversing"),
    }
    if steers:
        moves = [*_turns(times, motion), *_lane_changes(piece, remarks)]
        for role, side in (("left", 1), ("right", -1)):
            spans[role] = _merged((move.begin, move.end) for move in moves if move.side == side)
    return DerivedLamps({role: some for role, some in spans.items() if some})


def _braking(times: Floats, speeds: Floats) -> Bools:
    """Whether brake lamps are lit, (n,)."""
    if len(times) < 3 or float(np.max(speeds)) < _STANDS:
        return np.zeros(len(times), dtype=np.bool_)  # what never moves has no driver
    padded = np.pad(speeds, _MEAN // 2, mode="edge")
    mean = np.convolve(padded, np.ones(_MEAN) / _MEAN, mode="valid")
    change = np.gradient(mean, times)
    lost = np.maximum((_FRICTION[0] + _FRICTION[1] * mean) * mean, _BRAKES)
    wants = (change < -lost) | (speeds < _STANDS)
    leaves = (change > -_RELEASES * lost) & (speeds > _GOES)
    lit = _held(wants, leaves)
    least = round(_SHORTEST / _STEP)
    return _open(~_open(~lit, least), least)


def _held(sets: Bools, clears: Bools) -> Bools:
    """What stays as it was between two thresholds, (n,)."""
    state = np.where(sets, 1, np.where(clears, 0, -1))
    known = np.maximum.accumulate(np.where(state >= 0, np.arange(len(state)), 0))
    return np.asarray(state[known] == 1)


def _open(on: Bools, least: int) -> Bools:
    """Runs of fewer than so many steps are dropped, (n,)."""
    lit = on.copy()
    for first, last in _runs(on):
        if last - first < least and first > 0 and last < len(on):
            lit[first:last] = False
    return lit


def _runs(on: Bools) -> Iterator[tuple[int, int]]:
    """First index and the one behind the last of each run."""
    edges = np.diff(np.concatenate([[0], on.astype(np.int8), [0]]))
    yield from zip(
        np.flatnonzero(edges == 1).tolist(), np.flatnonzero(edges == -1).tolist(), strict=True
    )


def _spans(times: Floats, on: Bools) -> Spans:
    """Runs as spans of time."""
    last = len(times) - 1
    return tuple((float(times[a]), float(times[min(b, last)])) for a, b in _runs(on))


@dataclass(frozen=True, slots=True)
class _Indicated:
    """When indicators of one side are set.

    Attributes:
        begin: [s].
        end: [s].
        side: 1 for left, -1 for right.
    """

    begin: float
    end: float
    side: int


def _turns(times: Floats, motion: Motion) -> Iterator[_Indicated]:
    """Indicators for turns."""
    # Take headings of short chords along the path.
    ways = motion.travelled - motion.travelled[0]
    places = np.arange(0.0, float(ways[-1]), _WAY)
    if len(places) < 2 * _ARC / _WAY:
        return
    points = np.column_stack([np.interp(places, ways, c) for c in motion.positions[:, :2].T])
    arc = int(_ARC / _WAY)
    chords = points[arc:] - points[:-arc]
    headings = np.unwrap(np.arctan2(chords[:, 1], chords[:, 0]))
    middles = places[:-arc] + _ARC / 2.0
    curvature = np.gradient(headings, _WAY)
    # Tight bends that turn far enough are turns.
    for side in (1, -1):
        for first, last in _runs(side * curvature > 1.0 / _WIDEST):
            turned = side * (headings[last - 1] - headings[first])
            if turned < _LEAST_TURN:
                continue
            begins, ends = float(middles[first]), float(middles[last - 1])
            early = float(np.interp(max(begins - _WARNING_WAY, 0.0), ways, times))
            begin = min(early, float(np.interp(begins, ways, times)) - _WARNING_TIME)
            yield _Indicated(begin, float(np.interp(ends, ways, times)), side)


def _lane_changes(piece: MotionPiece, remarks: Iterable[Remark]) -> Iterator[_Indicated]:
    """Indicators for lane changes; the way that the vehicle takes tells the side."""
    for remark in remarks:
        if remark.kind != "lane change" or remark.end < piece.begin or remark.begin > piece.end:
            continue
        ends = np.clip([remark.begin, remark.end], piece.begin, piece.end)
        motion = piece.sample(ends)
        move = motion.positions[1, :2] - motion.positions[0, :2]
        # In a bend, half of the turn is the road's.
        turn = (motion.yaws[1] - motion.yaws[0] + np.pi) % (2.0 * np.pi) - np.pi
        yaw = motion.yaws[0] + turn / 2.0
        side = 1 if np.cos(yaw) * move[1] - np.sin(yaw) * move[0] > 0.0 else -1
        yield _Indicated(float(ends[0]) - _LANE_CHANGE, float(ends[1]), side)


def _during(remarks: Iterable[Remark], kind: str) -> Spans:
    """When remarks of a kind hold."""
    return tuple((remark.begin, remark.end) for remark in remarks if remark.kind == kind)


def _without(spans: Spans, others: Spans) -> Spans:
    """Spans that end where one of others begins."""
    left = []
    for begin, end in spans:
        cuts = [first for first, last in others if first < end and last > begin]
        if not cuts or min(cuts) > begin:
            left.append((begin, min([end, *cuts])))
    return tuple(left)


def _merged(spans: Iterable[tuple[float, float]]) -> Spans:
    """Spans in order; those that meet, or nearly, are one."""
    joined: list[tuple[float, float]] = []
    for begin, end in sorted(spans):
        if joined and begin <= joined[-1][1] + 1.0:
            joined[-1] = (joined[-1][0], max(end, joined[-1][1]))
        else:
            joined.append((begin, end))
    return tuple(joined)


BLINKS_PER_SECOND = 1.5
"""Of indicators (UN Regulation 6: 60 to 120 a minute)."""

FLASHES_PER_SECOND = 2.0
"""Of blue lamps, each flash a double one (UN Regulation 65: 2 to 4 Hz)."""

_FLASHES = ((0.0, 0.2), (0.3, 0.5))
"""Shares of a period in which blue lamps shine."""


@dataclass(frozen=True, slots=True)
class _Light:
    """What a lamp gives.

    Attributes:
        candelas: On its axis [cd].
        colour: Linear, of any brightness.
    """

    candelas: float
    colour: Colour


# fmt: off
_LIGHTS: Mapping[str, _Light] = {
    # role            candelas  colour
    "head":    _Light(25.0,     (1.0, 0.96, 0.9)),
    "tail":    _Light(10.0,     (1.0, 0.02, 0.01)),
    "brake":   _Light(110.0,    (1.0, 0.02, 0.01)),
    "left":    _Light(200.0,    (1.0, 0.33, 0.0)),
    "right":   _Light(200.0,    (1.0, 0.33, 0.0)),
    "reverse": _Light(150.0,    (1.0, 0.97, 0.92)),
    "blue":    _Light(500.0,    (0.02, 0.08, 1.0)),
    "fog":     _Light(200.0,    (1.0, 0.02, 0.01)),
    "front_fog": _Light(60.0,   (1.0, 0.96, 0.9)),
    "sign":    _Light(8.0,      (1.0, 0.9, 0.6)),
    "dials":   _Light(9.0e-5,   (1.0, 0.95, 0.88)),
    "screen":  _Light(5.0e-4,   (0.35, 0.6, 1.0)),
}
# fmt: on

_LOBES: Mapping[str, Lobe] = {
    "tail": Lobe(0.25, 15.0),
    "brake": Lobe(0.1, 25.0),
    "fog": Lobe(0.1, 25.0),
    "front_fog": Lobe(0.3, 6.0),
    "left": Lobe(0.15, 25.0),
    "right": Lobe(0.15, 25.0),
    "reverse": Lobe(0.3, 10.0),
    "blue": Lobe(0.5, 10.0),
}

_BICYCLE = 1500.0
"""Peak of a bicycle's head lamp [cd]: 15 lx at 10 m."""

_SMALL = 0.06
"""A single head lamp that is no larger belongs to a bicycle [m]."""

_BITS: Mapping[str, int] = {"right": 1, "left": 2, "brake": 8, "reverse": 128, "blue": 2048}
"""SUMO's signal bits (VehicleSignals)."""

_AT_NIGHT = frozenset({"head", "tail", "sign", "dials", "screen"})
"""Roles that everyone lights after sunset; the last two are on the dashboard."""

_FREE = "sign"
"""Role of the sign on a taxi's roof, which tells that nobody has taken it."""

_BY_DAY = frozenset({"head", "tail"})
"""Roles that everyone lights by day where weather hides much."""

_ONCOMING = _Light(200.0, (1.0, 0.96, 0.9))
"""Head lamps by day, which have no beam beside them that would dazzle."""

_FOG, _FRONT_FOG = "fog", "front_fog"
"""Roles of rear and front fog lamps."""

_WARNING = 4  # both indicators


@dataclass(frozen=True, slots=True, eq=False)
class _Log:
    """The signal bits of one vehicle, (n,) [s] and (n,)."""

    times: Floats
    bits: Ints


@dataclass(frozen=True, slots=True, eq=False)
class VehicleLights:
    """Which lamps are lit.

    Attributes:
        logs: Signal bits by key of the vehicles whose log has them.
        dark: Whether everyone has lights on.
        seed: Of the indicators' phases.
        weather: Over time, or None.
        taken: When people ride in a vehicle, by key: the sign on the roof of a taxi is off then.
    """

    logs: Mapping[str, _Log]
    dark: bool
    seed: int
    weather: WeatherCourse | None = None
    taken: Mapping[str, Spans] = field(default_factory=dict)

    def lit(self, key: str, time: float, *, derived: Callable[[], DerivedLamps]) -> frozenset[str]:
        """Return roles of the lamps of a vehicle that shine.

        Args:
            key: The vehicle's.
            time: SUMO's time [s].
            derived: Finds what its motion says; called only where the log says nothing.
        """
        roles = self._always(time)
        if any(begin <= time <= end for begin, end in self.taken.get(key, ())):
            roles -= {_FREE}
        log = self.logs.get(key)
        if log is None:
            shown = derived().roles_at(time)
        else:
            # A row tells of the step before it: were it held after its time, vehicles that set
            # off would still brake.
            row = min(int(np.searchsorted(log.times, time - 1e-9)), len(log.times) - 1)
            shown = _roles_of(int(log.bits[row]))
        return roles | shown - self._dark_now(key, time) if shown else roles

    def _always(self, time: float) -> frozenset[str]:
        """Roles that everyone lights at a time, whatever they do."""
        roles = _AT_NIGHT if self.dark else frozenset[str]()
        if self.weather is None:
            return roles
        now = self.weather.at(time)
        roles |= _BY_DAY if now.is_murky else frozenset()
        return roles | ({_FOG, _FRONT_FOG} if now.is_dense else frozenset())

    def _dark_now(self, key: str, time: float) -> frozenset[str]:
        """Roles that are in the dark part of their period; one vehicle's lamps keep time."""
        share = share_of(self.seed, key, "blink")
        blinks = (time * BLINKS_PER_SECOND + share) % 1.0 < 0.5
        flash = (time * FLASHES_PER_SECOND + share) % 1.0
        bright = any(begin <= flash < end for begin, end in _FLASHES)
        return frozenset(() if blinks else ("left", "right")) | frozenset(
            () if bright else ("blue",)
        )


@cache
def _roles_of(bits: int) -> frozenset[str]:
    """Roles that signal bits stand for."""
    shown = {role for role, bit in _BITS.items() if bits & bit}
    return frozenset(shown | {"left", "right"} if bits & _WARNING else shown)


def vehicle_lights(
    traces: Sequence[Trace],
    *,
    dark: bool,
    seed: int,
    weather: WeatherCourse | None = None,
    taken: Mapping[str, Spans] | None = None,
) -> VehicleLights:
    """Read which vehicles have a log of their signals.

    Args:
        traces: Of everyone.
        dark: Whether lamps are lit.
        seed: The job's.
        weather: Over time, or None.
        taken: When people ride in a vehicle, by key.
    """
    logs = {
        f"{trace.kind}:{name}": _Log(trace.times, np.maximum(trace.signals, 0))
        for trace, name in zip(traces, unique_ids(traces), strict=True)
        if trace.kind == "vehicle" and (trace.signals >= 0).any()
    }
    return VehicleLights(logs, dark, seed, weather, taken or {})


def running_lights(
    prototypes: Iterable[Prototype],
    *,
    dark: bool,
    left_hand: bool,
    weather: WeatherCourse | None = None,
) -> RunningLights | None:
    """Return the lamps that vehicles of a shot can light, or None if there are none.

    Args:
        prototypes: What is in view.
        dark: Whether head and tail lamps are on.
        left_hand: Whether traffic keeps left.
        weather: Over time, or None.
    """
    bodies = tuple(prototypes)
    roles = {lamp.role for body in bodies for lamp in body.lamps}
    heads = {body.name: _head_share(body) for body in bodies}
    shown = roles if dark else roles - _AT_NIGHT
    if weather is not None and weather.is_ever_murky:
        shown |= roles & _BY_DAY
    if not shown:
        return None
    lights = _LIGHTS if dark else {**_LIGHTS, "head": _ONCOMING}
    intensity = {role: _intensity(lights[role]) for role in sorted(shown)}
    if not (dark and "head" in roles):
        return RunningLights(intensity, None, dark, _LOBES)
    pattern = beam_pattern(left_hand=left_hand)
    peak = _intensity(_Light(2.0 * PEAK, _LIGHTS["head"].colour))
    beam = Beam(pattern, HALF_ANGLE, peak)
    return RunningLights(intensity, beam, dark, _LOBES, heads)


def in_fog(
    bodies: Mapping[str, Prototype], weather: WeatherCourse | None, *, left_hand: bool
) -> Mapping[str, Prototype]:
    """Return bodies by name, with fog lamps where the weather is ever so dense.

    Args:
        bodies: As they are in clear weather.
        weather: Over time, or None.
        left_hand: Whether traffic keeps left.
    """
    if weather is None or not weather.is_ever_dense:
        return bodies
    return {name: _with_fog_lamps(body, left_hand=left_hand) for name, body in bodies.items()}


def _with_fog_lamps(body: Prototype, *, left_hand: bool) -> Prototype:
    """A body with a rear fog lamp on the side of oncoming traffic, and with two in front."""
    heads, tails = (
        sorted((lamp for lamp in body.lamps if lamp.role == role), key=lambda lamp: lamp.at[1])
        for role in ("head", "tail")
    )
    lamps = []
    if len(tails) >= 2:
        lamps.append(_below(tails[0 if left_hand else -1], _FOG))
    if len(heads) >= 2:
        lamps += [_below(head, _FRONT_FOG) for head in (heads[0], heads[-1])]
    return replace(body, lamps=(*body.lamps, *lamps)) if lamps else body


def _below(lamp: VehicleLamp, role: str) -> VehicleLamp:
    """A fog lamp below another lamp."""
    x, y, z = lamp.at
    at = (x, _INWARDS * y, max(_LOWEST, z - _BELOW))
    return VehicleLamp(role, at, (_FOG_SIZE, _FOG_SIZE), lamp.yaw)


_INWARDS, _BELOW, _LOWEST, _FOG_SIZE = 0.8, 0.3, 0.35, 0.11
"""Place of a fog lamp against the lamp's above it: share of its way from the middle, how much
lower and how low at least [m]; and how large it is [m]."""


def _head_share(body: Prototype) -> float:
    """A body's head lamps against the two of a car."""
    sizes = [max(lamp.size) for lamp in body.lamps if lamp.role == "head"]
    if len(sizes) != 1:
        return 1.0
    return _BICYCLE / (2.0 * PEAK) if sizes[0] <= _SMALL else 0.5


def _intensity(light: _Light) -> Colour:
    """Radiant intensity of a lamp in scene units x m^2."""
    scale = light.candelas / CANDELAS_PER_UNIT / float(np.array(light.colour) @ LUMINANCE)
    red, green, blue = (scale * channel for channel in light.colour)
    return red, green, blue
