"""Overlays that stand still on the picture: words, speed, clock, the scale of colours."""

from __future__ import annotations

import math

import numpy as np

from sumo3dviz_pt.job.overlays import ClockOverlay, SpeedOverlay
from sumo3dviz_pt.overlays.canvas import INK, PLATE, Canvas, rgba
from sumo3dviz_pt.overlays.colours import speed_colour
from sumo3dviz_pt.overlays.facts import FilmFacts, FrameFacts, named

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
