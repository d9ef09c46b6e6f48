"""All textures of a scene's materials, evaluated by one function.

Bitmaps without repetition lie one after the other in one array of texels; what differs between
them is a row of numbers. So the kernel holds their arithmetic once, whatever their number.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from sumo3dviz_pt.model.scene import Bsdf
from sumo3dviz_pt.render.kernel.skipping import where
from sumo3dviz_pt.render.kernel.tables import Tables
from sumo3dviz_pt.render.kernels import aligned, load
from sumo3dviz_pt.render.materials.pyramid import Pyramid
from sumo3dviz_pt.render.materials.untiled import PLAIN, pyramid_of
from sumo3dviz_pt.render.materials.untiled_shading import Untiled, slide

_AMOUNTS = ("tile", "uneven", "patches", "fields", "roughness", "regular", "wear")
_ROW = 16


@dataclass(frozen=True, slots=True, eq=False)
class Spot:
    """Where a texture is seen; it stands for Mitsuba's surface interaction.

    Attributes:
        uv: Texture coordinates [tiles].
        t: Distance along the ray [m].
        wi: Direction to where the ray came from, in the surface's frame.
        corners: Numbers of the triangle's vertices.
        weights: Of these vertices.
    """

    uv: Any
    t: Any
    wi: Any
    corners: Any
    weights: Any

    @property
    def arrays(self) -> tuple[Any, ...]:
        """All of it, in order."""
        return self.uv, self.t, self.wi, self.corners, self.weights


@dataclass(frozen=True, slots=True, eq=False)
class _Sizes:
    """A pyramid whose numbers are arrays; see `Pyramid`."""

    size: Any
    levels: Any
    mean: Any
    spread: Any


@dataclass(frozen=True, slots=True, eq=False)
class _RowUntiled(Untiled):
    """Bitmaps without repetition, of which every lane has its own.

    Attributes:
        some: Which amounts are above 0 in any of the scene's textures.
        worn: Whether a lane's texture shows wear.
        tables: That tell the wear.
    """

    some: frozenset[str] = frozenset()
    worn: Any = False
    tables: Any = None

    @property
    def average(self) -> list[Any]:
        """Mean of each channel."""
        mean: Any = self.pyramid.mean
        return [mean.x, mean.y, mean.z]

    def has(self, what: str) -> bool:
        """Return whether one of the amounts, by its name, is above 0 in any texture."""
        return what in self.some

    def _copies(self, uv: Any, near: Any) -> tuple[list[Any], list[Any]]:
        """Return how much each shifted copy counts, and by what bits each is shifted."""
        sharp = [weight * weight * weight for weight in near.weights]
        if not self.has("regular"):
            return sharp, list(near.hashes)
        regular = self.regular > 0.0
        alone = [mi.Float(1.0), mi.Float(0.0), mi.Float(0.0)]
        weights = [dr.select(regular, a, b) for a, b in zip(alone, sharp, strict=True)]
        shifts = [dr.select(regular, slide(uv), bits) for bits in near.hashes]
        return weights, shifts

    def _wear_at(self, si: Any, active: Any) -> Any:
        """Return the mesh's wear, in [0, 1] each."""
        return self.tables.wear(si.corners, si.weights, active & self.worn)

    def _worn(self, si: Any, colour: Any, *, relief: Any, noise: Any, active: Any) -> Any:
        """Return a colour with its wear and paint, where a lane's texture shows them."""
        worn = Untiled._worn(self, si, colour, relief=relief, noise=noise, active=active)
        return dr.select(self.worn, worn, colour)

    def _polished(self, si: Any, rough: Any, *, noise: Any, active: Any) -> Any:
        """Return a roughness with its wear and paint, where a lane's texture shows them."""
        polished = Untiled._polished(self, si, rough, noise=noise, active=active)
        return dr.select(self.worn, polished, rough)


class Textures:
    """The textures that a scene's rows refer to.

    Args:
        tables: Of the scene.
        pixel: Angle of a pixel [rad].
    """

    def __init__(self, tables: Tables, pixel: float) -> None:
        self._tables = tables
        self._pixel = dr.opaque(mi.Float, pixel)
        self._bitmaps = [load(dict(value)) for value in tables.textures.bitmaps]
        self._rows, self._texels = _laid_out(tables.textures.untiled)
        worn = tables.worn and any(value.get("wear") for value in tables.textures.untiled)
        amounts = [_amounts(value) for value in tables.textures.untiled]
        self._some = frozenset(
            name for name in _AMOUNTS for some in amounts if some[name] > 0.0
        ) - (frozenset() if worn else {"wear"})

    def at(self, spot: Spot, numbers: Any, *, untiled: Any, bitmap: Any, rough: Any) -> Any:
        """Return colours and roughnesses.

        Args:
            spot: Where.
            numbers: Of each lane's textures: of its colour, and of its roughness.
            untiled: Which lanes' colours come from a bitmap without repetition.
            bitmap: Which lanes' colours come from a plain bitmap.
            rough: Which lanes have a texture of their roughness.
        """
        colour, roughness = mi.Color3f(0.5), mi.Float(0.5)
        if self._texels is not None:
            colour, roughness = where(
                untiled | rough,
                (*spot.arrays, *numbers, untiled, rough),
                self._without_repetition,
                (colour, roughness),
            )
        for number, texture in enumerate(self._bitmaps):
            own = bitmap & (numbers[0] == number)
            (colour,) = where(own, (spot.uv, own), _bitmap(texture), (colour,))
        return colour, roughness

    def _without_repetition(self, *given: Any) -> tuple[Any, Any]:
        """Return colours and roughnesses where a bitmap without repetition is seen.

        Args:
            given: A spot's arrays; numbers of the textures of colour and roughness; which lanes
                have the one and which the other.
        """
        number, rough_number, untiled, rough = given[-4:]
        spot = Spot(*given[:-4])
        colour, roughness = mi.Color3f(0.5), mi.Float(0.5)
        if any("roughness" not in value for value in self._tables.textures.untiled):
            colour = self._row(number, untiled).colour(spot, untiled)
        if "roughness" in self._some:
            roughness = self._row(rough_number, rough).rough(spot, rough)
        return colour, roughness

    def _row(self, number: Any, active: Any) -> _RowUntiled:
        """Return the textures of some numbers."""
        a, b, c, d = (dr.gather(mi.Vector4f, self._rows, 4 * number + k, active) for k in range(4))
        sizes = _Sizes(a.x, a.y, mi.Vector3f(b.x, b.y, b.z), a.z)
        return _RowUntiled(
            sizes,  # type: ignore[arg-type]
            self._texels,
            self._pixel,
            tile=c.x,
            uneven=c.y,
            patches=c.z,
            fields=c.w,
            roughness=d.x,
            wear=True if "wear" in self._some else None,
            regular=d.y,
            first=mi.UInt32(a.w),
            some=self._some,
            worn=active & (d.z > 0.0),
            tables=self._tables,
        )


def _bitmap(texture: Any) -> Any:
    """Return a function that reads one bitmap."""

    def read(uv: Any, active: Any) -> tuple[Any]:
        si = dr.zeros(mi.SurfaceInteraction3f)
        si.uv = uv
        return (mi.Color3f(texture.eval(si, active)),)

    return read


def _amounts(value: Bsdf) -> Mapping[str, float]:
    """Return a texture's amounts by name."""
    return {name: float(value.get(name, PLAIN.get(name, 0.0))) for name in _AMOUNTS}


def _laid_out(values: Sequence[Bsdf]) -> tuple[Any, Any]:
    """Return the rows and the texels of some textures; those of one file share texels."""
    if not values:
        return None, None
    pyramids: dict[str, Pyramid] = {}
    for value in values:
        file = str(value["filename"])
        if file not in pyramids:
            pyramids[file] = pyramid_of(file)
    firsts, begin = {}, 0
    for file, pyramid in pyramids.items():
        firsts[file] = begin
        begin += len(pyramid.texels)
    rows = np.zeros((len(values), _ROW))
    for row, value in zip(rows, values, strict=True):
        file, amounts = str(value["filename"]), _amounts(value)
        pyramid = pyramids[file]
        row[:4] = pyramid.size, pyramid.levels, pyramid.spread, firsts[file]
        row[4:7] = pyramid.mean
        row[8:15] = [amounts[name] for name in _AMOUNTS]
    texels = np.concatenate([pyramid.texels for pyramid in pyramids.values()])
    return mi.Float(aligned(rows, np.float32)), mi.Float(aligned(texels, np.float32))
