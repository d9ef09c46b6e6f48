"""Draws all overlays of a frame over its developed picture."""

from __future__ import annotations

import numpy as np

from sumo3dviz_pt.model.geometry import Image
from sumo3dviz_pt.overlays.around import faded
from sumo3dviz_pt.overlays.canvas import Canvas
from sumo3dviz_pt.overlays.facts import FilmFacts
from sumo3dviz_pt.overlays.following import Shown, draw_following, draw_trails
from sumo3dviz_pt.overlays.inset import draw_map
from sumo3dviz_pt.overlays.standing import draw_standing


def drawn(picture: Image, film: FilmFacts, number: int, shown: Shown | None = None) -> Image:
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


def _with_trails(picture: Image, film: FilmFacts, number: int, shown: Shown | None) -> Image:
    """Return a picture with trails where it shows no road user."""
    height, width = picture.shape[:2]
    canvas = Canvas((width, height))
    draw_trails(canvas, film, number)
    found = canvas.over(picture)
    return found if shown is None else np.where(shown.covered[..., None], picture, found)


def hides(film: FilmFacts) -> bool:
    """Return whether any overlay asks which road users a pixel shows."""
    wanted = film.settings
    return bool(wanted.labels or wanted.highlights or wanted.dots or wanted.trails)
