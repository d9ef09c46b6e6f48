"""What grows or is worn on a head: hair in many cuts, caps, hats, hoods and helmets."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from sumo3dviz_pt.library.mesh.noise import smoothstep
from sumo3dviz_pt.library.people.cloth import Folds
from sumo3dviz_pt.library.people.head import Skull, head_angles, on_head
from sumo3dviz_pt.library.people.skin import (
    Cloth,
    SkinPart,
    Stack,
    carried,
    closed,
    rope,
    swollen,
    turns,
)
from sumo3dviz_pt.model.geometry import Floats, unit


def covering(skull: Skull, heights: Mapping[float, float], angles: Floats) -> Floats:
    """Return the levels of a line around the head, such as a hairline, (m,).

    Args:
        skull: Which head.
        heights: Height over the chin [m] by angle from the front [deg], up to 180.
        angles: Where to read it, (m,) [rad].
    """
    turn = np.degrees(np.abs((angles + np.pi) % (2.0 * np.pi) - np.pi))
    z = np.interp(turn, list(heights), list(heights.values()))
    return skull.level_at(angles, z)


Heights = Mapping[float, float]
"""Height over the chin [m] by angle from the front [deg]."""

_SHORT: Heights = {
    **{0: 0.186, 24: 0.188, 44: 0.172, 58: 0.150, 68: 0.128, 76: 0.098},
    **{86: 0.100, 98: 0.130, 110: 0.126, 126: 0.075, 150: 0.036, 180: 0.028},
}
_LONG: Heights = {
    **{0: 0.186, 24: 0.184, 44: 0.165, 58: 0.135, 68: 0.085, 76: 0.000},
    **{86: -0.070, 98: -0.100, 126: -0.120, 150: -0.130, 180: -0.135},
}
_BOB: Heights = {
    **{0: 0.150, 24: 0.150, 44: 0.140, 58: 0.100, 66: 0.055, 76: 0.020},
    **{86: 0.006, 98: 0.000, 126: 0.000, 150: 0.005, 180: 0.008},
}
_RING: Heights = {
    **{0: 0.205, 40: 0.205, 60: 0.170, 70: 0.128, 78: 0.098},
    **{86: 0.100, 98: 0.130, 110: 0.126, 126: 0.075, 150: 0.036, 180: 0.028},
}
_FRINGE: Heights = {**_SHORT, 0: 0.150, 24: 0.152, 44: 0.150, 58: 0.140}
_LOOSE: Heights = {
    **{0: 0.182, 24: 0.180, 44: 0.160, 58: 0.120, 68: 0.060, 76: 0.000},
    **{86: -0.040, 98: -0.060, 126: -0.070, 150: -0.075, 180: -0.080},
}
_CHIN: Heights = {
    **{0: 0.184, 24: 0.182, 44: 0.160, 58: 0.112, 66: 0.060, 76: 0.028},
    **{86: 0.012, 98: 0.004, 126: -0.004, 150: -0.006, 180: -0.008},
}
_CAP: Heights = {0: 0.158, 50: 0.155, 90: 0.150, 130: 0.135, 180: 0.120}
_BEANIE: Heights = {0: 0.160, 50: 0.145, 80: 0.105, 100: 0.090, 130: 0.075, 180: 0.060}
_HOOD: Heights = {0: 0.190, 40: 0.180, 60: 0.120, 75: 0.030, 90: -0.030, 130: -0.070, 180: -0.080}
_BICYCLE: Heights = {0: 0.165, 50: 0.165, 90: 0.158, 130: 0.140, 180: 0.128}
_JET: Heights = {0: 0.160, 35: 0.155, 55: 0.120, 70: 0.035, 90: 0.012, 130: 0.005, 180: 0.005}
_FULL: Heights = {0: 0.155, 40: 0.150, 62: 0.120, 78: 0.020, 90: -0.015, 130: -0.015, 180: -0.010}


_SHIELD = Cloth("window")


@dataclass(frozen=True, slots=True)
class HairStyle:
    """What covers a head.

    Attributes:
        edge: Its lower edge.
        crown: Distance from the skin at the crown [m].
        sides: Distance from the skin at the sides [m].
        material: Its material.
        rough: Height of locks or folds [m].
        frayed: How far locks end above or below the edge [m].
        vents: Whether it has dark slots from front to back.
    """

    edge: Heights
    crown: float
    sides: float
    material: str = "hair"
    rough: float = 0.004
    frayed: float = 0.006
    vents: bool = False


STYLES: Mapping[str, HairStyle] = {
    "short": HairStyle(_SHORT, 0.015, 0.006),
    "crop": HairStyle(_SHORT, 0.007, 0.003, rough=0.001, frayed=0.003),
    "buzz": HairStyle(_SHORT, 0.004, 0.002, rough=0.0, frayed=0.002),
    "full": HairStyle(_SHORT, 0.024, 0.010, rough=0.007),
    "fringe": HairStyle(_FRINGE, 0.020, 0.009, rough=0.005, frayed=0.009),
    "faded": HairStyle(_SHORT, 0.021, 0.002, rough=0.005, frayed=0.003),
    "curly": HairStyle(_SHORT, 0.036, 0.022, rough=0.016, frayed=0.010),
    "afro": HairStyle(_SHORT, 0.062, 0.052, rough=0.012, frayed=0.006),
    "receding": HairStyle(_RING, 0.002, 0.007, rough=0.002),
    "long": HairStyle(_LONG, 0.016, 0.010, rough=0.007, frayed=0.022),
    "wavy": HairStyle(_LOOSE, 0.022, 0.022, rough=0.016, frayed=0.020),
    "bob": HairStyle(_BOB, 0.015, 0.012, rough=0.006, frayed=0.010),
    "chin": HairStyle(_CHIN, 0.018, 0.013, rough=0.008, frayed=0.012),
    "tied": HairStyle(_SHORT, 0.010, 0.006, rough=0.002),
    "bun": HairStyle(_SHORT, 0.011, 0.006, rough=0.002),
    "knot": HairStyle(_SHORT, 0.012, 0.007, rough=0.003),
    "plait": HairStyle(_SHORT, 0.011, 0.007, rough=0.003),
    "cap": HairStyle(_CAP, 0.018, 0.012, "cloth", rough=0.0),
    "hat": HairStyle(_CAP, 0.030, 0.014, "cloth", rough=0.002),
    "beanie": HairStyle(_BEANIE, 0.026, 0.013, "cloth", rough=0.003),
    "hood": HairStyle(_HOOD, 0.034, 0.030, "cloth", rough=0.006),
    "bicycle_helmet": HairStyle(_BICYCLE, 0.040, 0.024, "sign", rough=0.0, vents=True),
    "jet_helmet": HairStyle(_JET, 0.036, 0.038, "sign", rough=0.0),
    "full_helmet": HairStyle(_FULL, 0.040, 0.044, "sign", rough=0.0),
}
"""What can be on a head, by name; `bald` is nothing."""


def cover_levels(skull: Skull, styles: tuple[str, ...], *, fine: bool) -> Floats | None:
    """Return the levels above which some style hides the skin, (m,); None where none does.

    Args:
        skull: The head that it is for.
        styles: Names; those that are not in `STYLES` hide nothing.
        fine: Whether the head has its fine columns.
    """
    angles = head_angles(fine=fine)
    levels = [covering(skull, STYLES[s].edge, angles) for s in styles if s in STYLES]
    return np.min(levels, axis=0) if levels else None


def headwear(
    skull: Skull, style: str, cloth: Cloth, *, fine: bool, under: bool = False
) -> Iterator[SkinPart]:
    """Make hair or headwear, with its tail, brim or visor.

    Args:
        skull: The head that it is for.
        style: One of `STYLES`.
        cloth: What it is made of.
        fine: Whether to model locks and details.
        under: Whether something else is worn over it.
    """
    chosen = STYLES[style]
    rows = (4 if under else 9) if fine else 3
    shell = _shell(skull, chosen, cloth, fine=fine, rows=rows)
    yield shell
    if fine and cloth.material == "hair" and not under:
        yield _tufts(shell, chosen, cloth)
    extra = _EXTRAS.get(style)
    if extra is not None and fine:
        yield from extra(skull, cloth)


def _shell(skull: Skull, style: HairStyle, cloth: Cloth, *, fine: bool, rows: int) -> SkinPart:
    """Make a shell from its edge, which is drawn in under itself, to the crown."""
    angles = head_angles(fine=fine)
    grown = fine and style.material == "hair"
    frayed = _frayed(style, angles) * grown
    low = np.clip(covering(skull, style.edge, angles) + frayed / 0.013, 0.0, 18.0)
    rise = np.linspace(0.0, 1.0, rows)[:, None]
    share: Floats = np.asarray(np.sin(0.5 * np.pi * rise) ** 1.1, dtype=np.float64)
    levels = low + (19.0 - low) * share
    turn = np.broadcast_to(angles, levels.shape)
    heights = _drop(skull, style, angles, share) + frayed * (1.0 - share)
    points = _base(skull, levels, turn, heights)
    away = points - np.array([-0.005, 0.0, 0.125])
    away[..., 2] = np.maximum(away[..., 2], 0.0)
    away = unit(away)
    crown = smoothstep(0.15, 0.22, points[..., 2])
    thick = style.sides + crown * (style.crown - style.sides)
    thick = thick * smoothstep(-0.10, 0.34, share)
    locks = style.rough * Folds.of(len(style.edge), slant=0.8)(points * 1.6)
    if grown:
        locks = np.maximum(locks, -0.5 * thick) + _strands(style, angles, share, thick)
    if style.vents:
        locks = locks - 0.007 * _slots(angles) * _open_rows(share)
        # Helmets are drawn out behind.
        thick = thick + 0.016 * smoothstep(0.0, -0.10, points[..., 0]) * smoothstep(0.0, 0.3, share)
    points = points + away * (thick + locks)[..., None]
    inner = _base(skull, levels[:1], turn[:1], heights[:1]) - 0.006 * away[:1]
    rings = np.concatenate([inner, points]) if fine else swollen(points)
    shape = closed(skull.world(rings), bottom=False, top=True)
    piece = carried(shape, "head", cloth)
    if style.vents and fine and cloth.colour is not None:
        return _slotted(piece, _slots(angles), _open_rows(share)[:, 0])
    if cloth.material != "hair" or not fine:
        return piece
    return _combed(_streaked(piece, len(angles)), angles)


_TUFTS = 48


def _combed(piece: SkinPart, angles: Floats) -> SkinPart:
    """Let strands catch light one by one: they run down between the columns of a shell."""
    count = len(piece.vertices) // len(angles) * len(angles)
    dice = np.random.default_rng(len(piece.vertices))
    sway = np.where(np.arange(count) % 2, 0.30, -0.30) + dice.normal(0.0, 0.16, count)
    turn = np.tile(angles, count // len(angles))
    around = np.stack([-np.sin(turn), np.cos(turn), 0.0 * turn], axis=1)
    slopes = np.zeros_like(piece.vertices)
    slopes[:count] = np.clip(sway, -0.55, 0.55)[:, None] * around
    return replace(piece, slopes=slopes)


def _tufts(shell: SkinPart, style: HairStyle, cloth: Cloth) -> SkinPart:
    """Make locks that leave the shell and break its outline: spikes, closed, down along the hair.

    Args:
        shell: Of rings from the edge, whose first is drawn in, to the crown.
        style: What it is.
        cloth: What it is made of.
    """
    count, dice = len(head_angles(fine=True)), np.random.default_rng(round(3e4 * style.sides) + 11)
    rings = shell.vertices[: len(shell.vertices) // count * count].reshape(-1, count, 3)[1:]
    # Most are at the edge and about the crown, where the sky is behind them.
    where = dice.uniform(0.0, 1.0, _TUFTS)
    row = np.where(where < 0.45, 1.2 * dice.uniform(0.0, 1.0, _TUFTS), 0.0)
    row = np.where(where >= 0.45, dice.uniform(1.0, len(rings) - 1.01, _TUFTS), row)
    column = dice.uniform(0.0, count, _TUFTS)
    at, down, across = _on_rings(rings, row, column)
    out = unit(np.cross(down, across))
    out *= np.sign(((at - rings.mean(axis=(0, 1))) * out).sum(axis=1, keepdims=True))
    # Before the face they stay short.
    before = smoothstep(0.35, 0.75, np.cos(2.0 * np.pi * column / count)) * (row < 2.0)
    size = (0.7 + 30.0 * min(style.rough + style.crown, 0.03)) * (1.0 - 0.6 * before)
    length = (0.030 * size * dice.uniform(0.6, 1.4, _TUFTS))[:, None]
    wide = (0.0095 * dice.uniform(0.7, 1.3, _TUFTS))[:, None]
    way = unit(down + 0.35 * dice.normal(0.0, 1.0, (_TUFTS, 1)) * across)
    side = np.cross(way, out)
    base = at - 0.45 * length * way
    lift = dice.uniform(0.02, 0.16, (_TUFTS, 1)) * length
    corners = [base + wide * side - 0.005 * out, base - wide * side - 0.005 * out]
    corners += [base + 0.3 * length * way + 0.0025 * out, at + 0.55 * length * way + lift * out]
    # What lies below has vertices of its own, so that what is seen catches light as hair does.
    faces = np.array([[2, 1, 0], [2, 3, 1], [0, 3, 2], [5, 6, 4]])
    faces = faces + 7 * np.arange(_TUFTS)[:, None, None]
    points = np.stack([*corners, *corners[:2], corners[3]], axis=1).reshape(-1, 3)
    made = carried((points, faces.reshape(-1, 3)), "head", cloth)
    return replace(made, shade=np.repeat(dice.uniform(0.7, 1.25, _TUFTS), 4))


def _on_rings(rings: Floats, row: Floats, column: Floats) -> tuple[Floats, Floats, Floats]:
    """Return places between rings, (k, m, 3), and the directions down and around there, (n, 3)."""
    last = len(rings) - 1
    low, left = np.minimum(row.astype(np.int64), last - 1), column.astype(np.int64)
    right, up = (left + 1) % rings.shape[1], low + 1
    s, t = (column - left)[:, None], (row - low)[:, None]
    below = rings[low, left] * (1.0 - s) + rings[low, right] * s
    above = rings[up, left] * (1.0 - s) + rings[up, right] * s
    around = unit(rings[low, right] - rings[low, left] + 1e-9)
    return below * (1.0 - t) + above * t, unit(below - above + 1e-9), around


def _frayed(style: HairStyle, angles: Floats) -> Floats:
    """Return how far locks end above the edge of a style, (m,) [m]; before the face all alike."""
    dice = np.random.default_rng(round(1e4 * (style.crown + style.sides)))
    beside = smoothstep(0.9, -0.3, np.cos(angles))
    most = np.minimum(style.frayed, 0.004 + 0.05 * beside * style.frayed / 0.022)
    return np.asarray(dice.uniform(-1.0, 1.0, len(angles)) * most)


def _strands(style: HairStyle, angles: Floats, share: Floats, thick: Floats) -> Floats:
    """Return how far strands stand out, (rows, m) [m]: they run from the crown to the edge."""
    dice = np.random.default_rng(round(1e4 * style.sides))
    strands = np.where(np.arange(len(angles)) % 2, 1.0, -1.0)
    strands = strands + dice.normal(0.0, 0.5, len(angles))
    size = np.minimum(0.0012 + 0.12 * style.rough, 0.3 * thick)
    return np.asarray(size * strands * smoothstep(1.05, 0.5, share))


def _slots(angles: Floats) -> Floats:
    """Return 1 for columns of a head that lie in a helmet's slot, else 0, (m,)."""
    turn = np.degrees(np.abs((angles + np.pi) % (2.0 * np.pi) - np.pi))
    wanted = ((5.0, 14.0), (30.0, 45.0), (79.0, 105.0), (129.0, 131.0), (155.0, 157.0))
    inside = np.zeros(len(angles), dtype=np.bool_)
    for low, high in wanted:
        inside |= (turn > low) & (turn < high)
    return inside.astype(np.float64)


def _open_rows(share: Floats) -> Floats:
    """Return 1 for rows of a helmet that its slots run through, else 0."""
    return ((share > 0.30) & (share < 0.93)).astype(np.float64)


def _slotted(piece: SkinPart, columns: Floats, rows: Floats) -> SkinPart:
    """Darken a helmet's slots, and the foam at its edge."""
    assert piece.tint is not None
    quad = np.arange(len(piece.faces)) // 2
    row, column = np.minimum(quad // len(columns), len(rows) - 1), quad % len(columns)
    after = (column + 1) % len(columns)
    # The first row is the inside; row k lies between ring k - 1 and ring k of the shell.
    below, above = rows[np.maximum(row - 1, 0)], rows[row]
    inside = (columns[column] * columns[after] > 0) & (below * above > 0)
    dark = inside | (row == 0)
    return replace(piece, tint=np.where(dark[:, None], 0.012, piece.tint))


def _drop(skull: Skull, style: HairStyle, angles: Floats, share: Floats) -> Floats:
    """Return the heights of a shell's points, which may hang below the skull, (rows, m) [m]."""
    turn = np.degrees(np.abs((angles + np.pi) % (2.0 * np.pi) - np.pi))
    low = np.interp(turn, list(style.edge), list(style.edge.values()))
    return np.asarray(low + (0.231 - low) * share)


def _base(skull: Skull, levels: Floats, turn: Floats, heights: Floats) -> Floats:
    """Return points of the skull's skin, or below the ears of a curtain that falls from it."""
    ear = skull.level_at(turn[0], np.full(turn.shape[1], 0.095))
    points = skull.stack.points(np.maximum(levels, ear), turn)
    fall = np.maximum(points[..., 2] - heights, 0.0) * (levels < ear)
    points[..., 2] -= fall
    points[..., :2] *= (1.0 + 0.35 * fall - 2.2 * fall**2)[..., None]
    points[..., 0] -= 0.10 * fall
    return np.asarray(points)


def _streaked(piece: SkinPart, columns: int) -> SkinPart:
    """Colour locks lighter and darker."""
    assert piece.tint is not None
    quad = np.arange(len(piece.faces)) // 2
    dice = np.random.default_rng(7)
    lock = dice.uniform(0.66, 1.36, columns)[quad % columns]
    lock = lock * dice.uniform(0.88, 1.12, len(piece.faces) // 2 + 1)[quad]
    # The roots are darker than what the sun has bleached.
    row = (quad // columns).astype(np.float64)
    lock = lock * (0.72 + 0.36 * smoothstep(0.0, 6.0, row))
    return replace(piece, tint=piece.tint * lock[:, None])


def _tail(skull: Skull, cloth: Cloth) -> Iterator[SkinPart]:
    """Make a pony tail of three locks, bound where it begins."""
    band = _TAIL[0] + np.array([[0.3], [0.9]]) * (_TAIL[1] - _TAIL[0])
    yield on_head(skull, rope(band, np.array([0.017, 0.018]), 6), Cloth("trim"))
    for number, (aside, behind, most) in enumerate(_LOCKS):
        share = np.linspace(0.0, 1.0, len(_TAIL) + 1)
        path = np.stack([np.interp(share, np.linspace(0, 1, len(_TAIL)), c) for c in _TAIL.T], 1)
        path += np.array([behind, aside, 0.0]) * np.sin(np.pi * np.minimum(share, 0.8))[:, None]
        path[:, 2] = path[0, 2] + (path[:, 2] - path[0, 2]) * most
        wide = np.interp(share, [0.0, 0.25, 0.65, 1.0], [0.012, 0.022, 0.019, 0.003])
        piece = on_head(skull, rope(path, wide * (1.0 - 0.1 * number), 5), cloth)
        shade = np.random.default_rng(number).uniform(0.7, 1.3, len(piece.faces))
        yield replace(piece, shade=shade)


_TAIL = np.array(
    [
        *((-0.098, 0.0, 0.172), (-0.118, 0.0, 0.166), (-0.146, 0.0, 0.115), (-0.150, 0.002, 0.050)),
        *((-0.146, 0.004, -0.010), (-0.150, 0.008, -0.062)),
    ]
)
_LOCKS = ((0.0, 0.0, 1.0), (0.020, 0.008, 0.86), (-0.017, 0.010, 0.93))
"""Of a pony tail: its line in the head's frame; how far locks leave it, and how long they are."""


def _plait(skull: Skull, cloth: Cloth) -> Iterator[SkinPart]:
    """Make a plait that hangs down the back."""
    bead = np.array([0.006, 0.017, 0.012, 0.019, 0.013, 0.021, 0.014, 0.022])
    z = np.array([-0.150, -0.120, -0.095, -0.065, -0.040, -0.005, 0.025, 0.060])
    x = np.array([-0.130, -0.128, -0.125, -0.120, -0.116, -0.112, -0.108, -0.102])
    rows = np.stack([x, 0 * x, bead, bead, 1.15 * bead, z, z, 0 * x + 2.0], axis=1)
    yield on_head(skull, Stack(rows).grid(8, 6), cloth)


def _knot(skull: Skull, cloth: Cloth) -> Iterator[SkinPart]:
    """Make a knot of hair low at the nape."""
    lift = np.radians([-75.0, -35.0, 5.0, 45.0, 80.0])
    rows = [
        (
            -0.112,
            0,
            *[0.030 * np.cos(a)] * 2,
            0.040 * np.cos(a),
            *[0.072 + 0.028 * np.sin(a)] * 2,
            2,
        )
        for a in lift
    ]
    yield on_head(skull, Stack(np.array(rows)).grid(5, 8), cloth)


def _hat_brim(skull: Skull, cloth: Cloth) -> Iterator[SkinPart]:
    """Make the soft brim of a hat."""
    turn = turns(14)
    flat = np.stack([np.cos(turn), np.sin(turn), 0.0 * turn], axis=1)
    inner, outer = flat * [0.104, 0.086, 0.0], flat * [0.150, 0.128, 0.0]
    up, thick = np.array([-0.006, 0.0, 0.160]), np.array([0.0, 0.0, 0.004])
    drop = np.array([0.0, 0.0, 0.022])
    rings = [inner + up - thick, outer + up - drop - thick, outer + up - drop, inner + up + thick]
    yield on_head(skull, np.stack([rings[0], rings[1], rings[2], rings[3]]), cloth)


def _bun(skull: Skull, cloth: Cloth) -> Iterator[SkinPart]:
    """Make a knot of hair at the back."""
    lift = np.radians([-75.0, -35.0, 5.0, 45.0, 80.0])
    rows = [
        (-0.118, 0, *[0.036 * np.cos(a)] * 3, *[0.165 + 0.034 * np.sin(a)] * 2, 2) for a in lift
    ]
    yield on_head(skull, Stack(np.array(rows)).grid(5, 8), cloth)


def _brim(skull: Skull, cloth: Cloth) -> Iterator[SkinPart]:
    """Make the peak of a cap."""
    turn = np.radians(np.linspace(-62.0, 62.0, 9))
    inner = np.stack([0.088 * np.cos(turn), 0.080 * np.sin(turn), np.full(9, 0.168)], axis=1)
    outer = np.stack(
        [0.06 + 0.115 * np.cos(turn) ** 0.8, 0.078 * np.sin(turn), 0.160 - 0.012 * np.cos(turn)],
        axis=1,
    )
    # Around the peak's edge: above inside, above outside, below outside, below inside.
    thick = np.array([0.0, 0.0, 0.004])
    rings = np.stack([inner - thick, outer - thick, outer + thick, inner + thick], axis=1)
    yield on_head(skull, rings[::-1], cloth)


def _visor(skull: Skull, cloth: Cloth) -> Iterator[SkinPart]:
    """Make the dark shield before the eyes of a jet helmet."""
    yield _band(skull, (0.050, 0.165), 0.030, _SHIELD)


def _full_face(skull: Skull, cloth: Cloth) -> Iterator[SkinPart]:
    """Make the chin bar and the shield of a full-face helmet."""
    yield _band(skull, (-0.020, 0.075), 0.036, cloth)
    yield _band(skull, (0.070, 0.160), 0.032, _SHIELD)


def _band(skull: Skull, span: tuple[float, float], away: float, cloth: Cloth) -> SkinPart:
    """Make a closed band before the face, between two heights over the chin [m]."""
    turn = np.radians(np.linspace(-80.0, 80.0, 11))
    z = np.linspace(span[0], span[1], 4)
    bow = away + 0.012 * np.sin(np.linspace(0.2, 2.6, 4))
    reach = 0.094 + bow[:, None] * np.ones_like(turn)
    outer = np.stack(
        [
            reach * np.cos(turn),
            (reach - 0.016) * np.sin(turn),
            np.broadcast_to(z[:, None], reach.shape),
        ],
        axis=-1,
    )
    inner = outer * [0.9, 0.9, 1.0]
    rings = np.concatenate([outer, inner[:, ::-1]], axis=1)
    return on_head(skull, rings, cloth)


def _straps(skull: Skull, cloth: Cloth) -> Iterator[SkinPart]:
    """Make the straps of a bicycle helmet, which meet below the chin."""
    for s in (1.0, -1.0):
        for back in (0.030, -0.030):
            path = np.array([[back, 0.081, 0.150], [0.012, 0.0775, 0.085], [0.022, 0.063, 0.030]])
            path = np.concatenate([path, [[0.052, 0.026, -0.006]]]) * [1.0, s, 1.0]
            away = np.array([0.0, s, 0.0])
            yield on_head(skull, rope(path, np.full(4, 0.0075), 3, flat=away), Cloth("trim"))


_EXTRAS: Mapping[str, Callable[[Skull, Cloth], Iterator[SkinPart]]] = {
    "tied": _tail,
    "bun": _bun,
    "cap": _brim,
    "jet_helmet": _visor,
    "full_helmet": _full_face,
    "bicycle_helmet": _straps,
    "plait": _plait,
    "knot": _knot,
    "hat": _hat_brim,
}
