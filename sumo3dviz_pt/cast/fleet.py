"""Road users: which bodies and colours they show, and where they are at a time.

They are found by SUMO's id, or by their key.
"""

from __future__ import annotations

import logging
from collections.abc import Container, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Literal

import numpy as np

from sumo3dviz_pt.cast.axles import rigid_frames
from sumo3dviz_pt.cast.bodies import Body, Cockpit, build_body, open_cockpit
from sumo3dviz_pt.cast.choice import (
    Choice,
    Model,
    OwnLooks,
    PersonLook,
    PlainChoice,
    choose,
    drawn_class,
    looks_for,
    models_for,
)
from sumo3dviz_pt.cast.colours import own_palette, paint_of
from sumo3dviz_pt.cast.counts import counted_people
from sumo3dviz_pt.cast.drawing import AT_REST, Drawn, counted_bodies, full_bodies, letters_on
from sumo3dviz_pt.cast.lamps import VehicleLights
from sumo3dviz_pt.cast.outfits import Air, dressed_looks, dressed_riders, outfit_for
from sumo3dviz_pt.cast.poses import (
    PoseSampler,
    Presence,
    Present,
    Rise,
    effort,
    grounded,
    stride_phase,
)
from sumo3dviz_pt.job.settings import VehicleSettings
from sumo3dviz_pt.library.paints import flop_of
from sumo3dviz_pt.library.vehicles.plates import LETTER, letter
from sumo3dviz_pt.library.vehicles.wake import wake, wake_name
from sumo3dviz_pt.model.geometry import Bools, Colour, Floats, Ints, Transform
from sumo3dviz_pt.model.network import UNPLACED, Location
from sumo3dviz_pt.model.random import share_of
from sumo3dviz_pt.model.scene import Bsdf, Mover, Prototype, View
from sumo3dviz_pt.model.traffic import UNKNOWN_TYPES, VehicleType
from sumo3dviz_pt.model.trajectory import Trajectory, find_trajectory

_LOG = logging.getLogger(__name__)

_OFF_GROUND = frozenset({"aircraft", "cable_car", "drone", "ship"})
"""vClasses that stand on no road."""

_LEAST_WAKE = 0.5  # slower ships leave no foam [m/s]

Level = Literal["near", "far", "full"]
"""In detail, by a stand-in, in full detail."""


@dataclass(frozen=True, slots=True, eq=False)
class Fleet:
    """All road users of a shot.

    Attributes:
        trajectories: One for each road user.
        bodies: What each shows.
        colours: Of each.
        cockpits: Opened bodies by key of the road user that a camera sits in.
        prototypes: By name; only those in use.
        materials: Of user models, beside `MATERIALS`.
        lights: Which lamps they light; None leaves all off.
        seed: Of all chance.
        outfits: Of each, what makes the clothes of people differ; empty where nobody has one.
        suspension: Whether bodies move on their springs and riders lean.
        times: Of the shot's frames, increasing, (n,) [s]; None where they are not known.
        parked: Keys of those that never move.
        location: From where all places are counted; cameras of scene files are placed by it.
        wakes: Whether ships float on water that is drawn, and leave foam on it.
        places: Index of each road user by key.
        lengths: As drawn, (v,) [m].
        on_foot: Who walks, (v,).
        presence: Who exists when.
        pose_sampler: How they stand.
    """

    trajectories: tuple[Trajectory, ...]
    bodies: tuple[Body, ...]
    colours: tuple[Colour, ...]
    prototypes: Mapping[str, Prototype]
    materials: Mapping[str, Bsdf] = field(default_factory=dict)
    cockpits: Mapping[str, Cockpit] = field(default_factory=dict)
    lights: VehicleLights | None = None
    seed: int = 0
    outfits: tuple[Mapping[str, Colour], ...] = ()
    suspension: bool = True
    times: Floats | None = None
    parked: frozenset[str] = frozenset()
    location: Location = UNPLACED
    wakes: bool = False
    places: Mapping[str, int] = field(init=False)
    lengths: Floats = field(init=False)
    on_foot: Bools = field(init=False)
    presence: Presence = field(init=False)
    pose_sampler: PoseSampler = field(init=False)

    def __post_init__(self) -> None:
        """Index the stretches of motion, so that a frame looks only at those that it is in."""
        places = {trajectory.key: k for k, trajectory in enumerate(self.trajectories)}
        presence = Presence(self.trajectories, self.times)
        pose_sampler = PoseSampler(
            self.trajectories, self.bodies, presence, suspension=self.suspension
        )
        on_foot = [trajectory.kind == "person" for trajectory in self.trajectories]
        object.__setattr__(self, "places", places)
        object.__setattr__(self, "lengths", np.array([body.size[0] for body in self.bodies]))
        object.__setattr__(self, "on_foot", np.array(on_foot, dtype=np.bool_))
        object.__setattr__(self, "presence", presence)
        object.__setattr__(self, "pose_sampler", pose_sampler)

    @property
    def keys(self) -> tuple[str, ...]:
        """Keys of all road users, such as `vehicle:flow_0.3`."""
        return tuple(trajectory.key for trajectory in self.trajectories)

    @property
    def sizes(self) -> Floats:
        """Length, width and height as drawn, (v, 3) [m]."""
        return np.array([body.size for body in self.bodies]).reshape(-1, 3)

    def movers_at(self, time: float, *, view: View | None = None) -> tuple[Mover, ...]:
        """Return all road users that exist at a time, in the order of the trajectories.

        Args:
            time: SUMO's time [s].
            view: The camera; the vehicle that it rides in is opened if its view is a cutaway.
        """
        present = self.presence.at(time)
        return tuple(self.wholes(present, np.arange(len(present.users)), view=view))

    def wholes(self, present: Present, rows: Ints, *, view: View | None = None) -> Iterator[Mover]:
        """Yield some of the road users that exist at a time, each in one piece.

        Args:
            present: Everyone then.
            rows: Which of them, (n,).
            view: As in `movers_at`.
        """
        positions, yaws, pitches = present.positions[rows], present.yaws[rows], present.pitches
        matrices = rigid_frames(positions, yaws, pitches[rows])
        opened = view.rides_in if view is not None and view.cutaway else None
        for row, matrix in zip(rows.tolist(), matrices, strict=True):
            yield self._whole(present, row, matrix, opened=opened)

    def parts(
        self,
        present: Present,
        row: int,
        whole: Mover,
        *,
        level: Level,
        ridden: bool,
        lettered: bool = False,
    ) -> Iterator[Mover]:
        """Yield the parts that a road user that exists at a time is drawn with.

        Args:
            present: Everyone then.
            row: Which of them.
            whole: The road user in one piece, from `wholes`.
            level: Of detail.
            ridden: Whether the camera rides with it.
            lettered: Whether its number plates can be read.
        """
        body, piece = self.bodies[int(present.users[row])], int(present.pieces[row])
        full, stance = level == "full", AT_REST
        if full or ridden or body.assembly.bends:
            stance = self.pose_sampler.stance(piece, present.time, full=full, ridden=ridden)
        if self.suspension and body.ride == "lean" and level != "far":
            leant = Transform(self.pose_sampler.lean(piece, present.time))
            whole = replace(whole, world_from_body=whole.world_from_body @ leant)
        cockpit = None if level == "far" else self.cockpits.get(whole.id)
        for mover in body.assembly.movers(whole, full=full, stance=stance):
            yield mover
            if lettered:
                yield from letters_on(mover, body.assembly.plates.get(mover.prototype, ()))
            if cockpit is not None and mover.prototype == cockpit.body.name:
                yield from cockpit.needles(mover, speed=float(present.speeds[row]))
        moves = bool(present.speeds[row] > _LEAST_WAKE)
        if moves and level != "far" and self._leaves_wake(body):
            frame = whole.world_from_body.matrix.copy()
            frame[:3, :3] /= np.linalg.norm(frame[:3, :3], axis=0)
            placed, name = Transform(frame), wake_name(*body.size[:2])
            yield replace(whole, prototype=name, part="wake", world_from_body=placed)

    def _leaves_wake(self, body: Body) -> bool:
        """Whether a body leaves foam on the water that it moves on."""
        return self.wakes and body.vclass == "ship"

    def with_wakes(self) -> Fleet:
        """Return the same fleet on water that is drawn."""
        sizes = {body.size[:2] for body in self.bodies if body.vclass == "ship"}
        foam = {wake_name(*size): wake(*size) for size in sorted(sizes)}
        return replace(self, wakes=True, prototypes={**self.prototypes, **foam}) if foam else self

    def positions(self, times: Floats) -> tuple[Bools, Floats]:
        """Return where everyone is, for culling.

        Args:
            times: (t,) [s].

        Returns:
            Whether each exists, (v, t), and fronts, (v, t, 3) [m]: NaN where it does not.
        """
        shape = (len(self.trajectories), len(times))
        alive, positions = np.zeros(shape, dtype=np.bool_), np.full((*shape, 3), np.nan)
        for k, trajectory in enumerate(self.trajectories):
            motion = trajectory.sample(times)
            alive[k], positions[k] = motion.alive, motion.positions
        return alive, positions

    def body(self, key: str) -> Body:
        """Return what a road user shows; it must be one of `keys`."""
        return self.bodies[self.places[key]]

    def with_cockpit(self, key: str, *, left_hand: bool = False, wipers: bool = True) -> Fleet:
        """Return the same fleet, ready to open the vehicle that a camera sits in.

        Args:
            key: One of `keys`.
            left_hand: Whether traffic keeps left and drivers sit on the right.
            wipers: Whether wipers rest on its windscreen.
        """
        opened = open_cockpit(self.body(key), left_hand=left_hand, wipers=wipers)
        return replace(
            self,
            prototypes={**self.prototypes, **opened.prototypes},
            cockpits={**self.cockpits, key: opened},
        )

    def drawn(self, k: int, *, opened: bool = False) -> Drawn:
        """Return what a road user is drawn with.

        Args:
            k: Its index.
            opened: Whether a camera sits in it at some time.
        """
        drawn = replace(self.bodies[k].assembly.drawn, length=float(self.lengths[k]))
        if self._leaves_wake(self.bodies[k]):
            drawn = replace(drawn, near=(*drawn.near, wake_name(*self.bodies[k].size[:2])))
        cockpit = self.cockpits.get(self.trajectories[k].key)
        if cockpit is None or not opened:
            return drawn
        return replace(drawn, near=(*cockpit.names, *drawn.near[1:]), full=())

    def grounded(self, rise: Rise) -> Fleet:
        """Return the same fleet on the road that is drawn.

        Args:
            rise: How far the drawn surface lies above points, (n, 3) -> (n,) [m].
        """
        upright = np.where(self.on_foot, 0.0, self.lengths).tolist()
        trajectories = tuple(
            trajectory if body.vclass in _OFF_GROUND else grounded(trajectory, rise, length=length)
            for trajectory, body, length in zip(
                self.trajectories, self.bodies, upright, strict=True
            )
        )
        return replace(self, trajectories=trajectories)

    def with_full_detail(
        self, models: frozenset[str], *, lettered: bool = False, counted: bool = False
    ) -> Fleet:
        """Return the same fleet with some models in full detail; build them if they are new.

        Args:
            models: Their names.
            lettered: Whether number plates can be read.
            counted: Whether their numbers of triangles are enough.
        """
        made = (counted_bodies if counted else full_bodies)(
            unit
            for body in self.bodies
            if body.assembly.model in models
            for unit in body.assembly.units
        )
        letters = {LETTER: letter()} if lettered else {}
        return replace(self, prototypes={**self.prototypes, **made, **letters})

    def first_step(self, key: str) -> float:
        """Return the phase with which somebody's strides begin, [0, 1)."""
        return share_of(self.seed, key, "gait")

    def _whole(self, present: Present, row: int, frame: Floats, *, opened: str | None) -> Mover:
        """One road user at its place, in one piece."""
        k, piece = int(present.users[row]), int(present.pieces[row])
        body, key = self.bodies[k], self.trajectories[k].key
        name = body.prototype.name
        shown = [unit.prototype for unit in body.assembly.units]
        if key == opened and key in self.cockpits:
            shown.append(self.cockpits[key].body)
            name = shown[-1].name
        frame = frame.copy()
        frame[:3, :3] *= body.scale
        phase = share = 0.0
        if body.stride is not None:
            travelled = float(present.travelled[row])
            phase = stride_phase(travelled, stride=body.stride, start=self.first_step(key))
            share = effort(float(present.speeds[row]))
        lit = frozenset[str]()
        # What a body has no lamp for shines nowhere: bicycles brake without a light.
        has = frozenset(lamp.role for each in shown for lamp in each.lamps)
        if self.lights is not None and has:
            derived = partial(self.pose_sampler.derived, piece)
            lit = has & self.lights.lit(key, present.time, derived=derived)
        colour, parked = self.colours[k], key in self.parked
        outfit = self.outfits[k] if self.outfits else {}
        return Mover(
            key,
            name,
            Transform(frame),
            colour,
            lit,
            phase=phase,
            effort=share,
            parked=parked,
            outfit=outfit,
            flop=flop_of(colour),
        )


def build_fleet(
    trajectories: Sequence[Trajectory],
    vehicle_types: Mapping[str, VehicleType],
    settings: VehicleSettings,
    *,
    seed: int,
    counted: Container[str] = (),
    air: Air = Air.MIXED,
) -> Fleet:
    """Give every road user its body and colour; nobody has lights on.

    Args:
        trajectories: With unique keys.
        vehicle_types: By id; unknown types get SUMO's class defaults.
        settings: Models, colours and user models.
        seed: The job's; a road user's choice depends on it and on its id only.
        counted: Keys of those whose numbers of triangles are enough.
        air: What people dress for.

    Raises:
        ConfigError: If a model, colour or user's file is wrong.
    """
    casting = _Casting.of(settings, seed, air)
    kinds = [vehicle_types.get(t.type_id, UNKNOWN_TYPES[t.kind]) for t in trajectories]
    members = list(zip(trajectories, kinds, strict=True))
    choices = [casting.choice(trajectory, kind) for trajectory, kind in members]
    pairs = zip(trajectories, choices, strict=True)
    shaped = {choice for each, choice in pairs if each.key not in counted}
    prototypes = counted_people(set(choices) - shaped, shaped=shaped)
    made = {choice: build_body(choice, prototypes) for choice in dict.fromkeys(choices)}
    _announce(choices)
    return Fleet(
        tuple(trajectories),
        tuple(made[choice] for choice in choices),
        tuple(casting.colour(trajectory, kind) for trajectory, kind in members),
        prototypes,
        {name: bsdf for body in made.values() for name, bsdf in body.materials.items()},
        seed=seed,
        outfits=tuple(
            outfit_for(choice, seed=seed, key=trajectory.id)
            for trajectory, choice in zip(trajectories, choices, strict=True)
        ),
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Casting:
    """What decides which body and colour a road user gets.

    Attributes:
        settings: The scene file's.
        seed: The job's.
        own: What the scene file says of single road users.
        models: Vehicles that bodies are drawn from.
        looks: Looks that people are drawn from.
    """

    settings: VehicleSettings
    seed: int
    own: OwnLooks
    models: tuple[Model, ...]
    looks: tuple[PersonLook, ...]

    @classmethod
    def of(cls, settings: VehicleSettings, seed: int, air: Air) -> _Casting:
        """Look up what settings name, and refuse names and colours that do not exist."""
        wanted = dict(settings.models)
        looks = dressed_looks(looks_for(wanted.pop("pedestrian", ())), air)
        models = dressed_riders(models_for({**wanted, "passenger": settings.passenger}), air)
        if not isinstance(settings.colours, str):
            own_palette(settings.colours)
        return cls(settings, seed, OwnLooks(settings.by_id), models, looks)

    def choice(self, trajectory: Trajectory, kind: VehicleType) -> Choice:
        """Return the body of a road user of a vType: its own, or one by chance."""
        name = _named(trajectory, kind)
        own = self.own.choice(kind, name=name, walks=trajectory.kind == "person")
        return own or choose(
            kind,
            name=name,
            models=self.models,
            own=self.settings.user_models if trajectory.kind == "vehicle" else {},
            seed=self.seed,
            looks=self.looks,
        )

    def colour(self, trajectory: Trajectory, kind: VehicleType) -> Colour:
        """Return the colour of a road user of a vType: its own, or one by chance."""
        colours, seed = self.settings.colours, self.seed
        name = _named(trajectory, kind)
        own = self.own.paint(name, kind.id)
        return own or paint_of(drawn_class(kind), kind, key=name, colours=colours, seed=seed)


def _named(trajectory: Trajectory, kind: VehicleType) -> str:
    """The id that chance goes by: a train that has split or joined keeps its look."""
    name = trajectory.id.partition("#")[0]
    return name if kind.id.endswith(f"@{name}") else trajectory.id


def find_rider(fleet: Fleet, name: str) -> Trajectory:
    """Return the trajectory of a vehicle, person or container by SUMO's id, or by its key.

    Raises:
        ConfigError: If the log has none of that name; the message names some it has.
    """
    return find_trajectory(fleet.trajectories, name)


def _announce(choices: Sequence[Choice]) -> None:
    """Say once which classes have no detailed models."""
    plain = sorted({choice.vclass for choice in choices if isinstance(choice, PlainChoice)})
    if plain:
        _LOG.warning("plain bodies stand for %s: there are no models yet", ", ".join(plain))
