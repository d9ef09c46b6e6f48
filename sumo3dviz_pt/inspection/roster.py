"""Lists the road users of a scene's log, chosen by type, time and place, and its cameras.

Both lists show themselves in words.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from fnmatch import fnmatchcase
from operator import attrgetter
from types import MappingProxyType
from typing import Any, overload

from sumo3dviz_pt import catalog
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.job.errors import asked, settle
from sumo3dviz_pt.job.settings import CameraSettings, Job
from sumo3dviz_pt.job.values import Finite, Metres, Seconds
from sumo3dviz_pt.model.network import Location
from sumo3dviz_pt.model.traffic import Point, RoadUser
from sumo3dviz_pt.pipeline.production import scenario_files


class Cameras(Mapping[str, CameraSettings]):
    """Cameras by name."""

    def __init__(self, cameras: Mapping[str, CameraSettings]) -> None:
        self._cameras = dict(cameras)

    def __getitem__(self, name: str) -> CameraSettings:
        return self._cameras[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._cameras)

    def __len__(self) -> int:
        return len(self._cameras)

    def __repr__(self) -> str:
        width = max(map(len, self._cameras), default=0)
        lines = [f"{name:<{width}}  {self[name].in_words()}" for name in self]
        return "\n".join(lines) or "no cameras"


RADIUS = 30.0
"""Distance that counts as near where none is given [m]."""

_Order = Callable[[RoadUser], Any]


def _most(name: str) -> _Order:
    """Return the largest first."""
    value = attrgetter(name)
    return lambda user: -value(user)


def _distance(user: RoadUser) -> float:
    """Return the distance from the wanted point [m]; infinite for those that never come near."""
    return math.inf if user.passage is None else user.passage.distance


ORDERS: Mapping[str, _Order] = MappingProxyType(
    {
        "begin": attrgetter("begin"),
        "end": attrgetter("end"),
        "id": attrgetter("id"),
        "type": attrgetter("type_id", "id"),
        "length": _most("length"),
        "duration": _most("duration"),
        "mean": _most("mean_speed"),
        "max": _most("max_speed"),
        "distance": _distance,
    }
)
"""What lists are sorted by; lengths, durations and speeds begin with the largest."""


@dataclass(frozen=True, slots=True)
class RosterQuery:
    """Which road users to list, and in which order.

    Attributes:
        type: Pattern of a vType's id, a vClass or a kind such as `person`; * and ? are wildcards.
        at: Only those that are there at this time [s].
        near: Only those that pass this point, at that time if one is given.
        sort: A name in `ORDERS`; default by distance where a point is given, else by begin.
    """

    type: str = "*"
    at: Seconds | None = None
    near: Point | None = None
    sort: str | None = None

    def __post_init__(self) -> None:
        """Refuse what is no choice."""
        settle(self)


class Roster(Sequence[RoadUser]):
    """Road users, as a list that shows itself as a table."""

    def __init__(self, users: Sequence[RoadUser]) -> None:
        self._users = tuple(users)

    @overload
    def __getitem__(self, index: int) -> RoadUser: ...
    @overload
    def __getitem__(self, index: slice) -> Roster: ...
    def __getitem__(self, index: int | slice) -> RoadUser | Roster:
        users = self._users[index]
        return Roster(users) if isinstance(users, tuple) else users

    def __len__(self) -> int:
        return len(self._users)

    def __iter__(self) -> Iterator[RoadUser]:
        return iter(self._users)

    def __repr__(self) -> str:
        return "\n".join(table_lines(self._users))


def roster(job: Job, wanted: RosterQuery | None = None) -> Roster:
    """Read the road users of a scene's log, in one pass and without keeping samples.

    Raises:
        ConfigError: If there is no such order.
        InputError: If a file is missing or damaged.
    """
    from sumo3dviz_pt.sumo import read_location, read_roster, read_vehicle_types
    from sumo3dviz_pt.sumo.guesses import TypesOfUsers

    wanted = wanted or RosterQuery()
    order = _order(wanted)
    files = scenario_files(job)
    location = read_location(files.network)
    users = read_roster(
        files.trajectories,
        types=TypesOfUsers(read_vehicle_types(files.vehicle_types), job.vehicles.types),
        near=_inside(wanted.near, location),
        at=wanted.at,
        allow_truncated=job.scenario.allow_truncated,
        location=location,
    )
    rows = (_outside(user, location) for user in users)
    return Roster(sorted((user for user in rows if _fits(user, wanted)), key=order))


def _inside(point: Point | None, location: Location) -> Point | None:
    """Return a point of the user in our coordinates."""
    if point is None:
        return None
    x, y = location.inside([point.x, point.y]).tolist()
    return replace(point, x=x, y=y)


def _outside(user: RoadUser, location: Location) -> RoadUser:
    """Return a road user whose place is in SUMO's coordinates."""
    if user.place is None:
        return user
    x, y = location.outside([user.place.x, user.place.y]).tolist()
    return replace(user, place=replace(user.place, x=x, y=y))


def _order(wanted: RosterQuery) -> _Order:
    """Return how to sort."""
    name = wanted.sort or ("begin" if wanted.near is None else "distance")
    if name not in ORDERS:
        hint = catalog.did_you_mean(name, ORDERS)
        raise ConfigError(f"lists cannot be sorted by {name!r}{hint}", key="sort")
    if name == "distance" and wanted.near is None:
        raise ConfigError("give a place to sort by the distance from it", key="sort")
    return ORDERS[name]


def _fits(user: RoadUser, wanted: RosterQuery) -> bool:
    """Return whether a road user is wanted."""
    words = (user.type_id, user.vclass, user.kind)
    if not any(fnmatchcase(word, wanted.type) for word in words):
        return False
    if wanted.at is not None and user.place is None:
        return False
    if wanted.near is None:
        return True
    if wanted.at is None or user.place is None:
        return user.passage is not None
    away = math.hypot(user.place.x - wanted.near.x, user.place.y - wanted.near.y)
    return away <= wanted.near.radius


def point_of(job: Job, text: str, *, key: str = "near") -> Point:
    """Return a place to look from, as text: `X,Y`, `X,Y,R` [m], `CAMERA` or `CAMERA,R`.

    Args:
        job: Of the cameras.
        text: As it is written.
        key: What asks for it.

    Raises:
        ConfigError: If it is none of these.
    """
    words = [word.strip() for word in text.split(",")]
    numbers = [_number(word) for word in words]
    radius = RADIUS
    if numbers[0] is None or text in job.cameras:
        if len(words) == 2 and numbers[1] is not None and text not in job.cameras:
            text, radius = words[0], numbers[1]
        return point_near(job, text, radius=radius, key=key)
    if None in numbers or not 2 <= len(numbers) <= 3:
        raise ConfigError(f"{text!r} is no place; write X,Y or X,Y,R [m]", key=key)
    x, y, radius = (*(number or 0.0 for number in numbers), RADIUS)[:3]
    return point_near(job, (x, y), radius=radius, key=key)


def point_near(
    job: Job,
    place: str | tuple[float, float],
    *,
    radius: float | None = None,
    key: str = "near",
) -> Point:
    """Return a place to look from.

    Args:
        job: Of the cameras.
        place: A standing camera's name, or x, y [m].
        radius: [m]; default `RADIUS`.
        key: What asks for it.

    Raises:
        ConfigError: If there is no such camera, it moves, or the radius is no length.
    """
    radius = RADIUS if radius is None else asked(Finite, radius, key="radius")
    if radius <= 0.0:
        raise ConfigError(f"the radius must be above 0 m, not {radius:g}", key=key)
    if not isinstance(place, str):
        x, y = asked(tuple[Metres, Metres], place, key=key)
        return Point(x, y, radius)
    camera = job.cameras.get(place)
    if camera is None:
        hint = catalog.did_you_mean(place, job.cameras)
        raise ConfigError(f"no camera is called {place!r}{hint}", key=key)
    if camera.stands_at is None:
        raise ConfigError(f"{place!r} is no standing camera; give one, or X,Y [m]", key=key)
    x, y, _ = camera.stands_at
    return Point(x, y, radius)


def _number(word: str) -> float | None:
    """Return a finite number, or None."""
    try:
        value = float(word)
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def as_dicts(users: Sequence[RoadUser]) -> list[dict[str, Any]]:
    """Return road users for JSON, rounded to millimetres; what was not asked for is left out."""
    return [_rounded(asdict(user)) for user in users]


def _rounded(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return a mapping without None and without needless digits."""
    content: dict[str, Any] = {}
    for key, value in values.items():
        if isinstance(value, dict):
            content[key] = _rounded(value)
        elif value is not None:
            content[key] = round(value, 3) if isinstance(value, float) else value
    return content


_HEAD = ("id", "type", "class", "from [s]", "to [s]", "drive [m]", "mean", "max [m/s]", "lanes")


def table_lines(users: Sequence[RoadUser]) -> list[str]:
    """Return road users as people read them: a line each, after a head."""
    passing = any(user.passage is not None for user in users)
    placed = any(user.place is not None for user in users)
    head = [*_HEAD, *(["near [s]", "at [m]"] if passing else []), *(["x, y"] if placed else [])]
    rows = [[*head, "edges"], *(_row(user, passing=passing, placed=placed) for user in users)]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = ["  ".join(map(_padded, row, widths)).rstrip() for row in rows]
    return [*lines, f"{len(users)} road user{'' if len(users) == 1 else 's'}"]


def _row(user: RoadUser, *, passing: bool, placed: bool) -> list[str]:
    """Return one road user's cells."""
    cells = [user.id, user.type_id, user.vclass, f"{user.begin:.1f}", f"{user.end:.1f}"]
    cells += [f"{user.length:.0f}", f"{user.mean_speed:.1f}", f"{user.max_speed:.1f}"]
    cells.append(str(user.lanes))
    if passing:
        way = user.passage
        cells += ["", ""] if way is None else [f"{way.begin:.1f}-{way.end:.1f}"]
        cells += [] if way is None else [f"{way.distance:.1f}"]
    if placed:
        place = user.place
        cells.append("" if place is None else f"{place.x:.1f}, {place.y:.1f}")
    shown = user.edges if len(user.edges) < 4 else (user.edges[0], "...", user.edges[-1])
    return [*cells, " ".join(shown)]


def _padded(cell: str, width: int) -> str:
    """Return a cell; numbers stand to the right."""
    number = cell[:1].isdigit() and _number(cell) is not None
    return f"{cell:>{width}}" if number else f"{cell:<{width}}"
