"""What is seen through the panes of buildings: rooms with depth, as a function of the ray.

Behind a pane lies a box. Where a ray leaves it is found from the point on the pane and the ray's
direction, so that walls, ceilings and what stands in a room move against the pane's frame as they
would in a real room, without a single triangle. Curtains, blinds and plants stand right behind the
pane. All that differs from pane to pane comes from a hash of the pane's place.

By day rooms take a few per cent of the light that falls on the pane, more near it, and more where
lamps burn at the ceiling; by night the same box says where a lit room is bright and where dark.

A pane's corners tell where a ray met it: see `library/buildings/panes.py`, which writes them.

References:
    van Dongen, "Interior Mapping: A new technique for rendering realistic buildings", CGI 2008.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi

from sumo3dviz_pt.model.geometry import PANE_SIZES, PANE_STEP
from sumo3dviz_pt.render.textures import PIXEL, WEAR_ATTRIBUTE, mixed, unit

_PLUGIN = "sumo3dviz_rooms"

_DARK = (0.03, 0.031, 0.033)  # reflectance of panes where no texture of ours is possible
_STEEPEST = 0.02  # cosine of the flattest ray that is told from flatter ones
_BRIGHTEST = 0.75

_CLOTHS = (
    (0.58, 0.57, 0.54),
    (0.5, 0.45, 0.37),
    (0.34, 0.35, 0.36),
    (0.36, 0.27, 0.18),
    (0.22, 0.09, 0.07),
    (0.13, 0.19, 0.24),
    (0.17, 0.2, 0.12),
    (0.56, 0.55, 0.52),
)
"""Reflectance of curtains and blinds behind glass."""

_WARES = (
    (0.34, 0.12, 0.09),
    (0.4, 0.35, 0.24),
    (0.14, 0.2, 0.3),
    (0.46, 0.45, 0.42),
    (0.2, 0.24, 0.17),
    (0.06, 0.06, 0.065),
    (0.24, 0.17, 0.12),
    (0.33, 0.3, 0.29),
)
"""Reflectance of what stands in shops and on shelves."""


@dataclass(frozen=True, slots=True)
class Pane:
    """A point on a pane, and which pane it is.

    Attributes:
        x: From its left edge [m].
        y: From its lower edge [m].
        width: [m].
        height: [m].
        bits: Random, the same all over the pane.
        kind: Index in `model.geometry.PANE_KINDS`.
        bare: Whether no cloth hangs there.
    """

    x: Any
    y: Any
    width: Any
    height: Any
    bits: Any
    kind: Any
    bare: Any

    def chance(self, salt: int) -> Any:
        """Return a number in [0, 1) of this pane, another one for each salt."""
        return unit(mixed(self.bits + salt))

    def among(self, low: float, high: float, salt: int) -> Any:
        """Return a number between two others."""
        return low + (high - low) * self.chance(salt)


def pane_at(place: Any) -> Pane:
    """Return the pane that three numbers in [0, 1] of a pane's corners tell."""
    across, up = place.x * PANE_SIZES, place.y * PANE_SIZES
    columns, rows = dr.floor(across), dr.floor(up)
    width, height = dr.maximum(columns, 1.0) * PANE_STEP, dr.maximum(rows, 1.0) * PANE_STEP
    number = mi.UInt32(dr.clip(place.z, 0.0, 0.9999) * 1024.0)
    return Pane(
        (across - columns) * width,
        (up - rows) * height,
        width,
        height,
        mixed(number * 0x9E3779B1 + mi.UInt32(columns) * 131 + mi.UInt32(rows)),
        number >> 8,
        (number & 128) != 0,
    )


def inward(view: Any, normal: Any) -> Any:
    """Return how a ray goes on behind a pane: along it, up it, and inwards (at least a little).

    Args:
        view: Unit vector to where the ray came from.
        normal: Of the pane, outwards.
    """
    flat = dr.maximum(dr.sqrt(normal.x * normal.x + normal.y * normal.y), 1e-3)
    along = mi.Vector3f(-normal.y / flat, normal.x / flat, 0.0)
    up = dr.cross(mi.Vector3f(normal), along)
    deep = dr.maximum(dr.dot(view, normal), _STEEPEST)
    return mi.Vector3f(-dr.dot(view, along), -dr.dot(view, up), deep)


@dataclass(frozen=True, slots=True)
class Box:
    """A room: its left and right walls, floor and ceiling from the pane's corner, its depth [m]."""

    left: Any
    right: Any
    floor: Any
    ceiling: Any
    depth: Any


def leaves(box: Box, x: Any, y: Any, ray: Any) -> tuple[Any, Any, Any]:
    """Return where a ray leaves a room: its length to there, and to side walls and to level ones.

    Args:
        box: The room.
        x: Where it enters, from the pane's left edge [m].
        y: From the pane's lower edge [m].
        ray: As `inward` returns it.
    """
    side = _reach(dr.select(ray.x > 0.0, box.right, box.left) - x, ray.x)
    level = _reach(dr.select(ray.y > 0.0, box.ceiling, box.floor) - y, ray.y)
    return dr.minimum(dr.minimum(side, level), box.depth / ray.z), side, level


def _reach(way: Any, slope: Any) -> Any:
    """Return how far a ray goes until it has covered a way; never less than nothing."""
    steep = dr.abs(slope) > 1e-6
    return dr.select(steep, dr.maximum(way / dr.select(steep, slope, 1.0), 0.0), 1e6)


def box_of(pane: Pane) -> Box:
    """Return the room behind a pane."""
    shop, office = pane.kind == 2, pane.kind == 1
    low = dr.select(pane.height > 1.85, 0.05, 0.85)
    floor = -dr.select(shop, dr.maximum(3.0 - pane.height, 0.05) * 0.5, low)
    return Box(
        -pane.among(0.3, 1.4, 1),
        pane.width + pane.among(0.3, 1.4, 2),
        floor,
        pane.height + dr.select(shop, 0.25, pane.among(0.2, 0.5, 3)),
        dr.select(shop | office, pane.among(3.5, 7.0, 4), pane.among(2.6, 4.8, 4)),
    )


def seen_through(place: Any, ray: Any, colour: Any, away: Any) -> tuple[Any, Any]:
    """Return a pane's colour by day, and how bright a lit room is there against its mean.

    Args:
        place: Three numbers of the pane's corners.
        ray: As `inward` returns it.
        colour: Reflectance of the room's walls.
        away: Distance to the eye [m].
    """
    pane = pane_at(place)
    box = box_of(pane)
    shop, office = pane.kind == 2, pane.kind == 1
    size = away * PIXEL / ray.z  # of a pixel on the pane [m]
    day, glow = _room(pane, box, ray, colour, size)
    for depth, salt in ((0.55, 20), (0.16, 30)):
        day, glow = _thing(pane, box, ray, (day, glow), depth=depth, salt=salt)
    cloth, covered, shine = _covers(pane, size)
    covered = dr.select(shop | pane.bare, 0.0, covered)
    day = dr.lerp(day, cloth, covered)
    glow = dr.lerp(glow, cloth * shine, covered)
    day, glow = _sill(pane, day, glow, ~(shop | office))
    plain = pane.kind == 3
    day = dr.select(plain, colour, dr.clip(day, 0.004, _BRIGHTEST))
    return day, dr.select(plain, 1.0, dr.clip(glow, 0.02, 6.0))


def _room(pane: Pane, box: Box, ray: Any, colour: Any, size: Any) -> tuple[Any, Any]:
    """Return how the empty room looks where a ray leaves it, by day and lit."""
    shop, office = pane.kind == 2, pane.kind == 1
    far, side, level = leaves(box, pane.x, pane.y, ray)
    px, py, pz = pane.x + far * ray.x, pane.y + far * ray.y, far * ray.z
    on_side = (side <= level) & (side <= far)
    on_level = (level < side) & (level <= far)
    overhead = on_level & (ray.y > 0.0)
    underfoot = on_level & (ray.y <= 0.0)
    wall = mi.Color3f(colour)
    pale = mi.Color3f(0.72, 0.71, 0.69)
    ground = mi.Color3f(0.26, 0.17, 0.1) * pane.among(0.5, 1.5, 5)
    own = dr.select(overhead, pale, dr.select(underfoot, ground, wall))
    own = dr.select(on_level | on_side, own, _back(pane, box, (px, py), wall))
    own = dr.select(on_side & (pane.chance(6) < 0.5), own * 0.75, own)
    # Windows light what lies near them; lamps light all of a room, most below them.
    daylight = 0.035 + 0.3 * dr.exp(-0.85 * pz)
    daylight *= pane.among(0.5, 1.8, 16) * dr.select(on_side, 0.75, dr.select(overhead, 0.7, 1.0))
    near = dr.squared_norm(
        mi.Vector3f(
            px - 0.5 * (box.left + box.right), py - box.ceiling + 0.35, pz - 0.5 * box.depth
        )
    )
    lit = dr.select(shop | office, 1.05, 0.57 + 2.1 / (1.0 + 1.4 * near))
    on = (shop & (pane.chance(7) < 0.85)) | (office & (pane.chance(7) < 0.4))
    steady = dr.select(on, dr.select(shop, 0.3, 0.09), 0.0)
    open_ = _open(box, (px, py, pz), on_side, on_level)
    facing = dr.select(overhead, 1.1, dr.select(on_side, 0.72, dr.select(underfoot, 0.8, 1.0)))
    day, glow = own * (open_ * (daylight + steady)), own * (open_ * facing * lit * 1.9)
    # Rows of tubes hang under the ceilings of shops and offices.
    row = pz * 0.55 - dr.floor(pz * 0.55)
    tube = overhead & (row > 0.3) & (row < dr.select(size > 0.2, 0.5, 0.45)) & (shop | office)
    day = dr.select(tube & on, mi.Color3f(0.5), day)
    glow = dr.select(tube, mi.Color3f(4.5), glow)
    globe = _globe(pane, box, ray, far)
    return dr.select(globe, day * 1.35, day), dr.select(globe, mi.Color3f(3.6), glow)


def _open(box: Box, at: tuple[Any, Any, Any], on_side: Any, on_level: Any) -> Any:
    """Return how much of a room's light comes to a point on its walls: less in corners."""
    x, y, z = at
    across = dr.select(on_side, 9.0, dr.minimum(x - box.left, box.right - x))
    upwards = dr.select(on_level, 9.0, dr.minimum(y - box.floor, box.ceiling - y))
    behind = dr.select(on_level | on_side, box.depth - z, 9.0)
    corner = dr.maximum(dr.minimum(dr.minimum(across, upwards), behind), 0.0)
    return 1.0 - 0.5 * dr.exp(-3.5 * corner)


def _globe(pane: Pane, box: Box, ray: Any, far: Any) -> Any:
    """Return whether the lamp that hangs in the middle of some homes is met before the walls."""
    t = 0.5 * box.depth / ray.z
    x = pane.x + t * ray.x - 0.5 * (box.left + box.right)
    y = pane.y + t * ray.y - box.ceiling + 0.5
    hangs = (pane.kind == 0) & (pane.chance(8) < 0.45)
    return hangs & (t < far) & (x * x + y * y * 1.6 < pane.among(0.012, 0.04, 9))


def _back(pane: Pane, box: Box, at: tuple[Any, Any], wall: Any) -> Any:
    """Return the reflectance of a room's back wall: doors and pictures, shelves in shops."""
    x, y = at
    u, up = (x - box.left) / (box.right - box.left), y - box.floor
    door_at = pane.among(0.1, 0.7, 10)
    door = (u > door_at) & (u < door_at + 0.24) & (up < 2.05)
    inner = mi.Color3f(0.12, 0.085, 0.06) * pane.among(0.5, 3.5, 11)
    hung = pane.among(0.05, 0.7, 12)
    picture = (dr.abs(u - hung - 0.1) < 0.1) & (dr.abs(up - 1.6) < pane.among(0.15, 0.4, 13))
    own = dr.select(picture, _one_of(_WARES, pane.bits + 14) * 0.8, wall)
    own = dr.select(door, inner, own)
    # Shelves: boards with rows of goods, some gaps, one sort beside the other.
    board, across = up * 2.6, x * 6.0
    level, column = dr.floor(board), dr.floor(across + 64.0)
    cell = mixed(pane.bits + mi.UInt32(level * 57.0 + column))
    sort = _one_of(_WARES, mixed(pane.bits + mi.UInt32(level * 31.0 + dr.floor(column * 0.28))))
    tall = board - level < 0.5 + 0.32 * unit(mixed(cell + 1))
    stock = dr.select(tall, sort * (0.6 + 0.7 * unit(cell)), wall * 0.35)
    stock = dr.select(board - level < 0.07, mi.Color3f(0.35), stock)
    stocked = (pane.kind == 2) & (up < 2.3) & (pane.chance(15) < 0.6)
    return dr.select(stocked, stock, own)


def _thing(
    pane: Pane, box: Box, ray: Any, before: tuple[Any, Any], *, depth: float, salt: int
) -> tuple[Any, Any]:
    """Put what stands in a room before what lies behind it: cupboards, chairs, figures.

    Args:
        pane: The pane.
        box: The room.
        ray: As `inward` returns it.
        before: How the room looks without it, by day and lit.
        depth: Where it stands, as a share of the room's depth.
        salt: Of chance.
    """
    day, glow = before
    shop = pane.kind == 2
    t = depth * box.depth / ray.z
    far = leaves(box, pane.x, pane.y, ray)[0]
    x, up = pane.x + t * ray.x - box.left, pane.y + t * ray.y - box.floor
    # In shops there is one thing in each cell of a row, else one or none in the room.
    cells = dr.select(shop, 1.15, box.right - box.left)
    cell = dr.floor(x / cells)
    bits = mixed(pane.bits + salt + mi.UInt32(cell + 32.0) * 977)
    figure = shop & (unit(mixed(bits + 5)) < 0.3)
    wide = dr.select(figure, 0.22, 0.3 + 0.3 * unit(mixed(bits + 1)))
    spot = cells * (0.4 + 0.2 * unit(mixed(bits + 2)))
    tall = dr.select(shop, 0.5, 0.75) + dr.select(shop, 0.6, 1.1) * unit(mixed(bits + 3))
    tall = dr.select(figure, 1.72, tall)
    off = dr.abs(x - cell * cells - spot)
    # Figures have legs, shoulders and a head; the rest are tables, racks, chairs and cupboards.
    head = up - (tall - 0.12)
    slim = dr.select(up > tall - 0.3, 0.3, dr.select(up < 0.85, 0.62, 1.0))
    body = (off < wide * slim) & (up < tall - 0.24)
    body |= off * off + head * head * 0.7 < 0.0115
    block = (off < wide) & (up < tall)
    there = (t < far) & dr.select(figure, body, block) & (unit(bits) < 0.7)
    own = _one_of(_WARES, mixed(bits + 4)) * dr.select(figure, 0.7, 0.55)
    # Goods lie on tables in rows.
    band = mi.UInt32(dr.floor(up * 6.0) * 13.0 + dr.floor((off + 2.0) * 5.0))
    own = dr.select(shop & ~figure, own * (0.5 + unit(mixed(bits + band))), own)
    light = 0.035 + 0.3 * dr.exp(-0.85 * depth * box.depth) + dr.select(shop, 0.22, 0.0)
    return dr.select(there, own * light, day), dr.select(there, own * 1.7, glow)


def _covers(pane: Pane, size: Any) -> tuple[Any, Any, Any]:
    """Return cloth behind a pane: its colour by day, how far it covers a point, how it glows."""
    office = pane.kind == 1
    u, v = pane.x / pane.width, pane.y / pane.height
    sort = pane.chance(40)
    cloth = _one_of(_CLOTHS, pane.bits + 41) * pane.among(0.65, 1.1, 42)
    pale = mi.Color3f(0.56, 0.55, 0.53) * pane.among(0.75, 1.1, 42)
    fine = dr.clip(1.6 - size * 16.0, 0.0, 1.0)
    edge = 0.012 * dr.sin(9.0 * v + 6.0 * pane.chance(43))
    folds = 1.0 + fine * 0.22 * dr.sin(pane.x * pane.among(45.0, 75.0, 44) + 2.0 * dr.sin(5.0 * v))
    slats = 1.0 - fine * dr.select(dr.sin(pane.y * 125.0) > 0.5, 0.3, 0.0)
    drawn = dr.select(pane.chance(45) < 0.12, 0.5, pane.among(0.12, 0.42, 46))
    other = dr.select(pane.chance(47) < 0.7, drawn, pane.among(0.0, 0.3, 47))
    down = dr.select(pane.chance(48) < 0.2, 1.0, pane.among(0.08, 0.75, 49))
    curtains = (u < drawn + edge) | (u > 1.0 - other + edge)
    lace = (v < pane.among(0.4, 0.6, 50) + 0.2 * edge) & (u > 0.02)
    blind = v > 1.0 - down
    # Homes have curtains, lace before the lower half or all, and blinds.
    b, c, d = 0.36, 0.5, 0.72
    is_curtain, is_lace = (sort > 0.0) & (sort < b) & ~office, (sort > b) & (sort < c) & ~office
    is_veil = (sort > c) & (sort < d) & ~office
    is_blind = office | (sort > d)
    colour = dr.select(is_blind, pale * slats, dr.select(is_curtain, cloth, pale) * folds)
    veil = dr.select(curtains, 0.9, 0.55 + 0.1 * folds)
    share = dr.select(is_curtain & curtains, 1.0, dr.select(is_lace & lace, 0.8, 0.0))
    share = dr.select(is_veil, veil, dr.select(is_blind & blind, 1.0, share))
    shadow = 1.0 - 0.45 * dr.exp(-9.0 * (1.0 - v))
    return colour * shadow, share, dr.select(is_blind, 1.1, 2.6)


def _sill(pane: Pane, day: Any, glow: Any, home: Any) -> tuple[Any, Any]:
    """Put pots with plants, books and vases on the sills of some homes."""
    some = home & (pane.chance(60) < 0.35)
    column = dr.floor(pane.x * 7.0)
    bits = mixed(pane.bits + 61 + mi.UInt32(column))
    across = dr.abs(pane.x * 7.0 - column - 0.5)
    pot = unit(bits) < 0.4
    tall = (0.1 + 0.3 * unit(mixed(bits + 1))) * dr.select(across < 0.3, 1.0, 0.6)
    leaf = pot & (pane.y > 0.11) & (pane.y < tall)
    clay = pot & (pane.y <= 0.11) & (across < 0.34)
    green = mi.Color3f(0.035, 0.075, 0.022) * (0.6 + unit(mixed(bits + 2)))
    baked = _one_of(_WARES, mixed(bits + 3)) * 0.55
    own = dr.select(leaf, green, baked)
    there = some & (leaf | clay)
    return dr.select(there, own, day), dr.select(there, own * 0.8, glow)


def _one_of(colours: tuple[tuple[float, float, float], ...], bits: Any) -> Any:
    """Return one of eight colours by random bits."""
    number = mixed(bits) >> 29
    chosen = mi.Color3f(*colours[0])
    for k, colour in enumerate(colours[1:], 1):
        chosen = dr.select(number == k, mi.Color3f(*colour), chosen)
    return chosen


def rooms_texture(tint: Mapping[str, Any]) -> dict[str, Any]:
    """Return the texture as a plugin dict; in scalar variants panes are plain and dark.

    Args:
        tint: Stands for the colour of the rooms' walls.
    """
    if "scalar" in mi.variant():
        return {"type": "rgb", "value": list(_DARK)}
    place = {"type": "mesh_attribute", "name": WEAR_ATTRIBUTE}
    return {"type": _PLUGIN, "tint": dict(tint), "place": place}


def register_rooms() -> None:  # noqa: C901 - the plugin's class needs the variant to exist
    """Make the texture known to the active JIT variant."""

    class RoomsTexture(mi.Texture):  # type: ignore[misc]
        """What is seen through panes."""

        def __init__(self, props: Any) -> None:
            mi.Texture.__init__(self, props)
            self.tint, self.place = props.get_texture("tint", 0.5), props["place"]

        def eval(self, si: Any, active: Any = True) -> Any:
            return self.eval_3(si, active)

        def eval_3(self, si: Any, active: Any = True) -> Any:
            place = dr.clip(self.place.eval_3(si, active), 0.0, 1.0)
            ray = inward(si.to_world(si.wi), si.n)
            return seen_through(place, ray, self.tint.eval_3(si, active), si.t)[0]

        def eval_1(self, si: Any, active: Any = True) -> Any:
            return mi.luminance(self.eval_3(si, active))

        def mean(self) -> Any:
            return mi.Float(0.05)

        def is_spatially_varying(self) -> bool:
            return True

        def traverse(self, callback: Any) -> None:
            callback.put("tint", self.tint, mi.ParamFlags.Differentiable)
            callback.put("place", self.place, mi.ParamFlags.Differentiable)

        def to_string(self) -> str:
            return "RoomsTexture[]"

    mi.register_texture(_PLUGIN, lambda props: RoomsTexture(props))
