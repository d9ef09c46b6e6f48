"""The map in a corner: lanes, road users and what the camera sees, from above."""

from __future__ import annotations

import numpy as np

from sumo3dviz_pt.job.overlays import MapOverlay
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.overlays.canvas import FINER, Canvas, rgba
from sumo3dviz_pt.overlays.colours import speed_colour
from sumo3dviz_pt.overlays.facts import FilmFacts, FrameFacts

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
