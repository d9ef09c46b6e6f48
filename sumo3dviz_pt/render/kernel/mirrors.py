"""Where mirrors are seen: frames around cannot help there, so these places get more samples.

What a mirror shows moves unlike the mirror, and by no motion that one could follow back to the
frame before. So its pixels are averaged over their own samples alone. They are few: rectangles
around the mirrors of the vehicle that a camera rides in.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence

import numpy as np

from sumo3dviz_pt.model.areas import PixelArea
from sumo3dviz_pt.model.geometry import Bools, Floats, Ints
from sumo3dviz_pt.model.scene import View
from sumo3dviz_pt.render.kernel.glow import covered
from sumo3dviz_pt.render.loaded import LoadedScene

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
        found = [PixelArea.around(covered(panes, view, size)) for panes in self._panes()]
        large = [area for area in found if area is not None and area.pixels >= _LEAST]
        kept, room = [], _MOST * size[0] * size[1]
        for area in sorted(large, key=lambda each: -each.pixels):
            if area.pixels <= room:
                kept.append(area)
                room -= area.pixels
        return tuple(kept)

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
    faces: Ints = np.array(parameters[f"{name}.faces"], dtype=np.int64).reshape(-1, 3)
    # Where a mesh is flat, each face has corners of its own.
    _, same = np.unique(np.round(vertices / _SAME), axis=0, return_inverse=True)
    corners = same.reshape(-1)[faces]
    pairs = (corners[:, [0, 1]].ravel(), corners[:, [1, 2]].ravel())
    joined = coo_array((np.ones(len(pairs[0])), pairs), shape=(len(vertices), len(vertices)))
    piece = connected_components(joined, directed=False)[1][corners[:, 0]]
    return [vertices[faces[piece == number]] for number in np.unique(piece)]
