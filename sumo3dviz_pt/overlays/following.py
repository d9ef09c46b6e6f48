"""Overlays that follow road users: labels, frames, dots, and trails on the ground."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from itertools import pairwise

import numpy as np

from sumo3dviz_pt.job.overlays import DotsOverlay, HighlightOverlay, LabelOverlay, TrailOverlay
from sumo3dviz_pt.model.geometry import Bools, Floats
from sumo3dviz_pt.overlays.canvas import Canvas, Rgba, rgba
from sumo3dviz_pt.overlays.colours import speed_colour
from sumo3dviz_pt.overlays.facts import FilmFacts, FrameFacts, named
from sumo3dviz_pt.overlays.projected import (
    EDGES,
    box_corners,
    frame_around,
    in_camera,
    place_of,
    segment,
    within,
)

_LINE = 0.0035  # width of lines, share of the picture's height
_ABOVE = 0.25  # of a road user's top, at which words and dots stand [m]
_CORNER = 0.28  # of a frame's shorter side, that its corners are drawn of

TRAIL_REACH = 300.0
"""Farthest road users that have a trail [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Shown:
    """Whom the pixels of a frame show.

    Attributes:
        keys: Of the road users that can be seen.
        covered: Where a road user is seen, (h, w); the ground is not seen there.
    """

    keys: frozenset[str]
    covered: Bools


def draw_following(canvas: Canvas, film: FilmFacts, number: int, shown: Shown | None) -> None:
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
    film: FilmFacts, frame: FrameFacts, ids: Sequence[str], shown: Shown | None, reach: float
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
    found = frame_around(frame.view, corners, canvas.size)
    if found is not None:
        _draw_corners(canvas, found, colour, width)


def _draw_corners(canvas: Canvas, found: Floats, colour: Rgba, width: float) -> None:
    """Draw the four corners of a frame."""
    room = 2.0 * width
    top, left, bottom, right = found + np.array([-room, -room, room, room])
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
