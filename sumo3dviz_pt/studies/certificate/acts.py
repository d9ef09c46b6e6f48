"""Where a factor acts, and by how much: what the study file says, or what its levels' keys mean.

This is the only place that knows what a key of the scene file changes in a picture, and which keys
belong together: a factor is about one subject, and what its levels set beside it confounds it.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from types import MappingProxyType

from sumo3dviz_pt.job.study import ActSettings

_PLANTS = ("tree:*", "shrub:*", "hedge:*", "pit:*", "label:vegetation", "label:terrain")
_ROADS = (
    *("edge:*", "junction:*", "marking*", "kerb*", "road*", "verge:*", "label:road"),
    *("label:sidewalk", "label:ground", "label:parking"),
)
_GROUND = ("terrain*", "ground*", "label:terrain", "label:ground")
_TOWN = (
    *("fence:*", "label:fence", "court*", "label:sidewalk", "label:parking", "parked:*"),
    *("label:static", "lamp:*", "sign:*"),
)
_USERS = ("vehicle:*", "person:*", "container:*")
_KINDS_OF_USERS = tuple(pattern.removesuffix("*") for pattern in _USERS)
_POLES = ("label:pole", "label:polegroup", "label:traffic light", "label:traffic sign")


@dataclass(frozen=True, slots=True)
class Acts:
    """Where a factor acts.

    Attributes:
        things: Patterns of names, or of labels as `label:vegetation`: what may have another shape,
            stand elsewhere or be missing.
        looks: Patterns of what may have another colour, and keeps its shape.
        light: Whether sky, sun and lamps may be others.
        picture: Whether exposure, tone curve, glare and response may be others.
        camera: Whether it may be seen from elsewhere.
        motion: Whether traffic, signals and times may be others.
        anything: Whether all may be.
        overlays: Whether something else may be drawn over the film.
        tilt: By how many degrees the normal of level ground may lean from the vertical, where what
            looks otherwise is filled with water or has another grain; 0 is no other normal.
        lift: How far the surface of a road may be from where it was, along its normal [m].
    """

    things: tuple[str, ...] = ()
    looks: tuple[str, ...] = ()
    light: bool = False
    picture: bool = False
    camera: bool = False
    motion: bool = False
    anything: bool = False
    overlays: bool = False
    tilt: float = 0.0
    lift: float = 0.0

    @classmethod
    def asked(cls, settings: ActSettings) -> Acts:
        """Return what a study file says."""
        return cls(**settings.model_dump())

    def __or__(self, other: Acts) -> Acts:
        """Both together."""
        return Acts(
            tuple(dict.fromkeys((*self.things, *other.things))),
            tuple(dict.fromkeys((*self.looks, *other.looks))),
            self.light or other.light,
            self.picture or other.picture,
            self.camera or other.camera,
            self.motion or other.motion,
            self.anything or other.anything,
            self.overlays or other.overlays,
            max(self.tilt, other.tilt),
            max(self.lift, other.lift),
        )

    @property
    def develops(self) -> bool:
        """Whether what develops may differ: with light, or by itself."""
        return self.picture or self.light or self.anything

    @property
    def moves(self) -> bool:
        """Whether pictures need not be in register."""
        return self.camera or self.anything

    @property
    def on_world(self) -> bool:
        """Whether what stands may differ: lit windows, another view's detail, things by name."""
        named = (*self.things, *self.looks)
        standing = any(not pattern.startswith(_KINDS_OF_USERS) for pattern in named)
        return self.light or self.moves or self.motion or standing

    def may_reshape(self, name: str, label: str = "") -> bool:
        """Return whether a thing may have another shape."""
        shapes = (*self.things, *_USERS) if self.motion else self.things
        return self.anything or matches(shapes, name, label)

    def may_look(self, name: str, label: str = "") -> bool:
        """Return whether a thing may have another colour."""
        return self.may_reshape(name, label) or matches(self.looks, name, label)

    def __str__(self) -> str:
        words = {
            "sky, sun and lamps": self.light,
            "exposure, tone curve, glare and response": self.picture,
            "the camera": self.camera,
            "what traffic and signals do": self.motion,
            "what is drawn over the film": self.overlays,
            "anything": self.anything,
        }
        parts = [f"the shape of {', '.join(self.things)}"] if self.things else []
        parts += [f"the colour of {', '.join(self.looks)}"] if self.looks else []
        parts += [word for word, true in words.items() if true]
        return "; ".join(parts) or "nothing"


def matches(patterns: Iterable[str], name: str, label: str = "") -> bool:
    """Return whether a thing's name, or its label as `label:vegetation`, fits one of patterns."""
    own = (name, f"label:{label}")
    return any(fnmatchcase(each, pattern) for pattern in patterns for each in own)


WATER_TILT = 33.0
"""How far the normal of level ground may lean under water [degrees]. Rings of drops are no steeper
than .35 x .892 in each of their two layers (`render/kernel/deposits.py`), together a slope of .624
or 32 degrees; the grain of what counts as level leans 18 degrees at most."""

ROAD_LIFT = 0.0055
"""How far the surface of a road with another colour or of another material may lie from where it
was [m]: wear, details and painted lines are layers 2, 3.5 and 5 mm above it, and a plain colour
does not show wear."""

_AIR = Acts(looks=("*",), light=True, picture=True, tilt=WATER_TILT)
"""Fog and water on things: all look otherwise, and nothing has another shape."""

_RAIN = Acts(things=("{rider}",), looks=("*",), light=True, picture=True, tilt=WATER_TILT)
"""Rain: as fog, but wipers that rest by dry weather move before the picture, and are no shape."""

_SNOW = Acts(
    things=(*_PLANTS, *_ROADS, *_GROUND, "{rider}"),
    looks=("*",),
    light=True,
    picture=True,
    tilt=WATER_TILT,
)
"""Snow, or weather that may be any: it lies on the ground and on plants, and all look otherwise."""

_SURFACE = Acts(looks=_ROADS, tilt=WATER_TILT, lift=ROAD_LIFT)
_LOOKS = "how road users look"
_CAMERA, _LIGHT, _PICTURE = "the camera", "the light", "exposure and tone"
_WEATHER, _LOG, _PLANTED = "the weather", "the simulation", "plants"
_DRAWN = "what is drawn over the film"

_RULES: tuple[tuple[str, str, Acts], ...] = (
    # key of the scene file                  subject     acts on
    (r"sky\b.*|lights", _LIGHT, Acts(light=True)),
    (r"template", "", Acts()),  # what it holds stands under the keys themselves
    (r"output\.(exposure|tone|glare|response)", _PICTURE, Acts(picture=True)),
    (r"output\.layers\b.*", "", Acts()),  # beside the film, and in no picture
    (r"output\.(codec|half|sound)\b.*", "output", Acts()),  # in no frame, but in what people get
    (r"overlays\b.*", _DRAWN, Acts(overlays=True)),
    (r"weather\.(fog|wetness|puddles)\b.*", _WEATHER, _AIR),
    (r"weather\.(preset|rain|windscreen)\b.*", _WEATHER, _RAIN),
    (r"weather\.wind\b.*", _WEATHER, Acts(things=_PLANTS, light=True)),
    # What weather there is tells the season, too, as accounts know it: the air counts as another.
    (r"weather\.season", _WEATHER, Acts(things=(*_PLANTS, *_GROUND), looks=_GROUND, light=True)),
    (r"weather\b.*", _WEATHER, _SNOW),  # a course may bring any of them at other times
    (
        r"vehicles\.by_id\.(?P<id>.+)\.colour",
        _LOOKS,
        Acts(looks=("vehicle:{id}", "person:{id}")),
    ),
    (
        r"vehicles\.by_id\.(?P<id>.+?)(\.model)?",
        _LOOKS,
        Acts(things=("vehicle:{id}", "person:{id}")),
    ),
    (r"vehicles\.colours\b.*", _LOOKS, Acts(looks=_USERS)),
    (r"vehicles\b.*", _LOOKS, Acts(things=_USERS)),
    (r"ground\.planting", _PLANTED, Acts(things=_PLANTS)),
    (r"ground\.(texture|scale)", "the ground", Acts(looks=_GROUND, tilt=WATER_TILT)),
    (r"ground\b.*", "the ground", Acts(things=(*_GROUND, *_PLANTS, "label:water"))),
    (r"roads\.(surface|colour)|roads\.per_edge\..*\.(surface|colour)", "the roads", _SURFACE),
    (r"roads\b.*", "the roads", Acts(things=(*_ROADS, *_GROUND, "label:traffic light"))),
    (r"objects\.(trees|shrubs|hedges)\b.*", _PLANTED, Acts(things=_PLANTS)),
    (r"objects\.fences\b.*", "fences", Acts(things=("fence:*", "label:fence"))),
    (
        r"objects\.(?P<id>homes|shops|blocks|buildings)\b.*",
        "houses",
        Acts(things=("label:building",)),
    ),
    (
        r"street\.(town|parked)",
        "the town",
        Acts(things=("label:building", *_GROUND, *_PLANTS, *_POLES, *_TOWN)),
    ),
    (r"street\.fronts", "houses", Acts(things=("label:building", *_GROUND))),
    (
        r"street\b.*",
        "what stands in the street",
        Acts(things=(*_POLES, "label:static", "lamp:*", "sign:*", "kerb*")),
    ),
    (
        r"signals\.(show|design)",
        "how signals look",
        Acts(things=("signal:*", "label:traffic light", "label:pole")),
    ),
    (r"signals\b.*|motion\b.*", "how traffic moves", Acts(motion=True)),
    (
        r"traffic\.rides\.(?P<id>.+?)(\.[a-z]+)?",
        "rides",
        Acts(things=("vehicle:{id}", "person:{id}")),
    ),
    (r"traffic\b.*", "who is on the road", Acts(things=_USERS)),
    (r"cameras\.[^.]+\.exposure\b.*", _PICTURE, Acts(picture=True)),
    # Frames show the middle of their exposure, so another shutter shows other times.
    (r"cameras\.[^.]+\.shutter\b.*", _CAMERA, Acts(camera=True, motion=True)),
    (r"cameras\b.*", _CAMERA, Acts(camera=True)),
    (r"shots\b.*\.camera", _CAMERA, Acts(camera=True)),
    (r"shots\b.*", _CAMERA, Acts(camera=True, motion=True)),
    (r"scenario\.trajectories\b.*", _LOG, Acts(camera=True, motion=True)),
    (r"scenario\.signals\b.*", _LOG, Acts(motion=True)),
)
"""What keys are about and act on, the first that fits; all others act on anything. `{id}` is what a
key names, `{rider}` the vehicle that the camera rides in."""

_WITH: Mapping[str, frozenset[str]] = MappingProxyType(
    {
        _LIGHT: frozenset({_PICTURE}),
        _WEATHER: frozenset({_LIGHT, _PICTURE}),
        _LOG: frozenset({_CAMERA, "how traffic moves"}),
    }
)
"""What goes with a subject and is part of it: light has its exposure, weather its light, and
another log is seen by another rider at other times."""

_LAST = (
    *(_WEATHER, _LOG, "who is on the road", _LIGHT, "how traffic moves", _DRAWN, _CAMERA),
    _PICTURE,
)
"""Subjects that a factor with several is about last, in order; first come things by name."""

_FILMED = frozenset({"seed", "quality", "textured", "output"})
"""First words of keys that no factor is about if it is about anything else."""

_CONTENT = re.compile(
    r"(scenario|objects|street|roads|ground|vehicles|traffic|signals|weather)\b.*"
)
"""Keys of what there is to see: a factor that says where it acts may set any of them, and is judged
by what it says. All others are how it is filmed."""


@dataclass(frozen=True, slots=True)
class Subject:
    """What a factor is about.

    Attributes:
        acts: Where it acts.
        confounds: Which settings its levels change beside that, as in `StimulusPair.changed`.
        ruleless: Keys that no rule knows, so that they may change anything.
    """

    acts: Acts
    confounds: tuple[str, ...] = ()
    ruleless: tuple[str, ...] = ()


def subject_of(changes: Sequence[str], *, intended: Acts | None = None, rider: str = "") -> Subject:
    """Return what a factor is about, and what its levels change beside it.

    Args:
        changes: What differs in the scenes of two levels, as in `StimulusPair.changed`.
        intended: Where the study file says that it acts, if it does.
        rider: Id of the vehicle that the camera rides in, if it does.
    """
    rules = {change: _rule_of(key_of(change), rider) for change in changes}
    if intended is not None:
        beside = [change for change in changes if _is_beside(change, rules[change][1], intended)]
        # How much of it there may be is what the keys' own rules say.
        tilt, lift = (
            max((getattr(own, of) for _, own in rules.values()), default=0.0)
            for of in ("tilt", "lift")
        )
        return Subject(replace(intended, tilt=tilt, lift=lift), tuple(beside))
    about = {change: subject for change, (subject, _) in rules.items()}
    main = min({*about.values()} - {""}, key=_rank, default="")
    own = {"", main, *_WITH.get(main, ())}
    acts = Acts()
    for subject, some in rules.values():
        acts |= some if subject in own else Acts()
    beside = [change for change, subject in about.items() if subject not in own]
    ruleless = [key_of(each) for each in changes if rules[each][1].anything]
    return Subject(acts, tuple(beside), tuple(ruleless))


def _is_beside(change: str, acts: Acts, intended: Acts) -> bool:
    """Return whether a setting is none of what a factor says that it acts on."""
    if intended.anything:
        return False
    if acts.anything:
        return _CONTENT.fullmatch(key_of(change)) is None
    filmed = (
        acts.camera and not (intended.camera or intended.motion),
        acts.light and not intended.light,
        acts.overlays and not intended.overlays,
        re.match(r"output\.(codec|half|sound)\b", change) is not None,
    )
    users = [each for each in (*acts.things, *acts.looks) if each.startswith(_KINDS_OF_USERS)]
    may = intended.may_reshape if acts.things else intended.may_look
    others = bool(users) and not any(may(each) for each in users)
    return any(filmed) or (acts.picture and not intended.develops) or others


def _rank(subject: str) -> tuple[int, str]:
    """Return how late a subject comes among several: things first, how it is filmed last."""
    if subject in _LAST:
        return _LAST.index(subject) + 1, subject
    return (len(_LAST) + 1 if subject in _FILMED else 0), subject


def acts_of(changes: Iterable[str], *, rider: str = "") -> Acts:
    """Return where settings act, all together, by what differs in two scenes.

    Args:
        changes: Each begins with a dotted key and a colon, as in `StimulusPair.changed`.
        rider: Id of the vehicle that the camera rides in, if it does.
    """
    whole = Acts()
    for change in changes:
        whole |= _rule_of(key_of(change), rider)[1]
    return whole


def swaps_log(changes: Iterable[str]) -> bool:
    """Return whether levels set another log, so that everything that moves may differ."""
    return any(re.match(r"scenario\.trajectories\b", key_of(change)) for change in changes)


def key_of(change: str) -> str:
    """Return the dotted key that a change is about."""
    return change.partition(": ")[0]


def _rule_of(key: str, rider: str) -> tuple[str, Acts]:
    """Return what a key is about, and what it acts on."""
    own = f"vehicle:{_literal(rider)}" if rider else ""
    for pattern, subject, acts in _RULES:
        match = re.fullmatch(pattern, key)
        if match:
            # Ids are patterns of * and ? in scene files; brackets stand for themselves there.
            named = {name: _literal(id_) for name, id_ in match.groupdict().items()}
            things = (each.format(rider=own, **named) for each in acts.things)
            looks = tuple(each.format(**named) for each in acts.looks)
            some = replace(acts, things=tuple(each for each in things if each), looks=looks)
            return subject, some
    top = key.partition(".")[0]
    return _LOG if top == "scenario" else top, Acts(anything=True)


def _literal(id_: str) -> str:
    """Return an id as a pattern in which brackets stand for themselves."""
    return id_.replace("[", "[[]")
