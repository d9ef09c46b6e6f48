"""How paths aim at lamps and meet them, and where lamps and mirrors need more samples.

Many samples are traced where lamps may be seen directly, and only there. Most lamps are smaller
than a pixel and need them, but all together they cover a small part of a picture. So every face of
a lamp that shines is projected, and rays are traced through the pixels around it.

Mirrors get more samples because frames around cannot help there. What a mirror shows moves unlike
the mirror, and by no motion that one could follow back to the frame before. So its pixels are
averaged over their own samples alone. They are few: rectangles around the mirrors of the vehicle
that a camera rides in.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import drjit as dr
import mitsuba as mi
import numpy as np

from sumo3dviz_pt.model.geometry import Bools, Floats, Ints
from sumo3dviz_pt.model.layers import PixelArea
from sumo3dviz_pt.model.lens import Lens
from sumo3dviz_pt.model.scene import View
from sumo3dviz_pt.render.convert import faces_of
from sumo3dviz_pt.render.kernel.tables import Tables
from sumo3dviz_pt.render.kernels import aligned
from sumo3dviz_pt.render.lights.picks import LampPicks
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
        picks: How they shine and are picked.
        tables: Of the scene.
    """

    def __init__(self, picks: LampPicks, tables: Tables) -> None:
        self._picks, self._tables = picks, tables
        firsts = np.array([tables.place(name)[1] for name in picks.names])
        self._first_faces = mi.UInt32(aligned(firsts, np.uint32))

    def given(self, number: Any, column: Any, line: Any, *, of: int, active: Any) -> Any:
        """Return what a mesh of lamps gives to a cell; arguments as in `LampPicks.given`."""
        return self._picks.given(number, column, line, of=of, active=active)

    def met(self, number: Any, si: Any, before: Any, active: Any) -> tuple[Any, Any]:
        """Return the radiance of a lamp that a ray met, and the density of aiming there.

        Args:
            number: Of the lamp's mesh.
            si: The point on the lamp.
            before: Where the ray started, an interaction.
            active: Which lanes count.
        """
        out = si.to_world(si.wi)
        cosine = dr.dot(out, si.n)
        front = active & (cosine > 0.0)
        density = self._picks.density(number, si.uv.x, before.p, front)
        away = dr.squared_norm(si.p - before.p)
        pdf = dr.select(front, density * away / cosine, 0.0)
        return self._picks.shining(number, si.uv.y, out, front), pdf

    def aim(self, number: Any, place: Any, sample: Any, active: Any) -> LampAim:
        """Pick a point on a lamp by what lamps give to a place.

        Args:
            number: Of the lamps' mesh.
            place: The lit point.
            sample: Two numbers in [0, 1).
            active: Which lanes count.
        """
        picked = self._picks.pick(number, place, sample.x, active)
        face = picked.face + dr.gather(mi.UInt32, self._first_faces, number, active)
        part = mi.warp.square_to_uniform_triangle(mi.Point2f(picked.left, sample.y))
        return self._towards(place, face, part, (number, picked.density), active)

    def _towards(self, place: Any, face: Any, part: Any, picked: Any, active: Any) -> LampAim:
        """Return a point of a face as a place sees it.

        Args:
            place: The lit point.
            face: Number of the face.
            part: Where in the face, two numbers.
            picked: Number of the mesh, and the density of points [1/m2].
            active: Which lanes count.
        """
        number, density = picked
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
        return LampAim(d, distance, pdf, self._picks.shining(number, v, -d, front))


_NEAREST = 0.01  # faces that reach behind the eye are cut here [m]
_BEYOND = 1e6  # projected points are kept within this of the picture [px]


def covered(
    corners: Floats, view: View, size: tuple[int, int], *, thinner: float = np.inf
) -> Bools:
    """Return the pixels that triangles may cover, (h, w); others are surely free of them.

    Args:
        corners: In the network's coordinates, (n, 3, 3) [m].
        view: Of the camera.
        size: Width, height [px].
        thinner: Only those count that are narrower or lower than this in a sharp picture [px].
    """
    width, height = size
    seen = (corners - view.position) @ view.world_from_camera.matrix[:3, :3]
    there = np.zeros((height, width), dtype=np.bool_)
    for part, lens in view.lens.halves(size):
        there[part] = _covered(seen, lens, view.lens.eye_size(size), thinner)
    return there


def _covered(seen: Floats, lens: Lens, size: tuple[int, int], thinner: float) -> Bools:
    """Return the pixels of one eye's picture that triangles may cover, (h, w).

    Args:
        seen: Corners in the camera's frame, (n, 3, 3) [m].
        lens: Of the eye.
        size: Width, height [px].
        thinner: As in `covered`.
    """
    width, height = size
    if lens.is_straight:
        seen = seen[(seen[..., 0] > _NEAREST).any(axis=1)]
    row, column = _spans(seen, lens, size, thinner)
    inside = (row[1] >= 0) & (row[0] < height) & (column[1] >= 0) & (column[0] < width)
    top, bottom = np.clip(row[:, inside], 0, height - 1)
    left, right = np.clip(column[:, inside], 0, width - 1)
    # Each rectangle is written by its corners; sums along both axes fill it.
    edges = np.zeros((height + 1, width + 1), np.int32)
    for rows, columns, sign in (
        (top, left, 1),
        (top, right + 1, -1),
        (bottom + 1, left, -1),
        (bottom + 1, right + 1, 1),
    ):
        np.add.at(edges, (rows, columns), sign)
    return np.asarray(edges.cumsum(axis=0).cumsum(axis=1)[:-1, :-1] > 0)


def _spans(seen: Floats, lens: Lens, size: tuple[int, int], thinner: float) -> tuple[Ints, Ints]:
    """Return the first and last rows, and columns, of triangles in a picture, (2, n) each.

    Args:
        seen: Corners in the camera's frame, (n, 3, 3) [m].
        lens: Of one eye.
        size: Width, height [px].
        thinner: As in `covered`; where only a bound is known, a triangle counts as thin.
    """
    if lens.is_straight:
        low, high = _ends_ahead(seen, lens, size)
    else:
        low, high = _ends_around(seen, lens, size)
    extents = high - low
    thin = (extents < thinner).any(axis=0) | ~np.isfinite(extents).all(axis=0)
    # A slanting line is wide and high, too, and yet thin.
    thin |= _thickness(seen, lens, size[0]) < thinner
    seen, low, high = seen[thin], low[:, thin], high[:, thin]
    # Whole numbers are at pixels' centres; one pixel more is kept for rounding.
    room = 1.0 + _blur(seen, lens, size[0])
    spans = np.clip(np.stack([np.floor(low) - room, np.ceil(high) + room]), -_BEYOND, _BEYOND)
    return spans[:, 0].astype(int), spans[:, 1].astype(int)


def _ends_ahead(seen: Floats, lens: Lens, size: tuple[int, int]) -> tuple[Floats, Floats]:
    """Return the first, and the last row and column of triangles before a plane picture, (2, n)."""
    # Where an edge of a face passes the eye, it lies between the face's corners.
    cut = seen.copy()
    cut[..., 0] = _NEAREST
    places = lens.project(np.concatenate([seen, cut], axis=1), size)[0]
    ahead = seen[..., 0] > _NEAREST
    reaches_behind = (~ahead).max(axis=1, keepdims=True)
    counts = np.concatenate([ahead, np.broadcast_to(reaches_behind, ahead.shape)], axis=1)
    low = np.where(counts, places, np.inf).min(axis=-1)
    high = np.where(counts, places, -np.inf).max(axis=-1)
    return low, high


def _ends_around(seen: Floats, lens: Lens, size: tuple[int, int]) -> tuple[Floats, Floats]:
    """Return the same for other pictures, whose lines are curves and may go round behind."""
    places = lens.project(seen, size)[0]
    low, high = places.min(axis=-1), places.max(axis=-1)
    # Lamps are small: where one takes up much of the picture, it is near, or cut by its edge.
    wide = (high - low > 0.25 * np.array(size[::-1])[:, None]).any(axis=0)
    bend = 0.25 * (high - low).max(axis=0)
    return np.where(wide, -np.inf, low - bend), np.where(wide, np.inf, high + bend)


def _thickness(seen: Floats, lens: Lens, width: int) -> Floats:
    """Return the least height of triangles, as large as they look from before, (n,) [px]."""
    edges = np.roll(seen, -1, axis=1) - seen
    doubled = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
    longest = np.linalg.norm(edges, axis=2).max(axis=1, initial=1e-12)
    return np.asarray(doubled / longest / (_away(seen) * lens.pixel_width(width)))


def _away(seen: Floats) -> Floats:
    """Return how far the nearest corners of triangles are from the eye, (n,) [m]."""
    return np.asarray(np.maximum(np.linalg.norm(seen, axis=-1).min(axis=1, initial=np.inf), 0.1))


def _blur(seen: Floats, lens: Lens, width: int) -> Floats:
    """Return the radius into which a lens blurs triangles, (n,) [px]."""
    if lens.aperture == 0.0:
        return np.zeros(len(seen))
    apart = np.abs(1.0 / _away(seen) - 1.0 / lens.focus)
    return np.asarray(np.ceil(lens.aperture * apart / lens.pixel_width(width)))


_LEAST = 100
"""Pixels of a mirror that is worth it."""

_MOST = 0.1
"""Share of the picture that all mirrors together may take; larger ones are left out."""

_SAME = 1e-5
"""Corners nearer to each other than this are one [m]."""


class Mirrors:
    """Finds the mirrors in a view.

    Args:
        loaded: A scene that shows a frame.
        names: Names of the meshes of mirrors, by the body that they are part of.
    """

    def __init__(self, loaded: LoadedScene, names: Iterable[tuple[str, str]]) -> None:
        self._loaded = loaded
        self._by_body: Mapping[str, Sequence[Floats]] = {
            body: _pieces(loaded.parameters, name) for body, name in names
        }

    def areas(self, view: View, size: tuple[int, int]) -> tuple[PixelArea, ...]:
        """Return a rectangle around each mirror that is seen, the largest ones first.

        Args:
            view: Of the camera, in the frame that the scene shows.
            size: Width, height of the picture [px].
        """
        areas = [PixelArea.around(covered(panes, view, size)) for panes in self._panes()]
        large = [area for area in areas if area is not None and area.pixels >= _LEAST]
        chosen, room = [], _MOST * size[0] * size[1]
        for area in sorted(large, key=lambda each: -each.pixels):
            if area.pixels <= room:
                chosen.append(area)
                room -= area.pixels
        return tuple(chosen)

    def covered(self, view: View, size: tuple[int, int]) -> Bools:
        """Return the pixels that mirrors may cover, (h, w); arguments as in `areas`."""
        panes = [np.zeros((0, 3, 3)), *self._panes()]
        return covered(np.concatenate(panes), view, size)

    def _panes(self) -> Iterator[Floats]:
        """Go through the triangles of all mirrors in the frame, (n, 3, 3) each [m]."""
        pool, origin = self._loaded.pool, self._loaded.origin
        assert pool is not None and origin is not None, "show a frame first"
        for slot in pool.shown:
            matrix = pool.placed[slot][0]
            for piece in self._by_body.get(pool.body_of_slot[slot], ()):
                yield piece @ matrix[:3, :3].T + matrix[:3, 3] + origin


def _pieces(parameters: Mapping[str, object], name: str) -> list[Floats]:
    """Return the triangles of each connected piece of a mesh, (n, 3, 3) each [m]."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    vertices = np.array(parameters[f"{name}.vertex_positions"], dtype=np.float64).reshape(-1, 3)
    faces: Ints = faces_of(parameters, name).astype(np.int64)
    # Where a mesh is flat, each face has corners of its own.
    _, same = np.unique(np.round(vertices / _SAME), axis=0, return_inverse=True)
    corners = same.reshape(-1)[faces]
    pairs = (corners[:, [0, 1]].ravel(), corners[:, [1, 2]].ravel())
    joined = coo_array((np.ones(len(pairs[0])), pairs), shape=(len(vertices), len(vertices)))
    piece = connected_components(joined, directed=False)[1][corners[:, 0]]
    return [vertices[faces[piece == number]] for number in np.unique(piece)]
