"""What a ray met: the point, its frame, and the material there."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import drjit as dr
import mitsuba as mi

from sumo3dviz_pt.render.kernel.deposits import Deposits
from sumo3dviz_pt.render.kernel.exposure import Spot as Place
from sumo3dviz_pt.render.kernel.lobes import Finish, Lobes
from sumo3dviz_pt.render.kernel.rows import Kind, kinds_of, lobes_of
from sumo3dviz_pt.render.kernel.tables import Tables
from sumo3dviz_pt.render.kernel.textures import Spot, Textures
from sumo3dviz_pt.render.materials.paint import dusty
from sumo3dviz_pt.render.materials.stained import BRIGHTEST


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
    """

    si: Any
    finish: Finish
    there: Any
    foreign: Any
    lamps: Any
    face: Any


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

    @property
    def numbered(self) -> bool:
        """Whether pictures say what moves."""
        return self._tables.numbered

    @property
    def foreign(self) -> bool:
        """Whether any material is Mitsuba's own."""
        return Kind.FOREIGN in self.kinds

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
        uv = mi.Point2f(hit.prim_uv)
        weights = mi.Vector3f(1.0 - uv.x - uv.y, uv.x, uv.y)
        a, b, c = (dr.gather(mi.Vector4f, tables.points, corners[k], there) for k in range(3))
        p = _mixed(weights, a, b, c)
        normal = dr.normalize(dr.cross(_three(b) - _three(a), _three(c) - _three(a)))
        na, nb, nc = (dr.gather(mi.Vector4f, tables.normals, corners[k], there) for k in range(3))
        shading = _smoothed(_mixed(weights, na, nb, nc), normal, smooth)
        paint, own, instanced = mi.Color3f(0.5), p, mi.Bool(False)
        if tables.instanced:
            rows, paint, instanced = tables.instance(hit, there)
            p = dr.select(instanced, _moved(rows, p), p)
            normal = dr.select(instanced, _turned(rows, normal), normal)
            shading = dr.select(instanced, _turned(rows, shading), shading)
        si = dr.zeros(mi.SurfaceInteraction3f)
        si.t = dr.select(there, hit.t, dr.inf)
        si.p, si.n, si.sh_frame = mi.Point3f(p), mi.Normal3f(normal), mi.Frame3f(shading)
        si.uv = mi.Point2f(
            dr.dot(weights, mi.Vector3f(a.w, b.w, c.w)),
            dr.dot(weights, mi.Vector3f(na.w, nb.w, nc.w)),
        )
        si.wi = dr.select(there, si.to_local(-ray.d), -ray.d)
        spot = Spot(si.uv, si.t, si.wi, corners, weights)
        finish, kind = self._finish(spot, face=face, material=material, paint=paint, there=there)
        if self._deposits is not None:
            moves = (instanced | tables.moves(face), instanced, self._parked(hit, there))
            place = Place(p, own, shading, -ray.d, si.t, kind, *moves, there)
            finish = _weathered(self._deposits, finish, place, si)
        foreign = there & _has(kind, Kind.FOREIGN) if self.foreign else mi.Bool(False)
        return Surface(si, finish, there, foreign, lamps, face)

    def _parked(self, hit: Any, active: Any) -> Any:
        """Return whether a ray met who never moves; only snow asks."""
        if not self._tables.instanced or self._deposits is None or not self._deposits.snowy:
            return mi.Bool(False)
        return self._tables.parked(hit, active)

    def _finish(
        self, spot: Spot, *, face: Any, material: Any, paint: Any, there: Any
    ) -> tuple[Finish, Any]:
        """Return the material at a point, and what is special about it."""
        tables, lobes = self._tables, self.lobes
        gloss, more, gain = tables.row(material, there)
        kind = mi.UInt32(gloss.x)
        looks = tables.looks(face, there)
        colour, roughness = mi.Color3f(looks.x, looks.y, looks.z), looks.w
        if Kind.PAINTED in self.kinds:
            painted = _has(kind, Kind.PAINTED)
            colour = dr.select(painted, dusty(paint, spot.uv), colour)
        textured = Kind.UNTILED | Kind.BITMAP
        if self.kinds & (textured | Kind.ROUGH):
            numbers = (mi.UInt32(more.y), mi.UInt32(more.z))
            texel, rough = self._textures.at(
                spot,
                numbers,
                untiled=there & _has(kind, Kind.UNTILED),
                bitmap=there & _has(kind, Kind.BITMAP),
                rough=there & _has(kind, Kind.ROUGH),
            )
            if Kind.STAINED in self.kinds:
                stained = colour * texel * mi.Color3f(gain.x, gain.y, gain.z)
                stain = _has(kind, Kind.STAINED)
                texel = dr.select(stain, dr.minimum(stained, BRIGHTEST), texel)
            if Kind.SEASONED in self.kinds:
                gained = dr.minimum(texel * mi.Color3f(gain.x, gain.y, gain.z), BRIGHTEST)
                texel = dr.select(_has(kind, Kind.SEASONED), gained, texel)
            colour = dr.select(_has(kind, textured), texel, colour)
            roughness = dr.select(_has(kind, Kind.ROUGH), rough, roughness)
        dull = mi.Bool(False)
        if lobes.leaves or lobes.matts:
            dull = _has(kind, Kind.MATT | Kind.LEAF)
        metallic = tables.metallic(face, there) if lobes.metals else mi.Float(0.0)
        finish = Finish(
            lobes=lobes,
            colour=colour,
            roughness=roughness,
            metallic=metallic,
            eta=gloss.y,
            coat=gloss.z,
            coat_roughness=gloss.w,
            through=more.x,
            glossy=dr.select(dull, mi.Float(0.0), 1.0),
            matt=_has(kind, Kind.MATT) if lobes.matts else mi.Bool(False),
            open=_has(kind, Kind.OPEN),
            mirror=_has(kind, Kind.MIRROR) if lobes.mirrors else mi.Bool(False),
        )
        return finish, kind


def _weathered(deposits: Deposits, finish: Finish, place: Place, si: Any) -> Finish:
    """Return a material with what weather left on it, and turn its frame accordingly."""
    finish, shading = deposits.covered(finish, place)
    si.sh_frame = mi.Frame3f(shading)
    si.wi = dr.select(place.active, si.to_local(place.wi), place.wi)
    return finish


def _has(kind: Any, what: Kind) -> Any:
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
