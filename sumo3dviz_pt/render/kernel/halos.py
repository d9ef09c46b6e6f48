"""Light of lamps and head lamps that the air scatters towards the eye: halos, cones, a lit haze.

Each path looks at one lamp. Which one, a table says by the part of the picture: lamps are likely
there in proportion to the light that they scatter along a ray through the part's middle. A point
of the path's first segment is picked by its angle from the lamp, which cancels the square of the
distance: evenly, and the nearer the eye looks past a lamp, the more of them as droplets scatter,
which is mostly forwards. One shadow ray tells whether the lamp reaches it. Nothing is biased but
that lamps count as points, and that all but the strongest are left out.

References:
    Kulla, C. and Fajardo, M., Importance sampling techniques for path tracing in participating
    media, Computer Graphics Forum 31(4), 2012, doi:10.1111/j.1467-8659.2012.03148.x.
"""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from sumo3dviz_pt.model.geometry import Floats, Image
from sumo3dviz_pt.model.scene import FrameState
from sumo3dviz_pt.model.weather import ASYMMETRY
from sumo3dviz_pt.render.kernel.air import Air, Solids, phase
from sumo3dviz_pt.render.kernel.eye import Eye
from sumo3dviz_pt.render.kernel.lights import Lights
from sumo3dviz_pt.render.kernels import aligned
from sumo3dviz_pt.render.lights.standing import Sources, sources_of
from sumo3dviz_pt.render.loaded import LoadedScene

TILE = 20
"""Side of a part of the picture with its own table [px]."""

_MOST = 384
"""Lamps that are looked at, the strongest ones."""

_BY_CHANCE = 0.1
"""Share of the choice that does not look at where a lamp shines."""

_NEAREST = 0.05
"""Least distance of rays from a lamp's middle [m]."""

_DIM = 0.25
"""Share of what else is seen, below which not every path asks whether light is hidden."""

_END = 2000.0
"""Where rays end that meet nothing [m]."""

_WIDE = 0.1
"""Angle of parts where there is only one column of them [rad]."""

_MOST_FORWARDS = 0.6
"""Share of angles that are picked as droplets scatter, where the eye looks at a lamp."""

_FORWARDS = (1.0 - ASYMMETRY) / ASYMMETRY**0.5
"""Angle in which the phase function falls: it goes by (a^2 + angle^2)^-1.5 where that is small."""

_PLACES = ((0.025, 0.05), (0.125, 0.15), (0.35, 0.3), (0.75, 0.5))
"""Shares of the angle along a ray at which tables look at a lamp, and what part each stands for.

They are closer where light of lamps that shine towards the eye is scattered forwards.
"""


class Halos:
    """The lamps whose light is scattered in a frame.

    Args:
        loaded: A scene that shows a frame.
        lights: Its emitters.
        air: What is in the air.

    Attributes:
        count: Lamps and beams in the tables, the same in all frames.
    """

    def __init__(self, loaded: LoadedScene, lights: Lights, air: Air) -> None:
        self._loaded, self._lights, self._air = loaded, lights, air
        self._room = min(_MOST, loaded.most_lamps)
        self.count = self._room + len(lights.beam_names)
        self._columns = mi.UInt32(1)
        self._rows = self._chances = self._summed = mi.Float(0.0)
        self._seen: tuple[FrameState, bytes] | None = None

    def look_at(self, eye: Eye, size: tuple[int, int]) -> None:
        """Bring the lamps to the frame that is shown, as an eye sees it.

        Args:
            eye: What rays come from.
            size: Of its pictures, width and height [px].
        """
        frame, origin = self._loaded.frame, self._loaded.origin
        assert frame is not None and frame.weather is not None, "show a frame first"
        assert origin is not None, "show a frame first"
        start, directions = _middles(eye, size)
        seen = (frame, directions.tobytes() + start.tobytes())
        if self._seen == seen:
            return
        self._seen, running = seen, self._loaded.running.beams
        sources = sources_of(
            [glow for glow in self._loaded.glows().values() if glow.weight > 0.0],
            {} if running is None else running.placed,
            beams=self._lights.beam_names,
            beam=None if running is None else running.beam,
            room=self._room,
            seen=(start + origin, origin),
        )
        power = _scattered(sources, directions, start + origin, fading=frame.weather.extinction)
        total = power.sum(axis=1, keepdims=True)
        chances = power / np.where(total > 0.0, total, 1.0)
        self._columns = dr.opaque(mi.UInt32, directions.shape[1])
        self._rows, self._chances, self._summed = (
            mi.Float(aligned(table.ravel(), np.float32))
            for table in (sources.rows(origin), chances, np.cumsum(chances, axis=1))
        )

    def tile(self, pixel: Any, width: Any) -> Any:
        """Return the number of the part of the picture that a pixel lies in."""
        row = pixel // width
        return (row // TILE) * self._columns + (pixel - row * width) // TILE

    def along(
        self, solids: Solids, ray: Any, distance: Any, tile: Any, *, chance: Any, beside: Any
    ) -> Any:
        """Return light that the air scatters into rays, a colour.

        Args:
            solids: What may be in the way of light.
            ray: From the eye.
            distance: To what they meet; 0 where that is nothing [m].
            tile: Part of the picture.
            chance: Three numbers in [0, 1).
            beside: Luminance of what else is seen there.
        """
        end = dr.select(distance > 0.0, distance, _END)
        number, likely = self._pick(tile, chance.x)
        place, size = self._placed(number)
        to = place - ray.o
        nearest = dr.dot(to, ray.d)
        aside = dr.maximum(dr.norm(to - ray.d * nearest), _NEAREST)
        first, last = dr.atan(-nearest / aside), dr.atan((end - nearest) / aside)
        angle, density = _picked_angle(first, last, self._faces(number, to), chance.y)
        t = nearest + aside * dr.tan(angle)
        t = dr.clip(t, 0.0, end)
        point = ray.o + ray.d * t
        away = place - point
        reach = dr.maximum(dr.norm(away), _NEAREST)
        d = away / reach
        light = self._intensity(number, point, d, reach)
        passes = self._air.through(ray.o, ray.d, t, mi.Bool(True))
        passes *= self._air.reach(point, d, reach, mi.Bool(True))
        scattered = self._air.extinction(point) * phase(dr.dot(d, ray.d)) * passes
        gain = light * (scattered / (density * aside * dr.maximum(likely, 1e-20)))
        # What hardly shows beside the rest is asked for now and then, and counts for more.
        bright = mi.luminance(gain)
        often = dr.clip(bright * dr.rcp(_DIM * beside), 0.0, 1.0)
        often = dr.select(dr.isfinite(bright) & (beside > 0.0), often, 1.0)
        gain *= dr.rcp(often)
        lit = (likely > 0.0) & ~dr.all(gain == 0.0) & (chance.z < often)
        shadow = mi.Ray3f(point, d)
        shadow.maxt = dr.maximum(reach - size, 0.0)
        lit &= ~solids.hide(shadow, lit)
        return dr.select(lit, gain, 0.0)

    def _pick(self, tile: Any, chance: Any) -> tuple[Any, Any]:
        """Pick a lamp; return its number and how likely it was."""
        count = self.count
        row = tile * count

        def below(k: Any) -> Any:
            return dr.gather(mi.Float, self._summed, row + mi.UInt32(k)) <= chance

        number = mi.UInt32(dr.binary_search(0, count - 1, below))
        return number, dr.gather(mi.Float, self._chances, row + number)

    def _placed(self, number: Any) -> tuple[Any, Any]:
        """Return where a lamp is, and how large [m]."""
        row = dr.gather(mi.Vector4f, self._rows, 3 * number)
        return mi.Point3f(row.x, row.y, row.z), row.w

    def _faces(self, number: Any, to: Any) -> Any:
        """Return whether a lamp shines towards the eye.

        Args:
            number: Of the lamp.
            to: From the eye to the lamp [m].
        """
        axis = dr.gather(mi.Vector4f, self._rows, 3 * number + 1)
        return dr.dot(mi.Vector3f(axis.x, axis.y, axis.z), to) < 0.0

    def _intensity(self, number: Any, point: Any, d: Any, reach: Any) -> Any:
        """Return the radiant intensity of a lamp towards a point, a colour.

        Args:
            number: Of the lamp.
            point: That is lit.
            d: Unit, towards the lamp.
            reach: Distance of the lamp [m].
        """
        axis = dr.gather(mi.Vector4f, self._rows, 3 * number + 1)
        colour = dr.gather(mi.Vector4f, self._rows, 3 * number + 2)
        cosine = -dr.dot(d, mi.Vector3f(axis.x, axis.y, axis.z))
        lobe = axis.w + (1.0 - axis.w) * dr.exp(colour.w * (cosine - 1.0))
        light = mi.Color3f(colour.x, colour.y, colour.z) * (lobe * dr.maximum(cosine, 0.0))
        if not self._lights.beam_names:
            return light
        beam = number >= self._room
        thrown = self._lights.beam_at(point, dr.select(beam, number - self._room, 0), beam)
        return dr.select(beam, thrown * dr.square(reach), light)


def _picked_angle(first: Any, last: Any, faces: Any, chance: Any) -> tuple[Any, Any]:
    """Pick an angle along a ray as seen from a lamp; return it and its density.

    Args:
        first: Where the ray begins, against the ray's nearest point [rad].
        last: Where it ends [rad].
        faces: Whether the lamp shines towards the eye.
        chance: In [0, 1).
    """
    # How far light turns is the angle and a right one.
    low, high = _summed_forwards(first + 0.5 * dr.pi), _summed_forwards(last + 0.5 * dr.pi)
    aimed = _MOST_FORWARDS * dr.maximum(first * (-2.0 / dr.pi), 0.0)
    even = 1.0 - dr.select(faces, aimed, 0.0)
    evenly = chance < even
    share = dr.select(evenly, chance / even, (chance - even) / dr.maximum(1.0 - even, 1e-6))
    summed = dr.lerp(low, high, share)
    turned = _FORWARDS * summed * dr.rsqrt(dr.maximum(1.0 - dr.square(summed), 1e-6))
    angle = dr.select(evenly, dr.lerp(first, last, share), turned - 0.5 * dr.pi)
    angle = dr.clip(angle, first, last)
    there = dr.square(_FORWARDS) + dr.square(angle + 0.5 * dr.pi)
    peaked = _FORWARDS**2 / (there * dr.sqrt(there) * dr.maximum(high - low, 1e-12))
    return angle, even / dr.maximum(last - first, 1e-12) + (1.0 - even) * peaked


def _summed_forwards(turned: Any) -> Any:
    """Return how likely light turns less than an angle, but for a factor."""
    return turned * dr.rsqrt(_FORWARDS**2 + dr.square(turned))


def _middles(eye: Eye, size: tuple[int, int]) -> tuple[Floats, Floats]:
    """Return where an eye is, (3,), and unit directions of its parts, (rows, columns, 3).

    The last column and row may reach beyond the picture; chances need not be exact.
    """
    columns, rows = (-(-side // TILE) for side in size)
    index = dr.arange(mi.UInt32, columns * rows)
    across = mi.Float(index % columns) + 0.5
    down = mi.Float(index // columns) + 0.5
    part = mi.Point2f(across * (TILE / size[0]), down * (TILE / size[1]))
    ray = eye.ray(dr.minimum(part, 1.0), mi.Point2f(0.5))
    dr.eval(ray)
    starts, forwards = (np.array(each, np.float64).T for each in (ray.o, ray.d))
    return starts.mean(axis=0), forwards.reshape(rows, columns, 3)


def _spread(directions: Floats) -> float:
    """Return the angle between neighbours, (rows, columns, 3) [rad]."""
    if directions.shape[1] < 2:
        return _WIDE
    cosine = (directions[:, 1:] * directions[:, :-1]).sum(axis=-1)
    return float(np.arccos(np.clip(np.median(cosine), -1.0, 1.0)))


def _scattered(sources: Sources, directions: Floats, eye: Floats, *, fading: float) -> Floats:
    """Return what lamps scatter along rays, about, (rays, lamps).

    Args:
        sources: The lamps.
        directions: Of the rays, unit, (rows, columns, 3).
        eye: Where they start, (3,) [m].
        fading: Extinction [1/m].
    """
    spread = np.float32(0.5 * _spread(directions))
    # All that follows are tables of rays and lamps; single precision is enough for chances.
    ways: Image = directions.reshape(-1, 3).astype(np.float32)
    to: Image = (sources.places - eye).astype(np.float32)
    nearest: Image = ways @ to.T
    square = np.maximum((to * to).sum(axis=1) - nearest * nearest, 0) + np.float32(_NEAREST**2)
    wide = np.maximum(nearest, 0) * spread
    aside = np.sqrt(square + wide * wide)
    first = np.arctan(-nearest / aside)
    span = np.float32(0.5 * np.pi) - first
    power = np.zeros_like(aside)
    for share, part in _PLACES:
        beyond = aside * np.tan(first + span * np.float32(share))
        reach: Image = np.sqrt(square + beyond * beyond)
        light = _shining(sources, ways, to, np.asarray(nearest + beyond), reach)
        light *= np.float32(1.0 - _BY_CHANCE) * _phase(-beyond / reach)
        light += (_BY_CHANCE / (4.0 * np.pi) * sources.mean).astype(np.float32)
        light *= np.float32(part)
        power += light * np.exp(np.float32(-fading) * (nearest + beyond + reach))
    return np.asarray(power * span / aside, np.float64)


def _shining(sources: Sources, ways: Image, to: Image, t: Image, reach: Image) -> Image:
    """Return the intensities of lamps towards points of rays, (rays, lamps).

    Args:
        sources: The lamps.
        ways: Unit directions of the rays, (rays, 3).
        to: From their start to the lamps, (lamps, 3) [m].
        t: Distances of the points from the start, (rays, lamps) [m].
        reach: Distances of the points from the lamps, (rays, lamps) [m].
    """
    lamps, axes = sources.lamps, sources.axes[: sources.lamps].astype(np.float32)
    cosine = t[:, :lamps] * (ways @ axes.T) - (to[:lamps] * axes).sum(axis=1)
    outward = t[:, lamps:, None] * ways[:, None] - to[lamps:]
    return np.concatenate(
        [
            sources.by_lamps(cosine / reach[:, :lamps]),
            sources.by_beams(outward / reach[:, lamps:, None]),
        ],
        axis=1,
    )


def _phase(cosine: Image) -> Image:
    """As `air.phase`."""
    g = ASYMMETRY
    below = 1.0 + g * g - 2.0 * g * cosine
    return np.asarray((1.0 - g * g) / (4.0 * np.pi) / (below * np.sqrt(below)), np.float32)
