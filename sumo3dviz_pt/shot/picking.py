"""A shot for cameras that go anywhere, and which thing a point of its picture shows.

It is not known where such a camera, a client's in the viewer, will be and look. So everything
around some places is built, in all directions, and there is room for everyone on the road, at least
as a stand-in.

The road user at a point of a picture is the one whose box the ray meets first. Boxes are as long,
wide and high as what is drawn; vehicles that bend have one for each of their units. A box that
holds the surface seen there comes first, then any box in front of that, and last a box that the
point misses by little: people far away are a few pixels wide. Faces of what stands get names where
somebody asks what pixels show.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain

import numpy as np

from sumo3dviz_pt.cast.axles import rigid_frames, unit_frames
from sumo3dviz_pt.cast.drawing import Drawn
from sumo3dviz_pt.cast.fleet import Fleet
from sumo3dviz_pt.cast.poses import Present, links_of
from sumo3dviz_pt.job.settings import CameraSettings
from sumo3dviz_pt.model.camera import CameraPath
from sumo3dviz_pt.model.geometry import Floats, Ints, Mesh, Transform
from sumo3dviz_pt.model.layers import Thing, thing_named
from sumo3dviz_pt.model.lens import Lens
from sumo3dviz_pt.model.scene import LampSet, Slots, StaticPart, View
from sumo3dviz_pt.model.traffic import Scenario
from sumo3dviz_pt.model.trajectory import Trajectory
from sumo3dviz_pt.shot import crowd
from sumo3dviz_pt.shot.build import Shot, ShotBuilder
from sumo3dviz_pt.shot.cameras.aiming import Camera, build_camera
from sumo3dviz_pt.shot.cameras.free import StandingCamera
from sumo3dviz_pt.shot.crowd import CrowdFrames, CrowdPlan, plan_crowd
from sumo3dviz_pt.shot.road_users import everyone, with_seat
from sumo3dviz_pt.world.build import World
from sumo3dviz_pt.world.placement.surroundings import thing_at
from sumo3dviz_pt.world.roads.layout import RoadOwners

_LEAST = 1.0
"""Boxes can be clicked as if their sides were at least this long [m]."""

_LEAST_SHARE = 0.03
"""Boxes can be clicked as if their sides took at least this share of the picture's width."""

_MIRRORS = 0.25
"""Things that stand out of a box by no more than this belong to it, such as mirrors [m]."""

_SLACK, _SLACK_SHARE = 0.3, 0.01
"""How far a surface may lie in front of a box [m], and how much more per metre of distance."""

_PARALLEL = 1e-12
"""A ray this parallel to a side of a box is taken as a little oblique."""


@dataclass(frozen=True, slots=True, eq=False)
class _Ray:
    """A ray from the eye: (3,) [m] and a unit direction, (3,)."""

    origin: Floats
    direction: Floats


@dataclass(frozen=True, slots=True, eq=False)
class _Boxes:
    """Boxes on the ground, fronts' middles at their origins, unscaled.

    Attributes:
        users: Index of the road user of each, (b,).
        frames: (b, 4, 4).
        sizes: Length, width, height, (b, 3) [m].
    """

    users: Ints
    frames: Floats
    sizes: Floats


def pick(
    present: Present,
    fleet: Fleet,
    view: View,
    point: tuple[float, float],
    *,
    aspect: float,
    distance: float = np.inf,
) -> str | None:
    """Find the road user that is seen at a point of a picture.

    Args:
        present: Everyone at the picture's time.
        fleet: What they show.
        view: The camera; road users around it are not found.
        point: From the left and from the top, in [0, 1].
        aspect: Height / width of the picture.
        distance: Along the ray to the surface that is seen there [m]; road users behind it are
            not found.

    Returns:
        The road user's key, such as `vehicle:flow_0.3`, or None.
    """
    ray = _ray(view, point, aspect)
    boxes = _boxes(present, fleet, _near(present, fleet, ray, view.lens))
    margins = _margins(boxes, ray, view.lens)
    # Cross the boxes as they are, and a little larger.
    slack = _SLACK + _SLACK_SHARE * distance
    enter, leave = _crossed(ray, boxes, np.zeros_like(margins))
    widely, left = _crossed(ray, boxes, margins)
    near_by = (widely > 0.0) & (widely <= left) & (widely <= distance + slack)
    hit = near_by & (enter <= leave) & (enter <= distance + slack)
    seen = hit & (leave + slack >= distance)
    # Take the nearest of the best kind of hit.
    for mask, depths in ((seen, enter), (hit, enter), (near_by, widely)):
        if mask.any():
            first = int(np.argmin(np.where(mask, depths, np.inf)))
            return fleet.trajectories[int(boxes.users[first])].key
    return None


def _ray(view: View, point: tuple[float, float], aspect: float) -> _Ray:
    """The ray through a point of the picture."""
    direction = view.world_from_camera.directions(view.lens.ray(point, aspect)[None])[0]
    return _Ray(view.position, direction)


def _near(present: Present, fleet: Fleet, ray: _Ray, lens: Lens) -> Ints:
    """Rows of those that the ray may meet: it passes no farther away than they reach."""
    to_front = present.positions - ray.origin
    along = to_front @ ray.direction
    aside = np.linalg.norm(to_front - np.maximum(along, 0.0)[:, None] * ray.direction, axis=1)
    away = np.linalg.norm(to_front, axis=1)
    widest = np.array([max(fleet.bodies[k].size[1:]) for k in present.users.tolist()])
    reach = np.hypot(fleet.lengths[present.users], np.hypot(widest, widest))
    return np.flatnonzero(aside <= reach + _least(away, lens))


def _least(away: Floats, lens: Lens) -> Floats:
    """How long sides of boxes must be to be clicked, by their distances, (b,) [m]."""
    return np.asarray(np.maximum(_LEAST, lens.length_of(_LEAST_SHARE, away)))


def _margins(boxes: _Boxes, ray: _Ray, lens: Lens) -> Floats:
    """What boxes are enlarged by on each side, small ones more, (b, 3) [m]."""
    away = np.linalg.norm(boxes.frames[:, :3, 3] - ray.origin, axis=1)
    return np.maximum((_least(away, lens)[:, None] - boxes.sizes) / 2.0, _MIRRORS)


def _boxes(present: Present, fleet: Fleet, rows: Ints) -> _Boxes:
    """Boxes of some of those who exist at a time."""
    users = present.users[rows]
    sizes = np.array([fleet.bodies[k].size for k in users.tolist()]).reshape(-1, 3)
    frames = rigid_frames(present.positions[rows], present.yaws[rows], present.pitches[rows])
    rigid = np.array([not fleet.bodies[k].assembly.bends for k in users.tolist()], dtype=np.bool_)
    bent = [_units(present, fleet, row) for row in rows[~rigid].tolist()]
    whole = _Boxes(users[rigid], frames[rigid], sizes[rigid])
    return _Boxes(
        np.concatenate([whole.users, *(each.users for each in bent)]),
        np.concatenate([whole.frames, *(each.frames for each in bent)]),
        np.concatenate([whole.sizes, *(each.sizes for each in bent)]),
    )


def _units(present: Present, fleet: Fleet, row: int) -> _Boxes:
    """One box for each unit of a vehicle that bends."""
    user = int(present.users[row])
    body, links = fleet.bodies[user], links_of(fleet.bodies[user])
    piece = fleet.presence.pieces[int(present.pieces[row])]
    assert links is not None
    frames = unit_frames(piece, np.array([present.time]), links)[0]
    sizes = np.array([(length, *body.size[1:]) for length in links.lengths.tolist()])
    return _Boxes(np.full(len(sizes), user), frames, sizes)


def _crossed(ray: _Ray, boxes: _Boxes, margins: Floats) -> tuple[Floats, Floats]:
    """Where a ray enters and leaves boxes, (b,) [m]; it misses those it leaves before.

    Args:
        ray: From the eye.
        boxes: Some.
        margins: Added on both sides along x, y, z, (b, 3) [m].
    """
    rotations = boxes.frames[:, :3, :3]
    origins = np.einsum("bji,bj->bi", rotations, ray.origin - boxes.frames[:, :3, 3])
    directions = np.einsum("bji,j->bi", rotations, ray.direction)
    oblique = np.where(np.abs(directions) < _PARALLEL, _PARALLEL, directions)
    # From the front's middle on the ground to the box's lowest and highest corner.
    low = boxes.sizes * [-1.0, -0.5, 0.0] - margins
    high = boxes.sizes * [0.0, 0.5, 1.0] + margins
    first, second = (low - origins) / oblique, (high - origins) / oblique
    enter = np.minimum(first, second).max(axis=1)
    leave = np.maximum(first, second).min(axis=1)
    return enter, leave


_ROADS = ("road/", "markings/", "rails/")


def with_things(shot: Shot) -> Shot:
    """Return the same shot; every face of what stands belongs to a thing.

    Objects have names from the beginning. Faces of roads get those of their edges and junctions
    here, and whatever still has none that of its part.
    """
    data, owners = shot.data, shot.road_owners
    assert owners is not None, "was not made by `ShotBuilder`"
    static = tuple(_named(part, owners) for part in data.static)
    lamps = tuple(_named_lamps(some) for some in data.lamps)
    return replace(shot, data=replace(data, static=static, lamps=lamps))


def thing_of(name: str, fleet: Fleet, *, ego: str | None = None) -> Thing:
    """Return the thing of a name, with its class.

    Args:
        name: Of a road user, or of what stands.
        fleet: Everyone on the road.
        ego: Name of the road user that the camera rides in.
    """
    vclass = fleet.body(name).vclass if name in fleet.places else ""
    return thing_named(name, vclass=vclass, ego=name == ego)


def _named(static: StaticPart, owners: RoadOwners) -> StaticPart:
    """Return a part whose faces all have names."""
    mesh, things = static.part.mesh, static.part.mesh.things
    if not things and static.id.startswith(_ROADS):
        things = owners.things(static.id, mesh)
    named = _filled(replace(mesh, things=things), _name_of(static))
    return replace(static, part=replace(static.part, mesh=named))


def _name_of(static: StaticPart) -> str:
    """Return the name of a part's faces that have none: its id, without a number at its end."""
    if "/court/" in static.id:  # courts are numbered as a camera sees them
        return thing_at("court", static.part.mesh.bounds.mean(axis=0)[:2])
    head, _, last = static.id.rpartition("/")
    return head if last.isdecimal() else static.id


def _named_lamps(lamps: LampSet) -> LampSet:
    """Return a lamp set whose faces all have names."""
    return replace(lamps, mesh=_filled(lamps.mesh, lamps.id))


def _filled(mesh: Mesh, name: str) -> Mesh:
    """Return a mesh with a name where it has none."""
    runs = mesh.things or (("", len(mesh.faces)),)
    return replace(mesh, things=tuple((thing or name, count) for thing, count in runs))


_STEP = 1.0
"""Between the times at which room is made [s]."""

_MOST_NEAR = 48
"""Road users in detail at once: recording a scene of 240 takes three times as long as of 60."""

_AFOOT = frozenset({"pedestrian", "wheelchair"})

_ABOVE = 25.0
"""Height of the first view where the scene file has no camera [m]."""


def build_roam(
    world: World,
    trajectories: Sequence[Trajectory],
    *,
    times: tuple[float, float] | Floats,
    eyes: Floats | None = None,
    riding: Sequence[CameraSettings] = (),
    growing: bool = False,
) -> Shot:
    """Build everything around some places, and room for everyone.

    Args:
        world: What exists; the cabins that its scene file's cameras sit in can be opened.
        trajectories: The smoothed motion of everyone on the road.
        times: First and last that can be shown [s], or all that are shown one after the other,
            increasing, (n,): motion is worked out for many of them at once. Others take longer.
        eyes: Places around which there is detail, (n, 3) [m]; default: where the scene's
            cameras are.
        riding: Further cameras that sit in a vehicle.
        growing: Whether others will come, for whom there is to be room, too. Then cameras that
            ride with who is not there are left out.

    Returns:
        A shot whose own camera stands where the scene's first one is at the first time.

    Raises:
        ConfigError: If a name in the scene file is unknown.
    """
    # Everyone on the road; the cabins that cameras sit in can be opened.
    scenario, job, left_hand = world.scenario, world.job, world.left_hand
    frames, times = times if isinstance(times, np.ndarray) else None, (times[0], times[-1])
    fleet = replace(everyone(world, trajectories), times=frames)
    cameras = [*job.cameras.values(), *riding]
    if growing:
        cameras = [each for each in cameras if not each.rides_with or _is_there(fleet, each)]
    for camera in cameras:
        fleet = with_seat(fleet, camera, world=world)
    spares = _spares(world, fleet, times) if growing else None
    if spares is not None:  # their bodies are shown by others later
        known = {**spares.fleet.materials, **fleet.materials}
        prototypes = {**spares.fleet.prototypes, **fleet.prototypes}
        fleet = replace(fleet, prototypes=prototypes, materials=known)
    # Places around which there is detail.
    own = [each for each in job.cameras.values() if each in cameras]
    views = list(_views(own, fleet, times, left_hand=left_hand)) or [_overview(scenario)]
    places = np.stack([view.position for view in views]) if eyes is None else eyes
    moments = np.arange(times[0], times[1] + _STEP, _STEP)
    # Build the shot.
    builder = ShotBuilder(world, job.output.size[1] / job.output.size[0])
    home, room = (
        StandingCamera(views[0]),
        partial(_room, eyes=places, times=moments, spares=spares),
    )
    camera_path = CameraPath.all_round(places)
    shot = builder.shot(fleet, camera_path, camera=lambda **_: home, plan=room)
    return replace(shot, places=places)


def camera_view(shot: Shot, camera: CameraSettings, time: float, *, left_hand: bool) -> View:
    """Return the view of a camera.

    Args:
        shot: Has the road users that it may ride with.
        camera: Its settings.
        time: SUMO's [s].
        left_hand: Whether traffic keeps left, so that drivers sit on the right.

    Raises:
        ConfigError: If it rides with a road user that does not exist then.
    """
    return build_camera(camera, fleet=shot.fleet, left_hand=left_hand).view_at(time)


def with_traffic(
    shot: Shot, world: World, trajectories: Sequence[Trajectory], *, frames: Floats
) -> Shot | None:
    """Return the same shot with others on its roads.

    Args:
        shot: Of `build_roam`.
        world: What exists, with the signal log that goes with the traffic.
        trajectories: The smoothed motion of everyone on the road.
        frames: Times that are shown, increasing, (n,) [s].

    Returns:
        None where the shot lacks room for somebody.
    """
    fleet = replace(everyone(world, trajectories), times=frames)
    slots = shot.data.slots
    drawn = [fleet.drawn(k) for k in range(len(fleet.keys))]
    near = {name for each in drawn for name in (*each.near, *each.deforming)}
    full = sum(slots.near.values()) >= crowd.MOST_SLOTS
    moments = np.arange(float(frames[0]), float(frames[-1]) + _STEP, _STEP)
    most = _most_far(fleet, drawn, moments)
    if not (most <= Counter(slots.far) and (full or near <= slots.detailed.keys())):
        return None
    return shot.driven_by(fleet, world.scenario.signals, world=world)


def _is_there(fleet: Fleet, camera: CameraSettings) -> bool:
    """Return whether whom a camera rides with is on the road."""
    name = camera.rides_with
    keys = (f"{kind}:{name}" for kind in ("vehicle", "person", "container"))
    return name in fleet.places or any(key in fleet.places for key in keys)


_LEAST_SPARE, _MOST_TYPES, _FEW = 100, 24, 6
"""Road users for whom there is room beside those who are there, types that they may be of beside
those that were seen, and how many of each of these."""

_DRAWS, _DRAWS_OF_PEOPLE = 400, 2000
"""Of a type, so many are thought up to find which bodies they may show, and how often; few people
are dressed for another season, in many ways."""

_SIDE_BY_SIDE = 3
"""Of those who may come, so many of one body are drawn in detail at once."""


@dataclass(frozen=True, slots=True, eq=False)
class _Spares:
    """Those who may come.

    Attributes:
        fleet: Many of each type.
        shares: How many road users each of them stands for, (n,).
    """

    fleet: Fleet
    shares: Floats

    def counts(self, level: str) -> Counter[str]:
        """Return for how many bodies at a level there is to be room, by name.

        That is what is expected and twice its standard deviation, as chance chooses bodies.
        """
        expected: dict[str, float] = {}
        for k, share in enumerate(self.shares.tolist()):
            for name in getattr(self.fleet.drawn(k), level):
                expected[name] = expected.get(name, 0.0) + share
        return Counter({n: int(np.ceil(e + 2.0 * np.sqrt(e))) for n, e in expected.items()})


def _spares(world: World, fleet: Fleet, times: tuple[float, float]) -> _Spares:
    """Return those who may come: as many again as there are at once, of their types.

    Args:
        world: Says which types there are.
        fleet: Everyone who was seen.
        times: First and last that can be shown [s].
    """
    alive, _ = fleet.positions(np.arange(times[0], times[1] + _STEP, _STEP))
    count = max(int(alive.sum(axis=0).max(initial=0)), _LEAST_SPARE)
    seen = Counter((each.kind, each.type_id) for each in fleet.trajectories)
    total = max(sum(seen.values()), 1)
    rooms = {pair: max(count * n / total, float(_FEW)) for pair, n in seen.items()}
    others = [
        ("person" if kind.vclass in _AFOOT else "vehicle", name)
        for name, kind in sorted(world.scenario.vehicle_types.items())
        if kind.vclass != "container"
    ]
    fresh = [pair for pair in others if pair not in rooms][:_MOST_TYPES]
    rooms |= dict.fromkeys(fresh, float(count if not seen else _FEW))
    draws = [_DRAWS_OF_PEOPLE if kind == "person" else _DRAWS for kind, _ in rooms]
    coming = [
        Trajectory(f"spare {number}", kind, type_id, ())
        for (kind, type_id), count in zip(rooms, draws, strict=True)
        for number in range(count)
    ]
    shares = np.array([*rooms.values()]) / draws
    return _Spares(everyone(world, coming), np.repeat(shares, draws))


def _at_most(few: int, counts: Mapping[str, int]) -> Counter[str]:
    """Return the same counts, but none above a few."""
    return Counter({name: min(count, few) for name, count in counts.items()})


def _one_each(names: Iterable[Iterable[str]]) -> Counter[str]:
    """Return a count of one for each name."""
    return Counter(set(chain.from_iterable(names)))


def _most_far(fleet: Fleet, drawn: Sequence[Drawn], times: Floats) -> Counter[str]:
    """Return how many stand-ins of each body there are at once if all are drawn so, by name."""
    most = Counter[str]()
    for part in crowd.chunks(len(times)):
        alive, _ = fleet.positions(times[part])
        for column in alive.T:
            most |= Counter(name for k in np.flatnonzero(column).tolist() for name in drawn[k].far)
    return most


def _views(
    cameras: Sequence[CameraSettings],
    fleet: Fleet,
    times: tuple[float, float],
    *,
    left_hand: bool,
) -> Iterator[View]:
    """Yield the views that stand for the ways of the scene's cameras."""
    for settings in cameras:
        camera = build_camera(settings, fleet=fleet, left_hand=left_hand)
        yield from (camera.view_at(time) for time in camera.moments(times))


def _overview(scenario: Scenario) -> View:
    """From above the middle of all roads, to the north."""
    lanes = [lane.shape for lane in scenario.network.lanes.values()]
    middle = np.median(np.concatenate(lanes), axis=0) if lanes else np.zeros(3)
    middle = middle + np.array([0.0, -2.0 * _ABOVE, _ABOVE])
    placed = Transform.from_pose(tuple(middle), yaw=np.pi / 2.0, pitch=-np.arctan(0.5))
    return View(placed, Lens.of_degrees(60.0))


def _room(
    *,
    fleet: Fleet,
    camera: Camera,
    eyes: Floats,
    times: Floats,
    budget: int,
    spares: _Spares | None = None,
) -> CrowdPlan:
    """Room for those near any of the places in detail, and for everyone as a stand-in.

    None are drawn in full detail, which takes instances and triangles and would be seen in
    stills only. Each opened cabin has a slot of its own, as the vehicle may also be seen closed.
    Where the shot's own camera stands does not matter.
    """
    del camera
    bodies = [replace(fleet.drawn(k), full=()) for k in range(len(fleet.keys))]
    frames, most = [], _most_far(fleet, bodies, times)
    for part in crowd.chunks(len(times)):
        alive, positions = fleet.positions(times[part])
        for eye in eyes:
            camera_path = CameraPath.all_round(np.tile(eye, (alive.shape[1], 1)))
            frames.append(CrowdFrames(camera_path, alive, positions))
    triangles = {name: body.triangles for name, body in fleet.prototypes.items()}
    plan = plan_crowd(bodies, frames, triangles=triangles, budget=budget, limit=_MOST_NEAR)
    near = Counter(plan.slots.near)
    for cockpit in fleet.cockpits.values():
        near |= Counter(cockpit.names)
    deforming = Counter(plan.slots.deforming)
    if spares is not None:
        # One of each body here, wherever it is, or the next window would lack room again.
        most = (most | _one_each(body.far for body in bodies)) + spares.counts("far")
        near |= _at_most(_SIDE_BY_SIDE, spares.counts("near"))
        near |= _one_each(body.near for body in bodies)
        if sum(near.values()) > crowd.MOST_SLOTS:
            near = _at_most(1, near)
        deforming |= _at_most(1, spares.counts("deforming"))
        deforming |= _one_each(body.deforming for body in bodies)
    slots = Slots(*(dict(sorted(each.items())) for each in (near, most, deforming)))
    return replace(plan, slots=slots)
