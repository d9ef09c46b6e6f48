"""What lies and grows along fast roads by itself: gravel, mown grass, then tall weeds.

Colours are tints of faces, so that no material is added.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sumo3dviz_pt.library.plants.grass import Blades, blades_mesh
from sumo3dviz_pt.model.geometry import Floats, Ints, Mesh, merge_meshes
from sumo3dviz_pt.model.network import Network
from sumo3dviz_pt.model.random import share_of
from sumo3dviz_pt.model.scene import Part, StaticPart
from sumo3dviz_pt.world.placement.surroundings import Surroundings
from sumo3dviz_pt.world.plants.build import Plot, is_fast
from sumo3dviz_pt.world.street.places import Border, borders_near

REACH = 170.0
"""Weeds and gravel lie at most this far from a camera [m]."""

MOST_WEEDS = 90_000
"""Triangles of weeds, at most."""

STRIP = 0.55
"""Width of the strip of gravel beside the asphalt, about [m]."""

_MOWN = 2.4  # width of the strip that is mown [m]
_DEEP = 12.5  # where weeds end [m]
_DENSE = 7.0  # clumps on a square metre where they are densest
_WHOLE = 9.0  # up to this distance clumps are whole [m]
_BLADES = 22  # of a whole clump
_CLEAR = 0.9  # distance from everything paved [m]
_PIECE = 8.0  # length of gravel with one width of grains [m]
_STEP_OFF = 0.5  # where the ground lies farther from the road's height, no stones lie [m]
_STALKS = np.array(
    [
        [0.235, 0.195, 0.092],  # dead grass
        [0.165, 0.165, 0.062],  # ripe
        [0.085, 0.128, 0.034],  # green
        [0.058, 0.105, 0.030],  # nettles
        [0.120, 0.150, 0.040],
        [0.150, 0.090, 0.058],  # dock
    ]
)
_SHARES = np.array([0.26, 0.24, 0.22, 0.10, 0.13, 0.05])
_STONES = np.array(
    [[0.150, 0.140, 0.122], [0.185, 0.170, 0.148], [0.125, 0.112, 0.092], [0.130, 0.115, 0.080]]
)


def verges(network: Network, plot: Plot, *, around: Surroundings) -> tuple[StaticPart, ...]:
    """Build gravel and weeds beside the fast roads near a shot's cameras.

    Args:
        network: Its fast edges have verges.
        plot: What is paved.
        around: Cameras, ground and the seed.
    """
    borders = [b for b in borders_near(network, around, reach=REACH) if is_fast(b)]
    if not borders:
        return ()
    found = [_gravel(borders, around), _weeds(borders, plot, around)]
    return tuple(part for part in found if len(part.part.mesh.faces))


def _weeds(borders: Sequence[Border], plot: Plot, around: Surroundings) -> StaticPart:
    """Clumps of tall grass and weeds where no mower comes."""
    places = np.concatenate([_clumps(border, around.seed) for border in borders])
    away = around.distances(places)
    keep = (away < REACH) & around.pictured(places, radius=1.5)
    places = places[keep]
    places = places[plot.free(places, margin=_CLEAR)]
    away = around.distances(places)
    rng = np.random.default_rng(around.seed + 71)
    # Towards the end they thin out, so that no edge shows.
    fade = np.clip((REACH - away) / (0.5 * REACH), 0.0, 1.0)
    counts = np.clip(_BLADES * (_WHOLE / np.maximum(away, _WHOLE)) ** 1.15, 3.0, _BLADES)
    share = min(1.0, MOST_WEEDS / max(float((counts * fade).sum()), 1.0))
    keep = rng.random(len(places)) < fade * share
    blades = _blades(places[keep], counts[keep].astype(np.int64), around, rng)
    mesh, tint = blades_mesh(blades, fine=False)
    return StaticPart("ground/weeds", "ground", Part(mesh, "leaf", tint))


def _clumps(border: Border, seed: int) -> Floats:
    """Places of clumps beside a border, (n, 2) [m]: in drifts, denser away from the road."""
    rng = np.random.default_rng(int(share_of(seed, "weeds", border.edge.id) * 2**48))
    count = int(_DENSE * border.length * (_DEEP - _MOWN))
    along = rng.uniform(0.0, border.length, count)
    # The mower's edge is no straight line.
    edge = _MOWN + 0.35 * np.sin(along / 3.1) + 0.3 * np.sin(along / 7.7 + 1.0)
    out = edge + (_DEEP - edge) * rng.random(count) ** 1.4
    places = border.at(along, border.walk + out).places
    x, y = places.T
    drift = np.sin(x / 5.3 + y / 9.1) + np.sin(y / 4.1 - x / 11.0) + 0.8 * np.sin((x + y) / 2.3)
    chance = np.clip(0.42 + 0.3 * drift, 0.05, 1.0)
    return np.asarray(places[rng.random(count) < chance])


def _blades(places: Floats, counts: Ints, around: Surroundings, rng: np.random.Generator) -> Blades:
    """Blades of clumps: those of one share colour and height."""
    clump = np.repeat(np.arange(len(places)), counts)
    total = len(clump)
    x, y = places.T if len(places) else (np.zeros(0), np.zeros(0))
    # Neighbouring clumps are often of one kind.
    stand = 0.5 + 0.5 * np.sin(x / 3.7 + 2.0 * np.sin(y / 4.9)) * np.sin(y / 3.1 + x / 13.0)
    pick = np.clip(0.6 * stand + 0.4 * rng.random(len(places)), 0.0, 0.999)
    kind = np.searchsorted(np.cumsum(_SHARES), pick)
    coarse = np.sqrt(_BLADES / np.maximum(counts, 1))[clump]
    tall = rng.uniform(0.28, 0.8, len(places))[clump] * rng.uniform(0.45, 1.1, total)
    feet = places[clump] + rng.normal(0, 0.09, (total, 2)) * (1.0 + 0.35 * coarse[:, None])
    value = rng.uniform(0.75, 1.25, (total, 1)) * rng.uniform(0.85, 1.15, len(places))[clump, None]
    return Blades(
        np.column_stack([feet, around.height_at(feet) if total else np.zeros(0)]),
        rng.uniform(0.0, 2.0 * np.pi, total),
        tall,
        rng.uniform(0.011, 0.024, total) * coarse**2,
        rng.uniform(0.08, 0.6, total),
        np.clip(1.25 * _STALKS[np.minimum(kind, 5)][clump] * value, 0.004, 0.6),
    )


def _gravel(borders: Sequence[Border], around: Surroundings) -> StaticPart:
    """A ragged strip of stones along the asphalt's edge."""
    meshes: list[Mesh] = [merge_meshes([])]
    tints = [np.zeros((0, 3))]
    for border in borders:
        for k in range(max(int(border.length / _PIECE), 1)):
            ends = np.minimum(np.array([k, k + 1]) * _PIECE, border.length)
            middle = border.at(np.array([ends.mean()]), 0.3).places
            away = float(around.distances(middle)[0])
            if away > REACH or not around.pictured(middle, radius=_PIECE).all():
                continue
            rng = np.random.default_rng(
                int(share_of(around.seed, "gravel", border.edge.id, str(k)) * 2**48)
            )
            mesh, tint = _strip(border, ends, away, around, rng)
            meshes.append(mesh)
            tints.append(tint)
    part = Part(merge_meshes(meshes), "bark", np.concatenate(tints))
    return StaticPart("ground/gravel", "ground", part)


def _strip(
    border: Border, ends: Floats, away: float, around: Surroundings, rng: np.random.Generator
) -> tuple[Mesh, Floats]:
    """One piece of gravel: a grid whose outer edge is ragged, finer near a camera."""
    grain = float(np.clip(0.005 * away, 0.08, 0.6))
    along = np.linspace(ends[0], ends[1], max(int(np.ptp(ends) / grain), 1) + 1)
    across = np.linspace(0.0, 1.0, max(int(STRIP / grain), 1) + 1)
    wide = STRIP * (0.8 + 0.3 * np.sin(along / 1.7) * np.sin(along / 4.3 + 1.0))
    rows, steps = [], []
    for share in across:
        jitter = rng.normal(0, 0.22 * grain, len(along)) if share > 0.0 else 0.0
        places, level, _ = border.at(along, border.walk + share * wide + jitter)
        ground = around.height_at(places) + 0.012
        steps.append(np.abs(level - ground))
        rows.append(np.column_stack([places, ground + (1.0 - share) * (level - 0.015 - ground)]))
    n, m = len(along), len(across)
    i = np.arange(n - 1)[:, None] + n * np.arange(m - 1)
    quads = np.stack([i, i + 1, i + n + 1, i + n], axis=-1).reshape(-1, 4)
    # Beside bridges, walls and tunnels it would hang as a curtain from road to ground.
    quads = quads[np.concatenate(steps)[quads].max(axis=1, initial=0.0) < _STEP_OFF]
    if border.outward < 0:
        quads = quads[:, ::-1]
    faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    stone = _STONES[rng.integers(0, len(_STONES), len(faces))]
    return Mesh(np.concatenate(rows), faces), stone * rng.uniform(0.85, 1.15, (len(faces), 1))
