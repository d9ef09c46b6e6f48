"""How road users stand at a time: bent, swaying, on wheels that roll, with lamps that shine.

Everything is a function of the time alone. What is expensive and the same for a whole stretch
of motion, such as the way of a wheel, is computed when it is first used, and kept.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from sumo3dviz_pt.cast.articulation import UnitLinks, rigid_frames, unit_frames
from sumo3dviz_pt.cast.bodies import Body
from sumo3dviz_pt.cast.derived_lamps import DerivedLamps, derived_lamps
from sumo3dviz_pt.cast.drawing import AT_REST, Stance
from sumo3dviz_pt.cast.presence import Presence
from sumo3dviz_pt.cast.rolling import Hub, Rolling
from sumo3dviz_pt.cast.sway import SPRINGS, Springs, Sway, lean_at, sway_at
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.traffic import RAIL_CLASSES
from sumo3dviz_pt.model.trajectory import MotionPiece, Trajectory

_ON_WATER = frozenset(["ship"])


class PoseSampler:
    """Looks up how road users stand."""

    def __init__(
        self,
        trajectories: Sequence[Trajectory],
        bodies: Sequence[Body],
        presence: Presence,
        *,
        suspension: bool,
    ) -> None:
        """Keep references to what poses depend on.

        Args:
            trajectories: Of all road users.
            bodies: What each shows.
            presence: Their stretches of motion.
            suspension: Whether bodies move on their springs.
        """
        self._trajectories, self._bodies, self._presence = trajectories, bodies, presence
        self._suspension = suspension
        self._rolling: dict[int, Rolling] = {}
        self._derived: dict[int, DerivedLamps] = {}

    def stance(self, piece: int, time: float, *, full: bool, ridden: bool) -> Stance:
        """Return how a road user stands.

        Args:
            piece: Index of its stretch of motion.
            time: SUMO's [s].
            full: Whether it is drawn in full detail, with separate wheels.
            ridden: Whether the camera rides with it.
        """
        body = self._bodies[self._presence.owners[piece]]
        motion, links = self._presence.pieces[piece], links_of(body)
        units = None if links is None else unit_frames(motion, np.array([time]), links)[0]
        springs = springs_of(body) if self._suspension and (full or ridden) else None
        sway = None if springs is None else _swayed(body, sway_at(motion, time, springs=springs))
        wheels = self._wheels(piece).at(time) if full else None
        if units is None and sway is None and wheels is None:
            return AT_REST
        return Stance(units, sway, wheels)

    def lean(self, piece: int, time: float) -> Floats:
        """Return what riders of a cycle add to its placement, in its frame, (4, 4)."""
        return lean_at(self._presence.pieces[piece], time).about(0.0, 0.0)

    def derived(self, piece: int) -> DerivedLamps:
        """Return when the lamps of a vehicle without logged signals shine."""
        if piece not in self._derived:
            user = int(self._presence.owners[piece])
            steers = self._bodies[user].vclass not in RAIL_CLASSES | _ON_WATER
            remarks = self._trajectories[user].remarks
            motion = self._presence.pieces[piece]
            self._derived[piece] = derived_lamps(motion, remarks, steers=steers)
        return self._derived[piece]

    def _wheels(self, piece: int) -> Rolling:
        """The wheels of a road user that has full detail."""
        if piece not in self._rolling:
            body = self._bodies[self._presence.owners[piece]]
            motion, links = self._presence.pieces[piece], links_of(body)
            hubs = [
                Hub.of(number, place, body.scale * [unit.stretch, 1.0, 1.0])
                for number, unit in enumerate(body.assembly.units)
                for place in unit.wheels
            ]
            if body.ride == "lean":  # forks are part of the body, and riders lean to steer
                hubs = [replace(hub, steered=False) for hub in hubs]
            self._rolling[piece] = Rolling.of(
                motion.begin, motion.end, hubs, lambda times: _frames(motion, times, links)
            )
        return self._rolling[piece]


def links_of(body: Body) -> UnitLinks | None:
    """Return where the units of a body are held, as drawn; None where it is rigid."""
    return body.assembly.links(body.scale) if body.assembly.bends else None


def springs_of(body: Body) -> Springs | None:
    """Return the springs of a body, or None where it has none."""
    return SPRINGS.get(body.ride)


def first_frame(piece: MotionPiece, time: float, links: UnitLinks | None) -> Floats:
    """Return the placement of a road user's first unit, unscaled, (4, 4).

    Args:
        piece: A stretch of its motion.
        time: Within the stretch [s].
        links: Where its units are held; None where it is rigid.
    """
    return np.asarray(_frames(piece, np.array([time]), links)[0, 0])


def sway_of(body: Body, piece: MotionPiece, time: float) -> Floats:
    """Return what springs or riders do to a body's first unit, in its frame, (4, 4).

    Args:
        body: The body.
        piece: A stretch of its motion.
        time: Within the stretch [s].
    """
    springs = springs_of(body)
    if springs is not None:
        sway = sway_at(piece, time, springs=springs)
        return np.asarray(_swayed(body, sway)[0])
    return lean_at(piece, time).about(0.0, 0.0) if body.ride == "lean" else np.eye(4)


def _frames(piece: MotionPiece, times: Floats, links: UnitLinks | None) -> Floats:
    """Placements of all units at times, (n, u, 4, 4), unscaled."""
    if links is not None:
        return unit_frames(piece, times, links)
    motion = piece.sample(times)
    return rigid_frames(motion.positions, motion.yaws, motion.pitches)[:, None]


def _swayed(body: Body, sway: Sway) -> Floats:
    """What springs do to all units, each in its frame, (u, 4, 4).

    Units that are joined roll together and do not dive: they would part at the joint.
    """
    units = body.assembly.units
    height = SPRINGS[body.ride].height
    if len(units) == 1:
        return sway.about(-body.size[0] / 2.0, height)[None]
    rolled = Sway(roll=sway.roll).about(0.0, height)
    return np.broadcast_to(rolled, (len(units), 4, 4))
