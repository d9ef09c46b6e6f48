"""A log's motion in words, and one road user's motion drawn.

The words, and the values behind them, are what `check --motion` found. The drawing shows how a road
user moves, on a map and over time.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from math import degrees
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from sumo3dviz_pt.model.geometry import Floats, arc_length
from sumo3dviz_pt.model.numbers import counted
from sumo3dviz_pt.model.trajectory import Remark
from sumo3dviz_pt.report.plots import PALETTE, new_figure, save_figure

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
class MotionFinding:
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
    worst: tuple[MotionFinding, ...]


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
    births: tuple[MotionFinding, ...]
    deaths: tuple[MotionFinding, ...]


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
    remarks: tuple[MotionFinding, ...]

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


def _where(finding: MotionFinding) -> str:
    """Return the place of a finding in words."""
    lane = f" on {finding.lane}" if finding.lane else ""
    return f",{lane} at {finding.x:.1f}, {finding.y:.1f}"


def _remark_lines(remarks: Sequence[MotionFinding]) -> Iterator[str]:
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
        yield f"{kind:<14} {counted(len(some), 'time')}, {who}, {seconds:.1f} s together{why}"
        most = _MOST_LISTED if kind in _LISTED else WORST if kind != "lane change" else 0
        yield from _listed(some, most, _UNITS.get(kind, "m"))


def _listed(some: Sequence[MotionFinding], most: int, unit: str) -> Iterator[str]:
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
        yield f"  {counted(group.broken, 'frame')} with a value that is no number"
    yield f"  {counted(group.jumps, 'frame')} with a jump above 1.5 x logged speed / fps + 2 cm"
    for extreme in group.extremes:
        if not extreme.worst:
            continue
        yield f"  {extreme.name}: 99 % below {extreme.p99:.3g} {extreme.unit}; largest"
        yield from _table(extreme.worst, extreme.unit)


def _table(some: Iterable[MotionFinding], unit: str) -> Iterator[str]:
    """Yield one line for each finding."""
    for each in some:
        yield f"    {each.value:9.3g} {unit}  {each.id} at {each.time:.2f} s{_where(each)}"


_SHOWN, _LOGGED = PALETTE[0], PALETTE[3]
_ACROSS = PALETTE[2]
_COLOURS: Mapping[str, str] = MappingProxyType(
    {
        "lane change": PALETTE[5],
        "parking": PALETTE[1],
        "reversing": PALETTE[4],
        "no lanes": "0.55",
        "no route": "#b3a000",
        "off lane": "#8c564b",
        "gap": "0.25",
        "teleport": "0.25",
        "steep": "#7b4fb5",
    }
)
_OTHER = "#7b4fb5"
_MOST_BODIES = 40
"""About the largest number of outlines of the body on the map."""

_MOST_LABELS = 7
"""Largest number of clock times on the map."""

_ROOM = 12.0
"""Smallest distance between the path and the border of the map [m]."""

_WIDE = 1.7
"""A map whose width is more than this many times its height lies above the panels."""

_FINE = 300.0
"""Largest size of a map on which lanes can be told apart [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class MotionCourse:
    """A road user's values over time, as shown or as logged.

    Attributes:
        times: (n,) [s].
        places: Positions of the front, (n, 2) [m].
        yaws: (n,) [rad].
        speeds: (n,) [m/s].
        offsets: Distances from the lane's centre, positive to the left, (n,) [m].
        accelerations: Accelerations along the path, (n,) [m/s2]; empty where unknown.
        sideways: Accelerations to the left, (n,) [m/s2]; empty where unknown.
    """

    times: Floats
    places: Floats
    yaws: Floats
    speeds: Floats
    offsets: Floats
    accelerations: Floats
    sideways: Floats


@dataclass(frozen=True, slots=True, eq=False)
class Road:
    """A lane to draw.

    Attributes:
        shape: Centre line, (n, 2) [m].
        width: Width of the lane [m].
        inside: Whether it lies inside a junction.
    """

    shape: Floats
    width: float
    inside: bool


@dataclass(frozen=True, slots=True, eq=False)
class Drive:
    """What is drawn of a road user.

    Attributes:
        title: Name of the road user.
        subtitle: What is shown of it.
        shown: Its motion as displayed.
        logged: Its samples.
        roads: Lanes near it.
        remarks: What was noticed.
        size: Length and width of the body [m].
    """

    title: str
    subtitle: str
    shown: MotionCourse
    logged: MotionCourse
    roads: Sequence[Road]
    remarks: Sequence[Remark]
    size: tuple[float, float]


def motion_plot(drive: Drive, path: Path) -> None:
    """Write the picture of a drive.

    Args:
        drive: What to draw.
        path: The PNG to write.
    """
    # Put the map above the panels or beside them.
    low, high = _extent(drive)
    width, height = (high - low).tolist()
    figure = new_figure(14.0, 8.4)
    figure.suptitle(drive.title, x=0.008, ha="left", fontsize=14, weight="bold")
    if width > _WIDE * height:
        grid = figure.add_gridspec(3, 2, height_ratios=(1.35, 1.0, 1.0))
        place, panels = grid[0, :], [grid[row, column] for column in (0, 1) for row in (1, 2)]
    else:
        grid = figure.add_gridspec(4, 2, width_ratios=(1.1, 1.0))
        place, panels = grid[:, 0], [grid[row, 1] for row in range(4)]
    # Draw the map and the panels.
    _draw_map(figure.add_subplot(place), drive, low, high)
    axes = [figure.add_subplot(panels[0])]
    axes += [figure.add_subplot(panel, sharex=axes[0]) for panel in panels[1:]]
    _draw_panels(axes, drive)
    # Mark the remarks, and explain all colours.
    handles = _shade(axes, drive)
    handles = [*axes[0].get_legend_handles_labels()[0], *handles]
    figure.legend(handles=handles, loc="outside lower right", ncols=8, frameon=False, fontsize=9)
    save_figure(figure, path)


# The map ----------------------------------------------------------------------------------


def _extent(drive: Drive) -> tuple[Floats, Floats]:
    """Return the corners of the map, (2,) each [m]: the path with some road around it."""
    places = np.concatenate([drive.shown.places, drive.logged.places])
    places = places[np.isfinite(places).all(axis=1)]
    low, high = places.min(axis=0), places.max(axis=0)
    room = max(0.06 * float((high - low).max()), _ROOM)
    return low - room, high + room


def _draw_map(axis: Any, drive: Drive, low: Floats, high: Floats) -> None:
    """Draw lanes, path, samples and bodies seen from above.

    Args:
        axis: Where to draw.
        drive: What to draw.
        low: Lower left corner of the map, (2,) [m].
        high: Upper right corner, (2,) [m].
    """
    shown, logged = drive.shown, drive.logged
    fine = bool((high - low).max() < _FINE)
    _draw_roads(axis, drive.roads, fine=fine)
    _draw_bodies(axis, drive)
    axis.plot(*shown.places.T, color=_SHOWN, lw=1.8, zorder=4, solid_joinstyle="round")
    for remark in drive.remarks:
        inside = (shown.times >= remark.begin - 0.02) & (shown.times <= remark.end + 0.02)
        colour = _COLOURS.get(remark.kind, _OTHER)
        axis.plot(*shown.places[inside].T, color=colour, lw=5, alpha=0.45, zorder=3)
    dot = {"ms": 4.5, "mew": 0.6, "mec": "white"} if fine else {"ms": 2.2, "mew": 0.0}
    axis.plot(*logged.places.T, "o", color=_LOGGED, zorder=5, **dot)
    _label_times(axis, logged)
    axis.set_aspect("equal", adjustable="datalim")
    axis.update_datalim(np.stack([low, high]))
    axis.margins(0.0)
    axis.ticklabel_format(useOffset=False, style="plain")
    axis.set(xlabel="x [m]", ylabel="y [m]")
    axis.set_title(drive.subtitle, loc="left", fontsize=10)
    axis.set_facecolor("#f6f7f4")


def _draw_roads(axis: Any, roads: Sequence[Road], *, fine: bool) -> None:
    """Draw lanes as bands; on a fine map also with borders and centre lines."""
    from matplotlib.collections import LineCollection, PolyCollection

    for inside, colour in ((True, "#dcdcdc"), (False, "#cfcfcf")):
        bands = [_band(road) for road in roads if road.inside == inside]
        edge = "none" if inside else "white" if fine else colour
        filled = PolyCollection(bands, fc=colour, ec=edge, lw=0.7, zorder=1)
        axis.add_collection(filled, autolim=False)
    if fine:
        lines = LineCollection([road.shape for road in roads], colors="0.6", lw=0.6, zorder=2)
        lines.set_linestyle((0, (4, 3)))
        axis.add_collection(lines, autolim=False)


def _band(road: Road) -> Floats:
    """Return a lane's outline, (n, 2) [m]."""
    along = np.gradient(road.shape, axis=0)
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-9)
    side = 0.5 * road.width * np.stack([-along[:, 1], along[:, 0]], axis=1)
    return np.concatenate([road.shape + side, (road.shape - side)[::-1]])


def _draw_bodies(axis: Any, drive: Drive) -> None:
    """Draw outlines of the body at the times of some samples."""
    from matplotlib.collections import PolyCollection

    shown = drive.shown
    every = max(1, -(-len(drive.logged.times) // _MOST_BODIES))
    places = np.searchsorted(shown.times, drive.logged.times[::every] - 1e-6)
    places = np.unique(places[places < len(shown.times)])
    length, width = drive.size
    corners = np.array([[0, 1], [0, -1], [-2, -1], [-2, 1]]) * [length / 2, width / 2]
    boxes = []
    for place in places[np.isfinite(shown.yaws[places])].tolist():
        cosine, sine = np.cos(shown.yaws[place]), np.sin(shown.yaws[place])
        turn = np.array([[cosine, sine], [-sine, cosine]])
        boxes.append(corners @ turn + shown.places[place])
    colour = (*_rgb(_SHOWN), 0.13)
    filled = PolyCollection(boxes, fc=colour, ec=_SHOWN, lw=0.6, zorder=3)
    axis.add_collection(filled, autolim=False)


def _rgb(colour: str) -> tuple[float, float, float]:
    from matplotlib.colors import to_rgb

    red, green, blue = to_rgb(colour)
    return red, green, blue


def _label_times(axis: Any, logged: MotionCourse) -> None:
    """Write clock times beside some samples that lie apart."""
    travelled = arc_length(logged.places)
    wanted = np.linspace(0.0, travelled[-1], _MOST_LABELS)
    chosen = np.unique(np.clip(np.searchsorted(travelled, wanted), 0, len(travelled) - 1))
    if travelled[-1] < 1.0:
        chosen = chosen[:1]
    for place in chosen.tolist():
        axis.annotate(
            f"{logged.times[place]:.12g} s", logged.places[place], (7, 7), fontsize=8, zorder=6,
            textcoords="offset points", path_effects=_halo(), color="0.15",
        )  # fmt: skip


def _halo() -> list[Any]:
    """Return a white rim that keeps labels legible."""
    from matplotlib.patheffects import withStroke

    return [withStroke(linewidth=2.5, foreground="white")]


# Over time --------------------------------------------------------------------------------


def _draw_panels(axes: Sequence[Any], drive: Drive) -> None:
    """Draw speed, acceleration, heading and place in the lane over time."""
    shown, logged = drive.shown, drive.logged
    dots = {"ls": "", "marker": ".", "ms": 5, "mew": 0, "color": _LOGGED, "zorder": 4}
    # Curves of the shown motion, and dots for samples.
    speed, push, heading, offset = axes
    speed.plot(shown.times, shown.speeds, color=_SHOWN, lw=1.5, label="shown")
    speed.plot(logged.times, logged.speeds, label="logged", **dots)
    push.plot(shown.times, shown.accelerations, color=_SHOWN, lw=1.3, label="along")
    push.plot(shown.times, shown.sideways, color=_ACROSS, lw=1.1, label="to the left")
    above = {"loc": "lower right", "bbox_to_anchor": (1.0, 0.99), "borderaxespad": 0.0}
    push.legend(frameon=False, fontsize=8.5, ncols=2, **above)
    turned = _unwrapped(shown.yaws)
    heading.plot(shown.times, np.degrees(turned), color=_SHOWN, lw=1.5)
    heading.plot(logged.times, np.degrees(_beside(logged, shown, turned)), **dots)
    offset.plot(shown.times, _broken(shown.offsets), color=_SHOWN, lw=1.5)
    offset.plot(logged.times, logged.offsets, **dots)
    # Titles and scales.
    titles = ("speed [m/s]", "acceleration [m/s²]", "heading [deg, from east]",
              "left of the lane's centre [m]")  # fmt: skip
    for axis, title, least in zip(axes, titles, (2.0, 2.0, 4.0, 1.0), strict=True):
        axis.set_title(title, loc="left", fontsize=9.5, pad=3)
        axis.grid(visible=True, alpha=0.3, lw=0.6)
        axis.tick_params(labelsize=8.5)
        axis.ticklabel_format(useOffset=False)
        axis.margins(x=0.01)
        _widen(axis, least)
    speed.set_ylim(bottom=min(0.0, speed.get_ylim()[0]) - 0.02 * speed.get_ylim()[1])
    for axis in axes:
        last = axis.get_subplotspec().is_last_row()
        axis.tick_params(labelbottom=last)
        axis.set_xlabel("time [s]" if last else "")


def _widen(axis: Any, least: float) -> None:
    """Make an axis span at least `least`, so that noise does not look like motion."""
    low, high = axis.get_ylim()
    if high - low < least:
        middle = (low + high) / 2.0
        axis.set_ylim(middle - least / 2.0, middle + least / 2.0)


def _unwrapped(yaws: Floats) -> Floats:
    """Return yaws without jumps of 360 degrees; NaN stays."""
    turned = yaws.copy()
    known = np.isfinite(yaws)
    turned[known] = np.unwrap(yaws[known])
    return turned


def _beside(logged: MotionCourse, shown: MotionCourse, turned: Floats) -> Floats:
    """Return logged headings plus the full turns that bring them nearest those shown [rad]."""
    known = np.isfinite(turned)
    if not known.any():
        return logged.yaws
    near = np.interp(logged.times, shown.times[known], turned[known])
    return np.asarray(near + np.mod(logged.yaws - near + np.pi, 2.0 * np.pi) - np.pi)


def _broken(offsets: Floats) -> Floats:
    """Return offsets with a gap where another lane becomes the nearest."""
    shown = offsets.copy()
    shown[1:][np.abs(np.diff(offsets)) > 0.5] = np.nan
    return shown


def _shade(axes: Sequence[Any], drive: Drive) -> list[Any]:
    """Shade remarks in all panels, and return their handles for the legend."""
    from matplotlib.patches import Patch

    first, last = drive.shown.times[[0, -1]]
    for remark in drive.remarks:
        colour = _COLOURS.get(remark.kind, _OTHER)
        begin, end = max(remark.begin, first), min(remark.end, last)
        for axis in axes:
            axis.axvspan(begin, max(end, begin), color=colour, alpha=0.25, lw=0.8, zorder=0)
    kinds = dict.fromkeys(remark.kind for remark in drive.remarks)
    return [Patch(color=_COLOURS.get(kind, _OTHER), alpha=0.35, label=kind) for kind in kinds]
