"""Street lamps along urban roads and at POIs; by night they shine.

Heads have `FLUX` lumens and throw them to the sides as `LOBE` says, more than Lambert's law
would, so that roads are lit evenly: 17 to 20 lx below a lamp, and 10 to 17 lx on average.

References:
    EN 13201-2:2015, Road lighting, table 1 (M3: 1.0 cd/m^2, M4: 0.75 cd/m^2 on average,
    about 15 and 11 lx on asphalt of 0.07 cd/(m^2 lx)).
    Colour: Planck's law at 4000 K, the usual colour of such lamps, as a camera set to 5000 K
    sees it, in linear sRGB.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np

from sumo3dviz_pt.library.street.furniture import LENS, head, lens, pole
from sumo3dviz_pt.model.geometry import (
    Bools,
    Colour,
    Floats,
    Mesh,
    Transform,
    belonging,
    merge_meshes,
)
from sumo3dviz_pt.model.layers import LUMINANCE
from sumo3dviz_pt.model.scene import CANDELAS_PER_UNIT, LampSet, Lobe, Part
from sumo3dviz_pt.model.traffic import Poi
from sumo3dviz_pt.world.placement.lanes import facing_roads
from sumo3dviz_pt.world.placement.surroundings import Surroundings, thing_at
from sumo3dviz_pt.world.street.places import Border, Site, is_urban, spread

LAMP_SET = "street_lamps"
"""Beginning of the ids of lamp sets."""

WORDS = frozenset({"street_lamp", "lamp", "street_light"})
"""Types of POIs that are lamps, in lower case."""

LIT = 350.0
"""Lamps farther than this from the camera's path shine no more [m]."""

REACH = 600.0
"""Lamps farther than this are not built [m]."""

LOW, HIGH = 8.0, 10.0
"""Height of the lens along ordinary and along wide roads [m]."""

FLUX = {LOW: 7600.0, HIGH: 13500.0}
"""Luminous flux of a head by its height [lm]."""

LOBE = Lobe(3.0, 4.0)
"""Of a head: most candelas 50 degrees from straight down."""

_COLOUR = (1.0, 0.78, 0.56)
_SPACING = 30.0
_SHIFTS = np.array([0.0, 2.5, -2.5, 5.0, -5.0, 7.5, -7.5])  # other places of a lamp [m]
_ARM = 2.0  # how far heads stand out [m]
_BACK = 0.55  # from the kerb to the pole [m]
_VERGE = 1.1  # the same where there is no sidewalk [m]
_CORNER = 18.0  # between lamps of different roads, at least [m]
_ENDS = (4.0, 14.0)  # kept clear after junctions and before them, where signals stand [m]
_WIDE = 9.5  # carriageways from which lamps are high [m]
_NARROW = 10.0  # both directions together; below, the two sides take turns [m]
_LEVELS = (60.0, 150.0)
# fmt: off
_RINGS = (
    # from and up to which distance [m], weight (measured, as those in render/lights/running.py)
    (0.0,   70.0,  1.6),
    (70.0,  160.0, 1.2),
    (160.0, LIT,   0.5),
)
# fmt: on
_SHOWN = 14.0


@dataclass(frozen=True, slots=True)
class Lamp:
    """A lamp.

    Attributes:
        place: Of its foot, x, y, z [m].
        yaw: Towards the road [rad].
        height: Of its lens above the foot [m].
    """

    place: tuple[float, float, float]
    yaw: float
    height: float


def radiance(height: float) -> Colour:
    """Return the radiance of a lens that hangs at a height [m] straight down, in scene units."""
    area = LENS[0] * LENS[1]
    luminance = FLUX[height] / (LOBE.flux * area) / CANDELAS_PER_UNIT
    scale = luminance / float(np.dot(_COLOUR, LUMINANCE))
    red, green, blue = (scale * channel for channel in _COLOUR)
    return red, green, blue


def place_lamps(borders: Sequence[Border], pois: Sequence[Poi], site: Site) -> list[Lamp]:
    """Place lamps at POIs and along urban edges.

    Args:
        borders: Of edges.
        pois: All of the scenario.
        site: What is free; lamps are added to it.
    """
    lamps = _at_pois(pois, site)
    mapped = np.array([lamp.place[:2] for lamp in lamps]).reshape(-1, 2)
    widths = {(b.edge.from_junction, b.edge.to_junction): b.road for b in borders}
    stand: dict[tuple[str, str], Floats] = {}
    for border in borders:
        if not is_urban(border):
            continue
        ends = (border.edge.from_junction, border.edge.to_junction)
        # Pairs of lamps stand on both sides of wide roads; others light a corner together.
        pairs = ends if _takes_turns(border, widths) else ends[::-1]
        others = [places for key, places in stand.items() if key not in (ends, pairs)]
        own = _along(border, widths, site, mapped, np.concatenate([np.zeros((0, 2)), *others]))
        places = np.array([lamp.place[:2] for lamp in own]).reshape(-1, 2)
        stand[ends] = np.concatenate([stand.get(ends, np.zeros((0, 2))), places])
        lamps += own
    return lamps


def lamp_parts(lamps: Sequence[Lamp], around: Surroundings, *, dark: bool) -> list[Part]:
    """Build poles, heads and lenses of the lamps that a camera sees.

    Args:
        lamps: Those that stand somewhere.
        around: The cameras.
        dark: Whether it is night; lenses that shine then belong to `lamp_sets`.
    """
    places = np.array([lamp.place[:2] for lamp in lamps]).reshape(-1, 2)
    away = around.distances(places)
    seen = around.seen(places, radius=_SHOWN) & (away < REACH)
    shining = away < LIT
    parts: list[Part] = []
    for lamp, far, shown, lit in zip(lamps, away, seen, shining, strict=True):
        if not shown:
            continue
        level = int(np.searchsorted(_LEVELS, far))
        stand = Transform.from_pose(lamp.place, yaw=lamp.yaw)
        thing = thing_at("lamp", lamp.place)
        parts.append(Part(belonging(stand.mesh(_body(lamp.height, level)), thing), "galvanised"))
        if not (dark and lit):
            parts.append(Part(belonging(stand.mesh(lens(lamp.height)), thing), "lamp_lens"))
    return parts


@cache
def _body(height: float, level: int) -> Mesh:
    """Pole and head of a lamp."""
    return merge_meshes([pole(height, level=level), head(height, level=level)])


def lamp_sets(lamps: Sequence[Lamp], around: Surroundings) -> tuple[LampSet, ...]:
    """Build what shines by night, near the camera's path, in rings of distance.

    A path picks a set by its weight and then a lamp by its area. In one set of all, a near
    lamp would rarely be picked and then count so much that the firefly cap cut it off.
    """
    places = np.array([lamp.place[:2] for lamp in lamps]).reshape(-1, 2)
    away = around.distances(places)
    sets = []
    for number, (low, high, weight) in enumerate(_RINGS):
        ring = [lamp for lamp, d in zip(lamps, away.tolist(), strict=True) if low <= d < high]
        if ring:
            sets.append(_ring(f"{LAMP_SET}_{number}", ring, weight))
    return tuple(sets)


def _ring(name: str, lamps: Sequence[Lamp], weight: float) -> LampSet:
    """One lamp set."""
    stands = [Transform.from_pose(lamp.place, yaw=lamp.yaw) for lamp in lamps]
    meshes = [
        belonging(stand.mesh(lens(lamp.height)), thing_at("lamp", lamp.place))
        for stand, lamp in zip(stands, lamps, strict=True)
    ]
    mesh = merge_meshes(meshes)
    return LampSet(
        name,
        "street lamps",
        mesh,
        np.repeat(np.arange(len(lamps)), [len(lens.faces) for lens in meshes]),
        tuple(f"{name}/{i}" for i in range(len(lamps))),
        sampled=True,
        radiance=np.array([radiance(lamp.height) for lamp in lamps]),
        weight=weight,
        tint=np.full((len(mesh.faces), 3), 0.5),
        lobe=LOBE,
    )


def hidden_lamps(pois: Sequence[Poi], around: Surroundings) -> int:
    """Return how many lamps of a scenario would stand right before a camera, and so stand not."""
    return int(_before_cameras(_places_of(pois), around).sum())


def _before_cameras(places: Floats, around: Surroundings) -> Bools:
    """Which lamps, (n, 2) [m], would stand right before a camera."""
    if not len(places):
        return np.zeros(0, dtype=np.bool_)
    ground = around.index.heights(places)
    return around.clearance.before_lens(places, ground, height=LOW, reach=_ARM)


def _places_of(pois: Sequence[Poi]) -> Floats:
    """Where the scenario's lamps are, (n, 2) [m]."""
    return np.array([poi.position for poi in pois if _is_lamp(poi)]).reshape(-1, 2)


def _is_lamp(poi: Poi) -> bool:
    """Whether a point of interest is a lamp."""
    return poi.type.lower().split(".")[0] in WORDS


def _at_pois(pois: Sequence[Poi], site: Site) -> list[Lamp]:
    """Lamps at the scenario's points of interest; none on a road or right before a camera."""
    wanted = [poi for poi in pois if _is_lamp(poi)]
    places = _places_of(pois)
    free = site.holds(places) & ~site.around.index.covers(places, margin=0.1)
    free &= ~_before_cameras(places, site.around)
    yaws = facing_roads(places, site.around.index)
    heights = site.standing(places[free]) if free.any() else np.zeros(0)
    site.use(places[free])
    lamps = []
    for i, z in zip(np.flatnonzero(free), heights, strict=True):
        angle = wanted[i].yaw
        yaw = float(yaws[i]) if angle is None else angle
        x, y = map(float, places[i])
        lamps.append(Lamp((x, y, float(z)), yaw, LOW))
    return lamps


def _takes_turns(border: Border, widths: Mapping[tuple[str, str], float]) -> bool:
    """Whether lamps stand on the two sides of a narrow road in turn."""
    edge = border.edge
    twin = widths.get((edge.to_junction, edge.from_junction), 0.0)
    return bool(twin) and border.road + twin < _NARROW


def _along(
    border: Border,
    widths: Mapping[tuple[str, str], float],
    site: Site,
    mapped: Floats,
    others: Floats,
) -> list[Lamp]:
    """Lamps along one edge, away from given ones, (n, 2), and those of other roads, (m, 2)."""
    # Decide on the spacing.
    edge = border.edge
    twin = widths.get((edge.to_junction, edge.from_junction), 0.0)
    wide = border.road > _WIDE or border.road + twin > 2 * _WIDE
    # Narrow roads have lamps on their two sides in turn.
    turns = _takes_turns(border, widths)
    spacing, shift = _SPACING, 0.5
    if turns:
        # Each side measures along its own direction, so a quarter makes them take turns.
        spacing, shift = 2 * _SPACING, 0.25
        if border.length - sum(_ENDS) < _SPACING:
            # On short roads a single lamp stands, in the middle of one side.
            if edge.from_junction > edge.to_junction:
                return []
            shift = 0.5
    at = spread(border.length, spacing, ends=_ENDS, shift=shift)
    back = _BACK if border.walk > 0.0 else _VERGE
    if not len(at):
        return []
    # Where something else stands, the lamp moves along a little.
    tries = np.clip(at[:, None] + _SHIFTS, 1.0, max(border.length - 1.0, 1.0))
    places, road, yaw = border.at(tries.reshape(-1), back)
    # Take the first free place of each.
    good = (
        site.free(places, radius=0.2, height=LOW)
        & ~_near_any(places, mapped, _SPACING / 2)
        & ~_near_any(places, others, _CORNER)
    )
    good = site.level_with(places, road, among=good).reshape(tries.shape)
    first = np.flatnonzero(good.any(axis=1)) * len(_SHIFTS) + good.argmax(axis=1)[good.any(axis=1)]
    places, yaws = places[first], border.inward(yaw[first])
    heights = site.standing(places) if len(places) else np.zeros(0)
    site.use(places)
    return [
        Lamp((float(x), float(y), float(z)), float(turn), HIGH if wide else LOW)
        for (x, y), z, turn in zip(places, heights, yaws, strict=True)
    ]


def _near_any(places: Floats, others: Floats, distance: float) -> Bools:
    """Which places, (n, 2), lie closer to others, (m, 2), than a distance [m]."""
    if not len(places) or not len(others):
        return np.zeros(len(places), dtype=np.bool_)
    away = np.linalg.norm(places[:, None] - others[None], axis=2)
    return np.asarray(away.min(axis=1) < distance)
