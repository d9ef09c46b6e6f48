"""Pictures by name: what the renderer finds in each pixel, and which channels hold it.

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
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from sumo3dviz_pt.model.geometry import Image, Transform


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
        found = cls({}, 0)
        for name, width in widths.items():
            found += cls({name: slice(0, width)}, width)
        return found

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
        found = {name: traced[..., place] for name, place in self.places.items()}
        single = {name for name, place in self.places.items() if place.stop - place.start == 1}
        return Layers({n: layer[..., 0] if n in single else layer for n, layer in found.items()})
