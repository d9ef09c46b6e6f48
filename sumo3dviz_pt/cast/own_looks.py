"""Models and colours that a scene file gives to single road users, by id or pattern."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from fnmatch import fnmatchcase

from sumo3dviz_pt import catalog
from sumo3dviz_pt.cast.choice import (
    CAR_CLASSES,
    Choice,
    FigureChoice,
    Model,
    ModelChoice,
    can_be,
    drawn_class,
)
from sumo3dviz_pt.cast.colours import reflectance
from sumo3dviz_pt.cast.coupling import Carriages
from sumo3dviz_pt.job.values import OwnLook
from sumo3dviz_pt.library.materials.by_key import colour_of
from sumo3dviz_pt.model.geometry import Colour
from sumo3dviz_pt.model.traffic import RAIL_CLASSES, VehicleType


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
            return _figure(look.model) if walks else None
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


def _figure(name: str) -> FigureChoice:
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
