"""What pixels show: things with names, numbers made of the names, and classes.

A thing is a road user, a tree, a house, a sign, the surface of an edge, and so on. Its number is a
hash of its name, so it is the same in all frames, in all films and on every machine, and nobody has
to keep a list. Its class is one of the Cityscapes data set.

References:
    Cordts et al., "The Cityscapes Dataset for Semantic Urban Scene Understanding", CVPR 2016,
        doi:10.1109/CVPR.2016.350; ids as in `labels.py` of its scripts
        (https://github.com/mcordts/cityscapesScripts).
    Appleby, MurmurHash3 (https://github.com/aappleby/smhasher), `MurmurHash3_x86_32`, seed 0, which
        Cryptomatte uses, too (https://github.com/Psyop/Cryptomatte, specification 1.2.0).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

LABELS: Mapping[str, int] = {
    "unlabeled": 0,
    "ego vehicle": 1,
    "static": 4,
    "dynamic": 5,
    "ground": 6,
    "road": 7,
    "sidewalk": 8,
    "parking": 9,
    "rail track": 10,
    "building": 11,
    "wall": 12,
    "fence": 13,
    "guard rail": 14,
    "bridge": 15,
    "tunnel": 16,
    "pole": 17,
    "traffic light": 19,
    "traffic sign": 20,
    "vegetation": 21,
    "terrain": 22,
    "sky": 23,
    "person": 24,
    "rider": 25,
    "car": 26,
    "truck": 27,
    "bus": 28,
    "trailer": 30,
    "train": 31,
    "motorcycle": 32,
    "bicycle": 33,
}
"""Classes that occur, by the names and with the ids of Cityscapes."""

_OF_KIND: Mapping[str, str] = {
    # What stands, by the beginning of its name up to the colon.
    "tree": "vegetation",
    "shrub": "vegetation",
    "hedge": "vegetation",
    "fence": "fence",
    "home": "building",
    "shop": "building",
    "block": "building",
    "building": "building",
    "house": "building",
    "signal": "traffic light",
    "sign": "traffic sign",
    "lamp": "pole",
    "pole": "pole",
    "edge": "road",
    "junction": "road",
    "marking": "road",
    "sidewalk": "sidewalk",
    "kerb": "sidewalk",
    "court": "sidewalk",
    "verge": "terrain",
    "rails": "rail track",
    "person": "person",
    "vehicle": "car",
    "container": "dynamic",
    # Parts of the scene whose faces have no names of their own, by the beginning of their ids.
    "road": "road",
    "islands": "sidewalk",
    "ground": "terrain",
    "ground/blades": "vegetation",
    "ground/planted": "vegetation",
    "ground/tunnels": "tunnel",
    "ground/village": "building",
    "ground/wayside": "vegetation",
    "ground/weeds": "vegetation",
    "ground/woods": "vegetation",
    "areas": "terrain",
}
"""Classes of kinds of things; all others are static."""

_OF_VCLASS: Mapping[str, str] = {
    "bicycle": "bicycle",
    "bus": "bus",
    "cable_car": "train",
    "coach": "bus",
    "moped": "motorcycle",
    "motorcycle": "motorcycle",
    "pedestrian": "person",
    "rail": "train",
    "rail_electric": "train",
    "rail_fast": "train",
    "rail_urban": "train",
    "scooter": "bicycle",
    "ship": "dynamic",
    "subway": "train",
    "trailer": "truck",
    "tram": "train",
    "truck": "truck",
    "wheelchair": "person",
}
"""Classes of SUMO's vehicle classes; all others are cars."""

SKY = "sky"
"""Name of what has number 0."""

_MASK = 0xFFFFFFFF


@dataclass(frozen=True, slots=True)
class Thing:
    """What an instance number stands for.

    Attributes:
        name: Such as `vehicle:flow_0.3`, `tree:poi_7` or `edge:E1`.
        label: Its class, a name of `LABELS`.
    """

    name: str
    label: str

    @property
    def number(self) -> int:
        """Its instance number, [0, 2^32)."""
        return number_of(self.name)

    @property
    def label_id(self) -> int:
        """The id of its class."""
        return LABELS[self.label]

    @property
    def moves(self) -> bool:
        """Whether it is a road user."""
        return self.name.partition(":")[0] in ("vehicle", "person", "container")


def thing_named(name: str, *, vclass: str = "", ego: bool = False) -> Thing:
    """Return a thing with its class.

    Args:
        name: Its name.
        vclass: SUMO's vehicle class, of vehicles.
        ego: Whether it is the vehicle that the camera rides in.
    """
    if ego:
        return Thing(name, "ego vehicle")
    if name == SKY:
        return Thing(name, "sky")
    kind, colon, _ = name.partition(":")
    if vclass:
        return Thing(name, _OF_VCLASS.get(vclass, "car"))
    if colon:
        return Thing(name, _OF_KIND.get(kind, "static"))
    # The longest beginning of a part's id counts.
    words = name.split("/")
    beginnings = ("/".join(words[:count]) for count in range(len(words), 0, -1))
    return Thing(name, next((_OF_KIND[b] for b in beginnings if b in _OF_KIND), "static"))


def number_of(name: str) -> int:
    """Return the number of a thing: 0 for the sky, else the hash of its name, [0, 2^32)."""
    return 0 if name == SKY else murmur3(name.encode())


def murmur3(data: bytes) -> int:
    """Return MurmurHash3 of bytes, the one for x86 with 32 bits and seed 0."""
    whole = len(data) // 4 * 4
    state = 0
    for at in range(0, whole, 4):
        state ^= _scrambled(int.from_bytes(data[at : at + 4], "little"))
        state = (_turned(state, 13) * 5 + 0xE6546B64) & _MASK
    state ^= _scrambled(int.from_bytes(data[whole:], "little"))
    state ^= len(data)
    for shift, factor in ((16, 0x85EBCA6B), (13, 0xC2B2AE35)):
        state = ((state ^ (state >> shift)) * factor) & _MASK
    return state ^ (state >> 16)


def _scrambled(block: int) -> int:
    """Return a block of four bytes as the hash takes it."""
    return (_turned((block * 0xCC9E2D51) & _MASK, 15) * 0x1B873593) & _MASK


def _turned(value: int, count: int) -> int:
    """Return 32 bits turned to the left."""
    return ((value << count) | (value >> (32 - count))) & _MASK
