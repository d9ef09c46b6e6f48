"""Makes room for road users that park where something grows, or where an invented car stands.

SUMO moves a vehicle whose stop says `parking="true"` beside its lane, where no file tells of it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from sumo3dviz_pt.cast.fleet import Fleet
from sumo3dviz_pt.model.camera import CameraPath
from sumo3dviz_pt.model.geometry import Bools, Floats, Ints
from sumo3dviz_pt.model.scene import LeftOut, StaticPart
from sumo3dviz_pt.world.build import BuiltPlace
from sumo3dviz_pt.world.objects.stands import Stands
from sumo3dviz_pt.world.town.parked import FAMILY as PARKED

WHOLE = frozenset({PARKED, "trees", "shrubs"})
"""Families of which a thing that is in the way is left out as a whole."""

CUT = frozenset({"hedges", "fences"})
"""Families of which only what is in the way is left out."""

_REACH = 250.0  # from a camera, whom one sees stand in something [m]
_LOW, _HIGH = 0.3, 1.4  # between which a thing is in the way, above the ground [m]
_EVERY = 0.25  # how often road users are looked at [s]
_MOVED = 0.15  # how far they move until they are looked at again [m]
_SPARE = 0.25  # around them is a hedge cut [m]
_CELL = 0.75  # of the ground, in which what may be in the way is found before it is looked at [m]


def with_room(place: BuiltPlace, fleet: Fleet, camera_path: CameraPath) -> BuiltPlace:
    """Return a place without what road users of a shot stand in.

    Lamps, signs and houses stay.

    Args:
        place: What stands.
        fleet: On the ground that is drawn; without its frames' times, nothing is left out.
        camera_path: The shot's cameras.
    """
    taken = TakenGround.by(fleet, camera_path)
    if not len(taken.fronts):
        return place
    gone = dict(_in_the_way(place.static, taken))
    stands = _rest(place.stands, taken)
    count = len(place.stands.movers) - len(stands.movers)
    if not gone and not count:
        return place
    static = tuple(_without(part, gone, taken) for part in place.static)
    whole = [*gone.values(), *["plants"] * count]
    notes = (
        LeftOut(f"{whole.count(family)} {family}", "road users stand there")
        for family in sorted(set(whole))
    )
    return replace(place, static=static, stands=stands, left_out=(*place.left_out, *notes))


@dataclass(frozen=True, eq=False)
class TakenGround:
    """Where road users are in a shot: boxes on the ground.

    Attributes:
        fronts: Middle of the front end, (n, 3) [m].
        ways: Where it looks to, (n, 2).
        sizes: Length and width, (n, 2) [m].
    """

    fronts: Floats
    ways: Floats
    sizes: Floats

    @classmethod
    def by(cls, fleet: Fleet, camera_path: CameraPath) -> TakenGround:
        """Return where road users are near a shot's cameras.

        Args:
            fleet: On the ground that is drawn.
            camera_path: Where cameras are.
        """
        boxes = list(_boxes(fleet))
        if not boxes or not len(camera_path.positions):
            return cls(np.zeros((0, 3)), np.zeros((0, 2)), np.zeros((0, 2)))
        fronts, ways, sizes = (np.concatenate(each) for each in zip(*boxes, strict=True))
        away, _ = cKDTree(camera_path.positions[:, :2]).query(fronts[:, :2])
        near = away < _REACH
        return cls(fronts[near], ways[near], sizes[near])

    def holds(self, points: Floats, spare: float = 0.0) -> Bools:
        """Return which points, (m, 3), are in a box, or so near to one [m]; (m,)."""
        inside = np.zeros(len(points), dtype=np.bool_)
        maybe = self._over(points)
        if not len(maybe):
            return inside
        lengths, widths = 0.5 * self.sizes.T
        middles = self.fronts[:, :2] - lengths[:, None] * self.ways
        reach = float(np.hypot(lengths, widths).max()) + 2.0 * spare
        boxes = cKDTree(middles).query_ball_point(points[maybe, :2], reach)
        for k, near in zip(maybe.tolist(), boxes, strict=True):
            away, way = points[k, :2] - middles[near], self.ways[near]
            up = points[k, 2] - self.fronts[near, 2]
            inside[k] = np.any(
                (np.abs((away * way).sum(axis=1)) < lengths[near] + spare)
                & (np.abs(away[:, 1] * way[:, 0] - away[:, 0] * way[:, 1]) < widths[near] + spare)
                & (up > _LOW)
                & (up < _HIGH)
            )
        return inside

    def _over(self, points: Floats) -> Ints:
        """Return which points, (m, 3), lie above a cell with a box, (k,): few, of a town."""
        if not len(points) or not len(self.fronts):
            return np.zeros(0, np.int64)
        taken, lowest, highest = self._cells
        cells = _cell_of(points)
        at = np.minimum(np.searchsorted(taken, cells), len(taken) - 1)
        up = points[:, 2]
        height = (up > lowest[at] + _LOW) & (up < highest[at] + _HIGH)
        return np.flatnonzero((taken[at] == cells) & height)

    @cached_property
    def _cells(self) -> tuple[Ints, Floats, Floats]:
        """Cells with boxes, ascending, (c,), and the lowest and highest road in each, (c,) [m]."""
        numbers, heights = [], []
        for size in np.unique(self.sizes, axis=0):
            alike = np.flatnonzero((self.sizes == size).all(axis=1))
            along, aside = (_steps(extent + 2.0 * (_SPARE + _CELL)) for extent in size)
            a, b = (grid.ravel() for grid in np.meshgrid(along - 0.5 * size[0], aside))
            way, front = self.ways[alike], self.fronts[alike]
            left = np.stack([-way[:, 1], way[:, 0]], axis=1)
            flat = front[:, None, :2] + a[:, None] * way[:, None] + b[:, None] * left[:, None]
            numbers.append(_cell_of(flat.reshape(-1, 2)))
            heights.append(np.repeat(front[:, 2], len(a)))
        cells, at = np.unique(np.concatenate(numbers), return_inverse=True)
        up = np.concatenate(heights)
        lowest, highest = np.full(len(cells), np.inf), np.full(len(cells), -np.inf)
        np.minimum.at(lowest, at, up)
        np.maximum.at(highest, at, up)
        return cells, lowest, highest


def _steps(extent: float) -> Floats:
    """Places across an extent [m], that leave no cell out."""
    return np.linspace(-0.5 * extent, 0.5 * extent, int(np.ceil(extent / (0.6 * _CELL))) + 1)


def _cell_of(points: Floats) -> Ints:
    """The cell of the ground that points, (n, 2 or 3) [m], lie in, as one number; (n,)."""
    column, row = np.floor(points[:, :2] / _CELL).astype(np.int64).T
    return np.asarray(column * (1 << 31) + row)


def _boxes(fleet: Fleet) -> Iterator[tuple[Floats, Floats, Floats]]:
    """Yield fronts, ways and sizes of each road user, wherever it has moved to."""
    if fleet.times is None or not len(fleet.times):
        return
    begin, end = float(fleet.times[0]), float(fleet.times[-1])
    times = np.linspace(begin, end, 1 + int(np.ceil((end - begin) / _EVERY)))
    for trajectory, body in zip(fleet.trajectories, fleet.bodies, strict=True):
        motion = trajectory.sample(times)
        fronts, yaws = motion.positions[motion.alive], motion.yaws[motion.alive]
        if not len(fronts):
            continue
        steps = np.linalg.norm(np.diff(fronts[:, :2], axis=0), axis=1)
        pieces = np.floor(np.cumsum(steps) / _MOVED)
        fresh = np.concatenate([[True], np.diff(pieces, prepend=0.0) > 0.0])
        fresh[-1] = True
        ways = np.stack([np.cos(yaws), np.sin(yaws)], axis=1)
        yield fronts[fresh], ways[fresh], np.tile(body.size[:2], (int(fresh.sum()), 1))


def _in_the_way(static: Iterable[StaticPart], taken: TakenGround) -> Iterator[tuple[str, str]]:
    """Yield the names and the families of things of which road users stand in some face."""
    for part in static:
        if part.family not in WHOLE | CUT:
            continue
        mesh = part.part.mesh
        hit = np.flatnonzero(taken.holds(_middles(part)))
        ends = np.cumsum([count for _, count in mesh.things])
        for run in np.unique(np.searchsorted(ends, hit, side="right")).tolist():
            if mesh.things and mesh.things[run][0]:
                yield mesh.things[run][0], part.family


def _without(part: StaticPart, gone: Mapping[str, str], taken: TakenGround) -> StaticPart:
    """Return a part without what is in the way."""
    mesh = part.part.mesh
    if not any(gone.get(name) == part.family for name, _ in mesh.things):
        return part
    counts = [count for _, count in mesh.things]
    if part.family in CUT:
        keep = ~taken.holds(_middles(part), _SPARE)
    else:
        keep = np.repeat([name not in gone for name, _ in mesh.things], counts)
    starts = np.cumsum([0, *counts])
    things = tuple(
        (name, int(keep[start:end].sum()))
        for (name, _), start, end in zip(mesh.things, starts[:-1], starts[1:], strict=True)
    )
    tint = None if part.part.tint is None else part.part.tint[keep]
    return replace(
        part,
        part=replace(
            part.part, mesh=replace(mesh, faces=mesh.faces[keep], things=things), tint=tint
        ),
    )


def _middles(part: StaticPart) -> Floats:
    """The middles of a part's faces, (m, 3) [m]."""
    mesh = part.part.mesh
    return np.asarray(mesh.vertices[mesh.faces].mean(axis=1))


def _rest(stands: Stands, taken: TakenGround) -> Stands:
    """Return the plants that nobody stands in."""
    if not stands.movers:
        return stands
    feet = np.array([mover.world_from_body.matrix[:3, 3] for mover in stands.movers])
    feet[:, 2] += 0.5 * (_LOW + _HIGH)
    free = (~taken.holds(feet, _SPARE)).tolist()
    if all(free):
        return stands
    movers = tuple(mover for mover, stays in zip(stands.movers, free, strict=True) if stays)
    seeds = tuple(seed for seed, stays in zip(stands.seeds, free, strict=True) if stays)
    return replace(stands, movers=movers, seeds=seeds)
