"""What a ray met: the point, its frame, and the material there with its textures.

One function evaluates all textures of a scene's materials. Bitmaps without repetition lie one after
the other in one array of texels; what differs between them is a row of numbers. So the kernel holds
their arithmetic once, whatever their number.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from sumo3dviz_pt.model.scene import Bsdf
from sumo3dviz_pt.render.cabins import cabin_frame, cabin_seen, lens_seen
from sumo3dviz_pt.render.draped import draped_texture, is_draped
from sumo3dviz_pt.render.kernel.deposits import Deposits
from sumo3dviz_pt.render.kernel.grounds import Spot as Place
from sumo3dviz_pt.render.kernel.lights import where
from sumo3dviz_pt.render.kernel.lobes import Finish, Lobes
from sumo3dviz_pt.render.kernel.rows import MaterialKind, kinds_of, lobes_of
from sumo3dviz_pt.render.kernel.tables import Tables
from sumo3dviz_pt.render.kernels import aligned, aligned_zeros, load
from sumo3dviz_pt.render.paint import BRIGHTEST, Paint, aged, dusty, effect, soiled
from sumo3dviz_pt.render.rooms import inward, seen_through
from sumo3dviz_pt.render.textures import PLAIN, Pyramid, Untiled, pyramid_of, slide
from sumo3dviz_pt.render.weathering import weathering

_AMOUNTS = ("tile", "uneven", "patches", "fields", "roughness", "regular", "wear")
_ROW = 16


@dataclass(frozen=True, slots=True, eq=False)
class TextureSpot:
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
        self._bitmaps = [
            (load(draped_texture(value) if is_draped(value) else dict(value)), is_draped(value))
            for value in tables.textures.bitmaps
        ]
        self._rows, self._texels = _laid_out(tables.textures.untiled)
        worn = tables.worn and any(value.get("wear") for value in tables.textures.untiled)
        amounts = [_amounts(value) for value in tables.textures.untiled]
        self._some = frozenset(
            name for name in _AMOUNTS for some in amounts if some[name] > 0.0
        ) - (frozenset() if worn else {"wear"})

    def at(self, spot: TextureSpot, numbers: Any, *, untiled: Any, bitmap: Any, rough: Any) -> Any:
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
        for number, (texture, draped) in enumerate(self._bitmaps):
            own = bitmap & (numbers[0] == number)
            seen = (spot.uv, spot.t, own) if draped else (spot.uv, own)
            (colour,) = where(own, seen, _bitmap(texture), (colour,))
        return colour, roughness

    def _without_repetition(self, *inputs: Any) -> tuple[Any, Any]:
        """Return colours and roughnesses where a bitmap without repetition is seen.

        Args:
            inputs: A spot's arrays; numbers of the textures of colour and roughness; which lanes
                have the one and which the other.
        """
        number, rough_number, untiled, rough = inputs[-4:]
        spot = TextureSpot(*inputs[:-4])
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

    def read(uv: Any, *more: Any) -> tuple[Any]:
        si, active = dr.zeros(mi.SurfaceInteraction3f), more[-1]
        si.uv = uv
        if len(more) > 1:
            si.t = more[0]
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
    # Written once: they are the largest arrays of a scene beside its sky.
    texels = aligned_zeros((sum(len(each.texels) for each in pyramids.values()), 4), np.float32)
    for file, pyramid in pyramids.items():
        firsts[file] = begin
        begin += len(pyramid.texels)
        texels[firsts[file] : begin] = pyramid.texels
    rows = np.zeros((len(values), _ROW))
    for row, value in zip(rows, values, strict=True):
        file, amounts = str(value["filename"]), _amounts(value)
        pyramid = pyramids[file]
        row[:4] = pyramid.size, pyramid.levels, pyramid.spread, firsts[file]
        row[4:7] = pyramid.mean
        row[8:15] = [amounts[name] for name in _AMOUNTS]
    return mi.Float(aligned(rows, np.float32)), mi.Float(texels.ravel())


@dataclass(frozen=True, slots=True, eq=False)
class Surface:
    """What a ray met, as arrays of Dr.Jit.

    Attributes:
        si: Point, frame and direction, in Mitsuba's words; without shape and derivatives.
        finish: The material there.
        there: Whether a surface was met at all.
        foreign: Whether its material is Mitsuba's own.
        lamps: Number of the mesh of lamps that was met, from 1; else 0.
        face: Number of the face.
        shine: How bright a lit room is there against its mean; None in scenes without rooms.
    """

    si: Any
    finish: Finish
    there: Any
    foreign: Any
    lamps: Any
    face: Any
    shine: Any = None


@dataclass(frozen=True, slots=True, eq=False)
class _Glass:
    """Where and how a ray meets glass, as arrays of Dr.Jit.

    Attributes:
        own: The point in the body's frame [m].
        flat: The face's normal in that frame.
        d: Direction of the ray in the world.
        rows: Of the matrix of the instance that was hit; None in scenes without instances.
        instanced: Whether there is one.
        use: What is random in a road user, [0, 1).
    """

    own: Any
    flat: Any
    d: Any
    rows: Any
    instanced: Any
    use: Any

    def turned_back(self) -> Any:
        """Return the ray's direction in the body's frame, of unit length."""
        rows = self.rows
        return dr.normalize(
            self.d.x * _three(rows[0]) + self.d.y * _three(rows[1]) + self.d.z * _three(rows[2])
        )


class Surfaces:
    """Finds what rays met.

    Args:
        tables: Of the scene.
        pixel: Angle of a pixel [rad].
        deposits: What weather leaves on surfaces, or None.
    """

    def __init__(self, tables: Tables, pixel: float, deposits: Deposits | None = None) -> None:
        self._tables, self._deposits = tables, deposits
        self.kinds = kinds_of(tables.rows)
        self.lobes: Lobes = lobes_of(tables.rows, metals=tables.metals)
        if deposits is not None and deposits.snowy:
            self.lobes = replace(self.lobes, matts=True)
        self._textures = Textures(tables, pixel)
        self._pixel = dr.opaque(mi.Float, pixel)

    @property
    def numbered(self) -> bool:
        """Whether pictures say what moves."""
        return self._tables.numbered

    @property
    def foreign(self) -> bool:
        """Whether any material is Mitsuba's own."""
        return MaterialKind.FOREIGN in self.kinds

    def mover(self, hit: Any, surface: Surface, active: Any) -> Any:
        """Return the number of the moving part that was hit; 0 for what stands."""
        number = self._tables.mover(hit, surface.face, active)
        if not self.lobes.mirrors:
            return number
        return dr.select(active & surface.finish.mirror, self._tables.mirrored, number)

    def met(self, hit: Any, ray: Any, active: Any) -> Surface:
        """Return what a ray met.

        Args:
            hit: Mitsuba's preliminary intersection.
            ray: The ray.
            active: Which lanes count.
        """
        tables = self._tables
        first, lamps, there = tables.mesh_of(hit, active & hit.is_valid())
        face = first + hit.prim_index
        corners, material, smooth = tables.corners(face, there)
        weights = mi.Vector3f(1.0 - hit.prim_uv.x - hit.prim_uv.y, hit.prim_uv.x, hit.prim_uv.y)
        p, normal, shading, uv = _spanned(tables, corners, weights, there)
        shading = _smoothed(shading, normal, smooth)
        paint = Paint(mi.Color3f(0.5), mi.Float(0.0), mi.Float(0.0))
        rows, own, flat, instanced = None, p, normal, mi.Bool(False)
        if tables.instanced:
            rows, paint, instanced = tables.instance(hit, there)
            p = dr.select(instanced, _moved(rows, p), p)
            normal = dr.select(instanced, _turned(rows, normal), normal)
            shading = dr.select(instanced, _turned(rows, shading), shading)
        si = dr.zeros(mi.SurfaceInteraction3f)
        si.t = dr.select(there, hit.t, dr.inf)
        si.p, si.n, si.sh_frame = mi.Point3f(p), mi.Normal3f(normal), mi.Frame3f(shading)
        si.uv = uv
        si.wi = dr.select(there, si.to_local(-ray.d), -ray.d)
        spot = TextureSpot(si.uv, si.t, si.wi, corners, weights)
        finish, kind = self._finish(
            spot, face=face, material=material, paint=paint, own=own, there=there
        )
        finish, shine = self._through_panes(finish, kind, spot, inward(-ray.d, normal), there)
        glass = _Glass(own, flat, ray.d, rows, instanced, paint.use)
        finish = self._behind_glass(finish, kind, spot, glass, there)
        if self._deposits is not None:
            moves = (instanced | tables.moves(face), instanced, self._parked(hit, there))
            place = Place(p, own, shading, -ray.d, si.t, kind, *moves, there)
            finish = _weathered(self._deposits, finish, place, si)
        foreign = there & _has(kind, MaterialKind.FOREIGN) if self.foreign else mi.Bool(False)
        return Surface(si, finish, there, foreign, lamps, face, shine)

    def _aged(self, share: Any, kind: Any, spot: TextureSpot, there: Any) -> Any:
        """Return textures over their means with what weather did to walls."""
        if MaterialKind.WEATHERED not in self.kinds:
            return share
        old = there & _has(kind, MaterialKind.WEATHERED)
        place = self._tables.wear(spot.corners, spot.weights, old)
        args = (mi.Point2f(spot.uv), mi.Color3f(place))
        (factor,) = where(old, args, weathering, (mi.Color3f(1.0),))
        return dr.select(old, aged(share, factor), share)

    def _through_panes(
        self, finish: Finish, kind: Any, spot: TextureSpot, ray: Any, there: Any
    ) -> tuple[Finish, Any]:
        """Return a material with the room behind a pane, and how bright that is if it is lit."""
        if MaterialKind.ROOMS not in self.kinds:
            return finish, None
        room = there & _has(kind, MaterialKind.ROOMS)
        place = self._tables.wear(spot.corners, spot.weights, room)
        plain = (finish.colour, mi.Color3f(1.0))
        args = (place, mi.Vector3f(ray), finish.colour, spot.t)
        colour, shine = where(room, args, seen_through, plain)
        return replace(finish, colour=colour), shine

    def _behind_glass(
        self, finish: Finish, kind: Any, spot: TextureSpot, glass: _Glass, there: Any
    ) -> Finish:
        """Return a material with the cabin behind a car's pane, and the depth of a lamp."""
        colour = finish.colour
        if MaterialKind.CABIN in self.kinds:
            pane = there & _has(kind, MaterialKind.CABIN)
            numbers = mi.Vector2f(spot.uv.x, -spot.uv.y)
            ahead = cabin_frame(numbers, glass.rows, glass.instanced)
            place = self._tables.wear(spot.corners, spot.weights, pane)
            args = (mi.Vector3f(place), numbers, ahead, mi.Vector3f(glass.d), glass.use)
            (colour,) = where(pane, args, cabin_seen, (colour,))
        if MaterialKind.LENS in self.kinds and glass.rows is not None:
            lens = there & _has(kind, MaterialKind.LENS) & glass.instanced
            size = spot.t * self._pixel
            args = (mi.Vector3f(glass.own), glass.turned_back(), glass.flat, colour, size)
            (colour,) = where(lens, args, lens_seen, (colour,))
        return replace(finish, colour=colour)

    def _parked(self, hit: Any, active: Any) -> Any:
        """Return whether a ray met who never moves; only snow asks."""
        if not self._tables.instanced or self._deposits is None or not self._deposits.snowy:
            return mi.Bool(False)
        return self._tables.parked(hit, active)

    def _grime(
        self, kind: Any, spot: TextureSpot, own: Any, use: Any, there: Any
    ) -> tuple[Any, Any]:
        """Return whether something is painted in its road user's colour, and how dirty, [0, 1]."""
        painted = _has(kind, MaterialKind.PAINTED)
        if MaterialKind.PAINTED not in self.kinds:
            return painted, mi.Float(0.0)
        args = (mi.Point2f(spot.uv), mi.Vector3f(own), use)
        return painted, where(there & painted, args, soiled, (mi.Float(0.0),))[0]

    def _finish(
        self, spot: TextureSpot, *, face: Any, material: Any, paint: Any, own: Any, there: Any
    ) -> tuple[Finish, Any]:
        """Return the material at a point, and what is special about it."""
        tables, lobes = self._tables, self.lobes
        gloss, more, gain = tables.row(material, there)
        kind = mi.UInt32(gloss.x)
        looks = tables.looks(face, there)
        colour, roughness = mi.Color3f(looks.x, looks.y, looks.z), looks.w
        painted, grime = self._grime(kind, spot, own, paint.use, there)
        if MaterialKind.PAINTED in self.kinds:
            colour = dr.select(painted, dusty(paint.colour, grime), colour)
        textured = MaterialKind.UNTILED | MaterialKind.BITMAP
        if self.kinds & (textured | MaterialKind.ROUGH):
            numbers = (mi.UInt32(more.y), mi.UInt32(more.z))
            texel, rough = self._textures.at(
                spot,
                numbers,
                untiled=there & _has(kind, MaterialKind.UNTILED),
                bitmap=there & _has(kind, MaterialKind.BITMAP),
                rough=there & _has(kind, MaterialKind.ROUGH),
            )
            if MaterialKind.STAINED in self.kinds:
                share = self._aged(texel * mi.Color3f(gain.x, gain.y, gain.z), kind, spot, there)
                stain = _has(kind, MaterialKind.STAINED)
                texel = dr.select(stain, dr.minimum(colour * share, BRIGHTEST), texel)
            if MaterialKind.SEASONED in self.kinds:
                gained = dr.minimum(texel * mi.Color3f(gain.x, gain.y, gain.z), BRIGHTEST)
                texel = dr.select(_has(kind, MaterialKind.SEASONED), gained, texel)
            colour = dr.select(_has(kind, textured), texel, colour)
            roughness = dr.select(_has(kind, MaterialKind.ROUGH), rough, roughness)
        dull = mi.Bool(False)
        if lobes.leaves or lobes.matts:
            dull = _has(kind, MaterialKind.MATT | MaterialKind.LEAF)
        metallic = tables.metallic(face, there) if lobes.metals else mi.Float(0.0)
        if lobes.coats:
            flop = dr.select(painted, gloss.z * paint.flop, more.w)
            colour, metallic = effect(colour, metallic, spot.wi.z, flop)
        finish = Finish(
            lobes=lobes,
            colour=colour,
            roughness=roughness,
            metallic=metallic,
            eta=gloss.y,
            # Dust dulls a coat.
            coat=gloss.z * (1.0 - 0.6 * grime),
            coat_roughness=gloss.w + 0.35 * grime,
            through=more.x,
            glossy=dr.select(dull, mi.Float(0.0), 1.0),
            matt=_has(kind, MaterialKind.MATT) if lobes.matts else mi.Bool(False),
            open=_has(kind, MaterialKind.OPEN),
            mirror=_has(kind, MaterialKind.MIRROR) if lobes.mirrors else mi.Bool(False),
        )
        return finish, kind


def _weathered(deposits: Deposits, finish: Finish, place: Place, si: Any) -> Finish:
    """Return a material with what weather left on it, and turn its frame accordingly."""
    finish, shading = deposits.covered(finish, place)
    si.sh_frame = mi.Frame3f(shading)
    si.wi = dr.select(place.active, si.to_local(place.wi), place.wi)
    return finish


def _spanned(tables: Tables, corners: Any, weights: Any, active: Any) -> tuple[Any, ...]:
    """Return place, face's normal, mixed normal and texture coordinates of a point of a face."""
    a, b, c = (dr.gather(mi.Vector4f, tables.points, corners[k], active) for k in range(3))
    normal = dr.normalize(dr.cross(_three(b) - _three(a), _three(c) - _three(a)))
    na, nb, nc = (dr.gather(mi.Vector4f, tables.normals, corners[k], active) for k in range(3))
    uv = mi.Point2f(
        dr.dot(weights, mi.Vector3f(a.w, b.w, c.w)), dr.dot(weights, mi.Vector3f(na.w, nb.w, nc.w))
    )
    return _mixed(weights, a, b, c), normal, _mixed(weights, na, nb, nc), uv


def _has(kind: Any, what: MaterialKind) -> Any:
    """Return whether a material is any of some kinds."""
    return (kind & int(what)) != 0


def _three(vector: Any) -> Any:
    """Return the first three of four numbers."""
    return mi.Vector3f(vector.x, vector.y, vector.z)


def _mixed(weights: Any, a: Any, b: Any, c: Any) -> Any:
    """Return the weighted sum of three corners' first three numbers."""
    return _three(a) * weights.x + _three(b) * weights.y + _three(c) * weights.z


def _smoothed(mixed: Any, normal: Any, smooth: Any) -> Any:
    """Return the shading normal; users' meshes may have normals of no length, or that are NaN."""
    length = dr.norm(mixed)
    return dr.select(smooth & (length > 0.0), mixed / length, normal)


def _moved(rows: Any, p: Any) -> Any:
    """Return a point of a body in the world."""
    return mi.Vector3f(*(dr.dot(_three(row), p) + row.w for row in rows))


def _turned(rows: Any, normal: Any) -> Any:
    """Return a body's normal in the world: by the inverse transpose, as bodies are stretched."""
    x, y, z = (_three(row) for row in rows)
    turned = (dr.dot(dr.cross(y, z), normal), dr.dot(dr.cross(z, x), normal))
    return dr.normalize(mi.Vector3f(*turned, dr.dot(dr.cross(x, y), normal)))
