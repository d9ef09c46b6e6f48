"""Guesses vTypes that no file defines: from ids, lanes driven, speeds.

Every road user gets a vType. The decision follows from the scene file and from ids alone, whose
words are known in the languages of many scenarios. It never depends on the window of time that is
read, so that a still shows the same bodies as the film that it lies in.

Lanes driven and speeds in a whole log tell the vClass of types, too. The result depends on the part
of the log that is read. So only the proposal of a scene file, which reads all of it, guesses in
this way, and writes the result into the scene file.
"""

from __future__ import annotations

import re
import unicodedata
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from functools import cache
from itertools import pairwise

import numpy as np

from sumo3dviz_pt.model.network import Network
from sumo3dviz_pt.model.traffic import Scenario, Trace, TypeGuess, VehicleType
from sumo3dviz_pt.sumo.types import (
    ALL_CLASSES,
    CLASS_DEFAULTS,
    DEFAULT_TYPES,
    OBSOLETE_CLASSES,
    TYPE_OF_KIND,
    default_vehicle_type,
)

_WORDS = {
    # vClass: words without accents. Of several words in one id, the class that stands first wins.
    "emergency": "ambulance ambulances ambulanz rettungswagen krankenwagen rtw fire firetruck"
    " firebrigade fireengine feuerwehr pompiers bomberos brandweer rescue samu",
    "wheelchair": "wheelchair wheelchairs rollstuhl",
    "motorcycle": "motorcycles motorcyclist motorbike motorbikes mot moto motos motorrad"
    " motorraeder motorrader kraftrad motocicleta motocicletta motociclo motorfiets motocykl",
    "moped": "mopeds mofa ciclomotor ciclomotore cyclomoteur bromfiets",
    "scooter": "scooters escooter escooters kickscooter trottinette patinete monopattino",
    "bicycle": "bicycles bike bikes cyclist cyclists ebike ebikes pedelec cargobike"
    " fahrrad fahrraeder fahrrader radfahrer radler rad lastenrad velo velos bicyclette cycliste"
    " bici bicis bicicleta bicicletas bicicletta ciclista fiets fietsen fietser cykel sykkel"
    " rower kolo bisiklet polkupyora",
    "coach": "coaches reisebus fernbus autocar",
    "bus": "buses busses busse bussen autobus autobuses autobuz omnibus onibus minibus linienbus"
    " gelenkbus stadtbus citybus nachtbus nightbus schulbus schoolbus trolleybus oberleitungsbus"
    " obus ebus bendybus brt",
    "tram": "trams tramway tramways streetcar streetcars strassenbahn stadtbahn tranvia tramvia"
    " bonde sparvagn lightrail",
    "subway": "metro ubahn underground tunnelbana",
    "rail_urban": "sbahn railurban urbanrail railcar",
    "rail": "train trains railway zug zuege zuge treno treni tren trenes trem trein treinen pociag"
    " vlak eisenbahn locomotive",
    "ship": "ships boat boats ferry ferries schiff faehre fahre barco bateau navire vessel",
    "drone": "drones uav",
    "trailer": "trailers semitrailer sattelzug sattelschlepper roadtrain",
    "truck": "trucks lkw lkws lastwagen lastkraftwagen lorry lorries hgv hgvs camion camions"
    " camiones caminhao vrachtwagen vrachtauto lastbil ciezarowka kamion",
    "delivery": "van vans lieferwagen transporter lcv lcvs furgon furgone furgoneta fourgon"
    " camionnette bestelwagen sprinter parcel courier",
    "taxi": "taxis cab cabs taksi robotaxi",
    "authority": "police polizei policia polizia politie politi",
    "passenger": "car cars cartrailer auto autos automobile pkw pkws kfz sedan suv hatchback"
    " limousine voiture voitures coche coches carro carros macchina bil ev bev phev",
    "pedestrian": "pedestrians ped peds person persons walker walkers fussgaenger fussganger"
    " peaton peatones pieton pietons pedone pedoni voetganger",
}
_LISTED = {word: vclass for vclass, words in _WORDS.items() for word in words.split()}
_OWN = {vclass.replace("_", ""): vclass for vclass in (*CLASS_DEFAULTS, *OBSOLETE_CLASSES)}
_CLASSES = {word: OBSOLETE_CLASSES.get(vclass, vclass) for word, vclass in (_OWN | _LISTED).items()}
"""vClasses by word; SUMO's own names are words, too."""

_RANK = {vclass: rank for rank, vclass in enumerate(dict.fromkeys((*_WORDS, *CLASS_DEFAULTS)))}

_OF_PEOPLE = frozenset({"pedestrian", "wheelchair"})
"""vClasses that a person may have."""

_EMPTY = frozenset({"flow", "f", "veh", "vehicle", "v", "pt", "public", "transit", "trip", "type"})
"""First words of vehicles' ids that tell nothing."""

_PARTS = re.compile(r"[^\W\d_]+")
_HUMPS = re.compile(r"(?<=[a-z])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])")


@cache
def class_of_type(type_id: str, kind: str) -> str | None:
    """Return the vClass that the words of a vType's id say, or None.

    Args:
        type_id: SUMO's id, such as `veh_bus` or `Linienbus12m`.
        kind: `vehicle`, `person` or `container`; a person is never taken for a vehicle.
    """
    return _best(_words(type_id), kind)


@cache
def class_of_vehicle(name: str, kind: str) -> str | None:
    """Return the vClass that the first telling word of a road user's id says, or None.

    Later words often name an edge or a route, such as `E3_busstation`.

    Args:
        name: SUMO's id, such as `bus_12`, `tram:4` or `flow_bus.3`.
        kind: `vehicle`, `person` or `container`.
    """
    words = _words(name)
    while words and words[0] in _EMPTY:
        words.pop(0)
    return _best(words[:2], kind) if "".join(words[:2]) in _CLASSES else _best(words[:1], kind)


def _words(name: str) -> list[str]:
    """Return the words of an id in small letters and without accents."""
    parts = [word for part in _PARTS.findall(name) for word in _HUMPS.split(part)]
    plain = [unicodedata.normalize("NFKD", part.casefold()) for part in parts]
    return ["".join(c for c in word if not unicodedata.combining(c)) for word in plain]


def _best(words: list[str], kind: str) -> str | None:
    """Return the class of the telling word with the first rank; pairs tell more than words."""
    pairs = [first + second for first, second in pairwise(words)]
    classes = {_CLASSES[pair] for pair in pairs if pair in _CLASSES}
    classes = classes or {_CLASSES[word] for word in words if word in _CLASSES}
    if kind == "person":
        classes &= _OF_PEOPLE
    elif kind != "vehicle":
        return None
    return min(classes, key=_RANK.__getitem__, default=None)


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
        declared = self._declared(type_id or name)
        if declared is not None and kind == "vehicle":
            return declared
        return class_of_type(type_id, kind) if type_id else class_of_vehicle(name, kind)

    def _declared(self, name: str) -> str | None:
        """Return the class that the scene file gives, or None."""
        if name in self.classes:
            return self.classes[name]
        fitting = (c for pattern, c in self.classes.items() if fnmatchcase(name, pattern))
        return next(fitting, None)

    def typed(self, traces: Iterable[Trace]) -> tuple[tuple[Trace, ...], dict[str, VehicleType]]:
        """Return traces that all have a type id, and the types that they have by id."""
        types: dict[str, VehicleType] = {}
        retyped: list[Trace] = []
        for trace in traces:
            own = self.of(trace.kind, trace.id, trace.type_id)
            types[own.id] = own
            retyped.append(trace if own.id == trace.type_id else replace(trace, type_id=own.id))
        return tuple(retyped), types

    def guesses(self, traces: Iterable[Trace]) -> tuple[TypeGuess, ...]:
        """Return the types of vehicles that neither a file nor the scene file tells, by their ids.

        Args:
            traces: As they are in the log. Vehicles without a type count as one type for each
                class that their ids say, and are left out where these say nothing.
        """
        counts = Counter(
            (trace.type_id, self._class_of(trace.kind, trace.id, trace.type_id) or "")
            for trace in traces
            if trace.kind == "vehicle" and not self._is_known(trace)
        )
        return tuple(
            TypeGuess(type_id, count, vclass, "the names say so" if vclass else "")
            for (type_id, vclass), count in sorted(counts.items())
            if type_id or vclass
        )

    def _is_known(self, trace: Trace) -> bool:
        """Return whether a file or the scene file tells the class of a vehicle."""
        known = trace.type_id in self.defined or trace.type_id in DEFAULT_TYPES
        return known or self._declared(trace.type_id or trace.id) is not None


def _default_id(vclass: str) -> str:
    """Return the id of SUMO's default type of a class, or one of the same kind."""
    return _DEFAULT_OF.get(vclass, f"DEFAULT_{vclass.upper()}TYPE")


_MOST = 0.9
"""Share of vehicles, or of their rows, that makes evidence."""

_LEAST_ROWS = 20
"""Smallest number of rows on lanes that can tell something."""

_LEAST_VEHICLES = 5
"""Smallest number of vehicles whose speeds can tell something."""

_CYCLING = 8.0
"""Top speed that cyclists seldom exceed and cars on free roads do [m/s]."""

_DRIVING = 11.0
"""Speed limit, and top speed of other vehicles, beside which cyclists are slow [m/s]."""

_LIKELY = (
    # Classes in the order in which lanes that are closed to cars are theirs.
    *("bus", "tram", "subway", "rail_urban", "rail", "rail_electric", "rail_fast"),
    *("bicycle", "taxi", "delivery", "truck", "motorcycle", "emergency", "ship", "pedestrian"),
)


@dataclass(frozen=True, slots=True, eq=False)
class _TypeUse:
    """How the vehicles of a type were driven.

    Attributes:
        traces: All of them.
        lanes: Number of rows by lane id, lanes of the network outside junctions only.
    """

    traces: Sequence[Trace]
    lanes: Counter[str]

    def top_speeds(self) -> list[float]:
        """Return the largest logged speed of each vehicle [m/s]."""
        logged = [t.speeds for t in self.traces if t.kind == "vehicle"]
        return [float(np.nanmax(each)) for each in logged if np.isfinite(each).any()]


def with_use(scenario: Scenario) -> Scenario:
    """Return a scenario with what a whole log tells of the types whose names tell nothing.

    Args:
        scenario: As read without a window.
    """
    uses = {each.type_id: _use_of(each.type_id, scenario) for each in scenario.guesses}
    tops = _TypeUse(scenario.traffic.traces, Counter()).top_speeds()
    fast = max(tops, default=0.0) >= _DRIVING
    guesses = tuple(
        each if each.vclass else _with_use(each, uses[each.type_id], scenario.network, fast=fast)
        for each in scenario.guesses
    )
    types = {
        each.type_id: default_vehicle_type(each.type_id, "vehicle", vclass=each.vclass)
        for each in guesses
        if each.type_id and each.vclass
    }
    return replace(scenario, vehicle_types={**scenario.vehicle_types, **types}, guesses=guesses)


def _use_of(type_id: str, scenario: Scenario) -> _TypeUse:
    """Return how the vehicles of a type were driven."""
    log = scenario.traffic
    traces = [t for t in log.traces if t.kind == "vehicle" and t.type_id == type_id]
    lanes: Counter[str] = Counter()
    for trace in traces:
        numbers, counts = np.unique(trace.lanes[trace.lanes >= 0], return_counts=True)
        for number, count in zip(numbers.tolist(), counts.tolist(), strict=True):
            name = log.lane_names[number]
            if name in scenario.network.lanes and not name.startswith(":"):
                lanes[name] += count
    return _TypeUse(traces, lanes)


def _with_use(guess: TypeGuess, use: _TypeUse, network: Network, *, fast: bool) -> TypeGuess:
    """Return a guess with the first evidence that there is.

    Args:
        guess: One whose class nothing tells.
        use: How its vehicles were driven.
        network: The roads.
        fast: Whether some vehicles of the log are as fast as cars.
    """
    vclass = _by_ids(use)
    if vclass:
        return replace(guess, vclass=vclass, why="the ids of the vehicles say so")
    own = _by_lanes(use, network)
    if own:
        return replace(guess, vclass=own, why="the vehicles keep to lanes that are closed to cars")
    if fast and _cycles(use, network):
        why = f"the vehicles stay below {_CYCLING:g} m/s where bicycles may go"
        return replace(guess, vclass="bicycle", why=why)
    return guess


def _by_ids(use: _TypeUse) -> str | None:
    """Return the class that almost all ids of vehicles say, or None."""
    classes = Counter(class_of_vehicle(trace.id, trace.kind) for trace in use.traces)
    if not classes:
        return None
    vclass, count = classes.most_common(1)[0]
    return vclass if vclass and count >= _MOST * len(use.traces) else None


def _by_lanes(use: _TypeUse, network: Network) -> str | None:
    """Return the likeliest class where almost all rows lie on lanes without cars, or None."""
    rows = use.lanes.total()
    if rows < _LEAST_ROWS:
        return None
    allowed = Counter(
        {
            vclass: sum(n for lane, n in use.lanes.items() if vclass in network.lanes[lane].allowed)
            for vclass in ALL_CLASSES
        }
    )
    if allowed["passenger"] > (1.0 - _MOST) * rows:
        return None
    # Only lanes that carry a class all the way can be its own.
    return next((vclass for vclass in _LIKELY if allowed[vclass] >= _MOST * rows), None)


def _cycles(use: _TypeUse, network: Network) -> bool:
    """Return whether vehicles are as slow as bicycles where they could be faster."""
    tops = use.top_speeds()
    lanes = [network.lanes[lane] for lane in use.lanes]
    open_lanes = all("bicycle" in lane.allowed for lane in lanes)
    if len(tops) < _LEAST_VEHICLES or not lanes or not open_lanes:
        return False
    rows = use.lanes.total()
    faster = sum(n for lane, n in use.lanes.items() if network.lanes[lane].speed >= _DRIVING)
    return faster >= 0.5 * rows and float(np.quantile(tops, _MOST)) < _CYCLING
