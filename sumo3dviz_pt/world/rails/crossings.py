"""Level crossings: where barriers stand, and how far they are lowered at any time.

Every road that leads onto a level crossing gets a half barrier with flashing lights and a St
Andrew's cross before it. The signal log of the crossing says what they do:

| letter | lights | arm |
|---|---|---|
| `G`, `g`, `o`, `O`, none | dark | up, or rises in 4 s |
| `y` closing | flash | still up |
| `r` closed | flash | sinks in 6 s, then down |
| `u` opening | flash | rises in 4 s |
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import shapely

from sumo3dviz_pt.library.street import national as shapes
from sumo3dviz_pt.library.street.road_styles import RoadStyle
from sumo3dviz_pt.model.geometry import Floats, Transform, belonging, frozen, merge_meshes
from sumo3dviz_pt.model.network import Connection, Edge, Network
from sumo3dviz_pt.model.scene import LampSet, LeftOut, Mover, Part, Prototype, StaticPart
from sumo3dviz_pt.model.traffic import Scenario, SignalPhases
from sumo3dviz_pt.world.objects.objects import merged
from sumo3dviz_pt.world.placement.surroundings import HeightAt, Surroundings, thing_at
from sumo3dviz_pt.world.rails.ways import LEVEL_CROSSING, only_rails
from sumo3dviz_pt.world.roads.strips import is_footway
from sumo3dviz_pt.world.signals.heads import AspectCourse, course_of
from sumo3dviz_pt.world.signals.signals import GLASS, LOBE, NIGHT_POWER, RADIANCE

SINKING, RISING = 6.0, 4.0
"""How long an arm takes down and up [s]."""

UPRIGHT = np.radians(84.0)
"""Angle of a raised arm [rad]."""

_BESIDE = 0.75  # from the road's outer border to the drive [m]
_SHORT_OF_MIDDLE = 0.3  # from the tip of a lowered arm to the road's inner border [m]
_LONGEST = 12.0  # of an arm [m]
_CLEAR = 2.6  # from the middle of a track to an arm, at least [m]
_PLACES = (0.9, 0.5, 0.1, -0.4, -1.0, -2.0, -3.5, -5.0)  # behind the lanes' ends, tried in turn
_FLASH = 0.5  # each of the two lights is lit for so long [s]


@dataclass(frozen=True, slots=True, eq=False)
class Barrier:
    """A half barrier before a level crossing.

    Attributes:
        edge: Id of the road that it closes.
        tls: Id of the crossing's signals, or empty.
        foot: Of the drive, (3,) [m].
        yaw: Driving direction of the traffic that it stops [rad].
        length: Of the arm [m].
        side: Where the arm points: 1 to the traffic's left, -1 to its right.
        course: What the log says.
    """

    edge: str
    tls: str
    foot: Floats
    yaw: float
    length: float
    side: float
    course: AspectCourse

    @property
    def arm_yaw(self) -> float:
        """Direction of the arm from its hinge [rad]."""
        return self.yaw + self.side * np.pi / 2

    def lowered_at(self, time: float) -> float:
        """Return how far the arm is down at a time [s]: 0 up, 1 down."""
        times, shares = lowering(self.course)
        return float(np.interp(time, times, shares))

    def lit_at(self, time: float) -> tuple[bool, bool]:
        """Return which of the two lights, right and left, is lit at a time [s]."""
        if self.course.letter_at(time) not in {"y", "r", "u"}:
            return False, False
        first = (time + 1e-9) % (2.0 * _FLASH) < _FLASH
        return first, not first

    @property
    def moves(self) -> bool:
        """Whether the arm ever changes its place."""
        return len(set(lowering(self.course)[1].tolist())) > 1


def lowering(course: AspectCourse) -> tuple[Floats, Floats]:
    """Return times [s] and how far an arm is down at each of them, both (n,).

    Between them it moves evenly, before and after them not at all.
    """
    if not course.times:
        return np.zeros(1), np.zeros(1)
    share = float(course.letters[0] == "r")
    times, shares = [course.times[0]], [share]
    ends = (*course.times[1:], np.inf)
    for begin, end, letter in zip(course.times, ends, course.letters, strict=True):
        if letter == "y":
            goal, pace = share, 1.0
        else:
            goal, pace = (1.0, SINKING) if letter == "r" else (0.0, RISING)
        arrival = begin + abs(goal - share) * pace
        if arrival > end:
            goal = share + (goal - share) * (end - begin) / (arrival - begin)
            arrival = end
        times += [begin, float(arrival)]
        shares += [share, goal]
        share = goal
    return np.array(times), np.array(shares)


def barriers_of(
    network: Network,
    links: Sequence[Connection],
    phases: Mapping[str, SignalPhases],
) -> list[Barrier]:
    """Place the barriers of all level crossings.

    Args:
        network: The road network.
        links: Connections whose barriers are wanted; usually all of a region.
        phases: The signal log by tls id; without, a crossing stays open.
    """
    by_edge: dict[str, list[Connection]] = {}
    for link in links:
        edge = network.edges[network.lanes[link.from_lane].edge_id]
        if edge.function == "normal" and _is_road(edge):
            junction = network.junctions.get(edge.to_junction)
            if junction is not None and junction.type == LEVEL_CROSSING:
                by_edge.setdefault(edge.id, []).append(link)
    tracks = _tracks(network)
    barriers = []
    for key, own in by_edge.items():
        barrier = _barrier(network, network.edges[key], _course(own, phases), tracks)
        if barrier is not None:
            barriers.append(barrier)
    return barriers


def _is_road(edge: Edge) -> bool:
    """Whether something other than trains and people on foot uses an edge."""
    return any(not only_rails(lane) and not is_footway(lane) for lane in edge.lanes)


def _tracks(network: Network) -> shapely.STRtree:
    """The middles of all tracks, those inside junctions too."""
    lines = [
        shapely.LineString(lane.shape[:, :2])
        for lane in network.lanes.values()
        if only_rails(lane) and len(lane.shape) > 1
    ]
    return shapely.STRtree(lines)


def _course(
    links: Sequence[Connection], phases: Mapping[str, SignalPhases]
) -> tuple[str, AspectCourse]:
    """The crossing's tls id, and what its log says to the first link that it knows."""
    for link in links:
        entry = phases.get(link.tls)
        if link.tls and link.link_index >= 0 and entry is not None and entry.states:
            return link.tls, course_of(entry, link.link_index)
    return next((link.tls for link in links if link.tls), ""), AspectCourse((), ())


def _barrier(
    network: Network, edge: Edge, signal: tuple[str, AspectCourse], tracks: shapely.STRtree
) -> Barrier | None:
    """The barrier at the end of an edge; None if it has no room."""
    outer, inner = edge.lanes[0], edge.lanes[-1]
    step = outer.shape[-1, :2] - outer.shape[-2, :2]
    size = float(np.hypot(*step))
    if size < 1e-6:
        return None
    along = np.array([*(step / size), 0.0])
    left = np.array([-along[1], along[0], 0.0])
    side = -1.0 if network.left_hand else 1.0
    inward = side * left
    # Reach from beside the outer border to short of the inner one.
    first = outer.shape[-1] - inward * (outer.width / 2 + _BESIDE)
    reach = float((inner.shape[-1] - first) @ inward) + inner.width / 2 - _SHORT_OF_MIDDLE
    length = round(min(max(reach, 2.0), _LONGEST) * 2.0) / 2.0
    # Stand clear of the tracks, as near to the crossing as that allows.
    feet = [first + shift * along for shift in _PLACES]
    ends = [foot + length * inward for foot in feet]
    arms = [shapely.LineString([one[:2], other[:2]]) for one, other in zip(feet, ends, strict=True)]
    good = [
        k for k, arm in enumerate(arms)
        if not len(tracks.query(arm, predicate="dwithin", distance=_CLEAR))
    ]  # fmt: skip
    foot = feet[good[0] if good else -1]
    yaw = float(np.arctan2(along[1], along[0]))
    tls, course = signal
    return Barrier(edge.id, tls, foot, yaw, length, side, course)


FAMILY = "level crossings"
"""What users call the family."""

LAMP_SET = "level_crossings"
"""Id of the lamp set of flashing lights."""

REACH = 900.0
"""Barriers farther than this from every camera are left out [m]."""

_MOST_MOVING = 40
"""Arms that move in one shot; those farther away stand open."""

_FAR = 150.0
_GREY = (0.3, 0.3, 0.3)


@dataclass(frozen=True, slots=True, eq=False)
class Railway:
    """Level crossings, ready for the scene.

    Attributes:
        static: Everything that does not move.
        lamps: The flashing lights, or nothing.
        prototypes: Arms that move, by name.
        barriers: All of them; the lights follow them in order, right and left.
        moving: Those of them whose arms move.
        left_out: What was left out, and why.
        power: Factor of the lights' radiance.
    """

    static: tuple[StaticPart, ...] = ()
    lamps: tuple[LampSet, ...] = ()
    prototypes: Mapping[str, Prototype] = field(default_factory=dict)
    barriers: tuple[Barrier, ...] = ()
    moving: tuple[Barrier, ...] = ()
    left_out: tuple[LeftOut, ...] = ()
    power: float = 1.0

    @property
    def feet(self) -> Floats:
        """Where drives of barriers stand, (barriers, 2) [m]."""
        return np.array([barrier.foot[:2] for barrier in self.barriers]).reshape(-1, 2)

    @property
    def slots(self) -> Mapping[str, int]:
        """How many arms of each prototype move."""
        return dict(sorted(Counter(_arm_name(barrier) for barrier in self.moving).items()))

    def following(self, phases: Mapping[str, SignalPhases], network: Network) -> Railway | None:
        """Return the same crossings as another log says; None if another barrier moves in it.

        Args:
            phases: The signal log by tls id.
            network: The road network.
        """
        if not self.barriers:
            return self
        gates = barriers_of(network, network.connections, phases)
        courses = {(gate.edge, gate.tls): gate.course for gate in gates}

        def of(some: tuple[Barrier, ...]) -> tuple[Barrier, ...]:
            pairs = ((each, courses.get((each.edge, each.tls), each.course)) for each in some)
            return tuple(replace(each, course=course) for each, course in pairs)

        still = {each.edge for each in self.barriers} - {each.edge for each in self.moving}
        if any(each.moves and each.edge in still for each in of(self.barriers)):
            return None
        return replace(self, barriers=of(self.barriers), moving=of(self.moving))

    def radiance_at(self, time: float) -> dict[str, Floats]:
        """Return the radiance of the flashing lights at a time [s], (lights, 3), by set id."""
        if not self.lamps:
            return {}
        lit = np.array([barrier.lit_at(time) for barrier in self.barriers]).reshape(-1, 1)
        return {LAMP_SET: frozen(self.power * lit * np.array(RADIANCE["red"]))}

    def movers_at(self, time: float) -> tuple[Mover, ...]:
        """Return the arms that move, as they stand at a time [s]."""
        return tuple(
            Mover(
                f"barrier:{barrier.edge}",
                _arm_name(barrier),
                _arm_pose(barrier, barrier.lowered_at(time)),
                _GREY,
            )
            for barrier in self.moving
        )


def build_railway(
    scenario: Scenario,
    links: Sequence[Connection],
    *,
    around: Surroundings,
    style: RoadStyle,
    raised: HeightAt | None = None,
) -> Railway:
    """Build the level crossings near the cameras of a shot.

    Args:
        scenario: The road network and the signal log.
        links: The network's connections in the region that is built.
        around: The cameras.
        style: How the St Andrew's crosses are painted.
        raised: How much higher than the carriageway people walk at places.
    """
    gates = barriers_of(scenario.network, links, scenario.signals)
    if not gates:
        return Railway(left_out=(LeftOut(FAMILY, "no road near the camera crosses a railway"),))
    # Choose those near a camera, the nearest first.
    places = np.array([barrier.foot[:2] for barrier in gates])
    away = around.distances(places)
    order = [k for k in np.lexsort((np.arange(len(gates)), away)).tolist() if away[k] < REACH]
    lift = np.zeros(len(gates)) if raised is None else raised(places)
    chosen = [replace(gates[k], foot=gates[k].foot + np.array([0.0, 0.0, lift[k]])) for k in order]
    moving = [barrier for barrier in chosen if barrier.moves][:_MOST_MOVING]
    # Build what stands, arms that never move among it.
    still = {id(barrier) for barrier in chosen} - {id(barrier) for barrier in moving}
    parts: list[Part] = []
    for barrier, k in zip(chosen, order, strict=True):
        stand = Transform.from_pose(barrier.foot, yaw=barrier.yaw)
        level = int(away[k] > _FAR)
        parts += _placed(
            [shapes.drive(), *shapes.warning_mast(style.st_andrews_cross, level=level)], stand
        )
        if id(barrier) in still:
            pose = _arm_pose(barrier, barrier.lowered_at(0.0))
            parts += _placed(shapes.arm(barrier.length), pose)
    names = {_arm_name(barrier): shapes.arm(barrier.length) for barrier in moving}
    return Railway(
        tuple(merged(FAMILY, parts)),
        (_lights(chosen),) if chosen else (),
        {name: Prototype(name, made, made) for name, made in sorted(names.items())},
        tuple(chosen),
        tuple(moving),
        _silent(chosen),
        NIGHT_POWER if around.dark else 1.0,
    )


def _arm_name(barrier: Barrier) -> str:
    """The prototype of a barrier's arm."""
    return f"barrier_arm_{round(100 * barrier.length)}"


def _arm_pose(barrier: Barrier, lowered: float) -> Transform:
    """Where an arm is that is lowered by a share: 0 up, 1 down."""
    hinge = barrier.foot + np.array(shapes.HINGE)
    return Transform.from_pose(hinge, yaw=barrier.arm_yaw, pitch=(1.0 - lowered) * UPRIGHT)


def _placed(parts: Sequence[Part], where: Transform) -> list[Part]:
    """Parts carried into the world."""
    thing = thing_at("barrier", where.position)
    return [
        Part(belonging(where.mesh(part.mesh), thing), part.material, part.tint) for part in parts
    ]


def _lights(barriers: Sequence[Barrier]) -> LampSet:
    """The flashing lights of all barriers as one mesh."""
    meshes, names = [], []
    for barrier in barriers:
        stand = Transform.from_pose(barrier.foot, yaw=barrier.yaw)
        for side in shapes.LAMPS:
            thing = thing_at("barrier", barrier.foot)
            meshes.append(belonging(stand.mesh(shapes.light(side)), thing))
            names.append(f"{barrier.edge}/{side}")
    index = np.repeat(np.arange(len(meshes)), [len(mesh.faces) for mesh in meshes])
    tint = np.tile(GLASS["red"], (len(index), 1))
    mesh = merge_meshes(meshes)
    return LampSet(LAMP_SET, FAMILY, mesh, index, tuple(names), tint=tint, lobe=LOBE)


def _silent(barriers: Sequence[Barrier]) -> tuple[LeftOut, ...]:
    """Say which barriers stay open because no log tells when they close."""
    silent = sum(not barrier.course.times for barrier in barriers)
    if not silent:
        return ()
    why = "the signal log does not know their crossing; they stay open"
    return (LeftOut(f"closing of {silent} barriers", why),)
