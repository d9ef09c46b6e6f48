"""Guess a vClass from the words of an id, in the languages of many scenarios."""

from __future__ import annotations

import re
import unicodedata
from functools import cache
from itertools import pairwise

from sumo3dviz_pt.sumo.classes import CLASS_DEFAULTS, OBSOLETE_CLASSES

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
    return _said(_words(type_id), kind)


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
    return _said(words[:2], kind) if "".join(words[:2]) in _CLASSES else _said(words[:1], kind)


def _words(name: str) -> list[str]:
    """Return the words of an id in small letters and without accents."""
    parts = [word for part in _PARTS.findall(name) for word in _HUMPS.split(part)]
    plain = [unicodedata.normalize("NFKD", part.casefold()) for part in parts]
    return ["".join(c for c in word if not unicodedata.combining(c)) for word in plain]


def _said(words: list[str], kind: str) -> str | None:
    """Return the class of the telling word with the first rank; pairs tell more than words."""
    pairs = [first + second for first, second in pairwise(words)]
    found = {_CLASSES[pair] for pair in pairs if pair in _CLASSES}
    found = found or {_CLASSES[word] for word in words if word in _CLASSES}
    if kind == "person":
        found &= _OF_PEOPLE
    elif kind != "vehicle":
        return None
    return min(found, key=_RANK.__getitem__, default=None)
