"""Which body and which colour a road user gets: by its id, its vType and what the scene file says.

The choice is seeded by the id, so that a road user keeps its body for its whole life. A scene file
can give models and colours to single road users, by id or pattern. Trains, trams and ships have as
many units of a kind as their length takes.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import numpy as np

from sumo3dviz_pt import catalog
from sumo3dviz_pt.cast.colours import reflectance
from sumo3dviz_pt.cast.figures import PLAIN_CLASSES
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.job.values import OwnLook
from sumo3dviz_pt.library.materials import colour_of
from sumo3dviz_pt.model.geometry import Colour
from sumo3dviz_pt.model.random import pick, share_of
from sumo3dviz_pt.model.traffic import RAIL_CLASSES, VehicleType

_PARAMETERS = ("locomotiveLength", "carriageLength", "carriageGap")
_GAP = 1.0
"""SUMO's default between carriages [m]."""

CouplingRow = Mapping[str, Any]
"""A unit as `asset.yaml` lists it: `model`, `at`, and `repeat` with `pitch`; where the vehicle
bends, `pivots` and `bellows`, see `cast/fitting.py`."""


@dataclass(frozen=True, slots=True)
class Carriages:
    """What a vType says of its train (SUMO's parameters of the same names).

    Attributes:
        locomotive: Length of the first unit [m], > 0.
        carriage: Length of the others [m], > 0.
        gap: Between units [m].
    """

    locomotive: float
    carriage: float
    gap: float

    @classmethod
    def of(cls, params: Mapping[str, str]) -> Carriages | None:
        """Read the parameters; None where they give no length."""
        first, other, gap = (_length(params.get(name)) for name in _PARAMETERS)
        known = first or other
        if not known:
            return None
        return cls(first or known, other or known, _GAP if gap is None else gap)

    def split(self, length: float) -> tuple[tuple[float, float], ...]:
        """Return units of a train of a length [m], as SUMO's own drawing splits it.

        Returns:
            Distance of each unit's front behind the train's front, and its length [m].
        """
        pitch = self.carriage + self.gap
        more = max(0, int((length - self.locomotive) / pitch + 0.5))
        if more == 0:
            return ((0.0, length),)
        # Whole carriages share what is left, so that the train is as long as it says.
        pitch = (length - self.locomotive) / more
        own = max(pitch - self.gap, 0.5 * pitch)
        rest = [(self.locomotive + (k + 1) * pitch - own, own) for k in range(more)]
        return ((0.0, self.locomotive), *rest)


def _length(text: str | None) -> float | None:
    """A length [m], or None where there is none or it says nothing."""
    try:
        value = float(text) if text else -1.0
    except ValueError:
        return None
    return value if 0.0 <= value < 1e4 else None


def pitch_of(rows: Sequence[CouplingRow]) -> float:
    """Return what one more of the repeated units adds [m]; 0 where none are repeated."""
    return sum(float(row["pitch"]) for row in rows if row.get("repeat"))


def spare_units(length: float, pitch: float, *, wanted: float) -> int:
    """Return how many repeated units a vehicle has beyond those that the asset lists.

    Args:
        length: Of the asset as it is listed [m].
        pitch: What one more adds [m]; 0 where none are repeated.
        wanted: Length to fill [m].

    Returns:
        The number that takes the least stretching; -1 leaves out those that are listed.
    """
    if not pitch:
        return 0
    near = int((wanted - length) // pitch)
    return min(
        (max(-1, near), max(-1, near + 1)),
        key=lambda more: max(wanted / (length + more * pitch), (length + more * pitch) / wanted),
    )


def coupled(rows: Sequence[CouplingRow], more: int) -> list[tuple[CouplingRow, float]]:
    """Return units of a whole and where their fronts are, from front to rear.

    Args:
        rows: As the asset lists them; the repeated ones follow one another.
        more: From `spare_units`.

    Returns:
        Each unit's row and x of its front in the whole's frame [m].
    """
    again = [row for row in rows if row.get("repeat")]
    if not again:
        return [(row, float(row["at"])) for row in rows]
    pitch = pitch_of(rows)
    first = rows.index(again[0])
    tail = [row for row in rows[first:] if not row.get("repeat")]
    copies = [(row, k * pitch) for k in range(more + 1) for row in again]
    placed = [(row, 0.0) for row in rows[:first]] + copies + [(row, more * pitch) for row in tail]
    return [(row, float(row["at"]) - back) for row, back in placed]


def numbered(rows: Sequence[CouplingRow], count: int) -> list[CouplingRow]:
    """Return the rows of a train of some units: its first, its last, and repeated ones between."""
    again = [row for row in rows if row.get("repeat")] or list(rows[-1:])
    tail = [row for row in rows[rows.index(again[0]) :] if not row.get("repeat")][: count - 1]
    between = [again[k % len(again)] for k in range(count - 1 - len(tail))]
    return [rows[0], *between, *tail]


BodySize = tuple[float, float, float]
"""Length, width, height [m]."""

CAR_CLASSES = frozenset(
    [
        *("passenger", "taxi", "evehicle", "hov", "private", "authority", "army", "vip", "police"),
        *("custom1", "custom2", "ignoring"),
    ]
)
"""vClasses that cars show, if they have a car's size."""

LIVERIES = frozenset(["taxi", "police"])
"""Car classes with models of their own."""

_OWN_SHAPES = frozenset(["firebrigade", "police", "rickshaw"])
"""guiShapes that are no vClass but have models."""

_SHAPES_OF_RAIL = {"light": "tram", "city": "rail_urban", "fast": "rail_fast"}
"""Classes that the guiShapes `rail/light` and so on mean, which SUMO had up to version 0.27."""

CARGO = "rail/cargo"
"""SUMO's guiShape of goods trains."""

_CARGO_WORDS = ("cargo", "freight", "goods")
"""Words in a vType's id that tell of a goods train."""

_NEXT: Mapping[str, str] = {
    **{"trailer": "truck", "truck": "delivery", "coach": "bus", "delivery": "truck"},
    **{"rail_fast": "rail", "rail_electric": "rail", "subway": "rail_urban", "tram": "rail_urban"},
    **{"emergency": "delivery", "firebrigade": "truck", "rail_urban": "tram"},
}
"""Whose models stand for a class, if it has none of about that length."""

_WIDTHS_COUNT = frozenset(["ship", "aircraft"])
"""Classes whose models differ in width at the same length."""

_WIDTH_SPREAD = 0.4
"""Relative difference in width at which one of these becomes 1/e as likely."""

_RIDDEN = frozenset(["bicycle", "moped", "motorcycle", "scooter", "rickshaw"])
"""Classes around a rider, who has a person's size whatever the vType's size is."""

_STRETCHES = (1.5, 2.0)
"""Factors by which a model is stretched or squeezed to a vType's length, at most: the second
only where no model would do with the first, as it still looks better than a box."""

_LOOSE = {"drone": 8.0, "cable_car": 3.0}
"""The same for classes whose few models look much alike at any length."""

DEFAULT_CAR: BodySize = (5.0, 1.8, 1.5)
"""SUMO's size of the class passenger; the real car may have any."""

DEFAULT_PERSON = 1.719
"""SUMO's height of people; the real person may have any."""

_HEIGHT_SPREAD = 0.1
"""Relative difference in height at which a look becomes 1/e as likely."""

_CAR_LENGTHS = (2.2, 6.6)
_CAR_WIDTHS = (1.2, 2.5)
TALLEST_CAR = 2.3

_COARSE_SHAPES = frozenset(
    ["coach", "trailer", "emergency", "tram", "rail_urban", "subway", "wheelchair"]
)
"""Classes whose default guiShape is that of another class."""

_LENGTH_SPREAD = 0.08
"""Relative difference in length at which a model becomes 1/e as likely."""


@dataclass(frozen=True, slots=True)
class Model:
    """A vehicle of the catalogue.

    Attributes:
        name: In `assets/vehicles`.
        vclasses: What it can be drawn for.
        size: Of the unscaled model [m].
        share: How common it is, against 1 for most.
        gui_shapes: SUMO's guiShapes that mean it, such as `passenger/wagon`.
        pitch: What one more of its repeated units adds to its length [m]; 0 without any.
    """

    name: str
    vclasses: frozenset[str]
    size: BodySize
    share: float = 1.0
    gui_shapes: tuple[str, ...] = ()
    pitch: float = 0.0

    def filled(self, wanted: float) -> float:
        """Return its own length for a vType of a length, with as many units as fit best [m]."""
        more = spare_units(self.size[0], self.pitch, wanted=wanted)
        return self.size[0] + more * self.pitch

    @classmethod
    def of(cls, entry: catalog.Entry) -> Model:
        """Read a model's measures from its catalogue entry."""
        meta = entry.meta
        size = (float(meta["length"]), float(meta["width"]), float(meta["height"]))
        vclass = meta.get("vclass", "passenger")
        classes = frozenset([vclass] if isinstance(vclass, str) else vclass)
        shapes = tuple(meta.get("gui_shapes", [f"passenger/{entry.name}"]))
        share, pitch = float(meta.get("share", 1.0)), pitch_of(meta.get("units", ()))
        return cls(entry.name, classes, size, share, shapes, pitch)


@dataclass(frozen=True, slots=True)
class PersonLook:
    """A look of people on foot.

    Attributes:
        name: In `assets/people`.
        height: [m].
        share: How common it is, against 1 for most.
    """

    name: str
    height: float
    share: float = 1.0


@dataclass(frozen=True, slots=True)
class ModelChoice:
    """A vehicle of the catalogue, for a vType of this size [m], of these carriages."""

    model: Model
    vclass: str
    size: BodySize
    carriages: Carriages | None = None


@dataclass(frozen=True, slots=True)
class PlainChoice:
    """A plain body of a class and size [m]."""

    vclass: str
    size: BodySize


@dataclass(frozen=True, slots=True)
class UserChoice:
    """A user's own file, for a vType of this length [m]."""

    path: Path
    vclass: str
    length: float


@dataclass(frozen=True, slots=True)
class FigureChoice:
    """A person with a look of the catalogue, of this height [m]."""

    look: str
    height: float


Choice = ModelChoice | PlainChoice | UserChoice | FigureChoice


def models_for(wanted: Mapping[str, Sequence[str]]) -> tuple[Model, ...]:
    """Return the vehicles that bodies are drawn from.

    Args:
        wanted: Names by class; all that serve a class where it names none.

    Raises:
        ConfigError: If a name is unknown or of another class; the message suggests one.
    """
    known = [Model.of(catalog.find("vehicles", name)) for name in catalog.names("vehicles")]
    named = {vclass: frozenset(names) for vclass, names in wanted.items() if names}
    for vclass, names in named.items():
        serving = [model.name for model in known if vclass in model.vclasses]
        for name in sorted(names - set(serving)):
            word = "car" if vclass == "passenger" else vclass
            message = f"no {word} is called {name!r}{catalog.did_you_mean(name, serving)}"
            raise ConfigError(message, key=_key_of(vclass))
    models = [replace(model, vclasses=_classes_left(model, named)) for model in known]
    return tuple(model for model in models if model.vclasses)


def looks_for(wanted: Sequence[str]) -> tuple[PersonLook, ...]:
    """Return the looks that people on foot are drawn from.

    Args:
        wanted: Names; none stands for all.

    Raises:
        ConfigError: If a name is unknown; the message suggests one.
    """
    known = catalog.names("people")
    for name in wanted:
        if name not in known:
            message = f"there is no look {name!r}{catalog.did_you_mean(name, known)}"
            raise ConfigError(message, key="vehicles.models.pedestrian")
    metas = [(name, catalog.find("people", name).meta) for name in wanted or known]
    return tuple(PersonLook(n, float(m["height"]), float(m.get("share", 1.0))) for n, m in metas)


def _figure(kind: VehicleType, looks: Sequence[PersonLook], chance: float) -> FigureChoice:
    """A look whose height fits the vType's, if that says more than SUMO's default."""
    if abs(kind.height - DEFAULT_PERSON) < 1e-3:
        look = looks[pick([look.share for look in looks], chance)]
        return FigureChoice(look.name, look.height)
    off = [(look.height / kind.height - 1.0) / _HEIGHT_SPREAD for look in looks]
    weights = [
        look.share * float(np.exp(-(o**2))) + 1e-9 for look, o in zip(looks, off, strict=True)
    ]
    return FigureChoice(looks[pick(weights, chance)].name, kind.height)


def _key_of(vclass: str) -> str:
    """The scene file's key that names models of a class."""
    return "vehicles.passenger" if vclass == "passenger" else f"vehicles.models.{vclass}"


def _classes_left(model: Model, named: Mapping[str, frozenset[str]]) -> frozenset[str]:
    """The classes that a model may still serve."""
    return frozenset(
        vclass for vclass in model.vclasses if vclass not in named or model.name in named[vclass]
    )


def drawn_class(kind: VehicleType) -> str:
    """Return what a vType is drawn as: a class of models or of plain bodies.

    The guiShape wins over the vClass, whose first purpose is to tell which lanes a vehicle may
    use; but some classes have a guiShape that is too coarse for them.
    """
    shape, _, detail = kind.gui_shape.partition("/")
    if shape == "rail":
        shape = _SHAPES_OF_RAIL.get(detail, shape)
    known = shape in CAR_CLASSES | PLAIN_CLASSES and kind.vclass not in _COARSE_SHAPES
    vclass = shape if known or shape in _OWN_SHAPES else kind.vclass
    if vclass == "delivery" and kind.length < _CAR_LENGTHS[1] and kind.height < TALLEST_CAR:
        return "passenger"
    if vclass not in CAR_CLASSES:
        return vclass
    if kind.length > _CAR_LENGTHS[1] or kind.width > _CAR_WIDTHS[1]:
        return "truck"
    if kind.length < _CAR_LENGTHS[0] or kind.width < _CAR_WIDTHS[0]:
        return "motorcycle"
    return vclass if vclass in LIVERIES else "passenger"


def choose(
    kind: VehicleType,
    *,
    name: str,
    models: Sequence[Model],
    own: Mapping[str, Path],
    seed: int,
    looks: Sequence[PersonLook] = (),
) -> Choice:
    """Choose a body.

    Args:
        kind: The vType.
        name: SUMO's id of the road user.
        models: To draw from; a class without any gets plain bodies.
        own: Users' files by pattern of an id or a vType's id; the first that fits wins.
        seed: The job's.
        looks: Of people on foot; none gives them plain bodies.
    """
    # Users' own files and people on foot.
    vclass = drawn_class(kind)
    for pattern, path in own.items():
        if fnmatchcase(name, pattern) or fnmatchcase(kind.id, pattern):
            return UserChoice(path, vclass, kind.length)
    if vclass == "pedestrian" and looks:
        return _figure(kind, looks, share_of(seed, name, "look"))
    # Models that serve the class and can have the length.
    size = (kind.length, kind.width, kind.height)
    cars = Carriages.of(kind.params) if vclass in RAIL_CLASSES else None
    serving = _serving(vclass, kind, models, coupled=cars is not None)
    if not serving:
        return PlainChoice("passenger" if vclass in LIVERIES else vclass, size)
    # Draw one of them; models of about the right size are likelier.
    stand_in = not any(vclass in model.vclasses for model in serving)
    shapes = {_shape_of(kind), _NEXT.get(vclass, "") if stand_in else ""}
    serving = _meant(serving, shapes)
    weights = [model.share * _likelihood(model, size, vclass) for model in serving]
    drawn = serving[pick(weights, share_of(seed, name, "body"))]
    if vclass in _RIDDEN and size == DEFAULT_CAR:
        size = drawn.size
    # Models of another class are fitted as those of their own.
    fitted_as = vclass if vclass in drawn.vclasses or vclass in CAR_CLASSES else min(drawn.vclasses)
    return ModelChoice(drawn, fitted_as, size, cars)


def _shape_of(kind: VehicleType) -> str:
    """A vType's guiShape, or that of a goods train where its id tells of one."""
    rail = kind.gui_shape.startswith("rail") or kind.vclass in ("rail", "rail_electric")
    named = any(word in kind.id.lower() for word in _CARGO_WORDS)
    return CARGO if rail and named else kind.gui_shape


def _serving(
    vclass: str, kind: VehicleType, models: Sequence[Model], *, coupled: bool
) -> list[Model]:
    """The models that a vType of a class may show; those of the next class if there are none."""
    own = [model for model in models if vclass in model.vclasses]
    if not own and vclass in LIVERIES:
        own = [model for model in models if "passenger" in model.vclasses]
    if vclass in CAR_CLASSES or (vclass in _RIDDEN and kind.length == DEFAULT_CAR[0]):
        return own
    trains = [model for model in own if coupled and model.pitch]
    if trains:
        return trains
    factors = (*_STRETCHES, _LOOSE[vclass]) if vclass in _LOOSE else _STRETCHES
    other = [model for model in models if _NEXT.get(vclass) in model.vclasses]
    return _able(own, kind.length, factors) or _able(other, kind.length, _STRETCHES)


def _meant(models: list[Model], shapes: AbstractSet[str]) -> list[Model]:
    """The models that have one of some guiShapes, or else all; goods trains are always meant."""
    meant = [model for model in models if shapes & {*model.gui_shapes}]
    return meant or [model for model in models if model.gui_shapes != (CARGO,)] or models


def can_be(model: Model, length: float, *, most: float = _STRETCHES[0]) -> bool:
    """Return whether a model can be stretched to a length; trains gain or lose cars first.

    Args:
        model: Of the catalogue.
        length: Wanted [m].
        most: Factor by which it may become longer or shorter.
    """
    return 1.0 / most < length / model.filled(length) < most


def _able(models: Sequence[Model], length: float, factors: Sequence[float]) -> list[Model]:
    """The models that can be stretched to a length [m], no farther than needed."""
    for most in factors:
        able = [model for model in models if can_be(model, length, most=most)]
        if able:
            return able
    return []


def _likelihood(model: Model, size: BodySize, vclass: str) -> float:
    """How likely a model is drawn for a vType of a size."""
    if size[0] == DEFAULT_CAR[0]:
        return 1.0
    off = (model.filled(size[0]) / size[0] - 1.0) / _LENGTH_SPREAD
    if vclass in _WIDTHS_COUNT:
        aside = float(np.clip((model.size[1] / size[1] - 1.0) / _WIDTH_SPREAD, -2.0, 2.0))
        return float(np.exp(-(off**2) - aside**2)) + 1e-12
    return float(np.exp(-(off**2))) + 1e-6


@dataclass(frozen=True, slots=True)
class OwnLooks:
    """What a scene file says about single road users.

    Attributes:
        by_id: Model and colour by id or pattern; the exact id wins, then the first that fits.
    """

    by_id: Mapping[str, OwnLook]

    def of(self, name: str, type_id: str) -> OwnLook | None:
        """Return what is said about a road user, by its id and that of its vType."""
        if name in self.by_id:
            return self.by_id[name]
        for pattern, look in self.by_id.items():
            if fnmatchcase(name, pattern) or fnmatchcase(type_id, pattern):
                return look
        return None

    def choice(self, kind: VehicleType, *, name: str, walks: bool) -> Choice | None:
        """Return the body that a road user is given; None leaves it to chance.

        A vehicle is fitted to its vType where the model serves that class and can be
        stretched to that length; else it keeps its own size. Vehicles stay vehicles and
        people stay people, whatever a pattern fits.

        Args:
            kind: The vType.
            name: SUMO's id of the road user.
            walks: Whether it is a person.
        """
        look = self.of(name, kind.id)
        if look is None or look.model is None:
            return None
        if look.model in catalog.names("people"):
            return _own_looks_figure(look.model) if walks else None
        return None if walks else _vehicle(look.model, kind)

    def paint(self, name: str, type_id: str) -> Colour | None:
        """Return the colour that a road user is given, or None."""
        look = self.of(name, type_id)
        if look is None or look.colour is None:
            return None
        return reflectance(colour_of(look.colour))


def _model(name: str) -> Model:
    """A vehicle of the catalogue."""
    return Model.of(catalog.find("vehicles", name))


def _own_looks_figure(name: str) -> FigureChoice:
    """A person of the catalogue, in full height."""
    return FigureChoice(name, float(catalog.find("people", name).meta["height"]))


def _vehicle(name: str, kind: VehicleType) -> ModelChoice:
    """A vehicle of the catalogue, fitted to a vType if it serves its class."""
    model, vclass = _model(name), drawn_class(kind)
    cars = Carriages.of(kind.params) if vclass in RAIL_CLASSES else None
    fits = vclass in CAR_CLASSES or cars is not None or can_be(model, kind.length)
    if fits and vclass in model.vclasses:
        return ModelChoice(model, vclass, (kind.length, kind.width, kind.height), cars)
    return ModelChoice(model, min(model.vclasses), model.size)


def idle(by_id: Iterable[str], ids: Mapping[str, str]) -> list[str]:
    """Return ids and patterns that fit no road user.

    Args:
        by_id: Of a scene file.
        ids: vTypes' ids by road users' ids.
    """
    words = {*ids, *ids.values()}
    return [each for each in by_id if not any(fnmatchcase(word, each) for word in words)]
