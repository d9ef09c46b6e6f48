"""What each pixel's centre shows, without light: depth, surface, and whose it is."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from sumo3dviz_pt.model.geometry import Bools, Floats, Ints
from sumo3dviz_pt.model.scene import FrameState, Mover
from sumo3dviz_pt.render.kernel.centres import CENTRE
from sumo3dviz_pt.render.kernel.integrator import Kernel
from sumo3dviz_pt.render.kernel.owners import Owners
from sumo3dviz_pt.render.loaded import LoadedScene

OWNERS = ("depth", "face", "instance")
"""What must be asked for to know whose a pixel is."""


@dataclass(frozen=True, slots=True, eq=False)
class Facts:
    """What one place of each pixel shows.

    Attributes:
        found: What was asked for, by the names of `render.kernel.centres`, as arrays (h, w) or
            (h, w, c).
        owner: Number at each pixel of the thing that stands, or the part of what moves, (h, w);
            0 where there is none. None where nobody asked for `OWNERS`.
        owners: Names of all numbers.
    """

    found: Mapping[str, Any]
    owner: Ints | None = None
    owners: Owners | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """By number; of parts such as `vehicle:flow_0.3/wheel2`. The first is empty."""
        return ("",) if self.owners is None else self.owners.names


def facts_of(
    kernel: Kernel,
    loaded: LoadedScene,
    wanted: Collection[str],
    *,
    at: tuple[float, float] = CENTRE,
    owners: Owners | None = None,
) -> Facts:
    """Find what each pixel of the frame that is shown shows.

    Args:
        kernel: Of the scene, at that frame.
        loaded: The scene.
        wanted: Names of `render.kernel.centres`.
        at: Where in the pixels, in widths and heights of one.
        owners: Of that frame, where they are known already.
    """
    sensor, frame = loaded.scene.sensors()[0], loaded.frame
    assert frame is not None, "show a frame first"
    found = kernel.met_through(sensor, frame.view, wanted, at)
    if not {*OWNERS} <= {*wanted}:
        return Facts(found)
    owners = owners or kernel.owners(loaded)
    owner = owners.of(found["depth"], found["face"], found["instance"])
    return Facts(found, owner, owners)


def points_of(facts: Facts, frame: FrameState, size: tuple[int, int]) -> Floats:
    """Return what each pixel shows in the network's coordinates, (h, w, 3) [m].

    The sky is the eye itself, as its depth is 0.

    Args:
        facts: With `depth`.
        frame: That was shown.
        size: Width, height [px].
    """
    return np.asarray(frame.view.points(facts.found["depth"], size))


def carried(
    facts: Facts, loaded: LoadedScene, frames: tuple[FrameState, FrameState], points: Floats
) -> tuple[Floats, Bools]:
    """Return where all that pixels show is in another frame, (h, w, 3) [m], and if that is known.

    What stands stays. Bodies that keep their shape move rigidly, and their wheels turn. Of those
    that take poses, as walking people, and of plants in wind the very place on the body's face is
    followed. Unknown is what is not drawn in the other frame.

    Args:
        facts: With `OWNERS` and `corners`.
        loaded: The scene, at the first frame.
        frames: The frame that was shown, and the other.
        points: From `points_of`.
    """
    before, after = (_by_name(frame) for frame in frames)
    assert facts.owner is not None and facts.owners is not None, "ask for `OWNERS`"
    moved, known = points.copy(), np.ones(points.shape[:2], dtype=np.bool_)
    for number in np.unique(facts.owner).tolist():
        name = facts.names[number]
        if name not in before:
            continue
        here = facts.owner == number
        then = after.get(name)
        if then is None:
            known[here] = False
        elif loaded.takes_poses(before[name]):
            face = facts.found["face"][here]
            own = facts.owners.own_faces(face)
            moved[here] = loaded.place_on(then, own, facts.found["corners"][here])
        else:
            step = then.world_from_body.matrix @ np.linalg.inv(before[name].world_from_body.matrix)
            moved[here] = points[here] @ step[:3, :3].T + step[:3, 3]
    for name, (first, faces) in facts.owners.windswept.items():
        plants, face = loaded.plants(name), facts.found["face"].astype(np.int64) - first
        here = (face >= 0) & (face < faces) & (facts.found["depth"] > 0.0)
        if plants is not None and here.any():
            moved[here] = plants.place_on(frames[1], face[here], facts.found["corners"][here])
    return moved, known


def _by_name(frame: FrameState) -> dict[str, Mover]:
    """Return everything that moves in a frame, by its name."""
    return {mover.name: mover for mover in (*frame.everyone, *frame.fixtures)}
