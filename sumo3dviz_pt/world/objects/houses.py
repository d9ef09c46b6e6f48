"""Buildings at points and over polygons, and what of them shines at night.

Houses are made small enough to stand beside roads and each other, not in them.
"""

from __future__ import annotations

import logging
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import shapely

from sumo3dviz_pt import catalog
from sumo3dviz_pt.job.settings import ObjectSettings
from sumo3dviz_pt.library.buildings.building import RoofKind, Walls
from sumo3dviz_pt.library.buildings.facade import FAR, NEAR
from sumo3dviz_pt.library.buildings.palettes import CLADDINGS, WINDOWS, cladding, palette
from sumo3dviz_pt.library.buildings.palettes import SHOPS as SHOP_LIGHTS
from sumo3dviz_pt.library.buildings.panes import room_walls
from sumo3dviz_pt.library.buildings.shell import Palette, Shell, paint
from sumo3dviz_pt.library.buildings.shop_words import ENGLISH, Writing
from sumo3dviz_pt.library.buildings.styles import (
    BLOCKS,
    HOMES,
    SHOPS,
    BuildingStyle,
    cleaned,
    ended_at,
    extruded,
    style_for,
)
from sumo3dviz_pt.library.materials import MATERIALS, TINT, surface_bsdf, surface_scale
from sumo3dviz_pt.model.geometry import Bools, Floats, belonging, merge_meshes, settled
from sumo3dviz_pt.model.random import dice_of, seed_of, share_of
from sumo3dviz_pt.model.scene import CANDELAS_PER_UNIT, Bsdf, LampSet, Part
from sumo3dviz_pt.model.traffic import Polygon
from sumo3dviz_pt.world.objects.kinds import Kind, Staging, colour_in, drawn_model
from sumo3dviz_pt.world.placement.clearance import KEEP_CLEAR
from sumo3dviz_pt.world.placement.lanes import LaneIndex
from sumo3dviz_pt.world.placement.surroundings import Surroundings, thing_of

_LOG = logging.getLogger(__name__)

_STEP, _SMALLEST, _ROUNDS = 0.93, 0.5, 10
_APART = 0.3  # gap that is kept to roads and other houses [m]


def fitted(
    places: Floats, yaws: Floats, plans: Floats, sizes: Floats, *, index: LaneIndex
) -> Floats:
    """Shrink houses that reach over a carriageway or into another house.

    Args:
        places: Middle of each plan, (n, 2) [m].
        yaws: Where fronts look, (n,) [rad].
        plans: Lowest and highest corner of each plan, (n, 2, 2) [m], in its own frame.
        sizes: Wanted scale factors, (n,).
        index: The network's lanes.

    Returns:
        Scale factors, (n,), at least half of the wanted ones.
    """
    scales = np.array(sizes, dtype=np.float64)
    for _ in range(_ROUNDS):
        tight = _in_the_way(rectangles(places, yaws, plans * scales[:, None, None]), index)
        tight &= scales > _SMALLEST * sizes
        if not tight.any():
            break
        scales[tight] = np.maximum(scales[tight] * _STEP, _SMALLEST * sizes[tight])
    shrunk = int((scales < sizes).sum())
    if shrunk:
        _LOG.info("%d buildings are drawn smaller, so that they do not overlap", shrunk)
    return scales


def rectangles(places: Floats, yaws: Floats, plans: Floats) -> Sequence[shapely.Polygon]:
    """Return plans in the world, (n,) polygons.

    Args:
        places: Middle of each, (n, 2) [m].
        yaws: Where fronts look, (n,) [rad].
        plans: Lowest and highest corner of each in its own frame, (n, 2, 2) [m].
    """
    (x0, y0), (x1, y1) = plans[:, 0].T, plans[:, 1].T
    corners = np.stack([np.stack([x, y], -1) for x, y in ((x0, y0), (x1, y0), (x1, y1), (x0, y1))])
    cos, sin = np.cos(yaws), np.sin(yaws)
    x = places[:, 0] + corners[..., 0] * cos - corners[..., 1] * sin
    y = places[:, 1] + corners[..., 0] * sin + corners[..., 1] * cos
    polygons: Sequence[shapely.Polygon] = shapely.polygons(
        np.stack([x, y], axis=-1).transpose(1, 0, 2)
    )
    return polygons


def _in_the_way(plans: Sequence[shapely.Polygon], index: LaneIndex) -> Bools:
    """Which plans come too near to a carriageway or another plan, (n,)."""
    tight = np.zeros(len(plans), dtype=np.bool_)
    if len(index.areas.geometries):
        tight[index.areas.query(plans, predicate="dwithin", distance=_APART)[0]] = True
    one, other = shapely.STRtree(plans).query(plans, predicate="dwithin", distance=_APART)
    tight[one[one != other]] = True
    return tight


STYLES: Mapping[str, Mapping[str, BuildingStyle]] = {
    "homes": HOMES,
    "shops": SHOPS,
    "blocks": BLOCKS,
}
"""Models of the kinds that are buildings at points."""

_STREET = 40.0  # how far from a lane a wall still looks at the street [m]
_TOPS = (("height", 1.0), ("building:height", 1.0))
_WALLS = (("levels", 3.0), ("building:levels", 3.0))
_RISES = (("roof:height", 1.0), ("roof:levels", 2.7))
_ROOFS: Mapping[str, RoofKind] = {
    **dict.fromkeys(("gabled", "gable", "saltbox", "round"), "gable"),
    **dict.fromkeys(("hipped", "hip", "half-hipped", "pyramidal"), "hip"),
    **dict.fromkeys(("mansard", "gambrel"), "mansard"),
    **dict.fromkeys(("skillion", "lean_to"), "skillion"),
    "flat": "flat",
}
"""Roofs by `roof:shape`, as OpenStreetMap has it; the nearest that we build."""
_WEIGHTS = {WINDOWS: 0.0, SHOP_LIGHTS: 1.2}  # windows light nothing that lamps do not


@dataclass(frozen=True, slots=True)
class Chance:
    """What decides how a building looks.

    Attributes:
        seed: Of all chance.
        name: Unique among all objects.
        dark: Whether its windows are lit.
        language: Of what is written on its shops.
    """

    seed: int
    name: str
    dark: bool = False
    language: str = ENGLISH

    @property
    def writing(self) -> Writing:
        """What is written on its shops."""
        return Writing(self.language, seed_of(self.seed, self.name, "words"))

    @property
    def shell(self) -> int:
        """Seed of what its walls and roof have."""
        return int(self.share("shell") * 2**32)

    def share(self, word: str) -> float:
        """Return a number in [0, 1) for a use."""
        return share_of(self.seed, self.name, word)

    def dice(self, word: str) -> np.random.Generator:
        """Return random numbers for a use."""
        return dice_of(self.seed, self.name, word)


def house_parts(
    kind: Kind, settings: ObjectSettings, chance: Chance, *, level: int
) -> tuple[Part, ...]:
    """Build the parts of a building at a point in its own frame, front at +x.

    Args:
        kind: One of `STYLES`.
        settings: Checked ones.
        chance: Chooses model, variant and colours.
        level: Of detail.
    """
    style = STYLES[kind.name][drawn_model(kind, settings, chance.seed, chance.name)]
    variant = int(chance.share("variant") * style.variants)
    written = style.has_shops
    shell = (
        style.build(variant, level, chance.writing) if written else _shell(style, variant, level)
    )
    return painted(shell, style, settings, chance, level=level)


def plan_of(kind: Kind, settings: ObjectSettings, *, seed: int, name: str) -> Floats:
    """Return the lowest and highest corner of a building's walls in its own frame, (2, 2) [m].

    Args:
        kind: One of `STYLES`.
        settings: Say which models there are.
        seed: Of all chance.
        name: Of the building; chooses its model and variant.
    """
    style = STYLES[kind.name][drawn_model(kind, settings, seed, name)]
    variant = int(share_of(seed, name, "variant") * style.variants)
    walls = _shell(style, variant, FAR)["wall"][..., :2].reshape(-1, 2)
    return np.stack([walls.min(axis=0), walls.max(axis=0)])


def area_parts(
    kind: Kind, settings: ObjectSettings, items: Sequence[Polygon], staging: Staging
) -> list[Part]:
    """Build buildings over polygons, with their own or plausible heights.

    Args:
        kind: Gives the distances of the levels of detail.
        settings: Colour, and a factor of the heights.
        items: Their outlines.
        staging: Roads, ground, cameras and seed, and the factor of those distances.
    """
    around = staging.around
    _note_roofs(items)
    parts: list[Part] = []
    for item in items:
        chance = Chance(around.seed, f"{kind.name}:{item.id}", around.dark, around.language)
        centre = item.shape[:, :2].mean(axis=0)
        plan = cleaned(item.shape[:, :2] - centre)
        if plan is None or _holds_camera(plan + centre, around):
            continue
        level = staging.level(kind, float(around.distances(plan + centre).min()))
        height = settings.scale * height_of(item, float(shapely.Polygon(plan).area), around.seed)
        style, height = _styled(item, plan, height, chance)
        shell = extruded(
            plan,
            height,
            level=level,
            seed=chance.shell,
            style=style,
            walls=Walls(street_walls(plan + centre, around), writing=chance.writing),
        )
        # Slopes: stand on the lowest corner of the ground.
        z = float(np.min(around.height_at(plan + centre)))
        shift = np.array([*centre, z])
        placed = {role: quads + shift for role, quads in shell.items()}
        thing = thing_of(chance.name)
        for part in painted(placed, style, settings, chance, level=level):
            parts.append(replace(part, mesh=belonging(part.mesh, thing)))
    return parts


def _note_roofs(items: Sequence[Polygon]) -> None:
    """Say which shapes of roofs are not built as they are told."""
    others = Counter(shape for item in items if (shape := _shape_of(item)) not in ("", *_ROOFS))
    if others:
        some = ", ".join(f"{shape} ({count})" for shape, count in others.most_common(3))
        message = "roofs of these shapes are built as suits the plan: %s"
        _LOG.warning(message, some, extra={"once": f"roofs {some}"})


def _shape_of(item: Polygon) -> str:
    """Return what a building's params say of its roof; empty where they say nothing."""
    return item.params.get("roof:shape", "").strip().lower()


def street_walls(plan: Floats, around: Surroundings) -> tuple[int, ...]:
    """Return numbers of the walls of a plan, (n, 2) [m], that look at a street; maybe none."""
    if around.index.tree is None:
        return ()
    after = np.roll(plan, -1, axis=0)
    middles, along = (plan + after) / 2, after - plan
    nearest, distance = around.index.nearest(middles)
    towards = around.index.points[nearest, :2] - middles
    outward = np.column_stack([along[:, 1], -along[:, 0]])
    outward /= np.maximum(np.linalg.norm(outward, axis=1, keepdims=True), 1e-9)
    facing = (outward * towards).sum(axis=1) > 0.7 * np.linalg.norm(towards, axis=1)
    fit = facing & (distance < _STREET) & (np.linalg.norm(along, axis=1) > 4.0)
    return tuple(int(i) for i in np.flatnonzero(fit))


def height_of(item: Polygon, area: float, seed: int) -> float:
    """Return the height of a building [m]: as its params say, else one that is usual.

    Args:
        item: The building.
        area: Of its plan [m2].
        seed: Of heights that no param says.
    """
    told = _told(item, (*_TOPS, *_WALLS), 2.0)
    if told is not None:
        return told
    low, high = (2.5, 3.2) if area < 40 else (4.5, 7.0) if area < 300 else (6.0, 13.0)
    if area > 700:
        low, high = 7.0, 18.0
    return low + (high - low) * share_of(seed, item.id, "height")


def _told(item: Polygon, keys: Sequence[tuple[str, float]], least: float) -> float | None:
    """Return the first length that a building's params say [m], of at least some; else None."""
    for key, unit in keys:
        try:
            length = float(item.params.get(key, "").strip().removesuffix("m")) * unit
        except ValueError:
            continue
        if least <= length <= 400.0:
            return length
    return None


def _styled(
    item: Polygon, plan: Floats, height: float, chance: Chance
) -> tuple[BuildingStyle, float]:
    """Choose the style of a building over a plan; and the height of its walls [m].

    A height counts to the top of the roof, levels to its eaves, as in OpenStreetMap
    (https://wiki.openstreetmap.org/wiki/Simple_3D_Buildings).
    """
    top, walls = _told(item, _TOPS, 2.0), _told(item, _WALLS, 2.0)
    roof, rise = _ROOFS.get(_shape_of(item)), _told(item, _RISES, 0.3)
    # Which style suits is told by walls.
    eaves = height if top is None or walls is None else min(height, height * walls / top)
    style = style_for(plan, eaves, share=chance.share("style"), roof=roof)
    if rise is None and top is not None and walls is not None and top > walls:
        rise = height * (1.0 - walls / top)
    if top is not None:
        return ended_at(style, plan, height, seed=chance.shell, rise=rise)
    # The walls are as high as told, or as is usual, and the roof stands on them.
    if rise is not None:
        style, _ = ended_at(style, plan, height + rise, seed=chance.shell, rise=rise)
    return style, height


def cladding_material(name: str, *, textured: bool) -> Bsdf:
    """Return the material that shows a surface in the colour of each face.

    Args:
        name: As `cladding` gives it.
        textured: False shows the colours alone.
    """
    surface = name.removeprefix("cladding:")
    if not textured:
        return MATERIALS[CLADDINGS[surface]]
    entry = catalog.find("surfaces", surface)
    bsdf = surface_bsdf(entry)
    stained = {
        "type": "stained",
        # Walls wear as one, not by vertices as roads do.
        "texture": {key: item for key, item in bsdf["base_color"].items() if key != "wear"},
        "tint": TINT,
        "weathered": True,
        "mean": [float(value) for value in entry.meta["albedo"]],
    }
    return {**bsdf, "base_color": stained}


def lamp_sets(parts: Sequence[Part]) -> tuple[LampSet, ...]:
    """Build lit windows and signs as lamps, from parts whose tints are luminances [cd/m2]."""
    sets = []
    for material, weight in _WEIGHTS.items():
        some = [part for part in parts if part.material == material]
        if not some:
            continue
        # Faces of one luminance are one lamp.
        luminance = np.concatenate([part.tint for part in some if part.tint is not None])
        each, lamp_of_face = np.unique(settled(luminance).round(3), axis=0, return_inverse=True)
        family = material.removeprefix("lamp:")
        mesh = merge_meshes([part.mesh for part in some])
        sets.append(
            LampSet(
                f"buildings_{family}",
                "buildings",
                mesh,
                lamp_of_face.ravel(),
                tuple(f"{family}/{k}" for k in range(len(each))),
                sampled=weight > 0.0,
                radiance=each / CANDELAS_PER_UNIT,
                weight=weight,
                tint=None if mesh.wear is None else room_walls(mesh.wear[mesh.faces[:, 0]]),
            )
        )
    return tuple(sets)


def painted(
    shell: Shell, style: BuildingStyle, settings: ObjectSettings, chance: Chance, *, level: int
) -> tuple[Part, ...]:
    """Build a shell in the colours of one building; textures and lights to aim at only nearby.

    Args:
        shell: Quads by role.
        style: Says which colours it may have.
        settings: May have a colour for it.
        chance: Chooses.
        level: Of detail.
    """
    colours = _colours(style, settings, chance, textured=level != FAR)
    shift = 5.0 * chance.share("shift")
    office = style.colours.use == "office"
    parts = paint(shell, colours, tiles=_tiles(), shift=shift, office=office)
    if level == NEAR:
        return parts
    return tuple(
        Part(part.mesh, WINDOWS, part.tint) if part.material == SHOP_LIGHTS else part
        for part in parts
    )


def _colours(
    style: BuildingStyle, settings: ObjectSettings, chance: Chance, *, textured: bool
) -> Palette:
    """Colours of one building, chosen by its name."""
    rng = chance.dice("colour")
    return palette(style.colours, rng, colour_in(settings), textured=textured, dark=chance.dark)


@cache
def _tiles() -> Mapping[str, float]:
    """Metres per tile of every cladding."""
    return {cladding(surface): surface_scale(surface) for surface in CLADDINGS}


@cache
def _shell(style: BuildingStyle, variant: int, level: int) -> Shell:
    return style.build(variant, level)


def _holds_camera(plan: Floats, around: Surroundings) -> bool:
    """Whether a camera stands in a footprint."""
    wide = shapely.Polygon(plan).buffer(KEEP_CLEAR)
    return bool(shapely.contains_xy(wide, around.clearance.places[:, :2]).any())
