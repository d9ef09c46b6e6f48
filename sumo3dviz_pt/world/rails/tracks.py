"""Rails and sleepers: solid ones in ballast and grass, flush ones with grooves in streets.

Heads of rails in streets and grass are as high as roads are. Ballast is so, too, so that
the heads of rails on it are 14 cm higher; before level crossings and streets they come down.

References:
    Rails 60 E1 on ballast and 60 R2 with a groove in streets: EN 13674-1 and EN 14811.
    What lies below the sleepers' tops is not drawn.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import shapely

from sumo3dviz_pt.library.mesh.bands import band_along, offset
from sumo3dviz_pt.library.street.barriers import quad_mesh, swept, upright_boxes
from sumo3dviz_pt.model.geometry import Floats, Mesh, arc_length, merge_meshes
from sumo3dviz_pt.model.numbers import eased
from sumo3dviz_pt.model.scene import Part, StaticPart
from sumo3dviz_pt.world.roads.layout import RoadLayout
from sumo3dviz_pt.world.roads.markings.lines import Paint
from sumo3dviz_pt.world.roads.strips import (
    BALLAST,
    GRASS_TRACK,
    BoundsXY,
    Strip,
    distance_to,
    lane_line,
)

HEAD, RUST, GROOVE, SLEEPER = "rail_head", "rail_rust", "rail_groove", "sleeper"

GAUGE = 1.435
"""Standard gauge between the rails' inner faces [m] (UIC 510)."""

_WIDTH = 0.072  # of a rail's head [m]
_TOP, _FOOT = 0.012, -0.108  # of a rail's head and its foot, from where wheels roll [m]
RISE, _RAMP = 0.14, 14.0  # how high wheels roll on ballast, and how long tracks rise there [m]
_FLUSH = (0.058, 0.03)  # width of the groove inside a head and of the joint outside it [m]
_GRASS_TOP = 0.03  # height of a rail's head above grass [m]
SLEEPER_EVERY, _SLEEPER_TOP = 0.6, -0.1
_BESIDE = 1.0  # from a track's middle to what belongs to it [m]
_SLEEPER_SIZE = (2.6, 0.25)  # length and width [m]

# Half a profile from the foot to the head: across and up [m].
_PROFILE = ((0.075, _FOOT), (0.075, -0.096), (0.012, -0.08), (0.009, -0.045), (0.036, -0.026))
_HALF = 0.5 * _WIDTH

_PIECE = 33 * SLEEPER_EVERY  # length of pieces of track that are as fine as each other [m]
_NEAR, _MIDDLE = 130.0, 600.0  # up to these distances rails and sleepers are solid, or flat [m]


@dataclass(frozen=True, slots=True, eq=False)
class _Track:
    """A lane's track.

    Attributes:
        strip: The lane.
        bed: Surface that it lies in.
    """

    strip: Strip
    bed: str

    @property
    def solid(self) -> bool:
        """Whether its rails stand out of their bed."""
        return self.bed in {BALLAST, GRASS_TRACK}


def flush_paint(layout: RoadLayout) -> list[Paint]:
    """Draw rails that lie in streets: two bright heads, each with a dark groove and joint."""
    groove, joint = _FLUSH
    inner, outer = 0.5 * GAUGE, 0.5 * GAUGE + _WIDTH
    heads: list[Paint] = []
    grooves: list[Paint] = []
    for track in _tracks(layout):
        if track.solid:
            continue
        line, owner = lane_line(track.strip.lane), track.strip.lane.edge_id
        for paint, material, low, high in (
            (heads, HEAD, inner, outer),
            (grooves, GROOVE, inner - groove, outer + joint),
        ):
            quads = [band_along(line, right=r, left=g).whole() for r, g in
                     ((-high, -low), (low, high))]  # fmt: skip
            paint.append(Paint(owner, material, np.concatenate(quads)))
    return [*heads, *grooves]


def track_rise(layout: RoadLayout) -> Callable[[Floats], Floats] | None:
    """Return how high trains roll above roads at points, (n, 2) -> (n,) [m].

    It is `RISE` on ballast and falls to 0 where the same kind of track lies in a street.
    None is returned where no track lies in ballast.
    """
    tracks = [track for track in _tracks(layout) if "tram" not in track.strip.lane.allowed]
    lines = [shapely.LineString(track.strip.lane.shape[:, :2]) for track in tracks]
    solid = np.array([track.bed == BALLAST for track in tracks], dtype=np.bool_)
    if not solid.any():
        return None
    flush = shapely.STRtree([line for line, up in zip(lines, solid, strict=True) if not up])
    ballast = shapely.STRtree([line for line, up in zip(lines, solid, strict=True) if up])
    return RailHeight(flush, ballast)


@dataclass(frozen=True, slots=True, eq=False)
class RailHeight:
    """Tells the height of rails.

    Attributes:
        flush: Tracks in streets.
        ballast: Those in ballast.
    """

    flush: shapely.STRtree
    ballast: shapely.STRtree

    def __call__(self, places: Floats) -> Floats:
        """Return the height of rails at places, (n, 2) -> (n,) [m]."""
        spots = shapely.points(np.asarray(places, dtype=np.float64)[:, :2])
        share = np.zeros(len(spots))
        share[np.unique(self.ballast.query(spots, predicate="dwithin", distance=_BESIDE)[0])] = 1.0
        (spot, _), away = self.flush.query_nearest(
            spots, max_distance=_RAMP, return_distance=True, all_matches=False
        )
        share[spot] *= np.clip((away - _BESIDE) / (_RAMP - _BESIDE), 0.0, 1.0)
        return np.asarray(eased(share, RISE))


def track_parts(
    layout: RoadLayout, rise: Callable[[Floats], Floats] | None, focus: BoundsXY | None
) -> list[StaticPart]:
    """Build rails and sleepers of tracks in ballast and grass.

    Args:
        layout: The roads.
        rise: What `track_rise` gave.
        focus: Box around the camera's path [m], near which they are finer; or None.
    """
    by_material: dict[str, list[Mesh]] = {}
    for track in _tracks(layout):
        if not track.solid:
            continue
        for piece in _pieces(lane_line(track.strip.lane)):
            away = float(distance_to(focus, piece).min())
            if track.bed == BALLAST and rise is not None:
                piece = piece + rise(piece)[:, None] * np.array([0.0, 0.0, 1.0])
            for material, mesh in _piece(piece, track.bed, away).items():
                by_material.setdefault(material, []).append(mesh)
    return [
        StaticPart(f"rails/{material}", "roads", Part(merge_meshes(meshes), material))
        for material, meshes in sorted(by_material.items())
    ]


def _tracks(layout: RoadLayout) -> Iterator[_Track]:
    """All tracks; inside junctions they lie in what the junction is made of."""
    for group in layout.strips.values():
        yield from (_Track(strip, strip.look.surface) for strip in group if strip.look.rails)
    surfaces = dict(zip(layout.cells.owners, layout.cells.surfaces, strict=True))
    for key, inside in layout.insides.items():
        bed = surfaces.get(key, BALLAST)
        yield from (_Track(strip, bed) for strip in inside.ways if strip.look.rails)


def _pieces(line: Floats) -> list[Floats]:
    """Cut a line into pieces of 33 sleepers, each (k, 3) [m], k >= 2."""
    at = arc_length(line[:, :2])
    ends = [*np.arange(0.0, at[-1], _PIECE).tolist(), float(at[-1])]
    pieces = []
    for low, high in pairwise(ends):
        inner = at[(at > low + 0.02) & (at < high - 0.02)]
        third = low + (high - low) * np.arange(1, 4) / 4
        spots = np.unique(np.concatenate([[low], inner, third, [high]]))
        pieces.append(np.column_stack([np.interp(spots, at, column) for column in line.T]))
    return [piece for piece in pieces if np.hypot(*np.ptp(piece[:, :2], axis=0)) > 0.02]


def _piece(line: Floats, bed: str, away: float) -> dict[str, Mesh]:
    """Rails and sleepers of a piece of track so far from the camera [m], by material."""
    lift = np.array([0.0, 0.0, _GRASS_TOP - _TOP if bed == GRASS_TRACK else 0.0])
    sides = [offset(line, side * (0.5 * GAUGE + _HALF)) + lift for side in (-1.0, 1.0)]
    heads = [_head(side) for side in sides]
    parts = {HEAD: merge_meshes(heads)}
    if away < _MIDDLE:
        parts[RUST] = merge_meshes([_body(side, solid=away < _NEAR) for side in sides])
        if bed == BALLAST:
            parts[SLEEPER] = _sleepers(line, solid=away < _NEAR)
    return parts


def _head(line: Floats) -> Mesh:
    """The bright top of a rail."""
    band = band_along(line + np.array([0.0, 0.0, _TOP]), right=-0.6 * _HALF, left=0.6 * _HALF)
    return quad_mesh(band.whole())


def _body(line: Floats, *, solid: bool) -> Mesh:
    """The rusty rest of a rail."""
    shoulder = [(_HALF, -0.02), (_HALF, _TOP - 0.004), (0.62 * _HALF, _TOP - 0.001)]
    half = [*_PROFILE, *shoulder] if solid else [(_HALF, _FOOT), (_HALF, _TOP - 0.002)]
    profile = np.array([*half, *((-x, z) for x, z in half[::-1])])
    return swept(line, profile)


def _sleepers(line: Floats, *, solid: bool) -> Mesh:
    """Sleepers every 0.6 m below a piece of track."""
    at = arc_length(line[:, :2])
    spots = np.arange(0.5 * SLEEPER_EVERY, at[-1], SLEEPER_EVERY)
    points = np.column_stack([np.interp(spots, at, column) for column in line.T])
    step = np.diff(line, axis=0)
    which = np.clip(np.searchsorted(at, spots) - 1, 0, len(step) - 1)
    yaws = np.arctan2(step[which, 1], step[which, 0])
    half_long, half_wide = 0.5 * _SLEEPER_SIZE[0], 0.5 * _SLEEPER_SIZE[1]
    low = (-half_wide, -half_long, _SLEEPER_TOP - 0.12)
    high = (half_wide, half_long, _SLEEPER_TOP)
    if solid:
        return upright_boxes(points, low, high, yaws=yaws)
    along = np.column_stack([np.cos(yaws), np.sin(yaws), 0.0 * yaws])
    left = np.column_stack([-along[:, 1], along[:, 0], 0.0 * yaws])
    points = points + np.array([0.0, 0.0, _SLEEPER_TOP])
    corners = [(-1, 1), (-1, -1), (1, -1), (1, 1)]
    return quad_mesh(
        np.stack([points + a * half_wide * along + b * half_long * left for a, b in corners], 1)
    )
