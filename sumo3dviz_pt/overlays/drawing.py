"""Draws overlays over a developed picture: words, labels, trails, a map.

Words, speed, clock and the scale of colours stand still on the picture. Labels, frames, dots, and
trails on the ground follow road users. The map in a corner shows lanes, road users and what the
camera sees, from above.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from itertools import pairwise

import numpy as np

from sumo3dviz_pt.job.overlays import (
    ClockOverlay,
    DotsOverlay,
    HighlightOverlay,
    LabelOverlay,
    MapOverlay,
    SpeedOverlay,
    TrailOverlay,
)
from sumo3dviz_pt.model.geometry import Bools, Floats, Image
from sumo3dviz_pt.overlays.canvas import FINER, INK, PLATE, Canvas, Rgba, faded, rgba, speed_colour
from sumo3dviz_pt.overlays.facts import (
    EDGES,
    FilmFacts,
    FrameFacts,
    box_corners,
    frame_around,
    in_camera,
    named,
    place_of,
    segment,
    within,
)

PER_MS = {"km/h": 3.6, "mph": 3600 / 1609.344, "m/s": 1.0}
"""Units of speed in a metre per second."""

_SCALE = (0.34, 0.028)  # width and height of the scale's bar, shares of the picture's height
_BARS = 60


def draw_standing(canvas: Canvas, film: FilmFacts, number: int) -> None:
    """Draw what stands still.

    Args:
        canvas: To draw on.
        film: What it shows.
        number: Of the frame.
    """
    wanted, frame, now = film.settings, film.frames[number], film.film_time(number)
    for words in wanted.text:
        if words.start <= now < (math.inf if words.end is None else words.end):
            canvas.plate(words.text, place=words.place, share=words.size, colour=rgba(words.colour))
    if wanted.clock is not None:
        clock = wanted.clock
        canvas.plate(time_text(frame.time, clock), place=clock.place, share=clock.size)
    if wanted.speed is not None:
        _draw_speed(canvas, film, frame, wanted.speed)
    if wanted.scale.place is not None:
        _draw_scale(canvas, film)


def time_text(time: float, clock: ClockOverlay) -> str:
    """Return SUMO's time [s] in digits: 453.2 is 0:07:33.2."""
    # A frame shows its time from its first instant on, so it is cut off, not rounded.
    tenths = math.floor(time * 10 + 1e-6)
    if clock.form == "seconds":
        return f"{tenths / 10:.1f} s"
    hours, rest = divmod(tenths, 36_000)
    minutes, rest = divmod(rest, 600)
    return f"{hours}:{minutes:02d}:{rest // 10:02d}.{rest % 10}"


def speed_of(film: FilmFacts, frame: FrameFacts, vehicle: str | None) -> float | None:
    """Return a vehicle's speed, or that of the one that the camera rides with [m/s]."""
    for row, user in enumerate(frame.users.tolist()):
        key = film.keys[user]
        if (vehicle in (key, named(key))) if vehicle else key == film.ridden:
            speed = float(frame.poses[row, 5])
            return speed if np.isfinite(speed) else None
    return None


def _draw_speed(canvas: Canvas, film: FilmFacts, frame: FrameFacts, wanted: SpeedOverlay) -> None:
    """Draw a number and, smaller, its unit; nothing where the speed is not known."""
    speed = speed_of(film, frame, wanted.vehicle)
    if speed is None:
        return
    value = speed * PER_MS[wanted.unit]
    number = f"{value:.1f}" if wanted.unit == "m/s" else f"{value:.0f}"
    # The plate keeps its size while the number changes.
    height = canvas.size[1]
    wide = canvas.text_size("188", share=wanted.size)[0]
    unit = 0.42 * wanted.size
    beside = canvas.text_size(wanted.unit, share=unit)[0]
    pad = 0.5 * wanted.size * height
    size = (wide + beside + 2.4 * pad, wanted.size * height + 1.5 * pad)
    row, column = canvas.room(wanted.place, size)
    canvas.box(row, column, size, PLATE, radius=0.6 * pad)
    left = column - size[0] / 2
    canvas.text(
        number,
        (row, left + pad + wide),
        share=wanted.size,
        plate=None,
        anchor="rm",
    )
    canvas.text(
        wanted.unit,
        (row + 0.29 * wanted.size * height, left + 1.4 * pad + wide),
        share=unit,
        plate=None,
        anchor="lm",
    )


def _draw_scale(canvas: Canvas, film: FilmFacts) -> None:
    """Draw the colours of speeds with the numbers of their ends [km/h]."""
    scale, height = film.settings.scale, canvas.size[1]
    assert scale.place is not None
    wide, high = (share * height for share in _SCALE)
    letters = 0.022
    size = (wide + 1.2 * high, 2.9 * high)
    row, column = canvas.room(scale.place, size)
    canvas.box(row, column, size, PLATE, radius=0.4 * high)
    left, top = column - wide / 2, row - 1.05 * high
    for k in range(_BARS):
        speed = scale.slowest + (k + 0.5) / _BARS * (scale.fastest - scale.slowest)
        x0, x1 = left + wide * k / _BARS, left + wide * (k + 1) / _BARS
        corners = [[top, x0], [top, x1], [top + high, x1], [top + high, x0]]
        canvas.area(np.array(corners), speed_colour(speed, scale))
    below = row + 0.7 * high
    for share, speed, anchor in ((0.0, scale.slowest, "lm"), (1.0, scale.fastest, "rm")):
        words = f"{speed * 3.6:.0f}" + (" km/h" if share else "")
        place = left + share * wide
        canvas.text(words, (below, place), share=letters, colour=INK, plate=None, anchor=anchor)


_LINE = 0.0035  # width of lines, share of the picture's height
_ABOVE = 0.25  # of a road user's top, at which words and dots stand [m]
_CORNER = 0.28  # of a frame's shorter side, that its corners are drawn of

TRAIL_REACH = 300.0
"""Farthest road users that have a trail [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class ShownUsers:
    """Whom the pixels of a frame show.

    Attributes:
        keys: Of the road users that can be seen.
        covered: Where a road user is seen, (h, w); the ground is not seen there.
    """

    keys: frozenset[str]
    covered: Bools


def draw_following(canvas: Canvas, film: FilmFacts, number: int, shown: ShownUsers | None) -> None:
    """Draw frames, dots and labels; what is covered has none, as far as that is known.

    Of labels that would overlap, the nearest is written.

    Args:
        canvas: To draw on.
        film: What it shows.
        number: Of the frame.
        shown: Whom it shows.
    """
    wanted, frame = film.settings, film.frames[number]
    for mark in wanted.highlights:
        for row in _rows(film, frame, mark.ids, shown, mark.reach):
            _draw_mark(canvas, film, frame, row, mark)
    if wanted.dots is not None:
        for row in _rows(film, frame, wanted.dots.ids, shown, wanted.dots.reach):
            _draw_dot(canvas, film, frame, row, wanted.dots)
    for label in wanted.labels:
        for row in reversed([*_rows(film, frame, label.ids, shown, label.reach)]):
            _draw_label(canvas, film, frame, row, label)


def _rows(
    film: FilmFacts, frame: FrameFacts, ids: Sequence[str], shown: ShownUsers | None, reach: float
) -> Iterator[int]:
    """Yield rows of road users that patterns mean, the farthest first.

    The one that the camera sits in is never among them.
    """
    near = within(frame.view, frame.poses, reach)
    away = np.linalg.norm(frame.poses[:, :3] - frame.view.position, axis=1)
    for row in np.argsort(-away, kind="stable").tolist():
        key = film.keys[int(frame.users[row])]
        inside = film.inside and key == film.ridden
        if not near[row] or inside or (shown is not None and key not in shown.keys):
            continue
        if any(fnmatchcase(name, each) for each in ids for name in (key, named(key))):
            yield row


def _top(film: FilmFacts, frame: FrameFacts, row: int) -> Floats:
    """Return a point a little above the middle of a road user, (3,) [m]."""
    corners = box_corners(frame.poses[row], film.sizes[frame.users[row]])
    return np.asarray(corners[4:].mean(axis=0) + np.array([0.0, 0.0, _ABOVE]))


def _draw_dot(
    canvas: Canvas, film: FilmFacts, frame: FrameFacts, row: int, dots: DotsOverlay
) -> None:
    """Draw a dot above a road user, in the colour of its speed."""
    place = place_of(frame.view, _top(film, frame, row), canvas.size)
    if place is not None:
        colour = speed_colour(float(frame.poses[row, 5]), film.settings.scale)
        canvas.dot(*place, colour, radius=0.5 * dots.size * canvas.size[1])


def _draw_label(
    canvas: Canvas, film: FilmFacts, frame: FrameFacts, row: int, label: LabelOverlay
) -> None:
    """Write words above a road user."""
    place = place_of(frame.view, _top(film, frame, row), canvas.size)
    if place is None:
        return
    words = label_text(film, frame, row, label.text)
    height = label.size * canvas.size[1]
    lines = 0.7 * (words.count("\n") + 1) + 0.4
    at = place[0] - lines * height, place[1]
    if canvas.is_free(words, at, share=label.size):
        canvas.text(words, at, share=label.size, colour=rgba(label.colour))


def label_text(film: FilmFacts, frame: FrameFacts, row: int, text: str) -> str:
    """Return the words of a label: id, speed [km/h] and distance from the camera [m] filled in."""
    pose = frame.poses[row]
    away = float(np.linalg.norm(pose[:3] - frame.view.position))
    speed = "?" if np.isnan(pose[5]) else f"{pose[5] * 3.6:.0f}"
    filled = text.replace("{id}", named(film.keys[int(frame.users[row])]))
    return filled.replace("{speed}", speed).replace("{distance}", f"{away:.0f}")


def _draw_mark(
    canvas: Canvas, film: FilmFacts, frame: FrameFacts, row: int, mark: HighlightOverlay
) -> None:
    """Draw the edges of a road user's box, or the corners of the frame around it."""
    corners = box_corners(frame.poses[row], film.sizes[frame.users[row]])
    width, colour = max(_LINE * canvas.size[1], 1.0), rgba(mark.colour)
    if mark.form == "box":
        for a, b in EDGES:
            line = segment(frame.view, corners[a], corners[b], canvas.size)
            if line is not None:
                canvas.line(line, colour, width=width)
        return
    box = frame_around(frame.view, corners, canvas.size)
    if box is not None:
        _draw_corners(canvas, box, colour, width)


def _draw_corners(canvas: Canvas, box: Floats, colour: Rgba, width: float) -> None:
    """Draw the four corners of a frame."""
    room = 2.0 * width
    top, left, bottom, right = box + np.array([-room, -room, room, room])
    arm = _CORNER * min(bottom - top, right - left)
    for row, down in ((top, arm), (bottom, -arm)):
        for column, across in ((left, arm), (right, -arm)):
            corner = [[row + down, column], [row, column], [row, column + across]]
            canvas.line(np.array(corner), colour, width=width)


# Trails ------------------------------------------------------------------------------------


def draw_trails(canvas: Canvas, film: FilmFacts, number: int) -> None:
    """Draw where road users drove, as if nothing stood on the ground.

    Args:
        canvas: To draw on.
        film: What it shows.
        number: Of the frame.
    """
    frame = film.frames[number]
    for trail in film.settings.trails:
        for row in _rows(film, frame, trail.ids, None, TRAIL_REACH):
            _draw_trail(canvas, film, frame, row, trail)


def _draw_trail(
    canvas: Canvas, film: FilmFacts, frame: FrameFacts, row: int, trail: TrailOverlay
) -> None:
    """Draw where a road user drove, from its rear backward in time, ever fainter."""
    user = int(frame.users[row])
    path = film.paths.get(film.keys[user])
    if path is None or not len(path):
        return
    times = frame.time - trail.seconds, frame.time
    points = _behind(path, frame.poses[row, :3], float(film.sizes[user, 0]), times)
    for one, other in pairwise(points):
        age = (frame.time - 0.5 * (one[0] + other[0])) / trail.seconds
        alpha = 0.85 * (1.0 - age)
        if trail.colour == "speed":
            colour = speed_colour(0.5 * (one[4] + other[4]), film.settings.scale, alpha=alpha)
        else:
            colour = rgba(trail.colour, alpha)
        corners = _strip(frame, one[1:4], other[1:4], trail.width, canvas.size)
        if corners is not None:
            canvas.area(corners, colour, over=False)  # strips meet without seams


def _behind(path: Floats, front: Floats, length: float, times: tuple[float, float]) -> Floats:
    """Return the part of a path from a time on that lies behind a body, (n, 5).

    Args:
        path: As in `FilmFacts.paths`, (n, 5).
        front: Where the front is now, (3,) [m].
        length: Of the body [m].
        times: From when, and now [s].
    """
    begin, now = max(times[0], float(path[0, 0])), times[1]
    driven = path[path[:, 0] < now]
    if not len(driven):
        return driven
    # Both ends lie between samples, or the trail would jump from frame to frame.
    steps = np.linalg.norm(np.diff([*driven[:, 1:4], front], axis=0), axis=1)
    left = np.append(np.cumsum(steps[::-1])[::-1], 0.0)
    rear = float(np.interp(length, left[::-1], np.append(driven[:, 0], now)[::-1]))
    if rear <= begin:
        return driven[:0]
    inner = driven[(driven[:, 0] > begin) & (driven[:, 0] < rear), 0]
    chosen = np.array([begin, *inner, rear])
    known = np.vstack([driven, [now, *front, driven[-1, 4]]])
    return np.column_stack([np.interp(chosen, known[:, 0], known[:, k]) for k in range(5)])


def _strip(
    frame: FrameFacts, one: Floats, other: Floats, width: float, size: tuple[int, int]
) -> Floats | None:
    """Return the corners of a strip on the ground, (4, 2) [px]; None if it is not all ahead."""
    along = other - one
    length = float(np.hypot(*along[:2]))
    if length < 1e-6:
        return None
    across = 0.5 * width * np.array([-along[1], along[0], 0.0]) / length
    corners = np.stack([one + across, other + across, other - across, one - across])
    local = in_camera(frame.view, corners)
    if local[:, 0].min() < 0.3:
        return None
    return np.asarray(frame.view.lens.project(local, size)[0].T)


_GROUND = rgba("#10141a", 0.86)
_LANE = rgba("#59626e")
_SIGHT = rgba("#ffe08a", 0.26)
_RIDDEN = rgba("#ffffff")
_OTHER = rgba("#cfd6df")
_SIGHT_LENGTH = 0.8  # of the cone that the camera sees, share of the map's radius
_LEAST = 3.0  # least length of a road user on the map [px]


def draw_map(canvas: Canvas, film: FilmFacts, number: int, wanted: MapOverlay) -> None:
    """Draw the map of a frame.

    Args:
        canvas: To draw on.
        film: What it shows.
        number: Of the frame.
        wanted: Where, how large, how far.
    """
    side = max(round(wanted.size * canvas.size[1]), 16)
    frame = film.frames[number]
    sheet = Canvas((side, side))
    sheet.fill(_GROUND)
    turn = np.pi / 2 if wanted.north_up else _heading(frame)
    plan = _Plan(frame.view.position[:2], turn, side, wanted.radius)
    _draw_lanes(sheet, film, plan)
    _draw_sight(sheet, film, frame, plan)
    _draw_users(sheet, film, frame, plan)
    sheet.round_off(0.06 * side)
    row, column = canvas.room(wanted.place, (side, side))
    canvas.paste(sheet, left=round(column - side / 2), top=round(row - side / 2))


def _heading(frame: FrameFacts) -> float:
    """Return where the camera looks, counter-clockwise from east [rad]."""
    forward = frame.view.forward
    return float(np.arctan2(forward[1], forward[0]))


class _Plan:
    """Where points of the ground lie on the map."""

    def __init__(self, middle: Floats, up: float, side: int, radius: float) -> None:
        """Put a point of the ground into the map's middle and a direction [rad] up."""
        self.middle, self.side, self.radius, self.up = middle, side, radius, up
        self._pixels = side / (2.0 * radius)

    def places(self, points: Floats) -> Floats:
        """Return rows and columns of points on the ground, (n, 2) [m] -> (n, 2) [px]."""
        offset = np.asarray(points) - self.middle
        up = np.array([np.cos(self.up), np.sin(self.up)])
        right = np.array([up[1], -up[0]])
        middle = (self.side - 1) / 2
        return np.stack(
            [middle - offset @ up * self._pixels, middle + offset @ right * self._pixels], axis=-1
        )

    def length(self, metres: float) -> float:
        """Return how long so many metres are [px]."""
        return metres * self._pixels


def _draw_lanes(sheet: Canvas, film: FilmFacts, plan: _Plan) -> None:
    """Draw the lanes as wide as they are."""
    reach = plan.radius * 1.5
    for lane, width in zip(film.lanes, film.widths, strict=True):
        low, high = lane.min(axis=0) - reach, lane.max(axis=0) + reach
        if (plan.middle >= low).all() and (plan.middle <= high).all():
            sheet.plain_line(plan.places(lane), _LANE, width=max(plan.length(width), 1.0 / FINER))


def _draw_sight(sheet: Canvas, film: FilmFacts, frame: FrameFacts, plan: _Plan) -> None:
    """Draw the cone that the camera sees."""
    view, aspect = frame.view, film.size[1] / film.size[0]
    points = [view.position[:2]]
    for share in np.linspace(0.0, 1.0, 9):
        ray = view.world_from_camera.directions(view.lens.ray((float(share), 0.5), aspect))[:2]
        norm = float(np.linalg.norm(ray))
        if norm > 1e-6:
            points.append(view.position[:2] + _SIGHT_LENGTH * plan.radius * ray / norm)
    if len(points) > 2:
        sheet.area(plan.places(np.array(points)), _SIGHT)


def _draw_users(sheet: Canvas, film: FilmFacts, frame: FrameFacts, plan: _Plan) -> None:
    """Draw everyone from above; the one that the camera rides with is white."""
    ridden = _ridden_place(film, frame)
    coloured = film.settings.dots is not None or film.settings.scale.place is not None
    for x, y, yaw, length, width, speed in frame.around.tolist():
        long = max(length, _LEAST / plan.length(1.0))
        wide = max(width, 0.6 * _LEAST / plan.length(1.0))
        along = np.array([np.cos(yaw), np.sin(yaw)])
        across = 0.5 * wide * np.array([-along[1], along[0]])
        front = np.array([x, y])
        rear = front - long * along
        corners = np.stack([front + across, rear + across, rear - across, front - across])
        own = ridden is not None and np.hypot(*(front - ridden)) < 0.05
        other = speed_colour(speed, film.settings.scale) if coloured else _OTHER
        sheet.area(plan.places(corners), _RIDDEN if own else other)


def _ridden_place(film: FilmFacts, frame: FrameFacts) -> Floats | None:
    """Return where the front of the one is that the camera rides with, (2,) [m]."""
    for row, user in enumerate(frame.users.tolist()):
        if film.keys[user] == film.ridden:
            return np.asarray(frame.poses[row, :2])
    return None


def drawn(picture: Image, film: FilmFacts, number: int, shown: ShownUsers | None = None) -> Image:
    """Return a frame's picture with its overlays.

    Trails lie lowest, then what else follows road users, the map, what stands still; fades take
    all.

    Args:
        picture: sRGB-encoded, (h, w, 3) in [0, 1].
        film: What it shows, and which overlays it has.
        number: Of the frame.
        shown: Whom its pixels show; None where that is not known.
    """
    height, width = picture.shape[:2]
    if film.settings.trails:
        picture = _with_trails(picture, film, number, shown)
    canvas = Canvas((width, height))
    draw_following(canvas, film, number, shown)
    if film.settings.map is not None:
        draw_map(canvas, film, number, film.settings.map)
    draw_standing(canvas, film, number)
    return faded(canvas.over(picture), film, number)


def _with_trails(picture: Image, film: FilmFacts, number: int, shown: ShownUsers | None) -> Image:
    """Return a picture with trails where it shows no road user."""
    height, width = picture.shape[:2]
    canvas = Canvas((width, height))
    draw_trails(canvas, film, number)
    over = canvas.over(picture)
    return over if shown is None else np.where(shown.covered[..., None], picture, over)


def hides(film: FilmFacts) -> bool:
    """Return whether any overlay asks which road users a pixel shows."""
    wanted = film.settings
    return bool(wanted.labels or wanted.highlights or wanted.dots or wanted.trails)
