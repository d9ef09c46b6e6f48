"""Laws of the cameras that `init` proposes, whatever the network; each yields what breaks it.

What stands around them is what was built, not what the proposals reckon with.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from sumo3dviz_pt.job.settings import CameraSettings, CinematicCamera, EulerianCamera
from sumo3dviz_pt.model.geometry import Bools, Floats, Ints, unit
from sumo3dviz_pt.model.scene import StaticPart
from sumo3dviz_pt.model.traffic import Scenario
from sumo3dviz_pt.world.placement.lanes import LaneIndex

ABOVE = 2.0
"""Eyes are at least so high above what lies below them [m]."""

NEAR = 10.0
"""What is nearer than this fills much of a picture [m]."""

FILLED = 0.4
"""At most this share of a picture is filled by what is near."""

LITTLE = 0.04
"""At most this share of a picture is hidden by near things of one kind along streets."""

ALIVE = 0.5
"""In at least this share of a shot's seconds somebody is in the picture."""

COVERED = 1.0 / 6.0
"""No plant of ours covers more than this share of the middle of a picture."""

VEILED = 0.15
"""Our planting hides at most this share of the near roads in the middle of a picture."""

_SEEN = 150.0
"""Road users farther away than this are too small to count [m]."""

_FAR = 60.0
"""Roads farther away than this are small [m]."""

_RATIO = 9.0 / 16.0
_CELLS = (48, 27)  # of a picture, across and down
_PLANTED = ":planted:"  # in the names of things that our code plants
_STREET = ("street lamps", "signs", "furniture")
_HOUSES = ("street_fronts", "buildings", "homes", "shops", "blocks")


@dataclass(frozen=True, slots=True, eq=False)
class Pose:
    """Where a camera stands at a time.

    Attributes:
        eye: (3,) [m].
        target: What it looks at, (3,) [m].
        fov: Horizontal opening angle [deg].
    """

    eye: Floats
    target: Floats
    fov: float

    def rays(self, x: Floats, y: Floats) -> Floats:
        """Return directions through points of the picture, x and y in [-1, 1], (n, 3)."""
        ahead, right, up = self.axes()
        half = np.tan(np.radians(self.fov) / 2.0)
        return unit(ahead + half * x[:, None] * right + half * _RATIO * y[:, None] * up)

    def axes(self) -> tuple[Floats, Floats, Floats]:
        """Return unit vectors ahead, to the right and up."""
        ahead = unit(self.target - self.eye)
        right = unit(np.cross(ahead, [0.0, 0.0, 1.0]))
        return ahead, right, np.cross(right, ahead)


def poses_of(camera: CameraSettings) -> list[Pose]:
    """Return the poses of a camera that stands, or those of a flight's key frames."""
    if isinstance(camera, EulerianCamera):
        frames = [camera]
    elif isinstance(camera, CinematicCamera):
        frames = list(camera.keyframes)
    else:
        return []
    fov = float(camera.lens.fov)
    return [Pose(np.array(k.position), np.array(k.look_at), fov) for k in frames]


def badly_placed(pose: Pose, static: Sequence[StaticPart]) -> Iterator[str]:
    """Yield if an eye is too low above what lies below it, or inside of a house."""
    x, y, z = pose.eye
    down, up = (np.array([[0.0, 0.0, turn]]) for turn in (-1.0, 1.0))
    triangles = {part.id: _around(part, pose.eye, 0.01, plan=True) for part in static}
    for name, some in triangles.items():
        below = float(_hits(pose.eye + np.array([0.0, 0.0, 0.5]), down, some)[0]) - 0.5
        if below < ABOVE:
            yield f"the eye ({x:.2f}, {y:.2f}, {z:.2f}) is {below:.2f} m above {name}"
        houses = name.split("/")[0] in _HOUSES
        if houses and np.isfinite(_hits(pose.eye, up, some)[0]):
            yield f"the eye ({x:.2f}, {y:.2f}, {z:.2f}) is below {name}"


def filled(pose: Pose, static: Sequence[StaticPart]) -> Iterator[str]:
    """Yield if what is near fills too much of a picture."""
    x, y = np.meshgrid(np.linspace(-0.96, 0.96, 25), np.linspace(-0.93, 0.93, 15))
    rays = pose.rays(x.ravel(), y.ravel())
    some = np.concatenate([_around(part, pose.eye, NEAR, plan=False) for part in static])
    share = float((_hits(pose.eye, rays, some) < NEAR).mean())
    if share > FILLED:
        yield f"{100 * share:.0f} % of the picture is nearer than {NEAR:g} m"


def furnished(pose: Pose, static: Sequence[StaticPart]) -> Iterator[str]:
    """Yield what stands along streets, is near and hides more than a little of a picture.

    Heads of traffic lights stand where the network wants them: proposals look past them, and
    notes tell of them.
    """
    for part in static:
        if part.family in _STREET:
            share = _share(pose, _around(part, pose.eye, NEAR, plan=False))
            if share > LITTLE:
                yield f"{part.id} nearer than {NEAR:g} m hides {100 * share:.0f} % of the picture"


@dataclass(frozen=True, slots=True, eq=False)
class Plants:
    """What our code planted, looked at by its corners: leaves are smaller than a picture's cells.

    Attributes:
        names: Of the plants.
        owners: Whose each part is, its place among the names, (n,).
        corners: Of each part's faces, (m, 3) [m].
        balls: Around each part, middle and radius, (n, 4) [m].
    """

    names: tuple[str, ...]
    owners: Ints
    corners: tuple[Floats, ...]
    balls: Floats

    @classmethod
    def among(cls, static: Sequence[StaticPart]) -> Plants:
        """Find them among all that was built, once for many pictures."""
        numbers: dict[str, int] = {}
        owners, corners, balls = [], [], []
        for part in static:
            mesh, begin = part.part.mesh, 0
            for name, count in mesh.things:
                faces, begin = mesh.faces[begin : begin + count], begin + count
                if _PLANTED in name and count:
                    own = mesh.vertices[faces].reshape(-1, 3)
                    middle = 0.5 * (own.min(axis=0) + own.max(axis=0))
                    owners.append(numbers.setdefault(name, len(numbers)))
                    corners.append(own)
                    balls.append([*middle, 0.5 * np.linalg.norm(np.ptp(own, axis=0))])
        found = np.array(balls, dtype=float).reshape(-1, 4)
        return cls(tuple(numbers), np.array(owners, dtype=np.int64), tuple(corners), found)


def planted(pose: Pose, plants: Plants, lanes: LaneIndex) -> Iterator[str]:
    """Yield plants of ours that fill much of a picture, and if they hide much of its roads."""
    names, (away, cells, owners) = plants.names, _plants_in(pose, plants)
    near = _cells_of(owners, cells, away < 1.4 * NEAR, many=len(names))
    middle = 4.0 * _cells_of(owners, cells, _middle()[cells], many=len(names))
    for one in np.flatnonzero((near > LITTLE) | (middle > COVERED)):
        yield (
            f"{names[one]}, {away[owners == one].min():.1f} m away, covers"
            f" {100 * near[one]:.0f} % of the picture from near,"
            f" and {100 * middle[one]:.0f} % of its middle"
        )
    road = _roads_in(pose, lanes)
    before = np.full(len(road), np.inf)
    np.minimum.at(before, cells, away)
    seen = _middle() & (road < _FAR)
    hidden = float((before < road)[seen].mean()) if seen.any() else 0.0
    if hidden > VEILED:
        yield f"plants hide {100 * hidden:.0f} % of the roads in the middle of the picture"


def _cells_of(owners: Ints, cells: Ints, chosen: Bools, *, many: int) -> Floats:
    """Which share of a picture's cells the chosen corners of each owner lie in, (many,)."""
    count = int(np.prod(_CELLS))
    pairs = np.unique(owners[chosen] * count + cells[chosen])
    return np.bincount(pairs // count, minlength=many) / count


def _plants_in(pose: Pose, plants: Plants) -> tuple[Floats, Ints, Ints]:
    """Of corners of our plants in a picture: distances [m], cells, and whose they are."""
    chosen = np.flatnonzero(_may_show(pose, plants.balls))
    corners = [np.zeros((0, 3)), *(plants.corners[one] for one in chosen)]
    way = np.concatenate(corners) - pose.eye
    counts = [len(some) for some in corners[1:]]
    owners = np.repeat(plants.owners[chosen], counts)
    depth, x, y = (way @ axis for axis in pose.axes())
    half = np.tan(np.radians(pose.fov) / 2.0) * np.maximum(depth, 0.05)
    x, y = x / half, y / half / _RATIO
    inside = (depth > 0.05) & (np.abs(x) < 1.0) & (np.abs(y) < 1.0)
    across, down = _CELLS
    column, row = ((0.5 * (v[inside] + 1.0) * n).astype(int) for v, n in ((x, across), (y, down)))
    away = np.linalg.norm(way[inside], axis=1)
    return away, row * across + column, owners[inside]


def _may_show(pose: Pose, balls: Floats) -> Bools:
    """Whether balls, (n, 4), reach into a picture; most plants are beside it."""
    depth, x, y = ((balls[:, :3] - pose.eye) @ axis for axis in pose.axes())
    half, reach = np.tan(np.radians(pose.fov) / 2.0), balls[:, 3] + 0.01
    within = depth > -reach
    for beside, tangent in ((x, half), (y, half * _RATIO)):
        within &= np.abs(beside) - tangent * depth < reach * np.hypot(1.0, tangent)
    return np.asarray(within)


def _middle() -> Bools:
    """Which cells of a picture lie in its middle half, both ways."""
    row, column = np.divmod(np.arange(np.prod(_CELLS)), _CELLS[0])
    return (np.abs(column - 0.5 * (_CELLS[0] - 1)) < 0.25 * _CELLS[0]) & (
        np.abs(row - 0.5 * (_CELLS[1] - 1)) < 0.25 * _CELLS[1]
    )


def _roads_in(pose: Pose, lanes: LaneIndex) -> Floats:
    """How far away the road is in each cell of a picture [m]; infinite where there is none."""
    across, down = _CELLS
    x, y = np.meshgrid((np.arange(across) + 0.5) / across, (np.arange(down) + 0.5) / down)
    rays = pose.rays(2.0 * x.ravel() - 1.0, 2.0 * y.ravel() - 1.0)
    level = lanes.heights(pose.eye[None, :2])
    for _ in range(3):
        # Where the land rises or falls, the road is found in steps.
        away = (level - pose.eye[2]) / np.minimum(rays[:, 2], -1e-6)
        places = pose.eye + away[:, None] * rays
        level = lanes.heights(places[:, :2])
    return np.where((away < _FAR) & lanes.covers(places[:, :2]), away, np.inf)


def _share(pose: Pose, triangles: Floats) -> float:
    """Which share of a picture triangles, (n, 3, 3) [m], cover, by their projection."""
    half = np.tan(np.radians(pose.fov) / 2.0)
    depth, x, y = ((triangles - pose.eye) @ axis for axis in pose.axes())
    before = (depth > 0.05).all(axis=1)
    flat = np.stack([x[before], y[before]], axis=2) / depth[before][..., None]
    picture = shapely.box(-half, -half * _RATIO, half, half * _RATIO)
    seen = shapely.union_all(shapely.polygons(flat), grid_size=1e-6)
    return float(shapely.intersection(seen, picture).area / picture.area)


def lonely(poses: Sequence[Pose], span: tuple[float, float], scenario: Scenario) -> Iterator[str]:
    """Yield if nobody is in the picture for too much of a shot.

    Args:
        poses: Evenly spread over the shot.
        span: First and last time of the shot [s].
        scenario: With its log.
    """
    step = min(1.0, scenario.traffic.step)
    times = np.arange(span[0], span[1] - 1e-6, step)
    alive = np.zeros(len(times), dtype=np.bool_)
    for trace in scenario.traffic.traces:
        for row, time in enumerate(times):
            at = int(np.searchsorted(trace.times, time - 0.5 * step))
            there = at < len(trace.times) and trace.times[at] < time + 0.5 * step
            pose = poses[min(int(len(poses) * row / len(times)), len(poses) - 1)]
            alive[row] |= bool(there and _pictured(trace.positions[at], pose))
    if alive.mean() < ALIVE:
        yield f"somebody is in the picture for {100 * alive.mean():.0f} % of the shot"


def _pictured(place: Floats, pose: Pose) -> bool:
    """Whether a road user at a place is in a picture and near enough to count."""
    way = place + np.array([0.0, 0.0, 0.8]) - pose.eye
    depth, x, y = (float(way @ axis) for axis in pose.axes())
    half = np.tan(np.radians(pose.fov) / 2.0) * depth
    return 0.5 < depth < _SEEN and abs(x) < half and abs(y) < half * _RATIO


def _around(part: StaticPart, eye: Floats, reach: float, *, plan: bool) -> Floats:
    """Triangles whose boxes come near an eye, (n, 3, 3) [m]; in plan, whatever their height."""
    vertices, faces = part.part.mesh.vertices, part.part.mesh.faces
    for axis in range(2 if plan else 3):
        # By yes and no of each vertex: most parts have nothing near, and are millions of faces.
        for fits in (vertices[:, axis] < eye[axis] + reach, vertices[:, axis] > eye[axis] - reach):
            if not fits.all():
                faces = faces[fits[faces].any(axis=1)] if fits.any() else faces[:0]
    return np.asarray(vertices[faces], dtype=np.float64)


def _hits(eye: Floats, rays: Floats, triangles: Floats) -> Floats:
    """Distance to the first triangle along unit rays, (n,) [m]; inf where there is none.

    References:
        Moeller and Trumbore 1997, doi 10.1080/10867651.1997.10487468.
    """
    found = np.full(len(rays), np.inf)
    if not len(triangles):
        return found
    first, one, other = triangles[:, 0], *(triangles[:, k] - triangles[:, 0] for k in (1, 2))
    way = eye - first
    for number, ray in enumerate(rays):
        across = np.cross(ray, other)
        volume = (one * across).sum(axis=1)
        with np.errstate(divide="ignore", invalid="ignore"):
            u = (way * across).sum(axis=1) / volume
            turned = np.cross(way, one)
            v = (turned @ ray) / volume
            away = (other * turned).sum(axis=1) / volume
        inside = (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0) & (away > 0.0)
        found[number] = away[inside].min(initial=np.inf)
    return found
