"""Letters, digits and marks as strokes of our own, and lines of text.

A glyph is a list of polylines on a grid: x from 0 to its width, y from 0 (foot) to 1 (head of
capitals); small letters are `_SMALL` high, and some reach below 0. Letters with marks are put
together from the letter and the mark, as Unicode takes them apart.
"""

from __future__ import annotations

import unicodedata
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
import shapely

from sumo3dviz_pt.library.street.strokes import ribbon
from sumo3dviz_pt.model.geometry import Bools, Floats, settled

Line = Sequence[tuple[float, float]]


def _arc(
    centre: tuple[float, float], radii: tuple[float, float], begin: float, end: float
) -> list[tuple[float, float]]:
    """Return points of an elliptic arc between two angles [deg]."""
    turn = np.radians(np.linspace(begin, end, max(3, int(abs(end - begin) / 30) + 1)))
    return [
        (centre[0] + radii[0] * float(np.cos(t)), centre[1] + radii[1] * float(np.sin(t)))
        for t in turn
    ]


_BOWL = _arc((0.27, 0.27), (0.27, 0.27), -180, 180)
_O = [
    *_arc((0.27, 0.73), (0.27, 0.27), 0, 180),
    *_arc((0.27, 0.27), (0.27, 0.27), 180, 360),
    (0.54, 0.73),
]

_PLAIN: Mapping[str, tuple[Line, ...]] = {
    "0": (_O,),
    "1": ([(0.08, 0.78), (0.3, 1.0), (0.3, 0.0)],),
    "2": ([*_arc((0.27, 0.73), (0.26, 0.27), 165, -25), (0.02, 0.0), (0.54, 0.0)],),
    "3": (
        _arc((0.25, 0.76), (0.24, 0.24), 160, -80),
        _arc((0.25, 0.26), (0.28, 0.26), 80, -160),
    ),
    "4": ([(0.42, 0.0), (0.42, 1.0), (0.0, 0.3), (0.56, 0.3)],),
    "5": ([(0.48, 1.0), (0.08, 1.0), (0.05, 0.54), *_arc((0.25, 0.3), (0.28, 0.3), 120, -155)],),
    "6": (_BOWL, [(0.0, 0.27), (0.03, 0.6), (0.2, 0.9), (0.4, 1.0)]),
    "7": ([(0.0, 1.0), (0.54, 1.0), (0.2, 0.0)],),
    "8": (
        _arc((0.27, 0.26), (0.27, 0.26), -180, 180),
        _arc((0.27, 0.76), (0.23, 0.24), -180, 180),
    ),
    "9": (
        _arc((0.27, 0.73), (0.27, 0.27), -180, 180),
        [(0.54, 0.73), (0.51, 0.4), (0.34, 0.1), (0.14, 0.0)],
    ),
    "A": ([(0.0, 0.0), (0.3, 1.0), (0.6, 0.0)], [(0.1, 0.32), (0.5, 0.32)]),
    "B": (
        [(0.0, 0.0), (0.0, 1.0), (0.25, 1.0), *_arc((0.25, 0.76), (0.22, 0.24), 90, -90)],
        [(0.0, 0.52), (0.25, 0.52), *_arc((0.25, 0.26), (0.27, 0.26), 90, -90), (0.0, 0.0)],
    ),
    "C": (_arc((0.3, 0.5), (0.3, 0.5), 50, 310),),
    "D": ([(0.0, 0.0), (0.0, 1.0), *_arc((0.2, 0.5), (0.36, 0.5), 90, -90), (0.0, 0.0)],),
    "E": ([(0.48, 1.0), (0.0, 1.0), (0.0, 0.0), (0.48, 0.0)], [(0.0, 0.52), (0.4, 0.52)]),
    "F": ([(0.48, 1.0), (0.0, 1.0), (0.0, 0.0)], [(0.0, 0.52), (0.4, 0.52)]),
    "G": ([*_arc((0.3, 0.5), (0.3, 0.5), 50, 330), (0.58, 0.46), (0.32, 0.46)],),
    "H": ([(0.0, 0.0), (0.0, 1.0)], [(0.52, 0.0), (0.52, 1.0)], [(0.0, 0.52), (0.52, 0.52)]),
    "I": ([(0.04, 0.0), (0.04, 1.0)],),
    "J": ([(0.4, 1.0), (0.4, 0.25), *_arc((0.2, 0.24), (0.2, 0.24), 0, -170)],),
    "K": ([(0.0, 0.0), (0.0, 1.0)], [(0.52, 1.0), (0.02, 0.42)], [(0.18, 0.6), (0.54, 0.0)]),
    "L": ([(0.0, 1.0), (0.0, 0.0), (0.46, 0.0)],),
    "M": ([(0.0, 0.0), (0.0, 1.0), (0.34, 0.3), (0.68, 1.0), (0.68, 0.0)],),
    "N": ([(0.0, 0.0), (0.0, 1.0), (0.54, 0.0), (0.54, 1.0)],),
    "O": (_arc((0.31, 0.5), (0.31, 0.5), -180, 180),),
    "P": (
        [
            (0.0, 0.0),
            (0.0, 1.0),
            (0.25, 1.0),
            *_arc((0.25, 0.74), (0.25, 0.26), 90, -90),
            (0.0, 0.48),
        ],
    ),
    "R": (
        [
            (0.0, 0.0),
            (0.0, 1.0),
            (0.25, 1.0),
            *_arc((0.25, 0.74), (0.25, 0.26), 90, -90),
            (0.0, 0.48),
        ],
        [(0.26, 0.48), (0.54, 0.0)],
    ),
    "S": (
        [*_arc((0.27, 0.74), (0.26, 0.26), 30, 250), *_arc((0.27, 0.26), (0.27, 0.26), 70, -150)],
    ),
    "T": ([(0.0, 1.0), (0.56, 1.0)], [(0.28, 1.0), (0.28, 0.0)]),
    "U": ([(0.0, 1.0), (0.0, 0.27), *_arc((0.27, 0.27), (0.27, 0.27), 180, 360), (0.54, 1.0)],),
    "V": ([(0.0, 1.0), (0.3, 0.0), (0.6, 1.0)],),
    "W": ([(0.0, 1.0), (0.2, 0.0), (0.4, 0.8), (0.6, 0.0), (0.8, 1.0)],),
    "X": ([(0.0, 0.0), (0.56, 1.0)], [(0.0, 1.0), (0.56, 0.0)]),
    "Y": ([(0.0, 1.0), (0.28, 0.5), (0.56, 1.0)], [(0.28, 0.5), (0.28, 0.0)]),
    "Z": ([(0.0, 1.0), (0.54, 1.0), (0.0, 0.0), (0.54, 0.0)],),
    "Q": (_arc((0.31, 0.5), (0.31, 0.5), -180, 180), [(0.38, 0.22), (0.62, -0.04)]),
    "Ł": ([(0.08, 1.0), (0.08, 0.0), (0.54, 0.0)], [(-0.04, 0.4), (0.32, 0.64)]),
    "Ø": (_arc((0.31, 0.5), (0.31, 0.5), -180, 180), [(0.02, -0.04), (0.6, 1.04)]),
    "Æ": (
        [(0.0, 0.0), (0.36, 1.0), (0.82, 1.0)],
        [(0.42, 1.0), (0.42, 0.0), (0.82, 0.0)],
        [(0.12, 0.32), (0.42, 0.32)],
        [(0.42, 0.52), (0.74, 0.52)],
    ),
    "&": (
        [(0.62, 0.0), (0.14, 0.66), *_arc((0.29, 0.8), (0.18, 0.2), 200, -50),
         (0.1, 0.4), *_arc((0.25, 0.24), (0.25, 0.24), 150, 330), (0.6, 0.42)],
    ),
    "-": ([(0.02, 0.45), (0.3, 0.45)],),
    ".": ([(0.06, 0.0), (0.06, 0.14)],),
    "/": ([(0.0, 0.0), (0.36, 1.0)],),
    "'": ([(0.05, 1.0), (0.05, 0.74)],),
}  # fmt: skip


def _smaller(capital: str) -> tuple[Line, ...]:
    """Return a capital in the size of small letters."""
    return tuple([(0.84 * x, _SMALL * y) for x, y in line] for line in _PLAIN[capital])


_SMALL = 0.7  # height of small letters, as a share of capitals
_DOT: Line = [(0.04, 0.87), (0.04, 1.02)]
_ROUND = _arc((0.25, 0.35), (0.25, 0.35), -180, 180)
_ARCH = [*_arc((0.22, 0.44), (0.22, 0.26), 170, 0), (0.44, 0.0)]
_MINUSCULES: Mapping[str, tuple[Line, ...]] = {
    "a": (_ROUND, [(0.5, 0.7), (0.5, 0.0)]),
    "b": ([(0.0, 1.0), (0.0, 0.0)], _ROUND),
    "c": (_arc((0.27, 0.35), (0.27, 0.35), 48, 312),),
    "d": (_ROUND, [(0.5, 1.0), (0.5, 0.0)]),
    "e": ([(0.02, 0.36), (0.5, 0.36)], _arc((0.26, 0.35), (0.26, 0.35), 0, 312)),
    "f": ([*_arc((0.3, 0.8), (0.18, 0.2), 65, 180), (0.12, 0.0)], [(-0.02, 0.66), (0.34, 0.66)]),
    "g": (_ROUND, [(0.5, 0.7), (0.5, -0.06), *_arc((0.26, -0.06), (0.24, 0.22), -20, -145)]),
    "h": ([(0.0, 1.0), (0.0, 0.0)], _ARCH),
    "i": ([(0.04, 0.7), (0.04, 0.0)], _DOT),
    "j": ([(0.14, 0.7), (0.14, -0.1), *_arc((0.0, -0.1), (0.14, 0.18), -20, -90)],
          [(0.14, 0.87), (0.14, 1.02)]),
    "k": ([(0.0, 1.0), (0.0, 0.0)], [(0.42, 0.7), (0.02, 0.28)], [(0.15, 0.41), (0.46, 0.0)]),
    "l": ([(0.04, 1.0), (0.04, 0.0)],),
    "m": (
        [(0.0, 0.7), (0.0, 0.0)],
        [*_arc((0.18, 0.48), (0.18, 0.22), 170, 0), (0.36, 0.0)],
        [*_arc((0.54, 0.48), (0.18, 0.22), 170, 0), (0.72, 0.0)],
    ),
    "n": ([(0.0, 0.7), (0.0, 0.0)], _ARCH),
    "o": (_arc((0.26, 0.35), (0.26, 0.35), -180, 180),),
    "p": ([(0.0, 0.7), (0.0, -0.28)], _ROUND),
    "q": (_ROUND, [(0.5, 0.7), (0.5, -0.28)]),
    "r": ([(0.0, 0.7), (0.0, 0.0)], _arc((0.22, 0.44), (0.22, 0.26), 170, 60)),
    "s": _smaller("S"),
    "t": ([(0.13, 0.94), (0.13, 0.2), *_arc((0.29, 0.2), (0.16, 0.2), 200, 290)],
          [(-0.02, 0.66), (0.34, 0.66)]),
    "u": ([(0.0, 0.7), (0.0, 0.24), *_arc((0.22, 0.24), (0.22, 0.24), 200, 350)],
          [(0.44, 0.7), (0.44, 0.0)]),
    "v": _smaller("V"),
    "w": _smaller("W"),
    "x": _smaller("X"),
    "y": ([(0.0, 0.7), (0.25, 0.02)], [(0.5, 0.7), (0.14, -0.28)]),
    "z": _smaller("Z"),
    "ß": (
        [(0.0, 0.0), (0.0, 0.76), *_arc((0.2, 0.78), (0.2, 0.22), 170, -70),
         *_arc((0.22, 0.28), (0.26, 0.28), 75, -130)],
    ),
    "ł": ([(0.12, 1.0), (0.12, 0.0)], [(-0.02, 0.42), (0.26, 0.62)]),
    "ø": (_arc((0.26, 0.35), (0.26, 0.35), -180, 180), [(0.0, -0.04), (0.52, 0.74)]),
    "æ": (
        _ROUND,
        [(0.5, 0.36), (0.98, 0.36)],
        _arc((0.74, 0.35), (0.25, 0.35), 0, 312),
    ),
}  # fmt: skip

GLYPHS: Mapping[str, tuple[Line, ...]] = {**_PLAIN, **_MINUSCULES, " ": ()}
"""Strokes of every character without marks that `lettering` can write."""

# Strokes of marks around the middle of a letter, over the height 0; those below stand at its foot.
_ABOVE: Mapping[str, tuple[Line, ...]] = {
    "\u0300": ([(-0.12, 0.22), (0.06, 0.08)],),
    "\u0301": ([(0.12, 0.22), (-0.06, 0.08)],),
    "\u0302": ([(-0.16, 0.08), (0.0, 0.22), (0.16, 0.08)],),
    "\u0303": ([(-0.2, 0.1), (-0.08, 0.18), (0.08, 0.1), (0.2, 0.18)],),
    "\u0307": ([(0.0, 0.1), (0.0, 0.24)],),
    "\u0308": ([(-0.14, 0.1), (-0.14, 0.24)], [(0.14, 0.1), (0.14, 0.24)]),
    "\u030a": (_arc((0.0, 0.16), (0.1, 0.1), -180, 180),),
    "\u030b": ([(-0.02, 0.22), (-0.14, 0.08)], [(0.2, 0.22), (0.08, 0.08)]),
    "\u030c": ([(-0.16, 0.22), (0.0, 0.08), (0.16, 0.22)],),
}
_BELOW: Mapping[str, tuple[Line, ...]] = {
    "\u0327": ([(0.02, 0.0), (0.06, -0.12), (-0.1, -0.22)],),
    "\u0328": ([(0.2, 0.0), (0.1, -0.12), (0.24, -0.2)],),
}


@dataclass(frozen=True, slots=True)
class Hand:
    """How letters are written.

    Attributes:
        weight: Width of strokes, as a share of the height of capitals.
        gap: Space between the middles of strokes of two letters, as a share of that height.
        stretch: Width of letters, as a share of the usual one.
        kerned: Whether letters that leave room for each other, as L and T, stand closer.
        tolerance: How far strokes may run beside their curves, as a share of that height.
    """

    weight: float = 0.16
    gap: float = 0.26
    stretch: float = 1.0
    kerned: bool = False
    tolerance: float = 0.0


def can_write(text: str) -> bool:
    """Return whether there are strokes for every character of a text."""
    return all(_has_strokes(character) for character in text)


def lettering(text: str, *, height: float, weight: float = 0.16, gap: float = 0.26) -> Floats:
    """Write a line of text around the origin as triangles, (n, 3, 2) [m].

    Args:
        text: As `can_write` allows.
        height: Of capitals [m].
        weight: Width of strokes, as a share of the height.
        gap: Space between letters, as a share of the height.

    Raises:
        KeyError: If a character has no strokes.
    """
    return written(text, Hand(weight, gap), height=height)


def written(text: str, hand: Hand, *, height: float) -> Floats:
    """Write a line of text in a hand around the origin as triangles, (n, 3, 2) [m].

    Args:
        text: As `can_write` allows.
        hand: How letters are written.
        height: Of capitals [m]; their middle lies at the origin's height.

    Raises:
        KeyError: If a character has no strokes.
    """
    pieces: list[Floats] = []
    at, before = 0.0, ""
    for character in text:
        if before and hand.kerned:
            at -= _tucked(before, character) * hand.stretch
        pieces.append(_drawn(character, hand) + np.array([at, 0.0]))
        at += _width(character) * hand.stretch + hand.gap
        before = character
    drawn = settled(np.concatenate([np.zeros((0, 3, 2)), *pieces]))
    if not len(drawn):
        return drawn
    low, high = drawn.reshape(-1, 2).min(axis=0), drawn.reshape(-1, 2).max(axis=0)
    centred: Floats = (drawn - [(low[0] + high[0]) / 2, 0.5]) * height
    return centred


def _has_strokes(character: str) -> bool:
    """Whether a character and its marks are known."""
    try:
        _lines(character)
    except KeyError:
        return False
    return True


@cache
def _lines(character: str) -> tuple[Line, ...]:
    """Return the strokes of a character, with those of its marks."""
    if character in GLYPHS:
        return GLYPHS[character]
    apart = unicodedata.normalize("NFD", character)
    letter, marks = apart[0], apart[1:]
    lines = GLYPHS[letter]
    if not marks:
        raise KeyError(character)
    middle = _width(letter) / 2
    top = 1.06 if letter.isupper() or letter in "bdhkl" else _SMALL + 0.04
    if letter in "ij":
        lines = lines[:1]  # the mark stands for the dot
    for mark in marks:
        foot = top if mark in _ABOVE else 0.0
        for line in _ABOVE.get(mark) or _BELOW[mark]:
            lines = (*lines, [(middle + x, foot + y) for x, y in line])
    return lines


@cache
def _width(character: str) -> float:
    """Return how wide a character is on the grid, marks apart."""
    letter = unicodedata.normalize("NFD", character)[0]
    return max((x for line in GLYPHS[letter] for x, _ in line), default=0.3)


_BOLDEST_MARK = 0.12  # of the height of capitals


def _strokes_without_marks(character: str) -> int:
    """Return how many of a character's strokes belong to its letter."""
    letter = unicodedata.normalize("NFD", character)[0]
    return len(GLYPHS[letter]) - (letter in "ij" and letter != character)


@cache
def _drawn(character: str, hand: Hand) -> Floats:
    """Draw the strokes of a character on its grid, (n, 3, 2)."""
    inner = 1.0 - hand.weight  # strokes stay within the height
    pieces = [np.zeros((0, 3, 2))]
    for number, line in enumerate(_lines(character)):
        # Marks are no bolder than what keeps them apart.
        marked = number >= _strokes_without_marks(character)
        weight = min(hand.weight, _BOLDEST_MARK) if marked else hand.weight
        points = np.array(line, dtype=np.float64)
        if hand.tolerance > 0.0:
            simple = shapely.LineString(points).simplify(hand.tolerance)
            points = settled(shapely.get_coordinates(simple))
        points = points * [hand.stretch, inner] + [0.0, hand.weight / 2]
        pieces.append(ribbon(points, weight))
    return np.concatenate(pieces)


_TUCK, _MOST_TUCKED = 0.7, 0.2  # share of what two letters leave free, and how much at most
_STEPS = np.arange(-0.3, 1.31, 0.08)  # heights at which it is measured


@cache
def _tucked(before: str, character: str) -> float:
    """Return how much closer two letters stand than their widths say, on the grid."""
    if " " in (before, character):
        return 0.0
    right = _width(before) - _reach(before, right=True)
    free = right + _reach(character, right=False)
    return float(min(_TUCK * max(free.min(), 0.0), _MOST_TUCKED))


@cache
def _reach(character: str, *, right: bool) -> Floats:
    """Return how far left or right a character reaches around each of `_STEPS`, (n,)."""
    sides = np.full(len(_STEPS), -1.0 if right else 1.0)
    for line in _lines(character):
        knots = np.array(line, dtype=np.float64)
        steps = np.linspace(0.0, len(knots) - 1.0, 12 * len(knots))
        x, y = (np.interp(steps, np.arange(len(knots)), column) for column in knots.T)
        for k, height in enumerate(_STEPS):
            near: Bools = np.abs(y - height) < 0.12
            if near.any():
                sides[k] = max(sides[k], x[near].max()) if right else min(sides[k], x[near].min())
    return sides
