"""An integrator of our own: radiance, and all layers of the first surface, from one kernel.

Mitsuba's integrators call functions of shapes, materials and emitters, and trace primary rays
a second time for guides. Here all samples of a pixel are neighbours, and their layers are
summed as they come.

`met_through` says what rays through one place of every pixel meet first, such as its centre: facts,
without light and chance. They are not the picture's rays, which lie where chance puts them. So the
facts are the same whatever seed, samples and quality a picture has, and a picture does not depend
on whether they were asked for.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from sumo3dviz_pt.model.geometry import Bools, Image
from sumo3dviz_pt.model.layers import Channels, Layers, MovingPart, PixelArea, merged
from sumo3dviz_pt.model.scene import View
from sumo3dviz_pt.render.convert import WHOLE, PicturePart
from sumo3dviz_pt.render.kernel.air import Air, Solids
from sumo3dviz_pt.render.kernel.deposits import Deposits
from sumo3dviz_pt.render.kernel.eye import Eye, eye_of
from sumo3dviz_pt.render.kernel.grounds import Grounds
from sumo3dviz_pt.render.kernel.halos import Halos
from sumo3dviz_pt.render.kernel.lamps import Mirrors, covered
from sumo3dviz_pt.render.kernel.lights import Lights
from sumo3dviz_pt.render.kernel.paths import Bounds, Place, emitted_along, followed
from sumo3dviz_pt.render.kernel.surface import Surfaces
from sumo3dviz_pt.render.kernel.tables import Owners, Tables, owners_of
from sumo3dviz_pt.render.kernels import aligned
from sumo3dviz_pt.render.loaded import LoadedScene

CENTRE = (0.5, 0.5)
"""The middle of a pixel, in widths and heights of it."""


def met_through(
    place: Place,
    eye: Eye,
    wanted: Collection[str],
    at: tuple[float, float] = CENTRE,
    *,
    size: tuple[int, int],
) -> dict[str, Image]:
    """Return what rays through one place of every pixel meet first, by name.

    Only what is asked for is compiled and read from the tables.

    Args:
        place: What the rays go through.
        eye: What the rays come from; all go through the middle of its lens.
        wanted: Names of `RAYS`.
        at: Where in the pixels, in widths and heights of one.
        size: Width, height of the picture [px].
    """
    width, height = size
    pixel = dr.arange(mi.UInt32, width * height)
    columns, rows = dr.opaque(mi.UInt32, width), dr.opaque(mi.UInt32, height)
    row = pixel // columns
    across = mi.Float(pixel - row * columns) + dr.opaque(mi.Float, at[0])
    down = mi.Float(row) + dr.opaque(mi.Float, at[1])
    point = mi.Point2f(across / mi.Float(columns), down / mi.Float(rows))
    ray = eye.ray(point, mi.Point2f(0.5))
    hit = place.solids.nearest(ray, True)
    # Rays may begin a little before the eye.
    hit.t += eye.lead(ray)
    met = Met(place, hit, ray)
    channels = {name: of(met) for name, of in RAYS.items() if name in wanted}
    dr.schedule(channels)
    return {
        name: np.stack([np.array(one) for one in some], axis=-1)
        .reshape(height, width, len(some))
        .squeeze(axis=-1 if len(some) == 1 else ())
        for name, some in channels.items()
    }


@dataclass(frozen=True, eq=False)
class Met:
    """What rays have met.

    Attributes:
        place: What they went through.
        hit: Mitsuba's word for what each of them met first.
        ray: The rays.
    """

    place: Place
    hit: Any
    ray: Any

    @cached_property
    def surface(self) -> Any:
        """The surfaces that they met."""
        return self.place.surfaces.met(self.hit, self.ray, mi.Bool(True))

    def there(self, channels: Any) -> list[Any]:
        """Return channels where something was met, else 0."""
        return [dr.select(self.surface.there, one, 0.0) for one in channels]


def _instance(met: Met) -> list[Any]:
    """Return Mitsuba's numbers of instances."""
    number = dr.reinterpret_array(mi.UInt32, met.hit.instance)
    return [dr.select(mi.Bool(met.hit.is_valid()), number, 0)]


def _corners(met: Met) -> list[Any]:
    """Return where in the faces they were met."""
    there = mi.Bool(met.hit.is_valid())
    return [dr.select(there, one, 0.0) for one in met.hit.prim_uv]


def _albedo(met: Met) -> list[Any]:
    """Return reflectances."""
    albedo, foreign = met.surface.finish.colour, met.surface.foreign
    if met.place.surfaces.foreign:
        si = met.hit.compute_surface_interaction(met.ray, mi.RayFlags.All, foreign)
        theirs = si.bsdf().eval_diffuse_reflectance(si, foreign)
        albedo = dr.select(foreign, theirs, albedo)
    return met.there(albedo)


RAYS: Mapping[str, Callable[[Met], list[Any]]] = {
    "depth": lambda met: [dr.select(mi.Bool(met.hit.is_valid()), met.hit.t, 0.0)],
    "face": lambda met: [dr.select(met.surface.there, met.surface.face, 0)],
    "instance": _instance,
    "corners": _corners,
    "normals": lambda met: met.there(mi.Vector3f(met.surface.si.sh_frame.n)),
    "albedo": _albedo,
}
"""The channels of everything that can be asked for; layers name them in `model/numbers.py`.

`depth` is the distance from the eye along the ray [m], 0 where nothing was met; `face` the number
of the face in the tables, `instance` Mitsuba's number of the instance or 0, `corners` where in the
face it was met: weights of its second and third corner; `normals` unit shading normals; `albedo`
reflectance.
"""


CHANNELS = Channels.in_order(capped=3, lost=3, depth=1, hit=1, albedo=3, normal=3)
"""What the kernel finds in every scene."""

_EMITTED = Channels.in_order(emitted=3)
"""What it finds in scenes with lamps besides."""

FIRST = Channels.in_order(ids=1, first_depth=1)
"""What it finds of each pixel's first sample, where that is wanted."""

_OF_MIRRORS, _IN_MIRRORS = 4, 0x27D4EB2F
"""Share of the samples of lamps that pixels of mirrors get, and a part of their seed."""

_LARGE, _IN_LARGE = 4.0, 0x165667B1
"""Width and height of lamps that few samples hit well, as lit panes [px]; part of their seed."""

_MOST_LANES = 1 << 22  # at once; each takes 60 bytes


@dataclass(frozen=True, slots=True)
class Limits:
    """How long paths are, and how bright.

    Attributes:
        most: Most segments of a path.
        roulette: Segments after which paths may end by chance.
        cap: Highest channel value of a sample; inf for no cap.
        direct: Whether lamps that are seen directly are in the picture.
    """

    most: int
    roulette: int
    cap: float = np.inf
    direct: bool = True

    def bounds(self) -> Bounds:
        """Return the limits as numbers that are no part of the kernel's code."""
        most, roulette = (dr.opaque(mi.UInt32, number) for number in (self.most, self.roulette))
        cap = dr.opaque(mi.Float, min(self.cap, float(np.finfo(np.float32).max)))
        return Bounds(most, roulette, cap, dr.opaque(mi.Bool, self.direct))


class Kernel:
    """Traces pictures of a loaded scene.

    Args:
        loaded: A scene that shows a frame.
        pixel: Angle of a pixel [rad].
        numbered: Whether it finds the layers of `FIRST`, too.

    Attributes:
        scene: Mitsuba's; where the loaded scene has another one, the kernel is of no use.
        mirrors: Where they are seen; None if there are none, and then areas have all columns.
    """

    def __init__(self, loaded: LoadedScene, pixel: float, *, numbered: bool = False) -> None:
        self.scene = loaded.scene
        self._tables = Tables(loaded, numbered=numbered)
        air = Air(loaded) if loaded.misty else None
        lights = Lights(loaded, self._tables, air)
        halos = Halos(loaded, lights, air) if air is not None and lights.many else None
        mirrors = self._tables.mirrors()
        self.mirrors = Mirrors(loaded, mirrors) if mirrors else None
        self._loaded, self._deposits = loaded, deposits_of(loaded, pixel)
        self._rain_on()
        surfaces = Surfaces(self._tables, pixel, self._deposits)
        solids = Solids(loaded.scene, loaded.standing)
        shown = self.mirrors is not None
        self._place = Place(solids, surfaces, lights, air, halos, mirrors=shown)
        self._channels = CHANNELS + _EMITTED if lights.lamps else CHANNELS
        if numbered:
            self._channels += FIRST

    @property
    def movers(self) -> tuple[MovingPart, ...]:
        """What the numbers of the layer `ids` stand for."""
        return self._tables.movers

    def follow(self) -> None:
        """Bring everything to what the loaded scene shows."""
        self._tables.follow()
        if self._place.air is not None:
            self._place.air.follow()
        self._place.lights.follow()
        self._rain_on()

    def _rain_on(self) -> None:
        """Bring what weather leaves on surfaces to the frame that is shown."""
        frame = self._loaded.frame
        if self._deposits is not None and frame is not None and frame.weather is not None:
            self._deposits.follow(frame.weather, frame.time, frame.origin)

    def eye(self, sensor: Any, view: View, *, part: PicturePart = WHOLE) -> Eye:
        """Return what rays of a view come from; arguments as in `eye_of`."""
        return eye_of(sensor, view, self._tables.origin, size=_size_of(sensor), part=part)

    def glow(
        self,
        sensor: Any,
        view: View,
        *,
        spp: int,
        few: int,
        seed: int,
        band: tuple[float, float] = (0.0, 1.0),
    ) -> Image:
        """Trace lamps that are seen directly or in mirrors, and nothing else, (h, w, 3).

        Args:
            sensor: One of Mitsuba's, with its sampler.
            view: What it sees.
            spp: As in `trace`, of each pixel where there may be a small lamp; a quarter in mirrors.
            few: The same of pixels where only large lamps may be.
            seed: Of the pass.
            band: First and last row that are traced, shares of the picture's height.
        """
        size = _size_of(sensor)
        places = self._place.lights.shining() + self._tables.origin
        first, last = rows_of(band, size[1])
        there = covered(places, view, size)
        there[:first] = there[last:] = False
        small = there & covered(places, view, size, thinner=_LARGE)
        picture = np.zeros((*there.shape, 3), np.float32)
        eye = self.eye(sensor, view)
        if self.mirrors is not None:
            # Any lamp may be in a mirror, and what it shows is bright in few of its pixels.
            shown = self.mirrors.covered(view, size)
            shown[:first] = shown[last:] = False
            there &= ~shown
            some = -(-spp // _OF_MIRRORS)
            self._glow_in(picture, shown, sensor, eye, spp=some, seed=seed ^ _IN_MIRRORS)
        self._glow_in(picture, there & ~small, sensor, eye, spp=few, seed=seed ^ _IN_LARGE)
        self._glow_in(picture, there & small, sensor, eye, spp=spp, seed=seed)
        return picture

    def _glow_in(
        self, picture: Image, there: Bools, sensor: Any, eye: Eye, *, spp: int, seed: int
    ) -> None:
        """Trace lamps in some pixels, (h, w), and write them into a picture, (h, w, 3)."""
        spp, size = _whole_pattern(sensor, spp), _size_of(sensor)
        pixels = np.flatnonzero(there).astype(np.uint32)
        flat = picture.reshape(-1, 3)
        for first in range(0, len(pixels), _MOST_LANES // spp):
            some = pixels[first : first + _MOST_LANES // spp]
            sampler = _seeded(sensor, spp=spp, lanes=len(some) * spp, seed=seed + first)
            index = dr.arange(mi.UInt32, len(some) * spp) // dr.opaque(mi.UInt32, spp)
            pixel = dr.gather(mi.UInt32, mi.UInt32(aligned(some, np.uint32)), index)
            emitted = emitted_along(self._place, _ray(eye, sampler, pixel, size=size))
            dr.schedule(emitted)
            mean = mi.Color3f(*(_of_all(channel, spp) for channel in emitted))
            flat[some] = np.array(dr.ravel(mean)).reshape(-1, 3)

    def met_through(
        self, sensor: Any, view: View, wanted: Collection[str], at: tuple[float, float]
    ) -> dict[str, Image]:
        """Return what rays through one place of every pixel meet first; see `centres`."""
        eye = self.eye(sensor, view)
        return met_through(self._place, eye, wanted, at, size=_size_of(sensor))

    def owners(self, loaded: LoadedScene) -> Owners:
        """Find whom the faces of the tables belong to, in the frame that is shown."""
        return owners_of(self._tables, loaded)

    def trace(
        self,
        sensor: Any,
        eye: Eye,
        *,
        spp: int,
        seed: int,
        limits: Limits,
        area: PixelArea | None = None,
    ) -> Layers:
        """Trace one pass; it finds the layers of `CHANNELS`, `emitted` of lamps, and `FIRST`.

        Args:
            sensor: One of Mitsuba's, with its sampler.
            eye: What rays come from.
            spp: Samples of a pixel; samplers with a pattern may take some more.
            seed: Of the pass.
            limits: Of its paths.
            area: That is traced; default all of the picture.
        """
        spp = _whole_pattern(sensor, spp)
        width, height = _size_of(sensor)
        area = area or PixelArea((0, height), (0, width))
        columns = area.size[1]
        rows = max(1, min(height, _MOST_LANES // (columns * spp)))
        bounds, halos, parts = limits.bounds(), self._place.halos, []
        if halos is not None:
            halos.look_at(eye, (width, height))
        for top in range(*area.rows, rows):
            count = min(rows, area.rows[1] - top)
            sampler = _seeded(sensor, spp=spp, lanes=columns * count * spp, seed=seed + top)
            index = dr.arange(mi.UInt32, sampler.wavefront_size())
            pixel = self._pixel(index // dr.opaque(mi.UInt32, spp), top, area.columns, width)
            ray = _ray(eye, sampler, pixel, size=(width, height))
            tile = None if halos is None else halos.tile(pixel, dr.opaque(mi.UInt32, width))
            of_all, of_first = followed(self._place, sampler, ray, bounds, tile)
            dr.eval(of_all, of_first)
            means = [_of_all(channel, spp) for channel in of_all]
            means += [_of_first(channel, spp) for channel in of_first]
            parts.append(self._rows(means, (count, columns)))
        if len(parts) == 1:
            return parts[0]
        return merged(parts, lambda *rows: np.concatenate(rows))

    def _pixel(self, number: Any, top: int, columns: tuple[int, int], width: int) -> Any:
        """Return numbers of pixels in the picture by their numbers in some of its rows.

        Args:
            number: Row by row.
            top: The first row.
            columns: The first one, and that after the last one.
            width: Of the picture [px].
        """
        first = dr.opaque(mi.UInt32, top * width + columns[0])
        if self.mirrors is None:
            return number + first
        row = number // dr.opaque(mi.UInt32, columns[1] - columns[0])
        return number + row * dr.opaque(mi.UInt32, width - columns[1] + columns[0]) + first

    def _rows(self, channels: list[Any], size: tuple[int, int]) -> Layers:
        """Return some rows of a picture as layers.

        Args:
            channels: Arrays of Dr.Jit, which also puts those of a layer side by side.
            size: Rows, and columns [px].
        """
        layers = {name: channels[place] for name, place in self._channels.places.items()}
        flat = {
            name: some[0] if len(some) == 1 else dr.ravel(mi.Color3f(*some))
            for name, some in layers.items()
        }
        dr.schedule(flat)
        shapes = {name: size if len(some) == 1 else (*size, 3) for name, some in layers.items()}
        return Layers({name: np.array(one).reshape(shapes[name]) for name, one in flat.items()})


def deposits_of(loaded: LoadedScene, pixel: float) -> Deposits | None:
    """Return what weather leaves on a scene's surfaces; None where it leaves nothing.

    Args:
        loaded: The scene.
        pixel: Angle of a pixel [rad].
    """
    course = loaded.weather
    if course is None or not (course.is_wet or course.is_snowy):
        return None
    return Deposits(course, Grounds(loaded.shelters(), loaded.tracks, loaded.ruts), pixel)


def _of_all(channel: Any, spp: int) -> Any:
    """Return the mean of each pixel's samples, (pixels,)."""
    return dr.block_sum(channel, spp) / dr.opaque(mi.Float, spp)


def _of_first(channel: Any, spp: int) -> Any:
    """Return a channel of each pixel's first sample, (pixels,)."""
    pixel = dr.arange(mi.UInt32, len(channel) // spp)
    return dr.gather(mi.Float, channel, pixel * dr.opaque(mi.UInt32, spp))


def _whole_pattern(sensor: Any, spp: int) -> int:
    """Return how many samples a sensor's sampler takes that is asked for some."""
    pattern = sensor.sampler().clone()
    pattern.set_sample_count(spp)
    return int(pattern.sample_count())


def _seeded(sensor: Any, *, spp: int, lanes: int, seed: int) -> Any:
    """Return a sensor's sampler, ready for a pass whose samples of a pixel are neighbours."""
    sampler = sensor.sampler().clone()
    sampler.set_sample_count(spp)
    sampler.set_samples_per_wavefront(spp)
    sampler.seed(dr.opaque(mi.UInt32, seed % 2**32), lanes)
    return sampler


def rows_of(band: tuple[float, float], height: int) -> tuple[int, int]:
    """Return the first row of a band and that after its last one, of a picture so high [px]."""
    first, last = (round(share * height) for share in band)
    return first, last


def _size_of(sensor: Any) -> tuple[int, int]:
    """Return width, height of a sensor's picture [px]."""
    width, height = (int(size) for size in sensor.film().crop_size())
    return width, height


def _ray(eye: Eye, sampler: Any, pixel: Any, *, size: tuple[int, int]) -> Any:
    """Return rays through pixels, each through some place in it.

    Args:
        eye: What they come from.
        sampler: Where chance comes from.
        pixel: Number of the pixel, row by row.
        size: Width, height of the picture [px].
    """
    jitter = sampler.next_2d()
    width, height = (dr.opaque(mi.UInt32, one) for one in size)
    row = pixel // width
    across = mi.Float(pixel - row * width) + jitter.x
    down = mi.Float(row) + jitter.y
    place = mi.Point2f(across / mi.Float(width), down / mi.Float(height))
    on_lens = sampler.next_2d() if eye.is_blurred else mi.Point2f(0.5)
    return eye.ray(place, on_lens)
