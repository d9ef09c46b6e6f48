"""Finds road users by name."""

from __future__ import annotations

import difflib
from collections.abc import Sequence

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.model.trajectory import Trajectory


def find_trajectory(trajectories: Sequence[Trajectory], name: str) -> Trajectory:
    """Return a trajectory by SUMO's id, or by its key.

    Raises:
        ConfigError: If there is none of that name; the message names some.
    """
    known = {trajectory.key: trajectory for trajectory in trajectories}
    for key in (f"vehicle:{name}", f"person:{name}", f"container:{name}", name):
        if key in known:
            return known[key]
    raise ConfigError(f"no vehicle or person is called {name!r}{_suggested(name, trajectories)}")


def _suggested(name: str, trajectories: Sequence[Trajectory]) -> str:
    """End of a sentence that names near ids and some that exist."""
    ids = list(dict.fromkeys(trajectory.id for trajectory in trajectories))
    if not ids:
        return "; there is nobody in this time window"
    near = difflib.get_close_matches(name, ids, n=3, cutoff=0.6)
    some = [each for each in ids if each not in near][:3]
    meant = f"; did you mean {', '.join(map(repr, near))}?" if near else ""
    return f"{meant}; for example {', '.join(map(repr, some))} exist" if some else meant
