"""What pixels show: layers by name, things with names and classes, what numbers stand for.

A thing is a road user, a tree, a house, a sign, the surface of an edge, and so on. Its number is a
hash of its name, so it is the same in all frames, in all films and on every machine, and nobody
has to keep a list. Its class is one of the Cityscapes data set.

Layers are what the renderer finds in each pixel; `Channels` says which channels of a traced picture
hold which layer.

| layer | holds | shape |
|---|---|---|
| `radiance` | the picture: linear sRGB primaries, scene units | (h, w, 3) |
| `capped` | mean of the capped samples, before denoiser and haze | (h, w, 3) |
| `lost` | what the cap took; `capped` + `lost` is the plain mean | (h, w, 3) |
| `depth` | mean distance along the ray; samples that hit nothing count as 0 [m] | (h, w) |
| `hit` | share of samples that hit something, in [0, 1] | (h, w) |
| `albedo` | reflectance of the first surface | (h, w, 3) |
| `normal` | unit shading normal of the first surface | (h, w, 3) |
| `emitted` | light of lamps that are seen directly | (h, w, 3) |
| `lamp` | 1 where a lamp is seen directly, else 0 | (h, w) |
| `glow` | `emitted` with many samples, where the picture was traced without it | (h, w, 3) |
| `excess` | light of lamps that are seen directly, taken out of `radiance` | (h, w, 3) |
| `reflected` | what a pane before the eye adds by its reflections | (h, w, 3) |
| `passed` | share of the picture that comes through that pane, in [0, 1] | (h, w) |
| `ids` | what moves there: 0 is what stands or the sky, k the frame's k-th moving part | (h, w) |
| `first_depth` | how far away that is along the ray; 0 is the sky [m] | (h, w) |

`ids` and `first_depth` are no means: both are of the first sample of each pixel, and so belong
together.

References:
    Rec. ITU-R BT.709-6 (primaries and luminance); IEC 61966-2-1 (sRGB's transfer curve).
    Cordts et al., "The Cityscapes Dataset for Semantic Urban Scene Understanding", CVPR 2016,
        doi:10.1109/CVPR.2016.350; ids as in `labels.py` of its scripts
        (https://github.com/mcordts/cityscapesScripts).
    Appleby, MurmurHash3 (https://github.com/aappleby/smhasher), `MurmurHash3_x86_32`, seed 0, which
        Cryptomatte uses, too (https://github.com/Psyop/Cryptomatte, specification 1.2.0).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from sumo3dviz_pt.model.geometry import Bools, Image, Transform, frozen

LUMINANCE = frozen([0.2126, 0.7152, 0.0722])
"""Weights of linear red, green and blue in luminance; of encoded values, in BT.709's luma."""


def linear_from_srgb(value: float) -> float:
    """Undo sRGB's transfer curve for a value in [0, 1]."""
    return value / 12.92 if value <= 0.04045 else ((value + 0.055) / 1.055) ** 2.4


@dataclass(frozen=True, slots=True)
class PixelArea:
    """A rectangle of a picture.

    Attributes:
        rows: Its first row and that after its last one [px].
        columns: The same of its columns [px].
    """

    rows: tuple[int, int]
    columns: tuple[int, int]

    @classmethod
    def around(cls, there: Bools) -> PixelArea | None:
        """Return the smallest one that holds all pixels of a mask, (h, w); None if it has none."""
        rows, columns = (np.flatnonzero(there.any(axis=axis)) for axis in (1, 0))
        if not len(rows):
            return None
        return cls((int(rows[0]), int(rows[-1]) + 1), (int(columns[0]), int(columns[-1]) + 1))

    @property
    def size(self) -> tuple[int, int]:
        """Its rows and columns [px]."""
        return self.rows[1] - self.rows[0], self.columns[1] - self.columns[0]

    @property
    def pixels(self) -> int:
        """How many pixels it has."""
        rows, columns = self.size
        return rows * columns

    @property
    def slices(self) -> tuple[slice, slice]:
        """Where it lies in the arrays of a picture."""
        return slice(*self.rows), slice(*self.columns)

    def within(self, first: int, last: int) -> PixelArea | None:
        """Return the part of it that lies in some rows, up to that before `last`; None if none."""
        top, bottom = max(self.rows[0], first), min(self.rows[1], last)
        return PixelArea((top, bottom), self.columns) if top < bottom else None

    def below(self, row: int) -> PixelArea:
        """Return the same rectangle in a picture that begins at a row of this one."""
        return PixelArea((self.rows[0] - row, self.rows[1] - row), self.columns)


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
    "parked": "car",
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


@dataclass(frozen=True, slots=True, eq=False)
class Layers(Mapping[str, Image]):
    """Pictures of one size by name, as read-only arrays.

    Attributes:
        arrays: (h, w) or (h, w, c) each, by name.
    """

    arrays: Mapping[str, Image] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Make the arrays read-only here, and check that they have one size."""
        views = {name: array.view() for name, array in self.arrays.items()}
        for view in views.values():
            view.setflags(write=False)
        sizes = {name: view.shape[:2] for name, view in views.items()}
        if len(set(sizes.values())) > 1:
            raise ValueError(f"layers differ in size: {sizes}")
        object.__setattr__(self, "arrays", views)

    def __getitem__(self, name: str) -> Image:
        """The layer of a name."""
        return self.arrays[name]

    def __iter__(self) -> Iterator[str]:
        """Go through the names."""
        return iter(self.arrays)

    def __len__(self) -> int:
        """Return how many layers there are."""
        return len(self.arrays)

    def __or__(self, others: Mapping[str, Image]) -> Layers:
        """These layers and others, which win where names are the same."""
        return Layers({**self, **others})

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of all layers [px]."""
        height, width = next(iter(self.values())).shape[:2]
        return width, height


def merged(pictures: Sequence[Layers], how: Callable[..., Image]) -> Layers:
    """Make one picture of some, layer by layer.

    Args:
        pictures: All with the same names.
        how: Makes one array of as many arrays as there are pictures.
    """
    return Layers({name: how(*(each[name] for each in pictures)) for name in pictures[0]})


@dataclass(frozen=True, slots=True, eq=False)
class MovingPart:
    """A road user, or a part of one, that a number of the layer `ids` stands for.

    Attributes:
        name: The same in all frames, such as `vehicle:flow_0.3/body` or `vehicle:flow_0.3/wheel2`.
        world_from_part: Its placement in the network's coordinates. Its axes are stretched by the
            same factors in all frames. None where the part changes its shape.
    """

    name: str
    world_from_part: Transform | None


@dataclass(frozen=True, slots=True)
class Channels:
    """Which channels of a traced picture hold which layer.

    Attributes:
        places: Channels of each layer, by its name; a single one is a layer without channels.
        count: All channels, also those that no layer has.
    """

    places: Mapping[str, slice]
    count: int

    @classmethod
    def in_order(cls, **widths: int) -> Channels:
        """Lay out layers one after the other; the values are their numbers of channels."""
        channels = cls({}, 0)
        for name, width in widths.items():
            channels += cls({name: slice(0, width)}, width)
        return channels

    def __add__(self, others: Channels) -> Channels:
        """These channels, then others."""
        moved = {
            name: slice(self.count + place.start, self.count + place.stop)
            for name, place in others.places.items()
        }
        return Channels({**self.places, **moved}, self.count + others.count)

    def layers(self, traced: Image) -> Layers:
        """Name the layers of a traced picture, (h, w, channels).

        Raises:
            ValueError: If the picture has more or fewer channels.
        """
        if traced.shape[2] != self.count:
            raise ValueError(f"{traced.shape[2]} channels, not {self.count}: {[*self.places]}")
        layers = {name: traced[..., place] for name, place in self.places.items()}
        single = {name for name, place in self.places.items() if place.stop - place.start == 1}
        return Layers({n: layer[..., 0] if n in single else layer for n, layer in layers.items()})
