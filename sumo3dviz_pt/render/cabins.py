"""What is seen through the panes of cars, and in their lamps, as functions of the ray.

Behind a pane lies a cabin: seats with head rests, who drives and sometimes somebody beside, a
dashboard, a steering wheel, a shelf and now and then a parcel on it; where a ray leaves it through
a window on the other side, the street's light comes in. All moves against the frame as it would in
a real cabin, without a single triangle. Colours are reflectances, so a cabin is as bright as the
light on its pane lets it be; what the pane mirrors is the material's.

A pane's corners tell where a ray met it: see `model/cabins.py`.

References:
    van Dongen, "Interior Mapping: A new technique for rendering realistic buildings", CGI 2008.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi

from sumo3dviz_pt.model.cabins import (
    CABIN_LEVELS,
    CABIN_REACH,
    CABIN_STEPS,
    CHANCES,
    HEADINGS,
    PACKED,
)
from sumo3dviz_pt.render.textures import mixed, unit

DARK = (0.02, 0.022, 0.023)
"""Reflectance of a car's panes where no function of ours is possible."""

_FAR = 1e6
_DUST = (0.2, 0.185, 0.16)
_LINING, _DOOR, _DASH = (0.085, 0.083, 0.078), (0.016, 0.016, 0.017), (0.022, 0.022, 0.023)
_SEATS = ((0.014, 0.014, 0.015), (0.026, 0.026, 0.027), (0.05, 0.046, 0.04), (0.022, 0.019, 0.017))
_COATS = ((0.014, 0.017, 0.025), (0.075, 0.072, 0.069), (0.034, 0.014, 0.013), (0.02, 0.024, 0.019))
_SKINS = ((0.1, 0.07, 0.054), (0.08, 0.053, 0.04), (0.115, 0.083, 0.067), (0.036, 0.023, 0.017))
_GOODS = ((0.12, 0.082, 0.045), (0.16, 0.16, 0.15), (0.02, 0.035, 0.07), (0.09, 0.02, 0.02))


@dataclass(frozen=True, slots=True)
class _Cabin:
    """A cabin's measures as `CabinSize` has them, and what is random in it."""

    rear: Any
    roof: Any
    half: Any
    cowl: Any
    tail: Any
    bits: Any
    driven: Any

    def chance(self, salt: int) -> Any:
        """Return a number in [0, 1) of this car, another one for each salt."""
        return unit(mixed(self.bits + salt))


@dataclass(frozen=True, slots=True)
class _Ray:
    """Where a ray enters a cabin, and its unit direction: ahead, to the left, up."""

    p: Any
    d: Any


def cabin_frame(numbers: Any, rows: Any, instanced: Any) -> Any:
    """Return the direction in which a car looks, a unit vector.

    Args:
        numbers: The two of its pane.
        rows: Of the matrix of the instance that was hit, or None.
        instanced: Whether there is one.
    """
    heading = mi.UInt32(_whole(numbers.y, HEADINGS * CHANCES)) // CHANCES
    sine, cosine = dr.sincos(mi.Float(heading) * (6.283185307 / HEADINGS))
    stands = mi.Vector3f(cosine, sine, 0.0)
    if rows is None:
        return stands
    moves = dr.normalize(mi.Vector3f(rows[0].x, rows[1].x, rows[2].x))
    return dr.select(instanced, moves, stands)


def _whole(share: Any, count: int) -> Any:
    """Return the whole number that a number in [0, 1) tells."""
    return dr.floor(dr.clip(share, 0.0, 0.9999999) * count)


def cabin_seen(place: Any, numbers: Any, ahead: Any, d: Any, use: Any) -> tuple[Any]:
    """Return a pane's colour.

    Args:
        place: Where in the cabin it is met, three numbers in [0, 1].
        numbers: The two of the pane.
        ahead: Where the car looks to, a unit vector.
        d: Of the ray.
        use: What is random in a road user, [0, 1); 0 of who stands.
    """
    left = dr.normalize(mi.Vector3f(-ahead.y, ahead.x, 0.0))
    up = dr.cross(ahead, left)
    way = mi.Vector3f(dr.dot(d, ahead), dr.dot(d, left), dr.dot(d, up))
    ray = _Ray((mi.Vector3f(place) - 0.5) * CABIN_REACH, way)
    cabin = _read(numbers, use)
    far, colour = _hull(cabin, ray, mi.Vector3f(d))
    far, colour = _furniture(cabin, ray, far, colour)
    colour = _people(cabin, ray, far, colour)
    # Rear panes of some cars are tinted dark.
    private = (cabin.chance(1) < 0.4) & (ray.p.x < -0.3)
    shade = dr.select(private, 0.35, 1.0)
    colour = colour * shade * mi.Color3f(0.93, 1.0, 0.97)
    # Dust lies on panes, most along their lower edges.
    film = (0.02 + 0.07 * dr.exp(-ray.p.z * 14.0)) * (0.25 + 1.6 * use * use)
    film *= 1.0 + 0.5 * dr.sin(23.0 * ray.p.x) * dr.sin(17.0 * ray.p.y + 9.0 * ray.p.z)
    return (dr.clip(dr.lerp(colour, mi.Color3f(*_DUST), film), 0.004, 0.6),)


def _read(numbers: Any, use: Any) -> _Cabin:
    """Return the cabin that a pane's two numbers tell."""
    rest = mi.UInt32(_whole(numbers.x, PACKED))
    sizes = []
    for least, step in reversed(CABIN_STEPS):
        sizes.append(least + step * mi.Float(rest % CABIN_LEVELS))
        rest = rest // CABIN_LEVELS
    own = mi.UInt32(_whole(numbers.y, HEADINGS * CHANCES)) % CHANCES
    moving = mi.UInt32(_whole(use, CHANCES))
    driven = moving > 0
    bits = mixed(dr.select(driven, moving, own + CHANCES) * 0x9E3779B1)
    tail, cowl, half, roof, rear = sizes
    return _Cabin(rear, roof, half, cowl, tail, bits, driven)


def _hull(cabin: _Cabin, ray: _Ray, d: Any) -> tuple[Any, Any]:
    """Return where a ray leaves the cabin, and the colour there: lining, doors, or a window."""
    p, way = ray.p, ray.d
    low = -0.5
    # Planes that lean as windows do: (x, y, z) . normal = offset.
    side = dr.select(way.y > 0.0, 1.0, -1.0)
    t_side = _plane(side * p.y + 0.36 * p.z, side * way.y + 0.36 * way.z, cabin.half)
    t_roof = _plane(p.z, way.z, cabin.roof - 0.04)
    t_floor = _plane(-p.z, -way.z, -low)
    t_front = _plane(p.x + 1.75 * p.z, way.x + 1.75 * way.z, cabin.cowl)
    t_rear = _plane(0.7 * p.z - p.x, 0.7 * way.z - way.x, cabin.tail)
    far = dr.minimum(dr.minimum(t_side, t_roof), dr.minimum(t_floor, t_front))
    far = dr.minimum(far, t_rear)
    at = p + far * way
    outside = _street(at, d)
    # Doors below the edge, pillars between the windows, the roof's rim above them.
    pillar = dr.abs(at.x + 0.2) < 0.06
    pillar |= at.x < -cabin.tail + 0.42 + 0.4 * at.z
    pillar |= at.x > cabin.cowl - 0.3 - 1.7 * at.z
    solid = pillar | (at.z < 0.015) | (at.z > cabin.roof - 0.1)
    trim = dr.select(at.z < 0.015, mi.Color3f(*_DOOR), mi.Color3f(*_LINING))
    on_side = dr.select(solid, trim, outside)
    shut = (at.z < 0.04) | (dr.abs(at.y) > cabin.half - 0.3 * at.z - 0.06)
    across = dr.select(shut, mi.Color3f(*_DOOR), outside)
    lining = mi.Color3f(*_LINING) * (1.0 - 0.5 * dr.abs(at.x) / (cabin.tail + 0.4))
    colour = dr.select(far == t_side, on_side, across)
    colour = dr.select(far == t_roof, lining, colour)
    return far, dr.select(far == t_floor, mi.Color3f(0.007), colour)


def _plane(offset: Any, slope: Any, limit: Any) -> Any:
    """Return how far a ray goes until it reaches a plane from inside; far if it never does."""
    leaving = slope > 1e-4
    reach = (limit - offset) / dr.select(leaving, slope, 1.0)
    return dr.select(leaving, dr.maximum(reach, 0.0), _FAR)


def _street(at: Any, d: Any) -> Any:
    """Return what is seen out of the other window: sky over trees and houses, and the ground.

    Both panes take a part of it.
    """
    turn = 3.0 * d.x / (dr.abs(d.x) + dr.abs(d.y) + 1e-3) + 0.4 * at.x
    skyline = 0.07 + 0.05 * dr.sin(5.0 * turn) + 0.03 * dr.sin(13.0 * turn + 1.0)
    above = dr.clip((d.z - skyline) * 25.0, 0.0, 1.0)
    below = dr.clip((-0.03 - d.z) * 30.0, 0.0, 1.0)
    sky = dr.lerp(
        mi.Color3f(0.37, 0.395, 0.415), mi.Color3f(0.24, 0.285, 0.36), dr.clip(d.z, 0.0, 1.0)
    )
    trees = mi.Color3f(0.046, 0.054, 0.038) * (
        1.0 + 0.5 * dr.sin(29.0 * turn) * dr.sin(60.0 * d.z + 7.0 * turn)
    )
    return dr.lerp(dr.lerp(trees, sky, above), mi.Color3f(0.1, 0.098, 0.094), below)


def _blob(ray: _Ray, middle: Any, half: Any, *, round_: bool = False) -> tuple[Any, Any, Any]:
    """Return where a ray passes a body most closely, whether it meets it, and its place there.

    Args:
        ray: In the cabin's frame.
        middle: Of the body [m].
        half: Half its sizes [m].
        round_: Whether it is an ellipsoid; else its edges are only rounded off.
    """
    scale = mi.Vector3f(*(1.0 / each for each in half))
    q, e = (ray.p - middle) * scale, ray.d * scale
    t = -dr.dot(q, e) / dr.dot(e, e)
    m = q + t * e
    m2 = m * m
    inside = (dr.squared_norm(m) if round_ else dr.dot(m2, m2)) < 1.0
    return t, inside & (t > 0.0), m


def _furniture(cabin: _Cabin, ray: _Ray, far: Any, colour: Any) -> tuple[Any, Any]:
    """Put dashboard, shelf, seats, wheel and mirror before what lies behind them."""
    p, d = ray.p, ray.d
    # Dashboard and shelf are level.
    down = d.z < -1e-4
    t = dr.select(down, (-0.03 - p.z) / dr.select(down, d.z, 1.0), _FAR)
    x = p.x + t * d.x
    dash, shelf = x > cabin.cowl - 0.75, x < -cabin.rear - 0.12
    met = (t > 0.0) & (t < far) & (dash | shelf)
    far, colour = _nearer(far, colour, met, t, mi.Color3f(*_DASH))
    cloth = _one_of(_SEATS, mixed(cabin.bits + 3))
    # Backs lean: higher is farther behind.
    leaning = _Ray(mi.Vector3f(p.x + 0.24 * p.z, p.y, p.z), mi.Vector3f(d.x + 0.24 * d.z, d.y, d.z))
    y = 0.46 * cabin.half
    top = dr.minimum(cabin.roof - 0.16, 0.34)
    rows = ((mi.Float(0.0), 0.15, top), (-cabin.rear, 0.07, dr.minimum(top, 0.24)))
    for number, (back, high, rest) in enumerate(rows):
        for side in (1.0, -1.0):
            wide, deep = (0.25, 0.075) if number == 0 else (0.36, 0.09)
            middle = mi.Vector3f(back, side * y, high - 0.3)
            far, colour = _put(leaning, (far, colour), (middle, (deep, wide, 0.3)), cloth)
            middle = mi.Vector3f(back + 0.01, side * y, rest - 0.075)
            far, colour = _put(leaning, (far, colour), (middle, (0.05, 0.125, 0.085)), cloth)
    # The wheel's rim, and the mirror under the roof.
    tilted = _plane(p.x + 0.45 * p.z, d.x + 0.45 * d.z, mi.Float(0.53))
    tilted = dr.select(tilted < _FAR, tilted, _plane(-p.x - 0.45 * p.z, -d.x - 0.45 * d.z, -0.53))
    rim = p + tilted * d - mi.Vector3f(0.56, y, -0.06)
    met = (dr.abs(dr.norm(rim) - 0.185) < 0.016) & (tilted < far)
    far, colour = _nearer(far, colour, met, tilted, mi.Color3f(0.012))
    mirror = mi.Vector3f(cabin.cowl - 1.75 * (cabin.roof - 0.13) - 0.06, 0.0, cabin.roof - 0.13)
    far, colour = _put(ray, (far, colour), (mirror, (0.03, 0.12, 0.036)), mi.Color3f(0.012))
    # Something lies on the shelf, now and then.
    lies = cabin.chance(4) < 0.3
    parcel = mi.Vector3f(0.28 - cabin.tail, (cabin.chance(5) - 0.5) * cabin.half, 0.03)
    sizes = (0.1, 0.1 + 0.14 * cabin.chance(6), 0.06 + 0.05 * cabin.chance(7))
    t, met, m = _blob(ray, parcel, sizes)
    goods = _one_of(_GOODS, mixed(cabin.bits + 8))
    return _nearer(far, colour, met & lies & (t < far), t, goods * (0.75 + 0.35 * m.z))


def _put(ray: _Ray, before: tuple[Any, Any], body: tuple[Any, Any], own: Any) -> tuple[Any, Any]:
    """Put a body before what lies behind it, lighter at its top."""
    far, colour = before
    t, met, m = _blob(ray, *body)
    return _nearer(far, colour, met & (t < far), t, own * (0.8 + 0.4 * m.z - 0.25 * m.y * m.y))


def _nearer(far: Any, colour: Any, met: Any, t: Any, own: Any) -> tuple[Any, Any]:
    """Return distance and colour of what is nearer where it is met."""
    return dr.select(met, t, far), dr.select(met, own, colour)


def _people(cabin: _Cabin, ray: _Ray, far: Any, colour: Any) -> Any:
    """Put who drives, and who sits beside and behind in some cars, before what lies behind them."""
    crowded = cabin.chance(10)
    y = 0.46 * cabin.half
    seats = (
        (0.1, y, cabin.driven),
        (0.08, -y, cabin.driven & (crowded < 0.35)),
        (0.1 - cabin.rear, -y, cabin.driven & (crowded < 0.12)),
    )
    for number, (x, aside, there) in enumerate(seats):
        salt = 20 + 8 * number
        coat = _one_of(_COATS, mixed(cabin.bits + salt))
        skin = _one_of(_SKINS, mixed(cabin.bits + salt + 1))
        grown = 0.03 * (cabin.chance(salt + 2) - 0.5)
        high = dr.minimum(cabin.roof - 0.2, 0.25) + grown
        chest = (mi.Vector3f(x - 0.02, aside, high - 0.4), (0.13, 0.22, 0.235))
        t, met, m = _blob(ray, *chest)
        own = coat * (0.8 + 0.4 * m.z)
        far, colour = _nearer(far, colour, met & there & (t < far), t, own)
        head = (mi.Vector3f(x + 0.02, aside, high), (0.098, 0.077, 0.12))
        t, met, m = _blob(ray, *head, round_=True)
        hair = (m.z > 0.45) | ((m.x < 0.05) & (m.z > -0.35))
        dark = mi.Color3f(0.018, 0.014, 0.011) * (0.6 + 3.0 * cabin.chance(salt + 3))
        own = dr.select(hair, dark, skin * (0.8 + 0.25 * m.z))
        far, colour = _nearer(far, colour, met & there & (t < far), t, own)
        if number == 0:
            arm = (mi.Vector3f(x + 0.24, aside + 0.15, -0.1), (0.24, 0.05, 0.06))
            t, met, m = _blob(ray, *arm)
            far, colour = _nearer(far, colour, met & there & (t < far), t, coat * 0.8)
    return colour


def _one_of(colours: tuple[tuple[float, float, float], ...], bits: Any) -> Any:
    """Return one of four colours by random bits."""
    number = mixed(bits) >> 30
    chosen = mi.Color3f(*colours[0])
    for k, colour in enumerate(colours[1:], 1):
        chosen = dr.select(number == k, mi.Color3f(*colour), chosen)
    return chosen


_PRISM = 0.011
"""Width of the prisms of lamps [m]."""


def lens_seen(place: Any, d: Any, normal: Any, colour: Any, size: Any) -> tuple[Any]:
    """Return a lamp's colour: prisms and reflectors under its cover, each bright from some side.

    Args:
        place: Where it is met, in the body's frame [m].
        d: Of the ray, in the body's frame, of unit length.
        normal: Of the cover there, in the same frame.
        colour: Reflectance of the lamp on average.
        size: Of a pixel there [m].
    """
    deep = dr.maximum(-dr.dot(d, normal), 0.25)
    bottom = mi.Vector3f(place) + d * (0.02 / deep)
    fine, fine_at = _prisms(bottom, d, _PRISM)
    broad, broad_at = _prisms(mi.Vector3f(place) + d * (0.035 / deep), d, 4.0 * _PRISM)
    seam = dr.maximum(fine_at, 0.6 * broad_at)
    bright = 0.2 + 2.7 * fine * broad + 1.8 * broad * broad
    bright *= 1.0 - 0.5 * seam
    near = dr.clip(1.8 - size * (1.1 / _PRISM), 0.0, 1.0)
    factor = dr.lerp(1.0, bright, near)
    return (dr.minimum(mi.Color3f(colour) * factor, 0.75),)


def _prisms(at: Any, d: Any, width: float) -> tuple[Any, Any]:
    """Return how bright the prism at a point is, and how near its edge that lies."""
    across, up = at.y / width, at.z / width
    column, row = dr.floor(across), dr.floor(up)
    bits = mixed(mi.UInt32(mi.Int32(column)) * 0x9E3779B1 ^ mixed(mi.UInt32(mi.Int32(row)) + 77))
    lean = 2.0 * unit(bits) - 1.0
    tilt = 2.0 * unit(mixed(bits + 1)) - 1.0
    off = d.y * 3.0 + d.x * 2.0 + d.z * 4.0
    bright = 0.5 + 0.5 * dr.cos(6.0 * (off * lean + tilt))
    edge = dr.maximum(dr.abs(across - column - 0.5), dr.abs(up - row - 0.5)) * 2.0
    return bright, dr.clip((edge - 0.8) * 5.0, 0.0, 1.0)
