"""What `check --motion` found in a log's motion, as values and in words."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from math import degrees
from types import MappingProxyType
from typing import Any

WORST = 5
"""Number of findings of each kind that are listed in words."""

_MOST_LISTED = 20
"""The same for the kinds of `_LISTED`, which users can act on."""

FALLBACKS: Mapping[str, str] = MappingProxyType(
    {
        "no lanes": "the log names no lanes",
        "no route": "no route between two lanes fits",
        "off lane": "place contradicts the lane",
    }
)
"""Why motion does not follow the lanes, by the remark's kind."""

SPEEDS: Mapping[str, str] = MappingProxyType(
    {
        "last step": "each tells the way of the step before it (SUMO's Euler steps), so that"
        " places alone say how fast it goes between",
        "instant": "each holds at its instant and shapes the motion between",
        "unknown": "too few steps tell what they mean; they are taken as instants",
        "none": "the log has none; motion follows the places alone",
    }
)
"""What the log's speeds mean, by a word for it."""

_LISTED = ("teleport", "parking", "reversing", "steep", "unlike the log")
_UNITS: Mapping[str, str] = MappingProxyType(dict.fromkeys(("gap", *FALLBACKS), "s"))
"""Units of remarks that are not measured in metres; slopes are shown in degrees."""


@dataclass(frozen=True, slots=True)
class Finding:
    """Something that a road user does at a time and place.

    Attributes:
        id: SUMO's id of the road user.
        kind: What it does.
        time: When it begins or is worst [s].
        value: How large; the unit depends on the kind.
        lane: The lane or edge logged there, may be empty.
        x: Position of the front [m].
        y: Position of the front [m].
        z: Position of the front [m].
        end: When it ends [s]; the same time for a moment.
    """

    id: str
    kind: str
    time: float
    value: float
    lane: str
    x: float
    y: float
    z: float
    end: float


@dataclass(frozen=True, slots=True)
class Extreme:
    """How large one measure gets among all road users of a kind.

    Attributes:
        name: Name of the measure.
        unit: Its unit.
        p99: 99 % of all frames stay below it; NaN if there are none.
        worst: The largest value of each of the worst road users.
    """

    name: str
    unit: str
    p99: float
    worst: tuple[Finding, ...]


@dataclass(frozen=True, slots=True)
class UserGroup:
    """All road users of a kind.

    Attributes:
        kind: `vehicle`, `person` or `container`.
        users: Number of road users.
        seconds: Time for which all of them are shown together [s].
        extremes: Extremes of each measure.
        jumps: Frames that move further than 1.5 x logged speed / fps + 2 cm, without parking.
        broken: Frames with a value that is not a number.
    """

    kind: str
    users: int
    seconds: float
    extremes: tuple[Extreme, ...]
    jumps: int
    broken: int


@dataclass(frozen=True, slots=True)
class PopUps:
    """Who appears or vanishes within a shot's picture.

    Attributes:
        camera: Name of the shot's camera.
        begin: First time of the shot [s].
        end: Last time of the shot [s].
        births: Who appears, nearest first; the value is the distance from the eye [m].
        deaths: Who vanishes, nearest first; the value is the distance from the eye [m].
    """

    camera: str
    begin: float
    end: float
    births: tuple[Finding, ...]
    deaths: tuple[Finding, ...]


@dataclass(frozen=True, slots=True)
class MotionReport:
    """What was found in the motion of a log.

    Attributes:
        smoother: Name of the smoother.
        fps: Frame rate at which motion was measured [1/s].
        begin: First time of the log [s].
        end: Last time of the log [s].
        step: Step of the log [s].
        groups: Measures by kind of road user.
        births: Number of road users that appear within the log.
        deaths: Number of road users that vanish within the log.
        pop_ups: Who appears or vanishes in the pictures of the shots.
        speeds: What the log's speeds mean, a key of `SPEEDS`.
        remarks: Everything noticed, in the order of kinds and time.
    """

    smoother: str
    fps: float
    begin: float
    end: float
    step: float
    groups: tuple[UserGroup, ...]
    births: int
    deaths: int
    pop_ups: tuple[PopUps, ...]
    speeds: str
    remarks: tuple[Finding, ...]

    def as_dict(self) -> dict[str, Any]:
        """Return all of it for JSON; what is not a number is null."""
        content: dict[str, Any] = _finite(asdict(self))
        return content


def _finite(value: Any) -> Any:
    """Return the same value with None for NaN and infinity, which JSON does not have."""
    if isinstance(value, dict):
        return {key: _finite(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(each) for each in value]
    if isinstance(value, float) and not abs(value) < float("inf"):
        return None
    return value


def in_words(report: MotionReport) -> str:
    """Return the report as text."""
    return "\n".join(_lines(report))


def _lines(report: MotionReport) -> Iterator[str]:
    users = ", ".join(f"{group.users} {group.kind}s" for group in report.groups)
    yield f"motion   smoother {report.smoother}, measured at {report.fps:g} fps"
    yield (
        f"log      {report.begin:.12g} to {report.end:.12g} s every {report.step:g} s:"
        f" {users or 'empty'}"
    )
    yield f"speeds   {SPEEDS[report.speeds]}"
    yield f"births   {report.births} within the log; deaths {report.deaths}"
    for shot in report.pop_ups:
        yield from _pop_up_lines(shot)
    yield from _remark_lines(report.remarks)
    for group in report.groups:
        yield from _group_lines(group)


def _pop_up_lines(shot: PopUps) -> Iterator[str]:
    """Yield the lines of one shot."""
    yield (
        f"  {shot.camera}, {shot.begin:.12g} to {shot.end:.12g} s: {len(shot.births)} appear in the"
        f" picture, {len(shot.deaths)} vanish"
    )
    for word, some in (("appears", shot.births), ("vanishes", shot.deaths)):
        for each in some[:WORST]:
            where = f"{each.value:.0f} m away{_where(each)}"
            yield f"    {each.id} {word} at {each.time:.12g} s, {where}"


def _where(finding: Finding) -> str:
    """Return the place of a finding in words."""
    lane = f" on {finding.lane}" if finding.lane else ""
    return f",{lane} at {finding.x:.1f}, {finding.y:.1f}"


def _remark_lines(remarks: Sequence[Finding]) -> Iterator[str]:
    """Yield the lines of all remarks, by kind."""
    kinds = dict.fromkeys(["gap", *_LISTED, *FALLBACKS, "lane change"])
    kinds |= dict.fromkeys(remark.kind for remark in remarks)
    for kind in kinds:
        some = [remark for remark in remarks if remark.kind == kind]
        if not some:
            continue
        users = len({remark.id for remark in some})
        seconds = sum(remark.end - remark.time for remark in some)
        why = f" ({FALLBACKS[kind]}; follows hermite there)" if kind in FALLBACKS else ""
        who = f"{users} road user{'s' * (users > 1)}"
        yield f"{kind:<14} {len(some)} times, {who}, {seconds:.1f} s together{why}"
        most = _MOST_LISTED if kind in _LISTED else WORST if kind != "lane change" else 0
        yield from _listed(some, most, _UNITS.get(kind, "m"))


def _listed(some: Sequence[Finding], most: int, unit: str) -> Iterator[str]:
    """Yield the lines of the largest remarks of a kind."""
    for each in sorted(some, key=lambda each: -abs(each.value))[:most]:
        span = f"{each.time:.12g} to {each.end:.12g} s"
        size = f"{each.value:.2f} {unit}" if each.kind != "steep" else f"{degrees(each.value):.0f}°"
        yield f"    {each.id}, {span}: {size}{_where(each)}"
    if 0 < most < len(some):
        yield f"    and {len(some) - most} more (--json lists them)"


def _group_lines(group: UserGroup) -> Iterator[str]:
    """Yield the lines of the extremes of a kind of road users."""
    yield ""
    yield f"{group.kind}s: {group.users}, {group.seconds:.0f} s of motion"
    if group.broken:
        yield f"  {group.broken} frames hold a value that is no number"
    yield f"  {group.jumps} frames jump further than 1.5 x logged speed / fps + 2 cm"
    for extreme in group.extremes:
        if not extreme.worst:
            continue
        yield f"  {extreme.name}: 99 % below {extreme.p99:.3g} {extreme.unit}; largest"
        yield from _table(extreme.worst, extreme.unit)


def _table(some: Iterable[Finding], unit: str) -> Iterator[str]:
    """Yield one line for each finding."""
    for each in some:
        yield f"    {each.value:9.3g} {unit}  {each.id} at {each.time:.2f} s{_where(each)}"
