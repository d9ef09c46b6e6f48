"""All lamps of a scene in one set of tables, however many meshes they belong to.

Light is picked and weighed as `render/lights/emitter.py` does it for one mesh.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import drjit as dr
import mitsuba as mi
import numpy as np

from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.render.kernel.tables import Tables
from sumo3dviz_pt.render.kernels import aligned
from sumo3dviz_pt.render.lights.emitter import LampSizes, lamp_sizes
from sumo3dviz_pt.render.loaded import LoadedScene


class LampAim(NamedTuple):
    """A point on a lamp as a lit point sees it.

    Attributes:
        d: Unit, towards it.
        distance: To it [m].
        pdf: Density of that direction, without the choice among emitters [1/sr].
        radiance: Towards the lit point, a colour.
    """

    d: Any
    distance: Any
    pdf: Any
    radiance: Any


class LampTables:
    """The lamps of a loaded scene.

    Args:
        loaded: A scene that shows a frame.
        tables: Of the scene.
    """

    def __init__(self, loaded: LoadedScene, tables: Tables) -> None:
        self._loaded, self._tables, self.names = loaded, tables, tables.lamps
        shapes = {shape.id(): shape for shape in loaded.scene.shapes()}
        self._sizes: list[LampSizes] = [lamp_sizes(shapes[name].emitter()) for name in self.names]
        rows, lamps, cells = [], 0, 0
        self._firsts = []
        for name, size in zip(self.names, self._sizes, strict=True):
            self._firsts.append((lamps, cells))
            first_face = tables.place(name)[1]
            rows.append([size.count, size.units, size.fan, size.cells, lamps, cells, first_face, 0])
            lamps, cells = lamps + size.count, cells + size.cells**2 * size.units
        self._most = max((size.units for size in self._sizes), default=1)
        self._rows = mi.UInt32(aligned(np.array(rows, np.uint32), np.uint32))
        self._radiance, self._axes, self._lobes, self._density, self._chance, self._grid = (
            dr.zeros(mi.Float, width)
            for width in (3 * lamps, 3 * lamps, 2 * lamps, cells, cells, 3 * len(rows))
        )
        self.follow()

    def follow(self) -> None:
        """Bring the tables to what the loaded scene shows."""
        parameters = self._loaded.parameters
        for k, (name, (lamps, cells)) in enumerate(zip(self.names, self._firsts, strict=True)):
            for table, key, first in (
                (self._radiance, "radiance", 3 * lamps),
                (self._axes, "axes", 3 * lamps),
                (self._lobes, "lobes", 2 * lamps),
                (self._density, "density", cells),
                (self._chance, "chance", cells),
                (self._grid, "grid", 3 * k),
            ):
                values = parameters[f"{name}.emitter.{key}"]
                index = dr.arange(mi.UInt32, len(values)) + dr.opaque(mi.UInt32, first)
                dr.scatter(table, values, index)

    def shining(self) -> Floats:
        """Return the corners of all faces whose lamps shine, (n, 3, 3) [m]."""
        parameters = self._loaded.parameters
        found = [np.zeros((0, 3, 3))]
        for name, size in zip(self.names, self._sizes, strict=True):
            vertices = np.asarray(parameters[f"{name}.vertex_positions"]).reshape(-1, 3)
            faces = np.asarray(parameters[f"{name}.faces"]).reshape(-1, 3)
            # Mitsuba's v runs up, ours down.
            v = -np.asarray(parameters[f"{name}.vertex_texcoords"]).reshape(-1, 2)[faces[:, 0], 1]
            lamp = np.minimum((v * size.count).astype(int), size.count - 1)
            radiance = np.asarray(parameters[f"{name}.emitter.radiance"]).reshape(-1, 3)
            found.append(vertices[faces[(radiance[lamp] != 0.0).any(axis=1)]])
        return np.concatenate(found)

    def _row(self, number: Any, active: Any) -> tuple[Any, Any]:
        """Return a mesh's sizes, and where its numbers begin."""
        sizes = dr.gather(mi.Vector4u, self._rows, 2 * number, active)
        return sizes, dr.gather(mi.Vector4u, self._rows, 2 * number + 1, active)

    def _cell(self, number: Any, sizes: Any, place: Any, active: Any) -> Any:
        """Return where the numbers of a place's cell begin, within its mesh's."""
        grid = dr.gather(mi.Vector3f, self._grid, number, active)
        last = mi.Float(sizes.w) - 1.0
        column = mi.UInt32(dr.clip((place.x - grid.x) * grid.z, 0.0, last))
        row = mi.UInt32(dr.clip((place.y - grid.y) * grid.z, 0.0, last))
        return (row * sizes.w + column) * sizes.y

    def _shining(self, lamp: Any, out: Any, active: Any) -> Any:
        """Return the radiance of a lamp into a direction."""
        full = dr.gather(mi.Color3f, self._radiance, lamp, active)
        cosine = dr.dot(out, dr.gather(mi.Vector3f, self._axes, lamp, active))
        lobe = dr.gather(mi.Vector2f, self._lobes, lamp, active)
        share = lobe.x + (1.0 - lobe.x) * dr.exp(lobe.y * (cosine - 1.0))
        return dr.select(active, full * share, 0.0)

    def met(self, number: Any, si: Any, before: Any, active: Any) -> tuple[Any, Any]:
        """Return the radiance of a lamp that a ray met, and the density of aiming there.

        Args:
            number: Of the lamp's mesh.
            si: The point on the lamp.
            before: Where the ray started, an interaction.
            active: Which lanes count.
        """
        sizes, firsts = self._row(number, active)
        out = si.to_world(si.wi)
        cosine = dr.dot(out, si.n)
        front = active & (cosine > 0.0)
        # Mitsuba's v runs up, ours down.
        lamp = dr.minimum(mi.UInt32(-si.uv.y * mi.Float(sizes.x)), sizes.x - 1)
        unit = dr.minimum(mi.UInt32(si.uv.x * mi.Float(sizes.y)), sizes.y - 1)
        cell = self._cell(number, sizes, before.p, active)
        density = dr.gather(mi.Float, self._density, firsts.y + cell + unit, front)
        away = dr.squared_norm(si.p - before.p)
        pdf = dr.select(front, density * away / cosine, 0.0)
        return self._shining(firsts.x + lamp, out, front), pdf

    def aim(self, number: Any, place: Any, sample: Any, active: Any) -> LampAim:
        """Pick a point on a lamp by what lamps give to a place.

        Args:
            number: Of the lamps' mesh.
            place: The lit point.
            sample: Two numbers in [0, 1).
            active: Which lanes count.
        """
        sizes, firsts = self._row(number, active)
        first = firsts.y + self._cell(number, sizes, place, active)

        def chance(k: Any) -> Any:
            return dr.gather(mi.Float, self._chance, first + k, active)

        def below(k: Any) -> Any:
            return (k < sizes.y - 1) & (chance(dr.minimum(k, sizes.y - 1)) < sample.x)

        unit = dr.binary_search(0, self._most - 1, below)
        unit = dr.minimum(unit, sizes.y - 1)
        low = dr.select(unit > 0, chance(dr.maximum(unit, 1) - 1), 0.0)
        left = (sample.x - low) / dr.maximum(chance(unit) - low, 1e-12) * mi.Float(sizes.z)
        part = dr.minimum(mi.UInt32(dr.maximum(left, 0.0)), sizes.z - 1)
        left = dr.clip(left - mi.Float(part), 0.0, 1.0)
        face = firsts.z + unit * sizes.z + part
        return self._towards(
            place,
            face,
            mi.warp.square_to_uniform_triangle(mi.Point2f(left, sample.y)),
            (sizes, firsts.x, dr.gather(mi.Float, self._density, first + unit, active)),
            active,
        )

    def _towards(self, place: Any, face: Any, part: Any, picked: Any, active: Any) -> LampAim:
        """Return a point of a face as a place sees it.

        Args:
            place: The lit point.
            face: Number of the face.
            part: Where in the face, two numbers.
            picked: The mesh's sizes, its first lamp, and the density of points [1/m2].
            active: Which lanes count.
        """
        sizes, first_lamp, density = picked
        tables = self._tables
        corners = tables.corners(face, active)[0]
        a, b, c = (dr.gather(mi.Vector4f, tables.points, corners[k], active) for k in range(3))
        v = dr.gather(mi.Vector4f, tables.normals, corners[0], active).w
        a, b, c = (mi.Vector3f(each.x, each.y, each.z) for each in (a, b, c))
        normal = dr.normalize(dr.cross(b - a, c - a))
        to = a + (b - a) * part.x + (c - a) * part.y - mi.Vector3f(place)
        distance = dr.norm(to)
        d = to / distance
        cosine = -dr.dot(d, normal)
        front = active & (cosine > 0.0)
        pdf = dr.select(front, density * dr.square(distance) / cosine, 0.0)
        lamp = dr.minimum(mi.UInt32(-v * mi.Float(sizes.x)), sizes.x - 1)
        return LampAim(d, distance, pdf, self._shining(first_lamp + lamp, -d, front))
