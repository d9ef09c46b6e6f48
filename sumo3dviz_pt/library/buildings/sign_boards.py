"""Boards over shops and signs that stick out, and the words on them.

In wall coordinates: (along, inward, up) [m]. A wall's words and how they are written come from a
stream of their own, the same at all levels of detail: near, letters have round strokes; farther
away these have fewer corners; from afar a word is a bar as light or dark as the word is on average.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from sumo3dviz_pt.library.buildings.facade import FAR, MIDDLE, NEAR
from sumo3dviz_pt.library.buildings.shell import Shell, box, joined, rectangles
from sumo3dviz_pt.library.buildings.shop_words import UNTOLD, Writing
from sumo3dviz_pt.library.street.lettering import Hand, written
from sumo3dviz_pt.model.geometry import Floats

COLOURS = 3
"""How many boards of different colours a building may have."""

_ROUND = {NEAR: 0.025, MIDDLE: 0.1, FAR: 0.1}  # tolerance of strokes by level
_EDGE = 0.14  # between words and the ends of their board [m]
_NARROWEST = 0.7  # of letters, as a share of how they were to be
_BLANK = 0.3  # share of shops without a board


@dataclass(frozen=True, slots=True)
class Boards:
    """What is written over the shops of a wall.

    Attributes:
        writing: Says the language and the seed.
        wall: Seed of its building, and its number.
        whole: Whether one board runs along the whole wall; else each shop has one.
    """

    writing: Writing = UNTOLD
    wall: tuple[int, int] = (0, 0)
    whole: bool = False

    def dice(self, use: int) -> np.random.Generator:
        """Return random numbers for a use."""
        return self.writing.dice(*self.wall, use)

    def waiting(self) -> list[str]:
        """Return the words of the wall, the next one first; other walls begin elsewhere."""
        words = self.writing.words.large if self.whole else self.writing.words.shops
        house, number = self.wall
        order = self.writing.dice(house).permutation(np.array(words)).tolist()
        begin = (number * _WALL_WORDS) % len(order)
        return [*order[begin:], *order[:begin]]


_WALL_WORDS = 7  # about as many as a wall has shops


@dataclass(frozen=True, slots=True)
class _Line:
    """A word as it is to be written.

    Attributes:
        text: As it is spelt on the board.
        hand: How.
        size: Height of capitals [m].
        left: Whether it begins at the board's left end; else it stands in the middle.
    """

    text: str
    hand: Hand
    size: float
    left: bool


def sign_boards(
    edges: Floats, height: float, boards: Boards, *, level: int, rng: np.random.Generator
) -> Shell:
    """Build boards with words over the shop windows; their faces shine at night.

    Args:
        edges: Where shops begin and end along the wall, (n,) [m].
        height: Of the ground floor [m].
        boards: What is written.
        level: Of detail.
        rng: Chooses which shops have a board.
    """
    z0, z1 = height - 0.86, height - 0.26
    ends = edges.tolist()
    spans = [(ends[0], ends[-1])] if boards.whole else list(pairwise(ends))
    dice, waiting = boards.dice(1), boards.waiting()
    parts: list[Shell] = []
    for number, (a, b) in enumerate(spans):
        shown = boards.whole or rng.random() >= _BLANK
        u0, u1 = a + 0.12, b - 0.12
        line = _next_line(waiting, (u1 - u0) - 2 * _EDGE, dice)
        if not shown:
            continue
        colour = number % COLOURS
        parts.append({f"sign{colour}": rectangles(u0, u1, z0, z1, inward=-0.14)})
        if level == NEAR:
            parts.append({"joint": box((u0, -0.14, z0), (u1, 0.0, z1), skip="yY")})
        if line is not None:
            flat = _laid(line, (u0 + _EDGE, u1 - _EDGE), (z0 + z1) / 2, level)
            parts.append({f"letter{colour}": _upright(flat, -0.15)})
    return joined(parts)


def blade_signs(
    length: float,
    height: float,
    boards: Boards,
    *,
    level: int,
    rng: np.random.Generator,
) -> Shell:
    """Build signs of shops that stick out over the pavement; both sides shine at night.

    Args:
        length: Of the wall [m].
        height: Of the ground floor [m].
        boards: What is written.
        level: Of detail.
        rng: Chooses how many there are, where they hang and how large they are.
    """
    if length < 4.0:
        return {}
    parts: list[Shell] = []
    dice = boards.dice(2)
    for number in range(int(rng.integers(0, max(int(length / 7.0), 1) + 1))):
        u, tall = float(rng.uniform(0.8, length - 0.8)), float(rng.uniform(0.55, 1.0))
        wide, low = float(rng.uniform(0.5, 0.8)), height - 0.2
        text, mark = _short_word(boards.writing, dice), int(dice.integers(3))
        if level == FAR:
            continue
        faces = box((u - 0.06, -wide - 0.18, low), (u + 0.06, -0.18, low + tall), skip="ytYb")
        rim = box((u - 0.06, -wide - 0.18, low), (u + 0.06, -0.18, low + tall), skip="xX")
        colour = number % COLOURS
        parts.append({f"sign{colour}": faces, "joint": rim})
        hand = Hand(0.17, 0.29, kerned=True, tolerance=_ROUND[level])
        flat = np.concatenate([_named(text, hand, (wide, tall)), _mark(mark, wide, tall)])
        parts.append({f"letter{colour}": _both_sides(flat, u, wide, low)})
        if level == NEAR:
            arms = [
                box((u - 0.02, -0.2, z), (u + 0.02, 0.0, z + 0.04), skip="yY")
                for z in (low + 0.1, low + tall - 0.14)
            ]
            parts.append({"rail": np.concatenate(arms)})
    return joined(parts)


_WEIGHTS, _STRETCHES = (0.09, 0.21), (0.8, 1.2)  # as of `Hand`
_GAPS = (0.09, 0.18)  # between strokes of two letters, as a share of their height
_SIZES = (0.27, 0.35)  # height of capitals [m]


def _next_line(waiting: list[str], room: float, dice: np.random.Generator) -> _Line | None:
    """Take the first waiting word that fits into a room [m], written by chance; None if none does.

    As many random numbers are drawn whether or not a word fits.
    """
    weight, stretch, apart, size = (
        float(dice.uniform(*span)) for span in (_WEIGHTS, _STRETCHES, _GAPS, _SIZES)
    )
    capitals, left = dice.random() < 0.55, dice.random() < 0.25
    for word in waiting:
        text = word.upper() if capitals else word
        for narrower in (1.0, 0.85, _NARROWEST):
            hand = Hand(weight * narrower, (weight + apart) * narrower, stretch * narrower, True)
            if float(np.ptp(written(text, hand, height=size)[..., 0])) <= room:
                waiting.remove(word)
                return _Line(text, hand, size, left)
    return None


def _laid(line: _Line, ends: tuple[float, float], middle: float, level: int) -> Floats:
    """Write a word on a board between two ends [m] around a height [m], (n, 3, 2)."""
    own = line.hand
    hand = Hand(own.weight, own.gap, own.stretch, own.kerned, _ROUND[level])
    flat = written(line.text, hand, height=line.size)
    wide = float(np.ptp(flat[..., 0]))
    if level == FAR:
        flat = _bar(flat)
    at = ends[0] + wide / 2 if line.left else sum(ends) / 2
    placed: Floats = flat + np.array([at, middle])
    return placed


def _bar(flat: Floats) -> Floats:
    """Return a bar as long as a word with as much ink, as two triangles, (2, 3, 2)."""
    a, b = flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0]
    ink = float(np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum()) / 2
    x = float(np.ptp(flat[..., 0])) / 2
    y = ink / (4 * x)
    corners = np.array([(-x, -y), (x, -y), (x, y), (-x, y)])
    return corners[[[0, 1, 2], [0, 2, 3]]]


def _upright(flat: Floats, inward: float) -> Floats:
    """Stand triangles, (n, 3, 2), before a wall as quads whose last corners coincide, (n, 4, 3)."""
    corners = flat[:, [0, 1, 2, 2]]
    return np.stack([corners[..., 0], np.full(corners.shape[:2], inward), corners[..., 1]], axis=-1)


_SHORT = 8  # letters of words on signs that stick out, at most


def _short_word(writing: Writing, dice: np.random.Generator) -> str:
    """Choose a word for a sign that sticks out."""
    short: Sequence[str] = [word for word in writing.words.shops if len(word) <= _SHORT]
    return short[int(dice.integers(len(short)))].upper()


def _named(text: str, hand: Hand, size: tuple[float, float]) -> Floats:
    """Write a word low on a sign of a width and height [m], around its foot's middle, (n, 3, 2)."""
    wide, tall = size
    flat = written(text, hand, height=1.0)
    scale = min(0.8 * wide / float(np.ptp(flat[..., 0])), 0.2 * tall)
    placed: Floats = flat * scale + np.array([0.0, 0.12 * tall + scale / 2])
    return placed


def _mark(sort: int, wide: float, tall: float) -> Floats:
    """Draw a diamond, a board or a pair of bars high on a sign, as triangles, (n, 3, 2) [m]."""
    size, z = 0.22 * min(wide, tall), 0.66 * tall
    if sort == 0:
        outlines = np.array([[(-size, z), (0.0, z - size), (size, z), (0.0, z + size)]])
    elif sort == 1:
        outlines = rectangles(-1.4 * size, 1.4 * size, z - 0.8 * size, z + 0.8 * size)[..., [0, 2]]
    else:
        left, right = np.array([-size, 0.15 * size]), np.array([-0.15 * size, size])
        outlines = rectangles(left, right, z - size, z + size)[..., [0, 2]]
    return np.asarray(outlines[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3, 2))


def _both_sides(flat: Floats, u: float, wide: float, low: float) -> Floats:
    """Draw triangles, (n, 3, 2), on both faces of a sign that sticks out, (2 n, 4, 3) [m].

    Args:
        flat: Around the middle of the sign's foot [m].
        u: Of the sign's middle, along the wall [m].
        wide: Of the sign, away from the wall [m].
        low: Height of its foot [m].
    """
    corners = flat[:, [0, 1, 2, 2]]
    sides = []
    for side in (-1.0, 1.0):  # from either side, words run to the right
        out = -0.18 - wide / 2 + side * corners[..., 0]
        across = np.full_like(out, u + 0.063 * side)
        sides.append(np.stack([across, out, low + corners[..., 1]], axis=-1))
    return np.concatenate(sides)
