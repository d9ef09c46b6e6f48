"""Give every road user a vType, also where no file defines it.

The decision follows from ids and from the scene file alone. It never depends on the window of
time that is read, so that a still shows the same bodies as the film that it lies in.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase

from sumo3dviz_pt.model.scenario import TypeGuess
from sumo3dviz_pt.model.traffic import Trace, VehicleType
from sumo3dviz_pt.sumo.classes import DEFAULT_TYPES, TYPE_OF_KIND
from sumo3dviz_pt.sumo.guesses.words import class_of_type, class_of_vehicle
from sumo3dviz_pt.sumo.types import default_vehicle_type

_DEFAULT_OF = {vclass: type_id for type_id, vclass in DEFAULT_TYPES.items()}


@dataclass(frozen=True, slots=True)
class TypesOfUsers:
    """Finds the vType of each road user.

    A type that no file defines has the vClass that the scene file gives to it, else the one
    that the words of its id say, else that of a car, a pedestrian or a container. Where the
    log has no types, the id of the road user counts instead.

    Attributes:
        defined: Types by id, as files define them.
        classes: vClasses by type id, or by pattern of one; the exact id wins, then the first
            pattern that fits.
    """

    defined: Mapping[str, VehicleType]
    classes: Mapping[str, str] = field(default_factory=dict)

    def of(self, kind: str, name: str, type_id: str) -> VehicleType:
        """Return the type of a road user.

        Args:
            kind: `vehicle`, `person` or `container`.
            name: SUMO's id of the road user.
            type_id: Its vType in the log, may be empty.
        """
        for known in (f"{type_id}@{name}", type_id):
            if known in self.defined:
                return self.defined[known]
        if type_id in DEFAULT_TYPES:
            return default_vehicle_type(type_id, kind)
        vclass = self._class_of(kind, name, type_id)
        if type_id:
            return default_vehicle_type(type_id, kind, vclass=vclass)
        own = _default_id(vclass) if vclass else TYPE_OF_KIND[kind]
        return self.defined.get(own) or default_vehicle_type(own, kind, vclass=vclass)

    def _class_of(self, kind: str, name: str, type_id: str) -> str | None:
        """Return the vClass of a road user without a defined type; None where nothing tells."""
        given = self._given(type_id or name)
        if given is not None and kind == "vehicle":
            return given
        return class_of_type(type_id, kind) if type_id else class_of_vehicle(name, kind)

    def _given(self, name: str) -> str | None:
        """Return the class that the scene file gives, or None."""
        if name in self.classes:
            return self.classes[name]
        fitting = (c for pattern, c in self.classes.items() if fnmatchcase(name, pattern))
        return next(fitting, None)

    def typed(self, traces: Iterable[Trace]) -> tuple[tuple[Trace, ...], dict[str, VehicleType]]:
        """Return traces that all have a type id, and the types that they have by id."""
        types: dict[str, VehicleType] = {}
        found: list[Trace] = []
        for trace in traces:
            own = self.of(trace.kind, trace.id, trace.type_id)
            types[own.id] = own
            found.append(trace if own.id == trace.type_id else replace(trace, type_id=own.id))
        return tuple(found), types

    def guesses(self, traces: Iterable[Trace]) -> tuple[TypeGuess, ...]:
        """Return the types of vehicles that neither a file nor the scene file tells, by their ids.

        Args:
            traces: As they are in the log. Vehicles without a type count as one type for each
                class that their ids say, and are left out where these say nothing.
        """
        counts = Counter(
            (trace.type_id, self._class_of(trace.kind, trace.id, trace.type_id) or "")
            for trace in traces
            if trace.kind == "vehicle" and not self._told(trace)
        )
        return tuple(
            TypeGuess(type_id, count, vclass, "the names say so" if vclass else "")
            for (type_id, vclass), count in sorted(counts.items())
            if type_id or vclass
        )

    def _told(self, trace: Trace) -> bool:
        """Return whether a file or the scene file tells the class of a vehicle."""
        known = trace.type_id in self.defined or trace.type_id in DEFAULT_TYPES
        return known or self._given(trace.type_id or trace.id) is not None


def _default_id(vclass: str) -> str:
    """Return the id of SUMO's default type of a class, or one of the same kind."""
    return _DEFAULT_OF.get(vclass, f"DEFAULT_{vclass.upper()}TYPE")
