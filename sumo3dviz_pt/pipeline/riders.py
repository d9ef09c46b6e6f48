"""Refuses cameras that ride with a road user that is not there, and says when the log has it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from sumo3dviz_pt.catalog import did_you_mean
from sumo3dviz_pt.errors import ConfigError, cut
from sumo3dviz_pt.job.settings import CameraSettings, Job, LagrangianCamera, ShotSettings
from sumo3dviz_pt.model.geometry import Bools, Floats
from sumo3dviz_pt.model.trajectory import Trajectory

if TYPE_CHECKING:
    from sumo3dviz_pt.sumo import Whereabouts

_SLACK = 1e-6
"""Tolerance of times, because those of frames are sums of fractions [s]."""

_MOST_SPANS = 4


def check_rider(
    camera: CameraSettings,
    *,
    name: str,
    times: Floats,
    trajectories: Sequence[Trajectory],
    logs: Sequence[Path],
) -> None:
    """Refuse a camera whose road user is not there all the time; only then the logs are searched.

    Args:
        camera: Of any kind.
        name: Of the camera.
        times: Of all frames, (n,) [s].
        trajectories: What was read around these times.
        logs: Where they come from, whole.

    Raises:
        ConfigError: Says when the log has the road user, or which one may be meant.
    """
    if not isinstance(camera, LagrangianCamera):
        return
    missing = _missing(camera.vehicle, times, trajectories)
    if missing is not None:
        from sumo3dviz_pt.sumo import whereabouts

        raise _absent(camera.vehicle, whereabouts(logs, camera.vehicle), missing, name=name)


def check_companions(
    job: Job, films: Iterable[tuple[ShotSettings, Floats]], logs: Sequence[Path]
) -> None:
    """Refuse shots whose road user is not there all the time, before anything is built.

    Args:
        job: The scene file.
        films: Shots and the times of their frames, (n,) [s]; what comes after the log's end is
            no part of a film.
        logs: Of the simulation, whole.

    Raises:
        ConfigError: As `check_rider` does.
    """
    from sumo3dviz_pt.sumo import whereabouts

    for shot, times in films:
        camera = job.cameras[shot.camera]
        if not isinstance(camera, LagrangianCamera):
            continue
        found = whereabouts(logs, camera.vehicle)
        absent = _outside(times, found.spans) & (times <= found.end + _SLACK)
        if absent.any() or not found.spans:
            missing = float(times[np.argmax(absent)])
            raise _absent(camera.vehicle, found, missing, name=shot.camera)


def check_known(name: str, logs: Sequence[Path]) -> None:
    """Refuse a road user that no log ever has.

    Args:
        name: SUMO's id, or the key such as `person:walker_1`.
        logs: Of the simulation, whole.

    Raises:
        ConfigError: Says which one may be meant.
    """
    from sumo3dviz_pt.sumo import whereabouts

    found = whereabouts(logs, name)
    if not found.spans:
        hint = _hint(name, found.ids)
        raise ConfigError(f"no vehicle or person is called {cut(name)!r}{hint}")


def _absent(vehicle: str, found: Whereabouts, missing: float, *, name: str) -> ConfigError:
    """Return an error that says why a camera cannot ride with a road user at a time [s]."""
    shown = repr(cut(vehicle))
    key = f"cameras.{name}.vehicle"
    if not found.spans:
        hint = _hint(vehicle, found.ids)
        return ConfigError(f"no vehicle or person is called {shown}{hint}", key=key)
    lives = ", ".join(f"{begin:.12g} to {end:.12g} s" for begin, end in found.spans[:_MOST_SPANS])
    lives += " and later" if len(found.spans) > _MOST_SPANS else ""
    inside = any(begin <= missing <= end for begin, end in found.spans)
    why = "is not drawn at {:g} s (it rides in a vehicle then, or jumps)" if inside else ""
    why = why or "is not there at {:g} s"
    return ConfigError(f"{shown} {why.format(missing)}; the log has it from {lives}", key=key)


def _missing(name: str, times: Floats, trajectories: Sequence[Trajectory]) -> float | None:
    """Return the first time at which a road user is not there [s]; None if it always is."""
    known = {trajectory.key: trajectory for trajectory in trajectories}
    keys = (f"vehicle:{name}", f"person:{name}", f"container:{name}", name)
    rider = next((known[key] for key in keys if key in known), None)
    pieces = () if rider is None else rider.pieces
    absent = _outside(times, [(piece.begin, piece.end) for piece in pieces])
    return float(times[np.argmax(absent)]) if absent.any() else None


def _outside(times: Floats, spans: Iterable[tuple[float, float]]) -> Bools:
    """Return which times lie in none of some spans, (n,)."""
    there = np.zeros(len(times), dtype=np.bool_)
    for begin, end in spans:
        there |= (times >= begin - _SLACK) & (times <= end + _SLACK)
    return ~there


def _hint(name: str, ids: frozenset[str]) -> str:
    """End of a sentence that names near ids and some that exist."""
    if not ids:
        return "; the log has nobody"
    near = did_you_mean(name, ids)
    some = ", ".join(repr(cut(each)) for each in sorted(ids)[:3])
    return (near if near.startswith("; did") else "") + f"; for example {some} exist"
