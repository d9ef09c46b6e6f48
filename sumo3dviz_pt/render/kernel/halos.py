"""Light of lamps and head lamps that the air scatters towards the eye: halos, cones, a lit haze.

Each path looks at one lamp. Which one, a table says by the part of the picture: lamps are likely
there in proportion to the light that they scatter along a ray through the part's middle. A point
of the path's first segment is picked so that all angles from the lamp are equally likely, which
cancels the square of the distance, and one shadow ray tells whether the lamp reaches it. Nothing
is biased but that lamps count as points, and that all but the strongest are left out.

References:
    Kulla, C. and Fajardo, M., Importance sampling techniques for path tracing in participating
    media, Computer Graphics Forum 31(4), 2012, doi:10.1111/j.1467-8659.2012.03148.x.
"""

from __future__ import annotations

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.scene import FrameState
from sumo3dviz_pt.model.weather import ASYMMETRY
from sumo3dviz_pt.render.kernel.air import Air, phase
from sumo3dviz_pt.render.kernel.lights import Lights
from sumo3dviz_pt.render.kernels import aligned
from sumo3dviz_pt.render.lights.sources import Sources, sources_of
from sumo3dviz_pt.render.loaded import LoadedScene

TILE = 16
"""Side of a part of the picture with its own table [px]."""

_MOST = 384
"""Lamps that are looked at, the strongest ones."""

_BY_CHANCE = 0.1
"""Share of the choice that does not look at where a lamp shines."""

_NEAREST = 0.05
"""Least distance of rays from a lamp's middle [m]."""

_END = 2000.0
"""Where rays end that meet nothing [m]."""

_PLACES = (0.15, 0.5, 0.85)
"""Shares of the angle along a ray at which tables look at a lamp."""


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
        self._seen: tuple[FrameState, tuple[int, int]] | None = None

    def look_at(self, size: tuple[int, int]) -> None:
        """Bring the lamps to the frame that is shown, for pictures of a size [px]."""
        frame = self._loaded.frame
        assert frame is not None and frame.weather is not None, "show a frame first"
        if self._seen == (frame, size):
            return
        self._seen = (frame, size)
        running, eye = self._loaded.running.beams, frame.view.position
        sources = sources_of(
            self._loaded.glows(),
            {} if running is None else running.placed,
            beams=self._lights.beam_names,
            beam=None if running is None else running.beam,
            room=self._room,
            seen=(eye, frame.origin),
        )
        # The last column and row may reach beyond the picture; chances need not be exact.
        columns, rows = (-(-side // TILE) for side in size)
        directions = frame.view.directions((columns, rows)).reshape(-1, 3)
        spread = TILE * frame.view.lens.pixel_angle(size[0])
        given = _given(sources, directions, eye, spread=spread, fading=frame.weather.extinction)
        total = given.sum(axis=1, keepdims=True)
        chances = given / np.where(total > 0.0, total, 1.0)
        self._columns = dr.opaque(mi.UInt32, columns)
        self._rows, self._chances, self._summed = (
            mi.Float(aligned(table.ravel(), np.float32))
            for table in (sources.rows(frame.origin), chances, np.cumsum(chances, axis=1))
        )

    def tile(self, pixel: Any, width: Any) -> Any:
        """Return the number of the part of the picture that a pixel lies in."""
        row = pixel // width
        return (row // TILE) * self._columns + (pixel - row * width) // TILE

    def along(self, scene: Any, ray: Any, distance: Any, tile: Any, chance: Any) -> Any:
        """Return light that the air scatters into rays, a colour.

        Args:
            scene: Mitsuba's.
            ray: From the eye.
            distance: To what they meet; 0 where that is nothing [m].
            tile: Part of the picture.
            chance: Two numbers in [0, 1).
        """
        end = dr.select(distance > 0.0, distance, _END)
        number, likely = self._pick(tile, chance.x)
        place, size = self._placed(number)
        to = place - ray.o
        nearest = dr.dot(to, ray.d)
        aside = dr.maximum(dr.norm(to - ray.d * nearest), _NEAREST)
        first, last = dr.atan(-nearest / aside), dr.atan((end - nearest) / aside)
        t = nearest + aside * dr.tan(dr.lerp(first, last, chance.y))
        t = dr.clip(t, 0.0, end)
        point = ray.o + ray.d * t
        away = place - point
        reach = dr.maximum(dr.norm(away), _NEAREST)
        d = away / reach
        light = self._intensity(number, point, d, reach)
        passes = self._air.through(ray.o, ray.d, t, mi.Bool(True))
        passes *= self._air.through(point, d, reach, mi.Bool(True))
        scattered = self._air.extinction(point) * phase(dr.dot(d, ray.d)) * passes
        gain = light * (scattered * (last - first) / (aside * dr.maximum(likely, 1e-20)))
        lit = (likely > 0.0) & ~dr.all(gain == 0.0)
        shadow = mi.Ray3f(point, d)
        shadow.maxt = dr.maximum(reach - size, 0.0)
        lit &= ~scene.ray_test(shadow, lit)
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


def _given(
    sources: Sources, directions: Floats, eye: Floats, *, spread: float, fading: float
) -> Floats:
    """Return what lamps scatter along rays, about, (rays, lamps).

    Args:
        sources: The lamps.
        directions: Of the rays, unit, (rays, 3).
        eye: Where they start, (3,) [m].
        spread: Angle that a ray stands for [rad].
        fading: Extinction [1/m].
    """
    to = sources.places - eye
    nearest = directions @ to.T
    square = (to**2).sum(axis=1) - nearest**2
    wide = np.maximum(nearest, 0.0) * (0.5 * spread)
    aside = np.sqrt(np.maximum(square, 0.0) + wide**2 + _NEAREST**2)
    first = np.arctan(-nearest / aside)
    span = 0.5 * np.pi - first
    found = np.zeros_like(aside)
    for share in _PLACES:
        t = nearest + aside * np.tan(first + span * share)
        outward = t[..., None] * directions[:, None] - to
        reach = np.linalg.norm(outward, axis=-1)
        outward /= np.maximum(reach, 1e-6)[..., None]
        facing = -np.einsum("rlk,rk->rl", outward, directions)
        light = (1.0 - _BY_CHANCE) * sources.towards(outward) * _phase(facing)
        light += _BY_CHANCE / (4.0 * np.pi) * sources.mean
        found += light * np.exp(-fading * (np.maximum(t, 0.0) + reach))
    return np.asarray(found * span / aside)


def _phase(cosine: Floats) -> Floats:
    """As `air.phase`."""
    g = ASYMMETRY
    return np.asarray((1.0 - g * g) / (4.0 * np.pi) * (1.0 + g * g - 2.0 * g * cosine) ** -1.5)
