"""Which plants of a shot move in its wind: those near enough for that to be seen."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from sumo3dviz_pt.model.camera import CameraPath, in_picture
from sumo3dviz_pt.model.geometry import Floats, Mesh, merge_meshes, settled
from sumo3dviz_pt.model.random import seed_of
from sumo3dviz_pt.model.scene import Part, StaticPart
from sumo3dviz_pt.model.swaying import Swaying, strength_of
from sumo3dviz_pt.model.weather import WeatherCourse

BUDGET = 220_000
"""Triangles of plants that move, at most; the nearest plants come first."""

_FAMILIES = frozenset({"trees", "shrubs"})
_SEEN = 0.5  # how far the highest twigs move where that is worth it [px]
_MOVES = 0.02  # how far they move, by the plant's height
_UNSEEN = 3.0  # plants that only cast shadows into the picture count as so much farther away
_MOST_VIEWS = 40  # that tell how near plants are
_RADIUS = 10.0  # within which a plant and most of its shadow lie [m]
_FADES = 0.35  # share of the reach over which plants move less and less
_ROOT = 0.3  # how deep stems stand in the ground [m]


@dataclass(frozen=True, slots=True)
class _Run:
    """Faces of a part that belong to one plant.

    Attributes:
        plant: Its name.
        faces: Which of the part's.
        vertices: Which of the part's; no other face has any of them.
    """

    plant: str
    faces: slice
    vertices: slice


@dataclass(frozen=True, slots=True, eq=False)
class _Plant:
    """A plant.

    Attributes:
        foot: (3,) [m].
        height: [m].
        triangles: Of all its parts.
    """

    foot: Floats
    height: float
    triangles: int


@dataclass(frozen=True, slots=True, eq=False)
class Windswept:
    """What stands, with plants that move apart from those that do not.

    Attributes:
        static: All of it.
        swaying: How parts move, by their ids.
    """

    static: tuple[StaticPart, ...]
    swaying: Mapping[str, Swaying]


def in_wind(
    static: Sequence[StaticPart],
    weather: WeatherCourse | None,
    camera_path: CameraPath,
    *,
    pixels: float,
    seed: int,
) -> Windswept:
    """Return what stands, with plants that are seen to move apart; all as it is without wind.

    Args:
        static: What stands.
        weather: Over time.
        camera_path: The shot's cameras.
        pixels: Of the diagonal of their picture.
        seed: Of all chance.
    """
    if weather is None or not weather.strongest_wind or not len(camera_path.positions):
        return Windswept(tuple(static), {})
    runs = {part.id: list(_runs(part.part.mesh)) for part in static if part.family in _FAMILIES}
    plants = _plants(part for part in static if part.id in runs)
    far = _MOVES * strength_of(weather.strongest_wind)
    shares = _moving(plants, camera_path, far / (_SEEN * _pixel_angle(camera_path, pixels)))
    parts: list[StaticPart] = []
    swaying: dict[str, Swaying] = {}
    for part in static:
        own = runs.get(part.id, [])
        moving = [run for run in own if shares.get(run.plant, 0.0) > 0.0]
        if not moving:
            parts.append(part)
            continue
        still = [run for run in own if shares.get(run.plant, 0.0) <= 0.0]
        parts += [replace(part, part=_some(part.part, still))] if still else []
        windy = replace(part, id=f"{part.id}/wind", part=_some(part.part, moving))
        parts.append(windy)
        leaves = part.part.material == "leaf"
        swaying[windy.id] = _swaying(moving, plants, shares, seed, leaves=leaves)
    return Windswept(tuple(parts), swaying)


def _runs(mesh: Mesh) -> Iterator[_Run]:
    """Yield the plants of a mesh that was merged of them."""
    at = 0
    for plant, count in mesh.things:
        if count:
            corners = mesh.faces[at : at + count]
            vertices = slice(int(corners.min()), int(corners.max()) + 1)
            yield _Run(plant, slice(at, at + count), vertices)
        at += count


def _plants(parts: Iterable[StaticPart]) -> dict[str, _Plant]:
    """Find where plants stand and how high they are, by their names."""
    lowest: dict[str, Floats] = {}
    tops: dict[str, float] = {}
    faces: dict[str, int] = {}
    for part in parts:
        for run in _runs(part.part.mesh):
            if not run.plant:
                continue
            points = part.part.mesh.vertices[run.vertices]
            foot, top = points[np.argmin(points[:, 2])], float(points[:, 2].max())
            if run.plant not in lowest or foot[2] < lowest[run.plant][2]:
                low = points[points[:, 2] < foot[2] + 0.05].mean(axis=0)
                lowest[run.plant] = np.array([low[0], low[1], foot[2]])
            tops[run.plant] = max(top, tops.get(run.plant, top))
            faces[run.plant] = faces.get(run.plant, 0) + run.faces.stop - run.faces.start
    return {
        name: _Plant(
            foot + np.array([0.0, 0.0, _ROOT]),
            max(tops[name] - float(foot[2]) - _ROOT, 0.3),
            faces[name],
        )
        for name, foot in lowest.items()
    }


def _moving(
    plants: Mapping[str, _Plant], camera_path: CameraPath, worth: float
) -> dict[str, float]:
    """Return how far plants move, by what they would near a camera; 0 far away or over the budget.

    Args:
        plants: All of them, by their names.
        camera_path: The shot's cameras.
        worth: Up to which distance motion is seen, by the plant's height.
    """
    if not plants:
        return {}
    names = sorted(plants)
    heights = np.array([plants[name].height for name in names])
    middles = np.array([plants[name].foot for name in names])
    middles[:, 2] += 0.5 * heights
    away = settled(_distances(camera_path, middles) / (worth * heights))
    order = np.argsort(away, kind="stable")
    spent = np.cumsum([plants[names[k]].triangles for k in order])
    over = int(np.searchsorted(spent, BUDGET, side="right"))
    reach = 1.0 if over >= len(order) else min(1.0, float(away[order[over]]))
    shares = np.clip((reach - away) / (_FADES * max(reach, 1e-9)), 0.0, 1.0)
    return dict(zip(names, settled(shares).tolist(), strict=True))


def _distances(camera_path: CameraPath, middles: Floats) -> Floats:
    """Return how far plants are away from the nearest camera by their middles, (k, 3) [m], (k,)."""
    some = camera_path.slice(
        slice(None, None, max(1, -(-len(camera_path.positions) // _MOST_VIEWS)))
    )
    points = np.broadcast_to(middles[:, None], (len(middles), len(some.positions), 3))
    pictured = in_picture(some, middles, radius=_RADIUS)
    away = some.away(points) * np.where(pictured, 1.0, _UNSEEN)
    return np.asarray(away.min(axis=1))


def _pixel_angle(camera_path: CameraPath, pixels: float) -> float:
    """Return the least angle of a pixel [rad], of a picture with so many on its diagonal."""
    return 2.0 * float(np.clip(camera_path.half_angles.min(), 0.01, 0.5 * np.pi)) / pixels


def _some(part: Part, runs: Sequence[_Run]) -> Part:
    """Return a part with some of its plants."""
    mesh = part.mesh
    pieces = [
        Mesh(
            mesh.vertices[run.vertices],
            mesh.faces[run.faces] - run.vertices.start,
            *(None if each is None else each[run.vertices] for each in (mesh.normals, mesh.uvs)),
            things=((run.plant, run.faces.stop - run.faces.start),),
        )
        for run in runs
    ]
    tint = None if part.tint is None else np.concatenate([part.tint[run.faces] for run in runs])
    return Part(merge_meshes(pieces), part.material, tint)


def _swaying(
    runs: Sequence[_Run],
    plants: Mapping[str, _Plant],
    shares: Mapping[str, float],
    seed: int,
    *,
    leaves: bool,
) -> Swaying:
    """Return how the plants of a part move."""
    own = [plants[run.plant] for run in runs]
    return Swaying(
        feet=np.array([plant.foot for plant in own]),
        heights=np.array([plant.height for plant in own]),
        seeds=np.array([seed_of(seed, run.plant, "wind") for run in runs]),
        shares=np.array([shares[run.plant] for run in runs]),
        vertices=np.array([run.vertices.stop - run.vertices.start for run in runs]),
        leaves=leaves,
    )
