"""Which thing each face of the tables belongs to, in the frame that is shown.

Faces of meshes that stand say it by runs (`Mesh.things`); those of merged meshes of road users by
who is shown in each of their places; instances by their slots. Nothing of this is known to the
renderer's kernels: they find a face's number, and it is looked up here, where somebody asks.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np

from sumo3dviz_pt.model.geometry import Image, Ints
from sumo3dviz_pt.render.kernel.tables import Tables
from sumo3dviz_pt.render.loaded import LoadedScene

Run = tuple[str, int]


@dataclass(frozen=True, slots=True, eq=False)
class Owners:
    """Whom faces belong to.

    Attributes:
        names: Of things that stand, and of parts of road users; the first is empty.
        starts: The first face of each run, (n,), increasing.
        owner: Number of the name of each run, (n,).
        of_instance: Number of the name that an instance shows, by Mitsuba's number of it, (k,).
        windswept: First face and number of faces of each mesh that wind moves, by its name.
    """

    names: tuple[str, ...]
    starts: Ints
    owner: Ints
    of_instance: Ints
    windswept: Mapping[str, tuple[int, int]] = field(default_factory=dict)

    def of(self, depth: Image, face: Image, instance: Image) -> Ints:
        """Return the number of the name at each pixel; 0 where there is none.

        Args:
            depth: 0 where nothing was met, (h, w).
            face: Number in the tables, (h, w).
            instance: Mitsuba's number of the instance, or 0, (h, w).
        """
        run = np.searchsorted(self.starts, face, side="right") - 1
        owner = self.owner[np.maximum(run, 0)]
        by_slot = self.of_instance[np.minimum(instance, len(self.of_instance) - 1)]
        return np.where(depth > 0.0, np.where(instance > 0, by_slot, owner), 0)

    def own_faces(self, face: Image) -> Ints:
        """Return numbers of faces, (n,), among those of the part that they belong to."""
        run = np.searchsorted(self.starts, face, side="right") - 1
        return np.asarray(face.astype(np.int64) - self.starts[run])


def owners_of(tables: Tables, loaded: LoadedScene) -> Owners:
    """Find whom the faces of a loaded scene belong to, in the frame that it shows.

    Args:
        tables: Of the scene, at that frame.
        loaded: The scene.
    """
    numbers = {"": 0}
    starts, owner = [0], [0]
    windswept: dict[str, tuple[int, int]] = {}
    for first, name, faces in tables.meshes():
        at = first
        if loaded.plants(name) is not None:
            windswept[name] = (first, faces)
        for thing, count in _runs(loaded, name, faces):
            starts.append(at)
            owner.append(numbers.setdefault(thing, len(numbers)))
            at += count
    slots = {} if loaded.pool is None else loaded.pool.shown
    of_slot = {tables.number_of(slot): name for slot, name in slots.items()}
    of_instance = np.zeros(max(of_slot, default=0) + 1, np.int64)
    for number, name in of_slot.items():
        of_instance[number] = numbers.setdefault(name, len(numbers))
    return Owners(tuple(numbers), np.array(starts), np.array(owner), of_instance, windswept)


def _runs(loaded: LoadedScene, mesh: str, faces: int) -> Iterator[Run]:
    """Yield what the faces of a mesh belong to, in their order."""
    shown: Mapping[str, slice] | None = loaded.shown.get(mesh)
    if shown is None:
        yield from loaded.things(mesh) or (("", faces),)
        return
    at = 0
    for name, places in sorted(shown.items(), key=lambda item: item[1].start):
        yield "", places.start - at
        yield name, places.stop - places.start
        at = places.stop
    yield "", faces - at
