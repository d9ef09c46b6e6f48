"""How a body is put together at each level of detail: units, joints, wheels, scales.

Bodies in full detail are for close views. Reports only ask how much there is of each material in
them. The letters on number plates are movers of their own.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from sumo3dviz_pt import catalog
from sumo3dviz_pt.cast.axles import UnitLinks
from sumo3dviz_pt.library.vehicles.glazing import glazed, lens_counts, lensed
from sumo3dviz_pt.library.vehicles.packed import FULL, read_levels
from sumo3dviz_pt.library.vehicles.plates import (
    LETTER,
    LETTERS,
    Plate,
    letter_phase,
    plate_text,
    plates_of,
)
from sumo3dviz_pt.library.vehicles.recipe import WheelPlace
from sumo3dviz_pt.library.vehicles.stretching import BodyStretch, bend_phase, chord, stretched
from sumo3dviz_pt.model.geometry import Floats, Mesh, Transform
from sumo3dviz_pt.model.scene import Mover, Part, Prototype, VehicleLamp


@dataclass(frozen=True, slots=True)
class Drawn:
    """The prototypes that one road user is drawn with.

    Attributes:
        model: What it is a copy of.
        near: Names, one for each rigid part.
        far: Names, one for each part.
        full: Names, one for each rigid part in full detail; empty if there is none.
        deforming: Names, one for each part that takes poses, near and in full detail; such parts
            are never instanced.
        length: As drawn [m].
        letters: Names, one for each letter on its number plates.
    """

    model: str
    near: tuple[str, ...]
    far: tuple[str, ...]
    full: tuple[str, ...] = ()
    deforming: tuple[str, ...] = ()
    length: float = 0.0
    letters: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class Joint:
    """A bellows between a unit and the next one.

    Attributes:
        prototype: The bellows, with its poses.
        length: Of the bellows, unscaled [m].
        ahead: Distance of its front end behind the front of the unit ahead, unscaled [m].
        behind: Distance of its rear end behind the front of the unit behind, unscaled [m].
    """

    prototype: Prototype
    length: float
    ahead: float
    behind: float


@dataclass(frozen=True, slots=True, eq=False)
class Unit:
    """One rigid piece of a road user: a car, or a tractor, or a carriage.

    Attributes:
        prototype: Its body.
        at: x of its front in the whole's unscaled frame [m].
        wheels: Where its wheels turn at full detail; empty where there is none.
        model: The catalogue's name, if the prototype's is another.
        given: How full detail is made longer or shorter; None leaves it as it is.
        length: Unscaled [m]; known where it has pivots.
        pivots: Distances behind its front of the two points that stay on the path, unscaled
            [m]; None where it is rigid with the others.
        stretch: Factor along x beside the scale of the whole.
        joint: What hangs between it and the next unit, or None.
    """

    prototype: Prototype
    at: float = 0.0
    wheels: tuple[WheelPlace, ...] = ()
    model: str = ""
    given: BodyStretch | None = None
    length: float = 0.0
    pivots: tuple[float, float] | None = None
    stretch: float = 1.0
    joint: Joint | None = None

    @property
    def source(self) -> str:
        """Its name in the catalogue."""
        return self.model or self.prototype.name

    @property
    def full(self) -> str:
        """Name of its body at full detail."""
        return f"{self.source if self.given is None else self.prototype.name}/full"

    @property
    def wheel(self) -> str:
        """Name of its wheel at full detail."""
        return f"{self.source}/wheel"


@dataclass(frozen=True, slots=True, eq=False)
class Stance:
    """How the units and wheels of a road user stand at a time.

    Attributes:
        units: Placements of the bent vehicle's units, unscaled, (u, 4, 4); None where it is
            rigid.
        sway: What the springs do to each unit's body, in its frame, (u, 4, 4); None is nothing.
        wheels: Turned and steered, of all wheels in their order, (w, 2) [rad]; None is rest.
    """

    units: Floats | None = None
    sway: Floats | None = None
    wheels: Floats | None = None


AT_REST = Stance()
"""Rigid, on stiff springs, wheels as they were built."""


@dataclass(frozen=True, slots=True, eq=False)
class Assembly:
    """All units of a road user.

    Attributes:
        model: What it is a copy of.
        units: From front to rear, at least one.
        hinged: Whether the units' ends are kept together where it bends.
        drawn: Names of its prototypes at each level.
        plates: Number plates of its bodies, near and in full detail, by their names.
    """

    model: str
    units: tuple[Unit, ...]
    hinged: bool = False
    drawn: Drawn = field(init=False)
    plates: Mapping[str, tuple[Plate, ...]] = field(init=False)

    def __post_init__(self) -> None:
        """List the prototypes, and find number plates."""
        folds = [unit.joint.prototype for unit in self.units if unit.joint is not None]
        bodies = [unit.prototype for unit in self.units]
        deforming = tuple(p.name for p in (*bodies, *folds) if p.poses is not None)
        rigid = tuple(p.name for p in bodies if p.poses is None)
        # Those that take poses have all their detail near by.
        able = len(rigid) == len(bodies) and all(unit.wheels for unit in self.units)
        full = [name for unit in self.units for name in (unit.full, *_wheels(unit))] if able else []
        far = tuple(p.name for p in (*bodies, *folds))
        own = [plates_of(unit.prototype) for unit in self.units]
        letters = (LETTER,) * (LETTERS * sum(map(len, own)))
        drawn = Drawn(self.model, rigid, far, tuple(full), deforming, letters=letters)
        object.__setattr__(self, "drawn", drawn)
        named = zip(self.units, own, strict=True)
        plates = {name: some for u, some in named for name in (u.prototype.name, u.full)}
        object.__setattr__(self, "plates", plates)

    @property
    def prototypes(self) -> Mapping[str, Prototype]:
        """Bodies of all units, and what joins them, by name."""
        folds = [unit.joint.prototype for unit in self.units if unit.joint is not None]
        return {each.name: each for each in (*(unit.prototype for unit in self.units), *folds)}

    @property
    def bends(self) -> bool:
        """Whether its units follow the path one by one."""
        return len(self.units) > 1 and all(unit.pivots is not None for unit in self.units)

    def links(self, scale: Floats) -> UnitLinks:
        """Return where the units are held; only of a road user that bends.

        Args:
            scale: Of the whole, (3,).
        """
        stretch = np.array([unit.stretch for unit in self.units])
        pivots = np.array([unit.pivots for unit in self.units], dtype=np.float64)
        return UnitLinks(
            -float(scale[0]) * np.array([unit.at for unit in self.units]),
            float(scale[0]) * stretch * np.array([unit.length for unit in self.units]),
            float(scale[0]) * stretch[:, None] * pivots,
            self.hinged,
        )

    def movers(
        self, whole: Mover, *, full: bool = False, stance: Stance = AT_REST
    ) -> Iterator[Mover]:
        """Yield the parts of a road user at its place.

        Args:
            whole: The road user; its prototype names what the first unit shows.
            full: Whether it is drawn in full detail.
            stance: How it stands.
        """
        if len(self.units) == 1 and not full and stance is AT_REST:
            yield whole
            return
        frames = self._frames(whole.world_from_body.matrix, stance)
        # Bodies, each followed by its wheels.
        number = 0
        for index, unit in enumerate(self.units):
            part = f"unit{index}" if index else ""
            name = unit.prototype.name if index else whole.prototype
            swayed = frames[index] if stance.sway is None else frames[index] @ stance.sway[index]
            placed = Transform(swayed @ np.diag([*_scale(whole, unit), 1.0]))
            yield replace(
                whole, prototype=unit.full if full else name, part=part, world_from_body=placed
            )
            rims = unit.wheels if full else ()
            for wheel, place in enumerate(rims):
                turned, steered = (0.0, 0.0)
                if stance.wheels is not None:
                    turned, steered = stance.wheels[number].tolist()
                number += 1
                matrix = wheel_matrix(
                    frames[index], _scale(whole, unit), place, turned=turned, steered=steered
                )
                yield replace(
                    whole,
                    prototype=unit.wheel,
                    part=f"{part}wheel{wheel}",
                    world_from_body=Transform(matrix),
                )
        # Bellows.
        yield from self._folds(whole, frames)

    def _frames(self, whole: Floats, stance: Stance) -> Sequence[Floats]:
        """Placements of the units, unscaled."""
        if stance.units is not None:
            return list(stance.units)
        scale = np.linalg.norm(whole[:3, :3], axis=0)
        frames = []
        for unit in self.units:
            frame = whole.copy()
            frame[:3, :3] /= scale
            frame[:3, 3] += unit.at * whole[:3, 0]
            frames.append(frame)
        return frames

    def _folds(self, whole: Mover, frames: Sequence[Floats]) -> Iterator[Mover]:
        """What hangs between the units."""
        for index, unit in enumerate(self.units[:-1]):
            if unit.joint is None:
                continue
            joint, after = unit.joint, self.units[index + 1]
            ahead = frames[index] @ [-joint.ahead * _scale(whole, unit)[0], 0.0, 0.0, 1.0]
            behind = frames[index + 1] @ [-joint.behind * _scale(whole, after)[0], 0.0, 0.0, 1.0]
            headings = frames[index][:3, 0], frames[index + 1][:3, 0]
            bend = _turn(*headings)
            # Its x axis runs from end to end, its z axis between those of the units.
            matrix = np.eye(4)
            matrix[:3, 0] = (ahead - behind)[:3] / chord(joint.length, bend)
            ups = frames[index][:3, 2] + frames[index + 1][:3, 2]
            scale = _scale(whole, unit)
            left = np.cross(ups, headings[0] + headings[1])
            matrix[:3, 1] = scale[1] * left / np.linalg.norm(left)
            matrix[:3, 2] = scale[2] * ups / np.linalg.norm(ups)
            matrix[:3, 3] = ahead[:3]
            yield replace(
                whole,
                prototype=joint.prototype.name,
                part=f"joint{index}",
                world_from_body=Transform(matrix),
                phase=bend_phase(bend),
                effort=1.0,
            )


def _wheels(unit: Unit) -> list[str]:
    """The wheel's name, once for each wheel."""
    return [unit.wheel] * len(unit.wheels)


def _scale(whole: Mover, unit: Unit) -> Floats:
    """What a unit is scaled by, (3,)."""
    scale = np.linalg.norm(whole.world_from_body.matrix[:3, :3], axis=0)
    return np.asarray(scale * [unit.stretch, 1.0, 1.0])


def _turn(ahead: Floats, behind: Floats) -> float:
    """Angle from the heading of the unit behind to that of the unit ahead, to the left [rad]."""
    across = ahead[1] * behind[0] - ahead[0] * behind[1]
    return float(np.arctan2(across, ahead[0] * behind[0] + ahead[1] * behind[1]))


def wheel_matrix(
    frame: Floats, scale: Floats, place: WheelPlace, *, turned: float = 0.0, steered: float = 0.0
) -> Floats:
    """Return the placement of a wheel on a stretched body, round and on the ground, (4, 4).

    Args:
        frame: Of the body, unscaled, (4, 4).
        scale: Of the body, (3,).
        place: Where on the body.
        turned: How far it has rolled forwards [rad].
        steered: To the left [rad].
    """
    cs, ss, ct, st = np.cos(steered), np.sin(steered), np.cos(turned), np.sin(turned)
    about_z = np.array([[cs, -ss, 0.0], [ss, cs, 0.0], [0.0, 0.0, 1.0]])
    about_y = np.array([[ct, 0.0, st], [0.0, 1.0, 0.0], [-st, 0.0, ct]])
    linear = frame[:3, :3] @ about_z @ about_y
    if (place.at[1] < 0.0) != place.reversed:
        linear = linear * np.array([-1.0, -1.0, 1.0])
    matrix = np.eye(4)
    matrix[:3, :3] = linear * scale[2]
    matrix[:3, 3] = frame[:3, :3] @ (scale * place.at) + frame[:3, 3]
    return matrix


def full_prototypes(names: Iterable[str]) -> dict[str, Prototype]:
    """Return bodies and wheels in full detail of vehicles of the catalogue.

    Args:
        names: Of vehicles that have them.

    Returns:
        `<name>/full` and `<name>/wheel` by their names.
    """
    bodies = {}
    for name in sorted(names):
        entry = catalog.find("vehicles", name)
        for level, meshes in read_levels(entry.folder / FULL).items():
            parts = tuple(lensed(glazed(meshes.items(), entry.meta)))
            bodies[f"{name}/{level}"] = Prototype(f"{name}/{level}", parts, ())
    return bodies


def full_bodies(units: Iterable[Unit]) -> dict[str, Prototype]:
    """Return bodies and wheels in full detail by the names that units give them, lamps included.

    Args:
        units: Of models that have full detail.
    """
    wanted = {unit.full: unit for unit in units}
    made = full_prototypes({unit.source for unit in wanted.values()})
    bodies = {}
    for name, unit in wanted.items():
        body = made[f"{unit.source}/full"]
        if unit.given is not None:
            body = stretched(body, unit.given, name=name)
        bodies[name] = replace(body, lamps=unit.prototype.lamps)
        bodies[unit.wheel] = made[unit.wheel]
    return bodies


def counted(prototype: Prototype) -> dict[str, int]:
    """Return the triangles of a body by material."""
    counts: dict[str, int] = {}
    for part in prototype.parts:
        counts[part.material] = counts.get(part.material, 0) + len(part.mesh.faces)
    return counts


def counted_bodies(units: Iterable[Unit]) -> dict[str, Prototype]:
    """Return bodies and wheels by the names of `full_bodies`, without shape: reports only count.

    Args:
        units: Of models that have full detail.
    """
    bodies = {}
    for unit in units:
        meta = catalog.find("vehicles", unit.source).meta
        bodies[unit.full] = _shapeless(unit.full, meta["full"], unit.prototype.lamps)
        bodies[unit.wheel] = _shapeless(unit.wheel, meta["wheel"])
    return bodies


def _shapeless(
    name: str, counts: Mapping[str, int], lamps: tuple[VehicleLamp, ...] = ()
) -> Prototype:
    """A body of as many triangles of each material, all of which lie in one point."""
    point = np.zeros((1, 3))
    parts = (
        Part(Mesh(point, np.zeros((n, 3), np.int64)), kind)
        for kind, n in lens_counts(counts).items()
    )
    return Prototype(name, tuple(parts), (), lamps=lamps)


def letters_on(body: Mover, plates: Sequence[Plate]) -> Iterator[Mover]:
    """Yield the letters on the plates of a body.

    Args:
        body: A road user, or a unit of it, at its place.
        plates: In the body's frame.
    """
    text = plate_text(body.id)
    for number, plate in enumerate(plates):
        for place, (character, at) in enumerate(zip(text, plate.letters(), strict=True)):
            yield replace(
                body,
                prototype=LETTER,
                part=f"{body.part}plate{number}letter{place}",
                world_from_body=body.world_from_body @ at,
                phase=letter_phase(character),
                effort=1.0,
            )
