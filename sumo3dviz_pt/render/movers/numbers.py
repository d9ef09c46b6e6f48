"""Numbers of everything that moves in a frame, so that pictures can say what each pixel shows."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sumo3dviz_pt.model.layers import MovingPart
from sumo3dviz_pt.model.scene import Mover


@dataclass(frozen=True, slots=True, eq=False)
class Numbers:
    """What moves in a frame; the k-th part, from 1, has number k.

    Attributes:
        parts: All of them.
        by_name: Number of each, by its name.
    """

    parts: tuple[MovingPart, ...]
    by_name: Mapping[str, int]

    def of_faces(self, count: int, shown: Mapping[str, slice]) -> NDArray[np.float32]:
        """Return the number that each face of a merged mesh belongs to, 0 for free ones, (count,).

        Args:
            count: The mesh's faces.
            shown: Faces of each part, by its name.
        """
        numbers = np.zeros(count, np.float32)
        for name, faces in shown.items():
            numbers[faces] = self.by_name[name]
        return numbers


def numbered(
    rigid: Iterable[Mover], deforming: Iterable[Mover], *, plants: Iterable[str] = ()
) -> Numbers:
    """Number what moves.

    Args:
        rigid: What keeps its shape.
        deforming: What does not, as walking people.
        plants: Names of meshes that wind moves; they have no shape to keep either.
    """
    parts = [MovingPart(mover.name, mover.world_from_body) for mover in rigid]
    parts += [MovingPart(name, None) for name in (*(each.name for each in deforming), *plants)]
    return Numbers(tuple(parts), {part.name: k + 1 for k, part in enumerate(parts)})
