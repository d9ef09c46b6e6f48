"""Plants that share models, each built by itself, as laws look at all that stands."""

from collections.abc import Iterator

import numpy as np

from sumo3dviz_pt.model.geometry import Mesh, belonging
from sumo3dviz_pt.model.scene import Part, StaticPart
from sumo3dviz_pt.world.objects.stands import Stands

MOST = 6_000
"""Faces of a part, about: of crowns with more, so many are taken, one of every few."""


def unshared(stands: Stands) -> Iterator[StaticPart]:
    """Yield the parts of every plant where it stands."""
    for mover in stands.movers:
        for part in stands.prototypes[mover.prototype].parts:
            faces = part.mesh.faces[:: max(1, len(part.mesh.faces) // MOST)]
            corners = part.mesh.vertices[faces].reshape(-1, 3)
            own = Mesh(corners, np.arange(len(corners)).reshape(-1, 3))
            family = f"{mover.id.partition(':')[0]}s"
            mesh = belonging(mover.world_from_body.mesh(own), mover.id)
            yield StaticPart(f"{mover.id}/{part.material}", family, Part(mesh, part.material))
