"""Where a factor acts: what the study file says, or else what its levels' keys mean.

This is the only place that knows what a key of the scene file changes in a picture.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from fnmatch import fnmatchcase

from sumo3dviz_pt.job.study import ActSettings

_PLANTS = ("tree:*", "shrub:*", "hedge:*", "pit:*", "label:vegetation", "label:terrain")
_ROADS = (
    *("edge:*", "junction:*", "marking*", "kerb*", "road*", "label:road", "label:sidewalk"),
    *("label:ground", "label:parking"),
)
_GROUND = ("terrain*", "ground*", "label:terrain", "label:ground")
_USERS = ("vehicle:*", "person:*", "container:*")
_POLES = ("label:pole", "label:polegroup", "label:traffic light", "label:traffic sign")


@dataclass(frozen=True, slots=True)
class Acts:
    """Where a factor acts.

    Attributes:
        things: Patterns of names, or of labels as `label:vegetation`: what may have another shape,
            stand elsewhere or be missing.
        looks: Patterns of what may have another colour, and keeps its shape.
        light: Whether sky, sun and lamps may be others.
        picture: Whether exposure, tone curve and glare may be others.
        camera: Whether it may be seen from elsewhere.
        motion: Whether traffic, signals and times may be others.
        anything: Whether all may be.
    """

    things: tuple[str, ...] = ()
    looks: tuple[str, ...] = ()
    light: bool = False
    picture: bool = False
    camera: bool = False
    motion: bool = False
    anything: bool = False

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
        )

    @property
    def develops(self) -> bool:
        """Whether exposure, tone curve and glare may differ: with light, or by themselves."""
        return self.picture or self.light or self.anything

    @property
    def moves(self) -> bool:
        """Whether pictures need not be in register."""
        return self.camera or self.anything

    @property
    def on_world(self) -> bool:
        """Whether what stands may differ: lit windows, another view's detail, things by name."""
        named = (*self.things, *self.looks)
        users = tuple(pattern.partition(":")[0] + ":" for pattern in _USERS)
        standing = any(not pattern.startswith(users) for pattern in named)
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
            "exposure, tone curve and glare": self.picture,
            "the camera": self.camera,
            "what traffic and signals do": self.motion,
            "anything": self.anything,
        }
        said = [f"the shape of {', '.join(self.things)}"] if self.things else []
        said += [f"the colour of {', '.join(self.looks)}"] if self.looks else []
        said += [word for word, true in words.items() if true]
        return "; ".join(said) or "nothing"


def matches(patterns: Iterable[str], name: str, label: str = "") -> bool:
    """Return whether a thing's name, or its label as `label:vegetation`, fits one of patterns."""
    own = (name, f"label:{label}")
    return any(fnmatchcase(each, pattern) for pattern in patterns for each in own)


_AIR = Acts(looks=("*",), light=True, picture=True)
"""Fog and water on things: all look otherwise, and nothing has another shape."""

_RAIN = Acts(things=("{rider}",), looks=("*",), light=True, picture=True)
"""Rain: as fog, but wipers that rest by dry weather move before the picture, and are no shape."""

_SNOW = Acts(
    things=(*_PLANTS, *_ROADS, *_GROUND, "{rider}"), looks=("*",), light=True, picture=True
)
"""Snow, or weather that may be any: it lies on the ground and on plants, and all look otherwise."""

_RULES: tuple[tuple[str, Acts], ...] = (
    # key of the scene file                          acts on
    (r"sky\b.*|lights", Acts(light=True)),
    (r"template", Acts()),  # what it holds stands under the keys themselves
    (r"output\.(exposure|tone|glare)", Acts(picture=True)),
    (r"overlays\b.*|output\.(codec|half|layers|sound)\b.*", Acts()),  # not in what is compared
    (r"weather\.(fog|wetness|puddles)\b.*", _AIR),
    (r"weather\.(preset|rain|windscreen)\b.*", _RAIN),
    (r"weather\.wind\b.*", Acts(things=_PLANTS, light=True)),
    (r"weather\.season", Acts(things=(*_PLANTS, *_GROUND), looks=_GROUND)),
    (r"weather\b.*", _SNOW),  # a course may bring any of them at other times
    (r"vehicles\.by_id\.(?P<id>.+)\.colour", Acts(looks=("vehicle:{id}", "person:{id}"))),
    (r"vehicles\.by_id\.(?P<id>.+?)(\.model)?", Acts(things=("vehicle:{id}", "person:{id}"))),
    (r"vehicles\.colours\b.*", Acts(looks=_USERS)),
    (r"vehicles\b.*", Acts(things=_USERS)),
    (r"ground\.planting", Acts(things=_PLANTS)),
    (r"ground\.(texture|scale)", Acts(looks=_GROUND)),
    (r"ground\b.*", Acts(things=(*_GROUND, *_PLANTS, "label:water"))),
    (r"roads\.(surface|colour)|roads\.per_edge\..*\.(surface|colour)", Acts(looks=_ROADS)),
    (r"roads\b.*", Acts(things=(*_ROADS, *_GROUND, "label:traffic light"))),
    (r"objects\.(trees|shrubs|hedges)\b.*", Acts(things=_PLANTS)),
    (r"objects\.fences\b.*", Acts(things=("fence:*", "label:fence"))),
    (r"objects\.(?P<id>homes|shops|blocks|buildings)\b.*", Acts(things=("label:building",))),
    (r"street\.fronts", Acts(things=("label:building", *_GROUND))),
    (r"street\b.*", Acts(things=(*_POLES, "label:static", "lamp:*", "sign:*", "kerb*"))),
    (r"signals\.(show|design)", Acts(things=("signal:*", "label:traffic light", "label:pole"))),
    (r"signals\b.*|motion\b.*", Acts(motion=True)),
    (r"traffic\.rides\.(?P<id>.+?)(\.[a-z]+)?", Acts(things=("vehicle:{id}", "person:{id}"))),
    (r"traffic\b.*", Acts(things=_USERS)),
    (r"cameras\.[^.]+\.exposure\b.*", Acts(picture=True)),
    # Frames show the middle of their exposure, so another shutter shows other times.
    (r"cameras\.[^.]+\.shutter\b.*", Acts(camera=True, motion=True)),
    (r"cameras\b.*", Acts(camera=True)),
    (r"shots\b.*\.camera", Acts(camera=True)),
    (r"shots\b.*", Acts(camera=True, motion=True)),
    (r"scenario\.trajectories\b.*", Acts(camera=True, motion=True)),
    (r"scenario\.signals\b.*", Acts(motion=True)),
)
"""What keys act on, the first that fits; all others act on anything. `{id}` is what a key names,
`{rider}` the vehicle that the camera rides in."""


def acts_of(changes: Iterable[str], *, rider: str = "") -> Acts:
    """Return where a factor acts, by what differs in the scenes of its levels.

    Args:
        changes: Each begins with a dotted key and a colon, as in `StimulusPair.changed`.
        rider: Id of the vehicle that the camera rides in, if it does.
    """
    whole = Acts()
    for change in changes:
        whole |= _acts_of_key(key_of(change), rider)
    return whole


def key_of(change: str) -> str:
    """Return the dotted key that a change is about."""
    return change.partition(": ")[0]


def _acts_of_key(key: str, rider: str) -> Acts:
    """Return what a key acts on."""
    own = f"vehicle:{_literal(rider)}" if rider else ""
    for pattern, acts in _RULES:
        found = re.fullmatch(pattern, key)
        if found:
            # Ids are patterns of * and ? in scene files; brackets stand for themselves there.
            named = {name: _literal(id_) for name, id_ in found.groupdict().items()}
            things = (each.format(rider=own, **named) for each in acts.things)
            return Acts(
                tuple(each for each in things if each),
                tuple(each.format(**named) for each in acts.looks),
                *(getattr(acts, word) for word in ("light", "picture", "camera", "motion")),
            )
    return Acts(anything=True)


def _literal(id_: str) -> str:
    """Return an id as a pattern in which brackets stand for themselves."""
    return id_.replace("[", "[[]")
