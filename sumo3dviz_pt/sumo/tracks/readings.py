"""What the numbers of a table of trajectories mean: units, where angles count from, what moves.

Where neither a data set's form nor a user says it, motion tells: a time is in the unit in which
people would drive at a possible speed, and an angle counts from where it follows the way that is
driven. What was told in this way is said.
"""

from __future__ import annotations

import csv
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from sumo3dviz_pt.errors import InputError, cut
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.network import Location
from sumo3dviz_pt.model.traffic import TableColumn
from sumo3dviz_pt.sumo.places import is_projected, net_from_geo
from sumo3dviz_pt.sumo.tracks.columns import Form
from sumo3dviz_pt.sumo.tracks.tables import Cells, Table, Words, cells_of

METRES = {"m": 1.0, "ft": 0.3048, "cm": 0.01, "mm": 0.001, "km": 1000.0}
SPEEDS = {"m/s": 1.0, "km/h": 1 / 3.6, "mph": 0.44704, "ft/s": 0.3048}
TURNS = {"deg": np.pi / 180, "rad": 1.0}
TIMES = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}

_NOWHERE = Location()
_SLOW, _FAST = 0.3, 90.0
"""Bounds of the usual speed of those who move [m/s]."""

_MOVED = 0.3
"""Steps shorter than this tell no direction [m]."""

_MISFIT = np.radians(25.0)
"""An angle that is usually farther than this from the way that is driven tells none [rad]."""

_OTHER_SPEED = 0.15
"""Logarithm of the ratio of a speed to the driven one from which it is something else."""

_NAMED = 6
"""Largest number of columns that a note names."""

_EPOCH = 1e8
"""Seconds beyond which times count from a date long ago, or so."""


@dataclass(frozen=True, slots=True, eq=False)
class Samples:
    """Where road users are, row by row as a file has them, in SI units.

    Attributes:
        who: Ids.
        times: (n,) [s].
        places: (n, 3) [m].
        headings: Counter-clockwise from east, NaN where nothing tells, (n,) [rad].
        speeds: NaN where nothing tells, (n,) [m/s].
        sizes: Length, width and height, NaN where nothing tells, (n, 3) [m].
        classes: Words for classes; none where nothing tells.
        point: Where on the body places are: one of `model.numbers.TablePoint`.
        downwards: Whether the file's y grows downwards; places do not.
        meanings: vClasses by words for classes.
        columns: Of the table, with all that was told by values.
        notes: What was told by names and values, as clauses.
        location: By which longitudes and latitudes became metres.
    """

    who: Words
    times: Floats
    places: Floats
    headings: Floats
    speeds: Floats
    sizes: Floats
    classes: Words | None = None
    point: str = "centre"
    downwards: bool = False
    meanings: Mapping[str, str] = field(default_factory=dict)
    columns: Mapping[str, TableColumn] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    location: Location = _NOWHERE


def samples_in(table: Table, location: Location | None = None) -> Samples:
    """Read a table of trajectories.

    Args:
        table: The table.
        location: Of the network in whose coordinates places are given, if the table has
            longitudes and latitudes; None for metres to the east and north of their middle.

    Raises:
        InputError: If a cell is damaged, nothing is there, or a place is none on the Earth.
        MissingExtraError: If there are degrees and the package for projections is not installed.
    """
    cells, form = cells_of(table), table.form
    beside = _Beside.of(table)
    if form.is_geo:
        location = _checked(cells, location, table.file)
    rows = _Rows(table.file, cells, form, location or _NOWHERE)
    times, headings, speeds = _times(rows, beside), _headings(rows), _speeds(rows, beside)
    sizes = _sizes(rows)
    told = (times, headings, speeds)
    columns = dict(form.columns)
    for each in told:
        columns.update(each.columns)
    _check_speed(rows, times.values)
    notes = [each.note for each in told if each.note]
    if form.guessed:
        notes.insert(0, _columns_in_words(table))
    return Samples(
        cells.words["id"],
        times.values,
        _middle(rows.places, sizes, form),
        # Compasses point to true north.
        headings.values + rows.location.convergence,
        speeds.values,
        sizes,
        cells.words.get("class") or beside.classes(cells.words["id"]),
        "centre" if form.point == "corner" else form.point,
        form.downwards,
        form.classes,
        columns,
        tuple(notes),
        rows.location,
    )


def _checked(cells: Cells, location: Location | None, file: Path) -> Location:
    """Return the location by which degrees become metres, their own if none is given."""
    longitudes, latitudes = cells.numbers["x"], cells.numbers["y"]
    if (np.abs(longitudes) > 180.0).any() or (np.abs(latitudes) > 89.0).any():
        message = "a longitude or latitude is none on the Earth; say what the columns are"
        raise InputError(f"{message} (scenario.trajectories.columns)", file=file)
    if not (np.isfinite(longitudes) & np.isfinite(latitudes)).any():
        raise InputError("nobody in it has a place; write it again", file=file)
    if location is None:
        middle = f"+lat_0={np.nanmedian(latitudes):.3f} +lon_0={np.nanmedian(longitudes):.3f}"
        return Location(projection=f"+proj=tmerc {middle} +ellps=WGS84")
    if not is_projected(location):
        message = "it has longitudes and latitudes, but the network has no projection"
        raise InputError(f"{message}; take one that netconvert made of a map", file=file)
    return location


@dataclass(frozen=True, slots=True, eq=False)
class _Told:
    """What a column tells.

    Attributes:
        values: In our units, NaN where nothing tells, (n,).
        columns: The column, with what was left open.
        note: What was told by values, as a clause; empty where nothing was open.
    """

    values: Floats
    columns: Mapping[str, TableColumn] = field(default_factory=dict)
    note: str = ""


class _Rows:
    """Rows of a table, and which of them follow each other.

    Attributes:
        file: The table's file.
        cells: What it holds.
        form: What its columns mean.
        places: Its x, y and z, upright, (n, 3) [m].
        before, after: Indices of rows of the same road user, one after the other in time, (m,).
        ways: From one to the other, (m, 2) [m].
        location: By which degrees become metres.
        raw: Times or frames as the table has them, (n,).
    """

    def __init__(self, file: Path, cells: Cells, form: Form, location: Location) -> None:
        self.file, self.cells, self.form, self.location = file, cells, form, location
        self.raw = cells.numbers["time" if "time" in cells.numbers else "frame"]
        codes = cells.words["id"].codes
        order = np.lexsort((self.raw, codes))
        same = np.flatnonzero(codes[order][1:] == codes[order][:-1])
        self.before, self.after = order[same], order[same + 1]
        flat = self.plan("x", "y")
        self.places = np.column_stack([flat, np.nan_to_num(self.numbers("z", METRES))])
        self.ways = flat[self.after] - flat[self.before]

    @property
    def count(self) -> int:
        """Number of rows."""
        return len(self.raw)

    def plan(self, x: str, y: str) -> Floats:
        """Return two columns as places, upright, (n, 2) [m]."""
        if self.form.columns[x].unit == "deg":
            degrees = np.column_stack([self.cells.numbers[x], self.cells.numbers[y]])
            places = self.location.outside(net_from_geo(degrees, self.location))
            return np.where(np.isfinite(places), places, np.nan)
        north = self.numbers(y, METRES)
        return np.column_stack([self.numbers(x, METRES), -north if self.form.downwards else north])

    def numbers(self, role: str, units: Mapping[str, float]) -> Floats:
        """Return a column in our units, NaN where it is not there, (n,)."""
        values = self.cells.numbers.get(role)
        if values is None:
            return np.full(self.count, np.nan)
        return np.asarray(values * self.unit(self.form.columns[role], units))

    def unit(self, column: TableColumn, units: Mapping[str, float]) -> float:
        """Return how many of our units a column's unit has; that of the first if none is said.

        Raises:
            InputError: If the column cannot be in its unit.
        """
        if column.unit and column.unit not in units:
            known = ", ".join(units)
            message = f"the column {column.name!r} is said to be in {column.unit!r}; say {known}"
            raise InputError(message, file=self.file)
        return units[column.unit] if column.unit else next(iter(units.values()))


@dataclass(frozen=True, slots=True)
class _Beside:
    """What files beside a table of a data set tell.

    Attributes:
        rate: Frames in a second; None where nothing tells [Hz].
        kinds: Words for classes by id.
    """

    rate: float | None = None
    kinds: Mapping[str, str] = field(default_factory=dict)

    @classmethod
    def of(cls, table: Table) -> _Beside:
        """Read the files that highD and its like have beside each recording."""
        stem, mark, _ = table.file.name.partition("_tracks")
        if not mark or table.form.name not in ("highD", "inD"):
            return cls()
        about = _rows_of(table.file.with_name(f"{stem}_recordingMeta.csv"))
        users = _rows_of(table.file.with_name(f"{stem}_tracksMeta.csv"))
        rate = next((row["frameRate"] for row in about if row.get("frameRate")), None)
        kinds = {row.get("trackId") or row.get("id", ""): row.get("class", "") for row in users}
        try:
            return cls(float(rate) if rate else None, kinds)
        except ValueError:
            return cls(None, kinds)

    def classes(self, who: Words) -> Words | None:
        """Return words for classes of rows."""
        if not any(self.kinds.values()):
            return None
        return Words(who.codes, tuple(self.kinds.get(name, "") for name in who.texts))


def _rows_of(file: Path) -> list[dict[str, str]]:
    """Return the rows of a small table beside another; none where it cannot be read."""
    try:
        with file.open(encoding="utf-8-sig", newline="") as stream:
            return list(csv.DictReader(stream))
    except (OSError, UnicodeDecodeError, csv.Error):
        return []


def _columns_in_words(table: Table) -> str:
    """Say what columns were taken for, and which tell nothing."""
    form = table.form
    found = ", ".join(f"{role} is {column.name}" for role, column in form.columns.items())
    used = {column.name for column in form.columns.values()}
    rest = [name for name in table.names if name and name not in used]
    more = f"; not used: {', '.join(map(cut, rest[:_NAMED]))}" if rest else ""
    more += f" and {len(rest) - _NAMED} more" if len(rest) > _NAMED else ""
    point = {"centre": "middle"}.get(form.point, form.point)
    return (
        f"columns were told by their names: {found}{more}; x and y are taken for the {point} of"
        " bodies"
    )


def _check_speed(rows: _Rows, times: Floats) -> None:
    """Refuse places at which people would move at impossible speeds."""
    moved = np.linalg.norm(rows.ways, axis=1)
    spans = times[rows.after] - times[rows.before]
    good = (moved > 0.02) & (spans > 0)
    if good.any() and (speed := float(np.median(moved[good] / spans[good]))) > 10 * _FAST:
        message = (
            f"road users would move at {speed:,.0f} m/s; say in which unit the columns of x, y and"
            " time are (scenario.trajectories.columns)"
        )
        raise InputError(message, file=rows.file)


def _middle(places: Floats, sizes: Floats, form: Form) -> Floats:
    """Return the middle of boxes whose left upper corners are given, or places as they are."""
    if form.point != "corner":
        return places
    halves = np.nan_to_num(sizes[:, :2]) / 2
    return np.column_stack([places[:, :2] + halves * [1.0, -1.0], places[:, 2]])


def _sizes(rows: _Rows) -> Floats:
    """Return lengths, widths and heights, (n, 3) [m]; one of nothing, as people have, is NaN."""
    columns = [rows.numbers(name, METRES) for name in ("length", "width", "height")]
    if "rear_x" in rows.form.columns and "length" not in rows.form.columns:
        columns[0] = np.linalg.norm(_from_rear(rows), axis=1)
    sizes = np.column_stack(columns)
    return np.where(sizes > 0.05, sizes, np.nan)


def _from_rear(rows: _Rows) -> Floats:
    """Return the way from the rear to the front, (n, 2) [m]."""
    return np.asarray(rows.places[:, :2] - rows.plan("rear_x", "rear_y"))


def _times(rows: _Rows, beside: _Beside) -> _Told:
    """Return the times of rows [s]."""
    cells, form = rows.cells, rows.form
    if "time" not in cells.numbers:
        rate = beside.rate or form.rate
        guessed = beside.rate is None and form.guessed
        note = f"frames are taken for {rate:g} a second; say rate if they are not"
        return _Told(rows.raw / rate, note=note if guessed else "")
    if cells.clock:
        return _Told(_over_midnight(rows.raw))
    column, notes = form.columns["time"], []
    if not column.unit:
        column = replace(column, unit=_unit_of_times(rows))
        if column.unit != "s":
            notes.append(f"{column.name} looks like {column.unit}")
    seconds = rows.raw * rows.unit(column, TIMES)
    start = float(np.nanmin(seconds, initial=np.inf))
    if _EPOCH < abs(start) < np.inf:
        start = np.floor(start / 86400.0) * 86400.0
        seconds = seconds - start
        notes.append(f"{column.name} counts from long ago: {start:.0f} s are taken off")
    return _Told(seconds, {"time": column}, "; ".join(notes))


def _over_midnight(times: Floats) -> Floats:
    """Return times of a clock [s]; those after midnight belong to the next day.

    The longest time without anybody, counted around the clock, is where the table begins.
    """
    known = np.unique(times[np.isfinite(times)])
    if len(known) < 2 or not 0.0 <= known[0] <= known[-1] < 86400.0:
        return times
    gaps = np.diff(known)
    longest = int(np.argmax(gaps))
    if gaps[longest] < max(6 * 3600.0, 86400.0 - (known[-1] - known[0])):
        return times
    return np.where(times <= known[longest], times + 86400.0, times)


def _unit_of_times(rows: _Rows) -> str:
    """Return the unit of times in which those who move do so at a possible speed."""
    moved = np.linalg.norm(rows.ways, axis=1)
    spans = rows.raw[rows.after] - rows.raw[rows.before]
    good = (moved > 0.02) & (spans > 0)
    if not good.any():
        return "s"
    speed = float(np.median(moved[good] / spans[good]))
    return next((unit for unit, own in TIMES.items() if _SLOW <= speed / own <= _FAST), "s")


def _speeds(rows: _Rows, beside: _Beside) -> _Told:
    """Return the speeds of rows [m/s]; none where motion shows them to be something else."""
    column = rows.form.columns.get("speed")
    if column is None:
        return _Told(np.full(rows.count, np.nan))
    times = _times(rows, beside).values
    spans = times[rows.after] - times[rows.before]
    with np.errstate(divide="ignore", invalid="ignore"):
        driven = np.linalg.norm(rows.ways, axis=1) / spans
    values = np.abs(rows.cells.numbers["speed"])
    told = (values[rows.after] + values[rows.before]) / 2
    good = np.isfinite(driven) & (driven > 1.0) & (told > 0.1)
    units = [column.unit] if column.unit else list(SPEEDS)
    if not good.any():
        return _Told(rows.numbers("speed", SPEEDS), {"speed": replace(column, unit=units[0])})
    ratio = float(np.median(driven[good] / told[good]))
    off = {name: abs(np.log(ratio / SPEEDS.get(name, 1.0))) for name in units}
    best = min(off, key=lambda name: off[name])
    if not column.unit and off[best] > _OTHER_SPEED:
        note = f"{column.name} is not the speed that is driven, and left out"
        return _Told(np.full(rows.count, np.nan), note=note)
    column = replace(column, unit=best)
    note = f"{column.name} looks like {best}" if column != rows.form.columns["speed"] else ""
    return _Told(values * rows.unit(column, SPEEDS), {"speed": column}, note)


def _headings(rows: _Rows) -> _Told:
    """Return the headings of rows, counter-clockwise from east [rad]."""
    nothing = np.full(rows.count, np.nan)
    if "rear_x" in rows.form.columns:
        ways = _from_rear(rows)
        known = np.linalg.norm(ways, axis=1) > 0.1
        return _Told(np.where(known, np.arctan2(ways[:, 1], ways[:, 0]), np.nan))
    if "angle" not in rows.cells.numbers:
        return _Told(nothing)
    column, values = rows.form.columns["angle"], rows.cells.numbers["angle"]
    rows.unit(column, TURNS)
    compasses = _Compass.all_of(column)
    far = np.linalg.norm(rows.ways, axis=1) > _MOVED
    courses = np.arctan2(rows.ways[far, 1], rows.ways[far, 0])
    ends = values[rows.before[far]], values[rows.after[far]]
    misfits = {each: each.misfit(ends, courses) for each in compasses}
    best = min(misfits, key=lambda each: misfits[each]) if far.any() else compasses[0]
    if far.any() and len(compasses) > 1 and not misfits[best] < _MISFIT:
        note = f"{column.name} follows no way that is driven, so motion tells headings"
        return _Told(nothing, note=note)
    full = replace(column, unit=best.unit, zero=best.zero, turn=best.turn)
    note = f"{column.name} looks like {best.in_words}" if full != column else ""
    return _Told(best.headings(values), {"angle": full}, note)


@dataclass(frozen=True, slots=True)
class _Compass:
    """How an angle may be counted.

    Attributes:
        unit: One of `TURNS`.
        zero: `east` or `north`.
        turn: To the `left` or to the `right`.
    """

    unit: str
    zero: str
    turn: str

    @classmethod
    def all_of(cls, column: TableColumn) -> list[_Compass]:
        """Return what a column leaves open, the usual first."""
        usual = [("east", "left"), ("north", "right"), ("east", "right"), ("north", "left")]
        return [
            cls(unit, zero, turn)
            for unit in ([column.unit] if column.unit else TURNS)
            for zero, turn in usual
            if column.zero in ("", zero) and column.turn in ("", turn)
        ]

    def headings(self, values: Floats) -> Floats:
        """Return angles counter-clockwise from east [rad]."""
        angles = values * TURNS[self.unit]
        angles = angles if self.turn == "left" else -angles
        return np.asarray(angles + (np.pi / 2 if self.zero == "north" else 0.0))

    def misfit(self, ends: tuple[Floats, Floats], courses: Floats) -> float:
        """Return how far headings usually are from ways [rad].

        Args:
            ends: Angles where each way begins and ends, (m,) each.
            courses: Where it leads, (m,) [rad].
        """
        off = [np.abs(_turned(self.headings(each) - courses)) for each in ends]
        nearer = np.fmin(*off)
        known = np.isfinite(nearer)
        return float(np.mean(nearer[known])) if known.any() else np.inf

    @property
    def in_words(self) -> str:
        """What it is."""
        unit = {"deg": "degrees", "rad": "radians"}[self.unit]
        turn = "counter-clockwise" if self.turn == "left" else "clockwise"
        return f"{unit} from {self.zero}, {turn}"


def _turned(angles: Floats) -> Floats:
    """Return angles within half a turn [rad]."""
    return np.asarray((angles + np.pi) % (2 * np.pi) - np.pi)
