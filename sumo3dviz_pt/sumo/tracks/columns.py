"""What the columns of a table of trajectories mean: those of known data sets, or guessed ones.

A table has a row for each road user and time. Data sets that many people have are known by their
columns; in any other table the names tell what columns hold, and values in which unit (see
`readings`). What a user says wins over both.

References:
    highD, inD, rounD, exiD: the pages on formats of levelxdata.com; x and y of highD are a corner
    of a box in a picture whose y points down. NGSIM: FHWA-HRT-06-137; feet, the middle of the
    front. INTERACTION: Zhan et al., arXiv 1910.03088. pNEUMA: Barmpounakis and Geroliminis, 2020,
    doi:10.1016/j.trc.2019.11.023. Vissim: attributes of vehicle records.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

from sumo3dviz_pt.catalog import did_you_mean
from sumo3dviz_pt.errors import ConfigError, cut
from sumo3dviz_pt.model.traffic import TableChoices
from sumo3dviz_pt.model.traffic import TableColumn as Column

_NAMES = {
    # What a column holds: what it is called in some languages, in small letters, without accents,
    # units, spaces and signs.
    "time": "time t utc utctime timeutc localtime timestamp timestep"
    " simulationtime simtime simsec seconds sec globaltime"
    " unixtime epoch datetime clock timeofday gpstime elapsedtime ts zeit zeitstempel uhrzeit temps"
    " heure tiempo tempo tijd",
    "frame": "frame frameid frameno framenr framenum framenumber frameindex step stepid bild image",
    "id": "id vehicleid vehid vehnr veh vehicle vehicleno vehicleindex trackid track tracknr object"
    " objectid objid obj agent agentid carid car actor actorid participantid pedestrianid pedid"
    " personid person ped no name uid entity entityid device deviceid userid fahrzeug fahrzeugid"
    " vehicule vehiculeid idvehicule vehiculo veicolo voertuig",
    "x": "x posx xpos positionx xposition xcenter xcentre centerx centrex xutm utmx easting localx"
    " coordx xcoord xcoordinate worldx xworld locationx xlocation xfront frontx cx"
    " rechtswert ostwert",
    "y": "y posy ypos positiony yposition ycenter ycentre centery centrey yutm utmy northing localy"
    " coordy ycoord ycoordinate worldy yworld locationy ylocation yfront fronty cy"
    " hochwert nordwert",
    "lon": "lon lng long longitude gpslon gpslng gpslongitude poslon xlon lonwgs84 wgs84lon"
    " laengengrad langengrad",
    "lat": "lat latitude gpslat gpslatitude poslat ylat latwgs84 wgs84lat breitengrad",
    "z": "z posz zpos positionz zposition elevation altitude zcenter zcentre worldz locationz"
    " coordz zcoord",
    "rear_x": "rworldx rearx xrear",
    "rear_y": "rworldy reary yrear",
    "angle": "heading angle yaw yawangle orientation psi theta direction course hdg azimuth bearing"
    " rotation rotationyaw headingangle winkel richtung kurs cap angulo rumbo",
    "speed": "speed velocity v vel vvel spd absvelocity groundspeed geschwindigkeit vitesse"
    " velocidad velocita snelheid",
    "length": "length vlength vehiclelength len l objectlength laenge lange longueur longitud",
    "width": "width vwidth vehiclewidth wid w objectwidth breite largeur ancho",
    "height": "vehicleheight vheight objectheight",
    "class": "class vclass vehicleclass type typeid vehicletype vehtype agenttype objecttype"
    " objectclass category vehiclecategory kind label typ fahrzeugtyp fahrzeugklasse klasse"
    " categorie classe clase tipo art fahrzeugart",
}
_DEGREES = {"x": "lon", "y": "lat"}
_ROLES = {name: role for role, names in _NAMES.items() for name in names.split()}
_NUMBER = re.compile(r"(?:nr|no|num|nummer|number)$")  # after a word for a road user

_UNITS = {
    # Words at the end of a column's name, or in brackets there, and the unit that they mean.
    **dict.fromkeys(("s", "sec", "secs", "seconds"), "s"),
    **dict.fromkeys(("ms", "msec", "millis", "milliseconds"), "ms"),
    **dict.fromkeys(("m", "meter", "meters", "metre", "metres"), "m"),
    **dict.fromkeys(("ft", "feet", "foot"), "ft"),
    **{"cm": "cm", "mm": "mm", "km": "km"},
    **dict.fromkeys(("deg", "degree", "degrees", "°"), "deg"),
    **dict.fromkeys(("rad", "radian", "radians"), "rad"),
    **dict.fromkeys(("mps", "m/s"), "m/s"),
    **dict.fromkeys(("kmh", "km/h", "kph"), "km/h"),
    "mph": "mph",
    **dict.fromkeys(("fps", "ft/s"), "ft/s"),
}

_IN_BRACKETS = re.compile(r"(?:\s*[\[(]\s*([^\])]*)\s*[\])]|/(\w+))\s*$")
_PARTS = re.compile(r"[^\W_]+")
_HUMPS = re.compile(r"(?<=[a-z])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])")

_PLACED = ("id", "x", "y")


@dataclass(frozen=True, slots=True)
class Form:
    """How a table is to be understood.

    Attributes:
        name: What users call it; empty for a table of one's own.
        columns: What it holds, by one of `model.numbers.TableRole`.
        optional: Columns of such tables that may be missing.
        marks: Other columns by which such tables are known.
        point: Where on the body x and y are: one of `model.numbers.TablePoint`, or `corner` of
            a box.
        downwards: Whether y grows downwards, as in pictures.
        rate: Frames in a second, for tables that count them [Hz].
        classes: What the table's words, or numbers, for classes mean, as vClasses.
        guessed: Whether the columns were told by their names.
        repeated: How many of the last columns come again and again in a row, which is a road
            user's then.
    """

    name: str
    columns: Mapping[str, Column]
    optional: Mapping[str, Column] = field(default_factory=dict)
    marks: tuple[str, ...] = ()
    point: str = "centre"
    downwards: bool = False
    rate: float = 25.0
    classes: Mapping[str, str] = field(default_factory=dict)
    guessed: bool = False
    repeated: int = 0

    @property
    def is_geo(self) -> bool:
        """Whether x is a longitude and y a latitude."""
        return self.columns["x"].unit == "deg"


def _size(length: str = "length", width: str = "width", unit: str = "m") -> dict[str, Column]:
    return {"length": Column(length, unit), "width": Column(width, unit)}


def _place(x: str, y: str, unit: str = "m") -> dict[str, Column]:
    return {"x": Column(x, unit), "y": Column(y, unit)}


_OF_VISSIM = {
    **{"100": "passenger", "200": "truck", "300": "bus", "400": "tram"},
    **{"510": "pedestrian", "520": "pedestrian", "610": "bicycle", "620": "bicycle"},
}
"""Types of vehicles that Vissim has from the start."""

FORMS = (
    Form(
        "highD",
        {
            "frame": Column("frame"),
            "id": Column("id"),
            **_place("x", "y"),
            **_size("width", "height"),
        },
        {"class": Column("class")},
        marks=("xVelocity", "laneId"),
        point="corner",
        downwards=True,
    ),
    Form(
        "inD",
        {
            "frame": Column("frame"),
            "id": Column("trackId"),
            **_place("xCenter", "yCenter"),
            "angle": Column("heading", "deg", "east", "left"),
        },
        {"class": Column("class"), **_size()},
        classes={"truck_bus": "truck"},
    ),
    Form(
        "NGSIM",
        {
            "frame": Column("Frame_ID"),
            "id": Column("Vehicle_ID"),
            **_place("Local_X", "Local_Y", "ft"),
        },
        {
            **_size("v_Length", "v_Width", "ft"),
            "speed": Column("v_Vel", "ft/s"),
            "class": Column("v_Class"),
        },
        point="front",
        rate=10.0,
        classes={"1": "motorcycle", "2": "passenger", "3": "truck"},
    ),
    Form(
        "INTERACTION",
        {
            "time": Column("timestamp_ms", "ms"),
            "id": Column("track_id"),
            **_place("x", "y"),
            "class": Column("agent_type"),
        },
        {"angle": Column("psi_rad", "rad", "east", "left"), **_size()},
    ),
    Form(
        "pNEUMA",
        {
            "time": Column("time", "s"),
            "id": Column("track_id"),
            **_place("lon", "lat", "deg"),
        },
        {"speed": Column("speed", "km/h"), "class": Column("type")},
        marks=("traveled_d", "avg_speed"),
        classes={"Medium Vehicle": "delivery", "Heavy Vehicle": "truck"},
        repeated=6,
    ),
    Form(
        "Vissim",
        {
            "time": Column("SIMSEC", "s"),
            "id": Column("NO"),
            **_place("COORDFRONT x", "COORDFRONT y"),
        },
        {
            "z": Column("COORDFRONT z", "m"),
            "rear_x": Column("COORDREAR x", "m"),
            "rear_y": Column("COORDREAR y", "m"),
            "speed": Column("SPEED", "km/h"),
            **_size("LENGTH", "WIDTH"),
            "class": Column("VEHTYPE"),
        },
        point="front",
        classes=_OF_VISSIM,
    ),
    Form(
        "Vissim",
        {
            "time": Column("SIMSEK", "s"),
            "id": Column("NR"),
            **_place("KOORDVORNE x", "KOORDVORNE y"),
        },
        {
            "z": Column("KOORDVORNE z", "m"),
            "rear_x": Column("KOORDHINTEN x", "m"),
            "rear_y": Column("KOORDHINTEN y", "m"),
            "speed": Column("GESCHW", "km/h"),
            **_size("LAENGE", "BREITE"),
            "class": Column("FZTYP"),
        },
        point="front",
        classes=_OF_VISSIM,
    ),
    Form(
        "Vissim",
        {"time": Column("t", "s"), "id": Column("VehNr"), **_place("WorldX", "WorldY")},
        {
            "z": Column("WorldZ", "m"),
            "rear_x": Column("RWorldX", "m"),
            "rear_y": Column("RWorldY", "m"),
            "length": Column("Length", "m"),
            "class": Column("Type"),
        },
        point="front",
        classes=_OF_VISSIM,
    ),
    Form(
        "CARLA",
        {
            "time": Column("timestamp", "s"),
            "id": Column("id"),
            **_place("location_x", "location_y"),
            "angle": Column("rotation_yaw", "deg", "east", "right"),
        },
        {"z": Column("location_z", "m"), "class": Column("type_id")},
        downwards=True,
    ),
)
"""Tables of known data sets and tools; the first whose columns are all there is taken."""


def form_of(names: Iterable[str], choices: TableChoices) -> Form | None:
    """Return how a table with such columns is to be understood; None if nothing tells.

    Args:
        names: Of its columns.
        choices: What a user says.

    Raises:
        ConfigError: If a user names a column that the table has not.
    """
    there = list(names)
    known = next((form for form in FORMS if _is_form(form, there)), None)
    if known is None:
        columns = _by_names(there)
        place = _words(columns["x"].name)[0] if "x" in columns else ""
        form = Form("", columns, point="front" if "front" in place else "centre", guessed=True)
    else:
        more = {role: column for role, column in known.optional.items() if _is_there(column, there)}
        form = replace(known, columns={**known.columns, **more})
    form = _chosen(form, there, choices)
    form = replace(form, columns={**form.columns, **_in_degrees(form.columns)})
    timed = "time" in form.columns or "frame" in form.columns
    return form if timed and all(role in form.columns for role in _PLACED) else None


def missing_in(names: Iterable[str], choices: TableChoices) -> list[str]:
    """Return what no column of a table tells, in words; empty where all that is needed is there."""
    there = {**_by_names(names), **choices.columns}
    needed = {"time": "the time", "id": "who it is", "x": "x", "y": "y"}
    if "frame" in there:
        needed.pop("time")
    return [words for role, words in needed.items() if role not in there]


def _chosen(form: Form, there: list[str], choices: TableChoices) -> Form:
    """Return a form with what a user says."""
    for role, column in choices.columns.items():
        if not _is_there(column, there):
            hint = did_you_mean(column.name, there)
            raise ConfigError(
                f"the table has no column {cut(column.name)!r}{hint}",
                key=f"scenario.trajectories.columns.{role}",
            )
    own = dict(choices.columns)
    kept = {role: column for role, column in form.columns.items() if role not in own}
    if "time" in own:
        kept.pop("frame", None)
    return replace(
        form,
        columns={**kept, **own},
        guessed=form.guessed and bool(kept),
        point=choices.point or form.point,
        downwards=form.downwards if choices.downwards is None else choices.downwards,
        rate=choices.rate or form.rate,
        classes={**form.classes, **choices.classes},
    )


def _is_there(column: Column, names: Iterable[str]) -> bool:
    """Whether a table has a column, or one whose cells hold x, y and z of which it is a part."""
    names = set(names)
    base, _, part = column.name.rpartition(" ")
    return column.name in names or (part in ("x", "y", "z") and base in names)


def _is_form(form: Form, names: list[str]) -> bool:
    """Whether a table with such columns is one of a form."""
    columns = all(_is_there(column, names) for column in form.columns.values())
    return columns and set(form.marks) <= set(names)


def _by_names(names: Iterable[str]) -> dict[str, Column]:
    """Return what columns hold by their names alone; the first of several is taken."""
    found: dict[str, Column] = {}
    for name in names:
        words, unit = _words(name)
        role = _ROLES.get(words)
        if role is None and _ROLES.get(_NUMBER.sub("", words)) == "id":
            role = "id"
        if role is not None:
            found.setdefault(role, Column(name, unit))
    if "time" in found:
        found.pop("frame", None)
    degrees = {role: found.pop(name, None) for role, name in _DEGREES.items()}
    if not {"x", "y"} <= found.keys() and None not in degrees.values():
        found.update({role: column for role, column in degrees.items() if column is not None})
    return found


def _in_degrees(columns: Mapping[str, Column]) -> dict[str, Column]:
    """Return the columns of longitudes and latitudes, with their unit."""
    named = {role: columns[role] for role in _DEGREES.keys() & columns.keys()}
    return {
        role: replace(column, unit="deg")
        for role, column in named.items()
        if not column.unit and _ROLES.get(_words(column.name)[0]) == _DEGREES[role]
    }


def _words(name: str) -> tuple[str, str]:
    """Return a column's name in small letters, and its unit, which is empty if it tells none."""
    bracket = _IN_BRACKETS.search(name)
    if bracket:
        unit = (bracket[1] or bracket[2] or "").strip().lower()
        return _joined(_parts(name[: bracket.start()])), _UNITS.get(unit, "")
    parts = _parts(name)
    if len(parts) > 1 and parts[-1] in _UNITS and _joined(parts) not in _ROLES:
        return _joined(parts[:-1]), _UNITS[parts[-1]]
    return _joined(parts), ""


def _parts(name: str) -> list[str]:
    """Return the words of a name in small letters, without accents."""
    plain = "".join(c for c in unicodedata.normalize("NFKD", name) if not unicodedata.combining(c))
    return [part.lower() for word in _PARTS.findall(plain) for part in _HUMPS.split(word)]


def _joined(parts: list[str]) -> str:
    return "".join(parts)
