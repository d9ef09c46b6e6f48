"""Which share of the picture shows what, by the layer `instance`.

A visible share is the number of pixels whose central ray meets a thing first, over all pixels of
the frame. So it tells how large a thing is seen: what hides behind others, or lies beyond the edge
of the picture, does not count, and it is not the share of the thing that is visible. A thing that
is thinner than a pixel counts by the rays that meet it. Rain, fog and overlays hide nothing.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from sumo3dviz_pt.pipeline.certificate.acts import matches
from sumo3dviz_pt.pipeline.certificate.evidence import COUNTED
from sumo3dviz_pt.pipeline.films.frames import frames_folder
from sumo3dviz_pt.pipeline.layers.places import beside

Row = dict[str, str | int | float]


def share_rows(film: Path, number: int, named: Sequence[str]) -> Iterator[Row]:
    """Yield the visible share of each class and of named things in a frame.

    Args:
        film: The film.
        number: The frame's.
        named: Patterns of names of things that are told apart.

    Raises:
        InputError: If the layers are missing or damaged.
    """
    from sumo3dviz_pt.pipeline.layers.read import read_frame

    seen = read_frame(beside(frames_folder(film)), number)
    numbers, counts = np.unique(seen.layers[COUNTED], return_counts=True)
    things: dict[str, int] = {}
    classes: dict[str, int] = {}
    for key, pixels in zip(numbers.tolist(), counts.tolist(), strict=True):
        thing = seen.things.get(int(key))
        name, label = ("sky", "sky") if thing is None else (thing.name, thing.label)
        classes[label] = classes.get(label, 0) + pixels
        if matches(named, name, label):
            things[name] = things.get(name, 0) + pixels
    whole = int(counts.sum())
    for kind, some in (("class", classes), ("thing", things)):
        for name, pixels in sorted(some.items()):
            share = round(pixels / whole, 6)
            yield {"frame": number, "kind": kind, "name": name, "share": share}
