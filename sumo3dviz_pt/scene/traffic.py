"""Road users: which bodies and colours they show, and where they are at a time."""

from __future__ import annotations

import difflib
import logging
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.job import VehicleSettings
from sumo3dviz_pt.model.geometry import Bools, Colour, Floats, Ints, Transform
from sumo3dviz_pt.model.scene import Bsdf, Mover, Prototype, View
from sumo3dviz_pt.model.traffic import VehicleType
from sumo3dviz_pt.model.trajectory import Motion, Piece, Trajectory
from sumo3dviz_pt.scene.bodies import Body, build_body
from sumo3dviz_pt.scene.body_choice import (
    Choice,
    PlainChoice,
    choose,
    drawn_class,
    looks_for,
    models_for,
)
from sumo3dviz_pt.scene.chance import share_of
from sumo3dviz_pt.scene.crowd import Drawn
from sumo3dviz_pt.scene.fitted_models import Shelf
from sumo3dviz_pt.scene.fleet_colours import own_palette, paint_of
from sumo3dviz_pt.scene.gait import Walk, effort
from sumo3dviz_pt.scene.heroes import hero_prototypes
from sumo3dviz_pt.scene.vehicle_lights import VehicleLights
from sumo3dviz_pt.shapes.cutaway import cutaway

_LOG = logging.getLogger(__name__)

_MOMENT = 0.1
"""Before and after which the speed tells whether somebody brakes [s]."""

_UNKNOWN_TYPES: Mapping[str, VehicleType] = {
    "vehicle": VehicleType("", "passenger", 5.0, 1.8, 1.5),
    "person": VehicleType("", "pedestrian", 0.215, 0.478, 1.719),
    "container": VehicleType("", "container", 6.1, 2.4, 2.6),
}
"""SUMO's class defaults (1.28), where the type is not known."""


@dataclass(frozen=True, slots=True, eq=False)
class Fleet:
    """All road users of a shot.

    Attributes:
        trajectories: One for each road user.
        bodies: What each shows.
        colours: Of each.
        cockpits: Names of opened prototypes by key of who rides in them.
        prototypes: By name; only those in use.
        materials: What user models need beside `MATERIALS`.
        pieces: All stretches of motion with their owner's index, in order.
        lives: Begin and end of each piece, (pieces, 2) [s].
        owners: Index of each piece's road user, (pieces,).
        places: Index of each road user by key.
        lights: Which lamps they light; None leaves all off.
        seed: Of all chance.
        walks: How far people have walked, by index of the piece.
    """

    trajectories: tuple[Trajectory, ...]
    bodies: tuple[Body, ...]
    colours: tuple[Colour, ...]
    prototypes: Mapping[str, Prototype]
    materials: Mapping[str, Bsdf] = field(default_factory=dict)
    cockpits: Mapping[str, str] = field(default_factory=dict)
    lights: VehicleLights | None = None
    seed: int = 0
    pieces: tuple[Piece, ...] = field(init=False)
    lives: Floats = field(init=False)
    owners: Ints = field(init=False)
    places: Mapping[str, int] = field(init=False)
    walks: Mapping[int, Walk] = field(init=False)

    def __post_init__(self) -> None:
        """Index the pieces of motion, so that a frame asks only those alive."""
        pieces = [(k, piece) for k, t in enumerate(self.trajectories) for piece in t.pieces]
        lives = np.array([(piece.begin, piece.end) for _, piece in pieces]).reshape(-1, 2)
        places = {trajectory.key: k for k, trajectory in enumerate(self.trajectories)}
        object.__setattr__(self, "places", places)
        object.__setattr__(self, "pieces", tuple(piece for _, piece in pieces))
        object.__setattr__(self, "lives", lives)
        object.__setattr__(self, "owners", np.array([k for k, _ in pieces], dtype=np.int64))
        walks = {
            number: Walk.of(piece)
            for number, (k, piece) in enumerate(pieces)
            if self.bodies[k].stride is not None
        }
        object.__setattr__(self, "walks", walks)

    @property
    def keys(self) -> tuple[str, ...]:
        """Keys of all road users, such as `vehicle:flow_0.3`."""
        return tuple(trajectory.key for trajectory in self.trajectories)

    @property
    def sizes(self) -> Floats:
        """Length, width and height as drawn, (v, 3) [m]."""
        return np.array([body.size for body in self.bodies]).reshape(-1, 3)

    def movers_at(self, time: float, *, view: View | None = None) -> tuple[Mover, ...]:
        """Everyone who exists at a time [s], in the order of the trajectories.

        Args:
            time: SUMO's time [s].
            view: The camera; the vehicle that it rides in is opened where it says so.
        """
        return tuple(mover for _, mover in self.present_at(time, view=view))

    def present_at(self, time: float, *, view: View | None = None) -> tuple[tuple[int, Mover], ...]:
        """Everyone who exists at a time with their index; arguments as in `movers_at`."""
        inside = (self.lives[:, 0] - 1e-9 <= time) & (time <= self.lives[:, 1] + 1e-9)
        alive = np.flatnonzero(inside)
        motions = [self._sampled(piece, time) for piece in alive.tolist()]
        if not motions:
            return ()
        owners = [int(self.owners[piece]) for piece in alive.tolist()]
        matrices = _placements(motions, scales=np.stack([self.bodies[k].scale for k in owners]))
        opened = view.rides_in if view is not None and view.cutaway else None
        return tuple(
            (int(self.owners[n]), self._mover(n, matrix, motion, time, opened=opened))
            for n, matrix, motion in zip(alive.tolist(), matrices, motions, strict=True)
        )

    def positions(self, times: Floats) -> tuple[Bools, Floats, Floats]:
        """Where everyone is, for culling.

        Args:
            times: (t,) [s].

        Returns:
            Whether each exists, (v, t); fronts, (v, t, 3) [m]; yaws, (v, t) [rad]; NaN
            where it does not exist.
        """
        shape = (len(self.trajectories), len(times))
        alive = np.zeros(shape, dtype=np.bool_)
        positions, yaws = np.full((*shape, 3), np.nan), np.full(shape, np.nan)
        for k, trajectory in enumerate(self.trajectories):
            motion = trajectory.sample(times)
            alive[k], positions[k], yaws[k] = motion.alive, motion.positions, motion.yaws
        return alive, positions, yaws

    def body(self, key: str) -> Body:
        """What a road user shows; it must be one of `keys`."""
        return self.bodies[self.places[key]]

    def with_cockpit(self, key: str, *, left_hand: bool = False) -> Fleet:
        """The same fleet, ready to open the vehicle that a camera sits in.

        Args:
            key: One of `keys`.
            left_hand: Whether traffic keeps left and drivers sit on the right.
        """
        body = self.body(key)
        cowl, eye = body.seat.cowl / body.scale, body.seat.eye / body.scale
        eye = eye * [1.0, -1.0 if left_hand else 1.0, 1.0]
        opened = cutaway(body.prototype, cowl=float(cowl[0]), belt=float(cowl[2]), eye=eye)
        return replace(
            self,
            prototypes={**self.prototypes, opened.name: opened},
            cockpits={**self.cockpits, key: opened.name},
        )

    def drawn(self, k: int, *, opened: bool = False) -> Drawn:
        """What a road user is drawn with.

        Args:
            k: Its index.
            opened: Whether a camera sits in it at some time.
        """
        drawn, cockpit = self.bodies[k].assembly.drawn, self.cockpits.get(self.keys[k])
        if not (opened and cockpit):
            return drawn
        return replace(drawn, near=(cockpit, *drawn.near[1:]), hero=())

    def with_heroes(self, models: frozenset[str]) -> Fleet:
        """The same fleet with some models in full detail, built if need be."""
        units = {
            unit.hero: unit
            for body in self.bodies
            if body.assembly.model in models
            for unit in body.assembly.units
        }
        made = hero_prototypes({unit.source for unit in units.values()})
        lit = {
            name: replace(made[name], lamps=unit.prototype.lamps) for name, unit in units.items()
        }
        return replace(self, prototypes={**self.prototypes, **made, **lit})

    def _sampled(self, piece: int, time: float) -> Motion:
        """Motion of one piece a moment before a time, at it and a moment after."""
        begin, end = self.lives[piece]
        times = np.array([time - _MOMENT, time, time + _MOMENT])
        return self.pieces[piece].sample(np.clip(times, begin, end))

    def _mover(
        self, piece: int, matrix: Floats, motion: Motion, time: float, *, opened: str | None
    ) -> Mover:
        """One road user at its place."""
        k = int(self.owners[piece])
        key, name = self.trajectories[k].key, self.bodies[k].prototype.name
        if key == opened:
            name = self.cockpits.get(key, name)
        mover = Mover(key, name, Transform(matrix), self.colours[k])
        speed, stride = float(motion.speeds[1]), self.bodies[k].stride
        if stride is not None:
            start = share_of(self.seed, key, "gait")
            phase = self.walks[piece].phase(time, stride=stride, start=start)
            mover = replace(mover, phase=phase, effort=effort(speed))
        if self.lights is None or not self.bodies[k].prototype.lamps:
            return mover
        change = float(motion.speeds[2] - motion.speeds[0]) / (2.0 * _MOMENT)
        return replace(mover, lit=self.lights.lit(key, time, speed=speed, acceleration=change))


def build_fleet(
    trajectories: Sequence[Trajectory],
    vehicle_types: Mapping[str, VehicleType],
    settings: VehicleSettings,
    *,
    seed: int,
    lights: VehicleLights | None = None,
) -> Fleet:
    """Give every road user its body and colour.

    Args:
        trajectories: With unique keys.
        vehicle_types: By id; unknown types get SUMO's class defaults.
        settings: Models, colours and user models.
        seed: The job's; a road user's choice depends on it and on its id only.
        lights: Which lamps they light; None leaves all off.

    Raises:
        ConfigError: If a model, colour or user's file is wrong.
    """
    wanted = dict(settings.models)
    looks = looks_for(wanted.pop("pedestrian", ()))
    models = models_for({**wanted, "passenger": settings.passenger})
    if not isinstance(settings.colours, str):
        own_palette(settings.colours)
    kinds = [vehicle_types.get(t.type_id, _UNKNOWN_TYPES[t.kind]) for t in trajectories]
    choices = [
        choose(
            k,
            name=t.id,
            models=models,
            own=settings.user_models if t.kind == "vehicle" else {},
            seed=seed,
            looks=looks,
        )
        for t, k in zip(trajectories, kinds, strict=True)
    ]
    shelf: Shelf = {}
    made = {choice: build_body(choice, shelf) for choice in dict.fromkeys(choices)}
    _announce(choices)
    paints = [
        paint_of(drawn_class(k), k, key=t.id, colours=settings.colours, seed=seed)
        for t, k in zip(trajectories, kinds, strict=True)
    ]
    materials = {name: bsdf for body in made.values() for name, bsdf in body.materials.items()}
    bodies = tuple(made[choice] for choice in choices)
    return Fleet(
        tuple(trajectories),
        bodies,
        tuple(paints),
        shelf,
        materials,
        lights=lights,
        seed=seed,
    )


def find_rider(fleet: Fleet, name: str) -> Trajectory:
    """The trajectory of a vehicle, person or container by SUMO's id, or by its key.

    Raises:
        ConfigError: If the log has none of that name; the message names some it has.
    """
    known = {trajectory.key: trajectory for trajectory in fleet.trajectories}
    for key in (f"vehicle:{name}", f"person:{name}", f"container:{name}", name):
        if key in known:
            return known[key]
    raise ConfigError(f"no vehicle or person is called {name!r}{_suggested(name, fleet)}")


def _suggested(name: str, fleet: Fleet) -> str:
    """End of a sentence that names near ids and some that exist."""
    ids = list(dict.fromkeys(trajectory.id for trajectory in fleet.trajectories))
    if not ids:
        return "; there is nobody in this time window"
    near = difflib.get_close_matches(name, ids, n=3, cutoff=0.6)
    some = [each for each in ids if each not in near][:3]
    meant = f"; did you mean {', '.join(map(repr, near))}?" if near else ""
    return f"{meant}; for example {', '.join(map(repr, some))} exist" if some else meant


def _announce(choices: Sequence[Choice]) -> None:
    """Say once which classes have no detailed models."""
    plain = sorted({choice.vclass for choice in choices if isinstance(choice, PlainChoice)})
    if plain:
        _LOG.warning("plain bodies stand for %s: there are no models yet", ", ".join(plain))


def _placements(motions: Sequence[Motion], *, scales: Floats) -> Floats:
    """Matrices from body to world, (n, 4, 4): scale, then pitch, then yaw.

    Args:
        motions: Each at three times, of which the middle one counts.
        scales: (n, 3).
    """
    yaws = np.array([motion.yaws[1] for motion in motions])
    pitches = np.array([motion.pitches[1] for motion in motions])
    cy, sy, cp, sp = np.cos(yaws), np.sin(yaws), np.cos(pitches), np.sin(pitches)
    zero = np.zeros(len(motions))
    matrices = np.zeros((len(motions), 4, 4))
    matrices[:, :3, 0] = np.stack([cy * cp, sy * cp, sp], axis=1)
    matrices[:, :3, 1] = np.stack([-sy, cy, zero], axis=1)
    matrices[:, :3, 2] = np.stack([-cy * sp, -sy * sp, cp], axis=1)
    matrices[:, :3, :3] *= scales[:, None, :]
    matrices[:, :3, 3] = np.stack([motion.positions[1] for motion in motions])
    matrices[:, 3, 3] = 1.0
    return matrices
