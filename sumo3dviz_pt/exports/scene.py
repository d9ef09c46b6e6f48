"""A scene at one time, or over a stretch of it, as a tree of things that other tools can show.

Things stand, or move along a track: where they are at each time, whether they are there, and how
much of each pose they show. Lamps are things that are there while they shine.

Everything is in metres from an origin near the cameras, x east, y north, z up.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.exports.looks import Geometry, Look, Piece, pieces_of
from sumo3dviz_pt.job.cameras import CameraSettings
from sumo3dviz_pt.job.settings import Job
from sumo3dviz_pt.model.geometry import Bools, Colour, Floats, Ints, Mesh, merge_meshes
from sumo3dviz_pt.model.progress import Doing, announce
from sumo3dviz_pt.model.scene import (
    ORIGIN_GRID,
    OWN,
    Bsdf,
    LampSet,
    Mover,
    Part,
    Prototype,
    VehicleLamp,
)

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

    from sumo3dviz_pt.pipeline.reading import Ground
    from sumo3dviz_pt.shot.build import Shot

REACH = 400.0
"""Road users farther than this from all cameras are left out [m]."""

MOST_TIMES = 5000
"""Times of a track, at most."""

_GREY: Colour = (0.5, 0.5, 0.5)
_WHITEST = 0.85
_GLOW = 6.0  # brightest channel of a lamp that shines, against a sunlit white wall
_PANE_GLOW = 1.5  # of what shines all the time, such as lit windows
_CORNERS = 12  # of a vehicle's lamp
_FROM_CAMERA = np.array([[0.0, 0.0, -1.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
_LENS = Look(colour=(0.03, 0.03, 0.03), roughness=0.12, name="lens")


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """How a thing moves.

    Attributes:
        matrices: Placements in its parent's frame, (t, 4, 4), or (1, 4, 4) where it stands.
        there: Whether it is there, (t,) or (1,).
        weights: Of its poses, (t, p); None for what is rigid.
    """

    matrices: Floats
    there: Bools
    weights: Floats | None = None

    @property
    def moves(self) -> bool:
        """Whether its placement changes."""
        return bool(np.ptp(self.matrices, axis=0).any())


@dataclass(frozen=True, slots=True, eq=False)
class Exported:
    """A thing.

    Attributes:
        name: Such as `vehicle:flow_0.3`, and unique.
        family: What a user would call it, such as `roads`.
        pieces: What it shows.
        track: How it moves; None stands in its parent's frame.
        colours: What its pieces' looks are multiplied with, by role.
        children: Things in its frame.
        owner: Id of the road user that it is a part of; empty for all else.
    """

    name: str
    family: str
    pieces: tuple[Piece, ...]
    track: Track | None = None
    colours: Mapping[str, Colour] = field(default_factory=dict)
    children: tuple[Exported, ...] = ()
    owner: str = ""

    def look(self, piece: Piece) -> Look:
        """Return a piece's look in this thing's colours."""
        if not piece.role:
            return piece.look
        factor = self.colours.get(piece.role, _GREY if piece.role == OWN else (1.0, 1.0, 1.0))
        pairs = zip(piece.look.colour, factor, strict=True)
        red, green, blue = (min(a * b, _WHITEST) for a, b in pairs)
        return replace(piece.look, colour=(red, green, blue))


@dataclass(frozen=True, slots=True, eq=False)
class ExportedCamera:
    """A camera of the scene file.

    Attributes:
        name: Its.
        matrices: Camera frame (+x forward, +y left, +z up) in the world, (t, 4, 4).
        slope: Of its picture's left edge: the tangent of half its horizontal angle.
        rides: Id of the road user that it sits in; empty where it sits in none.
    """

    name: str
    matrices: Floats
    slope: float
    rides: str = ""

    def placed(self, origin: Floats) -> Floats:
        """Return where it is as other tools say it: cameras look along -z with +y up, (t, 4, 4)."""
        matrices = self.matrices.copy()
        matrices[:, :3, 3] -= origin
        matrices[:, :3, :3] = matrices[:, :3, :3] @ _FROM_CAMERA
        return matrices


@dataclass(frozen=True, slots=True, eq=False)
class ExportedScene:
    """What leaves.

    Attributes:
        origin: Of all places, in the network's coordinates, (3,) [m].
        times: SUMO's [s], (t,); one of them for a scene that stands still.
        things: What exists.
        cameras: Those of the scene file.
        sun: Unit vector to it, (3,); None by night, or under clouds of a picture.
        size: Of the film's pictures [px].
        dark: Whether it is night.
        notes: What was left out or is simpler, in words.
    """

    origin: Floats
    times: Floats
    things: tuple[Exported, ...]
    cameras: tuple[ExportedCamera, ...]
    sun: Floats | None
    size: tuple[int, int]
    dark: bool = False
    notes: tuple[str, ...] = ()

    @property
    def sun_turn(self) -> Rotation | None:
        """How a light is turned that shines along -z, so that it shines as the sun does."""
        from scipy.spatial.transform import Rotation

        if self.sun is None:
            return None
        turn, _ = Rotation.align_vectors(self.sun[None], np.array([[0.0, 0.0, 1.0]]))
        return turn

    @property
    def walks(self) -> bool:
        """Whether somebody takes more than one pose."""
        return any(
            thing.track is not None and thing.track.weights is not None for thing in self.things
        )

    @property
    def triangles(self) -> int:
        """Of everything, as often as it is shown."""

        def of(thing: Exported) -> int:
            own = sum(len(piece.geometry.faces) for piece in thing.pieces)
            return own + sum(map(of, thing.children))

        return sum(map(of, self.things))


def exported(job: Job, times: Floats) -> ExportedScene:
    """Gather a scene around its file's cameras.

    Args:
        job: The scene file.
        times: SUMO's, increasing evenly, (t,) [s]; one of them for a scene that stands still.

    Raises:
        ConfigError: If the log has nothing then.
        InputError: If a file is wrong.
    """
    from sumo3dviz_pt.pipeline.reading import Ground
    from sumo3dviz_pt.pipeline.worlds import roam_around

    ground = Ground.of(job, begin=float(times[0]), end=float(times[-1]))
    announce(Doing.BUILD)
    job, alone = _with_riders(job, ground)
    shot = roam_around(job, ground, frames=times)
    found, notes = _cameras(job, ground, shot, times)
    notes += alone
    assert shot.places is not None
    origin = np.round(shot.places.mean(axis=0) / ORIGIN_GRID) * ORIGIN_GRID
    origin[2] = 0.0
    materials = shot.data.materials
    moving = _Moving(shot, times, origin)
    things = (
        *_standing(shot, origin),
        *moving.things(),
        *_signals(shot, times, origin, materials),
    )
    sun = shot.data.sky.sun_direction
    if sun is not None and (shot.dark or sun[2] <= 0.0):
        sun = None
    if shot.data.weather is not None:
        notes.append("left out the weather: nothing falls there, and all is dry and without snow")
    left = [item for item in shot.data.left_out if item.surprising]
    notes += [*(f"left out {item.what}: {item.why}" for item in left), *moving.notes]
    return ExportedScene(
        origin, times, things, tuple(found), sun, job.output.size, shot.dark, tuple(notes)
    )


def _with_riders(job: Job, ground: Ground) -> tuple[Job, list[str]]:
    """Return a job without the cameras whose road user is never there, and a note on each."""
    from sumo3dviz_pt.model.trajectory import find_trajectory

    cameras, notes = dict(job.cameras), []
    for name, settings in job.cameras.items():
        if settings.rides_with:
            try:
                find_trajectory(ground.trajectories, settings.rides_with)
            except ConfigError:
                notes.append(_left_out(name, cameras.pop(name)))
    return job.model_copy(update={"cameras": cameras}), notes


def _left_out(name: str, camera: CameraSettings) -> str:
    """Say that a camera is not there."""
    return f"left out camera {name}: {camera.rides_with} is not on the road all the time"


def _cameras(
    job: Job, ground: Ground, shot: Shot, times: Floats
) -> tuple[list[ExportedCamera], list[str]]:
    """Return the cameras that other tools have, too, and why others are left out."""
    from sumo3dviz_pt.shot.picking import camera_view

    left_hand, cameras, notes = ground.scenario.network.left_hand, [], []
    for name, settings in job.cameras.items():
        try:
            views = [camera_view(shot, settings, float(t), left_hand=left_hand) for t in times]
        except ConfigError:
            notes.append(_left_out(name, settings))
            continue
        if not views[0].lens.is_pinhole:
            notes.append(f"left out camera {name}: its lens is no plain perspective")
            continue
        slope = views[0].lens.edges(job.output.size[1] / job.output.size[0])[0]
        matrices = np.stack([view.world_from_camera.matrix for view in views])
        cameras.append(ExportedCamera(name, matrices, slope, views[0].rides_in or ""))
    return cameras, notes


# What stands --------------------------------------------------------------------------------


def _shifted(mesh: Mesh, origin: Floats) -> Mesh:
    """Return a mesh in the frame of what leaves."""
    return replace(mesh, vertices=mesh.vertices - origin)


def _standing(shot: Shot, origin: Floats) -> Iterator[Exported]:
    """Yield what stands, one thing for each family, its pieces joined by their looks."""
    families: dict[str, list[Piece]] = defaultdict(list)
    for static in shot.data.static:
        part = replace(static.part, mesh=_shifted(static.part.mesh, origin))
        families[static.family] += pieces_of(part, shot.data.materials[part.material])
    for family, pieces in sorted(families.items()):
        yield Exported(family, family, tuple(_joined(pieces)))


def _joined(pieces: Iterable[Piece]) -> Iterator[Piece]:
    """Join rigid pieces of one look."""
    groups: dict[tuple[Look, str, bool, bool, bool], list[Geometry]] = defaultdict(list)
    for piece in pieces:
        geometry = piece.geometry
        smooth, laid = geometry.normals is not None, geometry.uvs is not None
        key = (piece.look, piece.role, smooth, laid, geometry.colours is not None)
        groups[key].append(geometry)
    for (look, role, *_), members in groups.items():
        mesh = merge_meshes([Mesh(g.points, g.faces, g.normals, g.uvs) for g in members])
        colours = [g.colours for g in members if g.colours is not None]
        joined = Geometry(
            mesh.vertices,
            mesh.faces,
            mesh.normals,
            mesh.uvs,
            np.concatenate(colours) if colours else None,
        )
        yield Piece(joined, look, role)


# Signals ------------------------------------------------------------------------------------


def _signals(
    shot: Shot, times: Floats, origin: Floats, materials: Mapping[str, Bsdf]
) -> Iterator[Exported]:
    """Yield lamps that stand, those together that shine at the same times in the same colour."""
    courses = [
        {**shot.signals.radiance_at(time), **shot.railway.radiance_at(time)}
        for time in times.tolist()
    ]
    for lamps in shot.data.lamps:
        if lamps.radiance is None:
            radiance = np.stack([course[lamps.id] for course in courses])
        else:
            radiance = lamps.radiance[None]
        glow = _GLOW if lamps.radiance is None else _PANE_GLOW
        yield from _lamp_groups(lamps, _settled(radiance), origin, glow)


def _settled(radiance: Floats) -> Floats:
    """Return when each lamp shines in which colour, in few numbers, (t, lamps, 3)."""
    brightest = radiance.max(axis=2, keepdims=True)
    shining = brightest > 1e-9
    hue = np.where(shining, radiance / np.maximum(brightest, 1e-9), 0.0)
    return np.asarray(np.round(hue, 2))


def _lamp_groups(lamps: LampSet, hues: Floats, origin: Floats, glow: float) -> Iterator[Exported]:
    """Yield the lamps of a set; each group is dark, and in every colour that it shows."""
    flat = hues.transpose(1, 0, 2).reshape(len(lamps.lamps), -1)
    courses, group = np.unique(flat, axis=0, return_inverse=True)
    mesh = _shifted(lamps.mesh, origin)
    for number, course in enumerate(courses.reshape(len(courses), -1, 3)):
        members = np.flatnonzero(group.ravel() == number)
        more = f" and {len(members) - 1} more" if len(members) > 1 else ""
        name = f"{lamps.id}/{lamps.lamps[int(members[0])]}{more}"
        shone = np.asarray(course.any(axis=1), np.bool_)
        own = np.isin(lamps.lamp_of_face, members)
        part = Mesh(mesh.vertices, mesh.faces[own], mesh.normals)
        if not shone.all():
            yield _lamp(f"{name}/off", lamps.family, part, _LENS, ~shone)
        for colour in np.unique(course[shone], axis=0):
            at = np.asarray((course == colour).all(axis=1), np.bool_)
            yield _lamp(f"{name}/on", lamps.family, part, _glowing(colour, glow), at)


def _lamp(name: str, family: str, mesh: Mesh, look: Look, there: Bools) -> Exported:
    """Return lamps that are there at some times."""
    pieces = pieces_of(Part(mesh, ""), {"type": "diffuse"})
    shown = tuple(replace(piece, look=look) for piece in pieces)
    track = None if there.all() else Track(np.eye(4)[None], there)
    return Exported(name, family, shown, track)


def _glowing(colour: Iterable[float], strength: float = _GLOW) -> Look:
    """Return the look of a lamp that shines in a colour, as bright in its brightest channel."""
    red, green, blue = (float(channel) for channel in colour)
    most = max(red, green, blue, 1e-12)
    return replace(
        _LENS,
        name="lamp",
        glow=(strength * red / most, strength * green / most, strength * blue / most),
    )


# Road users ---------------------------------------------------------------------------------


@dataclass(slots=True, eq=False)
class _Course:
    """A mover while its times are collected.

    Attributes:
        first: As it was first.
        movers: As it was at each time, by the time's index.
    """

    first: Mover
    movers: dict[int, Mover] = field(default_factory=dict)


class _Moving:
    """Road users, plants that are alike, barriers: whatever is a copy of a body."""

    def __init__(self, shot: Shot, times: Floats, origin: Floats) -> None:
        self._shot, self._times, self._origin = shot, times, origin
        self._bodies: dict[str, tuple[Piece, ...]] = {}
        self._lamps: dict[tuple[str, str], tuple[Piece, ...]] = {}
        self.notes: list[str] = []

    def things(self) -> Iterator[Exported]:
        """Yield them all."""
        courses: dict[str, _Course] = {}
        for index, time in enumerate(self._times.tolist()):
            announce(Doing.MEASURE, index, len(self._times), what="motion")
            for mover in self._at(time):
                course = courses.setdefault(f"{mover.name}/{mover.prototype}", _Course(mover))
                course.movers[index] = mover
        if not courses:
            self.notes.append(f"no road user is within {REACH:g} m of the cameras")
        for course in courses.values():
            yield self._thing(course)

    def _at(self, time: float) -> Iterator[Mover]:
        """Yield everything that is a copy of a body at a time."""
        shot = self._shot
        assert shot.places is not None
        yield from shot.parts_at(time, near=shot.places, reach=REACH)
        yield from shot.railway.movers_at(time)
        weather = None if shot.data.weather is None else shot.data.weather.at(time)
        yield from shot.stands.movers_at(time, weather)

    def _thing(self, course: _Course) -> Exported:
        """Return a mover with its track and its lamps."""
        mover, count = course.first, len(self._times)
        prototype = self._shot.data.prototypes.get(mover.prototype)
        prototype = prototype or self._shot.fleet.prototypes[mover.prototype]
        there = np.zeros(count, dtype=np.bool_)
        there[list(course.movers)] = True
        # Where it is not there, it waits where it was last, or will be first.
        known = np.array(sorted(course.movers))
        filled = known[np.clip(np.searchsorted(known, np.arange(count), "right") - 1, 0, None)]
        states = [course.movers[index] for index in filled.tolist()]
        matrices = np.stack([state.world_from_body.matrix for state in states])
        matrices[:, :3, 3] -= self._origin
        weights, pose = None, None
        if prototype.poses is not None:
            weights = _pose_weights(states, len(prototype.poses.vertices) - 1)
            if not np.ptp(weights, axis=0).any():  # it keeps one pose, which is its shape then
                pose, weights = weights[0], None
        colours = {**mover.outfit, OWN: mover.colour}
        family = mover.id.partition(":")[0]
        return Exported(
            f"{mover.id}/{mover.part}".rstrip("/"),
            family,
            self._body(prototype, pose),
            Track(matrices, there, weights),
            colours,
            tuple(self._lights(prototype, states)),
            mover.id,
        )

    def _body(self, prototype: Prototype, pose: Floats | None) -> tuple[Piece, ...]:
        """Return a body's pieces, made when first asked for."""
        key = prototype.name if pose is None else f"{prototype.name} {pose.tolist()}"
        if key not in self._bodies:
            self._bodies[key] = tuple(self._pieces(prototype, pose))
        return self._bodies[key]

    def _pieces(self, prototype: Prototype, pose: Floats | None) -> Iterator[Piece]:
        """Yield a body's pieces, in one pose or with all that it takes."""
        materials = {**self._shot.fleet.materials, **self._shot.data.materials}
        first, rigid = 0, list[Piece]()
        for part in prototype.parts:
            end = first + len(part.mesh.vertices)
            bsdf = _material(materials, part.material)
            if prototype.poses is None:
                rigid += pieces_of(part, bsdf)
            elif pose is None:
                shapes = prototype.poses.vertices[:, first:end]
                yield from pieces_of(posed(part, shapes[0]), bsdf, tuple(shapes[1:]))
            else:
                shares = np.concatenate([[1.0 - pose.sum()], pose])
                points = np.tensordot(shares, prototype.poses.vertices[:, first:end], 1)
                normals = np.tensordot(shares, prototype.poses.normals[:, first:end], 1)
                rigid += pieces_of(posed(part, points, normals), bsdf)
            first = end
        yield from _joined(rigid)

    def _lights(self, prototype: Prototype, states: Sequence[Mover]) -> Iterator[Exported]:
        """Yield its lamps that shine at some time."""
        running = self._shot.data.running
        for role in sorted(frozenset[str]().union(*(state.lit for state in states))):
            key = (prototype.name, role)
            if key not in self._lamps:
                own = [_ellipse(lamp) for lamp in prototype.lamps if lamp.role == role]
                shape = merge_meshes(own)
                self._lamps[key] = tuple(pieces_of(Part(shape, ""), {"type": "diffuse"}))
            lit = np.array([role in state.lit for state in states])
            glow = running.intensity.get(role) if running is not None else None
            look = _glowing(glow or (1.0, 1.0, 1.0))
            shown = tuple(replace(piece, look=look) for piece in self._lamps[key])
            track = None if lit.all() else Track(np.eye(4)[None], lit)
            yield Exported(role, "lamps", shown, track)


def posed(part: Part, points: Floats, normals: Floats | None = None) -> Part:
    """Return a part whose mesh has other points, (n, 3), and maybe normals."""
    mesh = replace(part.mesh, vertices=points)
    return replace(part, mesh=mesh if normals is None else replace(mesh, normals=normals))


def _material(materials: Mapping[str, Bsdf], name: str) -> Bsdf:
    """Return a material of a body, in use by the shot or not."""
    from sumo3dviz_pt.library.materials import MATERIALS

    return materials[name] if name in materials else MATERIALS[name]


def _pose_weights(states: Sequence[Mover], count: int) -> Floats:
    """Return how much of each phase of a movement is shown, (t, phases).

    Between the two nearest phases, and between rest and movement, as the renderer does it.
    """
    weights = np.zeros((len(states), count))
    for row, state in enumerate(states):
        place = (state.phase % 1.0) * count
        first, share = int(place) % count, place - int(place)
        weights[row, first] += state.effort * (1.0 - share)
        weights[row, (first + 1) % count] += state.effort * share
    return weights


def _ellipse(lamp: VehicleLamp) -> Mesh:
    """Return a lamp's flat ellipse in its body's frame."""
    angles = 2.0 * np.pi * np.arange(_CORNERS) / _CORNERS
    ahead = np.array([np.cos(lamp.yaw), np.sin(lamp.yaw), 0.0])
    left, up = np.array([-ahead[1], ahead[0], 0.0]), np.array([0.0, 0.0, 1.0])
    rim = 0.5 * lamp.size[0] * np.cos(angles)[:, None] * left
    rim = rim + 0.5 * lamp.size[1] * np.sin(angles)[:, None] * up
    points = np.asarray(lamp.at) + np.concatenate([np.zeros((1, 3)), rim])
    around: Ints = np.arange(_CORNERS, dtype=np.int64)
    faces = np.stack([np.zeros_like(around), 1 + around, 1 + (around + 1) % _CORNERS], axis=1)
    return Mesh(points, faces)
