"""Hair, caps, hoods and helmets: shells over a figure's head."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from sumo3dviz_pt.library.mesh.noise import smoothstep
from sumo3dviz_pt.library.people.head import Skull, covering, head_angles, on_head
from sumo3dviz_pt.library.people.skin import Cloth, Folds, SkinPart, carried
from sumo3dviz_pt.library.people.stack import Stack, closed, swollen
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.vectors import unit

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
    """

    edge: Heights
    crown: float
    sides: float
    material: str = "hair"
    rough: float = 0.004


STYLES: Mapping[str, HairStyle] = {
    "short": HairStyle(_SHORT, 0.016, 0.008),
    "crop": HairStyle(_SHORT, 0.008, 0.005, rough=0.001),
    "full": HairStyle(_SHORT, 0.026, 0.013, rough=0.007),
    "receding": HairStyle(_RING, 0.002, 0.009, rough=0.002),
    "long": HairStyle(_LONG, 0.020, 0.013, rough=0.007),
    "bob": HairStyle(_BOB, 0.020, 0.013, rough=0.006),
    "tied": HairStyle(_SHORT, 0.012, 0.009, rough=0.002),
    "bun": HairStyle(_SHORT, 0.012, 0.009, rough=0.002),
    "cap": HairStyle(_CAP, 0.018, 0.012, "cloth", rough=0.0),
    "beanie": HairStyle(_BEANIE, 0.026, 0.013, "cloth", rough=0.003),
    "hood": HairStyle(_HOOD, 0.034, 0.030, "cloth", rough=0.006),
    "bicycle_helmet": HairStyle(_BICYCLE, 0.038, 0.026, "sign", rough=0.0),
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
    yield _shell(skull, chosen, cloth, fine=fine, rows=rows)
    extra = _EXTRAS.get(style)
    if extra is not None and fine:
        yield from extra(skull, cloth)


def _shell(skull: Skull, style: HairStyle, cloth: Cloth, *, fine: bool, rows: int) -> SkinPart:
    """Make a shell from its edge, which is drawn in under itself, to the crown."""
    angles = head_angles(fine=fine)
    low = covering(skull, style.edge, angles)
    share = np.sin(0.5 * np.pi * np.linspace(0.0, 1.0, rows))[:, None] ** 1.1
    levels = low + (19.0 - low) * share
    turn = np.broadcast_to(angles, levels.shape)
    heights = _drop(skull, style, angles, share)
    points = _base(skull, levels, turn, heights)
    away = points - np.array([-0.005, 0.0, 0.125])
    away[..., 2] = np.maximum(away[..., 2], 0.0)
    away = unit(away)
    crown = smoothstep(0.15, 0.22, points[..., 2])
    thick = style.sides + crown * (style.crown - style.sides)
    thick = thick * smoothstep(-0.10, 0.34, share)
    locks = style.rough * Folds.of(len(style.edge), slant=0.8)(points * 1.6)
    points = points + away * (thick + locks)[..., None]
    inner = _base(skull, levels[:1], turn[:1], heights[:1]) - 0.006 * away[:1]
    rings = np.concatenate([inner, points]) if fine else swollen(points)
    shape = closed(skull.world(rings), bottom=False, top=True)
    piece = carried(shape, "head", cloth)
    return _streaked(piece, len(angles)) if cloth.material == "hair" and fine else piece


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
    lock = np.random.default_rng(7).uniform(0.78, 1.28, columns)[quad % columns]
    return replace(piece, tint=piece.tint * lock[:, None])


def _tail(skull: Skull, cloth: Cloth) -> Iterator[SkinPart]:
    """Make a pony tail."""
    rows = (
        (-0.150, 0.004, 0.010, 0.010, 0.012, -0.060, -0.060, 2.0),
        (-0.150, 0.003, 0.022, 0.020, 0.026, 0.010, 0.010, 2.0),
        (-0.146, 0.0, 0.026, 0.022, 0.030, 0.080, 0.080, 2.0),
        (-0.130, 0.0, 0.022, 0.020, 0.022, 0.140, 0.140, 2.0),
        (-0.108, 0.0, 0.010, 0.010, 0.012, 0.168, 0.168, 2.0),
    )
    yield on_head(skull, Stack(np.array(rows)).grid(6, 7), cloth)


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


def _vents(skull: Skull, cloth: Cloth) -> Iterator[SkinPart]:
    """Make the dark slots along a bicycle helmet."""
    for y in (-0.045, -0.015, 0.015, 0.045):
        x = np.linspace(0.10, -0.09, 6)
        z = 0.2655 - 5.2 * x**2 - 6.5 * y**2 + 0.002
        rows = np.stack([x, np.full(6, y), z], axis=1)
        wide = 0.008 * np.array([0.2, 1.0, 1.0, 1.0, 1.0, 0.2])[:, None] * [0.0, 1.0, 0.0]
        deep = np.array([0.0, 0.0, -0.02])
        rings = np.stack([rows + wide + deep, rows + wide, rows - wide, rows - wide + deep], axis=1)
        yield on_head(skull, rings[::-1], Cloth("trim"))


_EXTRAS: Mapping[str, Callable[[Skull, Cloth], Iterator[SkinPart]]] = {
    "tied": _tail,
    "bun": _bun,
    "cap": _brim,
    "jet_helmet": _visor,
    "full_helmet": _full_face,
    "bicycle_helmet": _vents,
}
