"""What railways add to a place beside tracks: level crossings with barriers that move."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from sumo3dviz_pt.library.street import level_crossing as shapes
from sumo3dviz_pt.library.street.road_styles import RoadStyle
from sumo3dviz_pt.model.geometry import Floats, Transform, belonging, frozen, merge_meshes
from sumo3dviz_pt.model.lamps import LampSet
from sumo3dviz_pt.model.network import Connection
from sumo3dviz_pt.model.scenario import Scenario
from sumo3dviz_pt.model.scene import LeftOut, Mover, Part, Prototype, StaticPart
from sumo3dviz_pt.world.objects.build import merged
from sumo3dviz_pt.world.placement.surroundings import HeightAt, Surroundings
from sumo3dviz_pt.world.placement.things import thing_at
from sumo3dviz_pt.world.rails.crossings import UPRIGHT, Barrier, barriers_of
from sumo3dviz_pt.world.signals.bodies import GLASS, LOBE
from sumo3dviz_pt.world.signals.build import NIGHT_POWER, RADIANCE

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
    found = barriers_of(scenario.network, links, scenario.signals)
    if not found:
        return Railway(left_out=(LeftOut(FAMILY, "no road near the camera crosses a railway"),))
    # Choose those near a camera, the nearest first.
    places = np.array([barrier.foot[:2] for barrier in found])
    away = around.distances(places)
    order = [k for k in np.lexsort((np.arange(len(found)), away)).tolist() if away[k] < REACH]
    lift = np.zeros(len(found)) if raised is None else raised(places)
    chosen = [replace(found[k], foot=found[k].foot + np.array([0.0, 0.0, lift[k]])) for k in order]
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
