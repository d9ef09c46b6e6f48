"""Writes sound tracks: where everyone near a film's camera is at each time, and the camera itself.

They are what tools of auralisation ask for: moving sources, in the picture or not, and a listener;
the sound that is made here, in `heard.py`, is made of the same.
Beside `drive.mp4` the folder `drive.sound` holds `listener.csv`, `sources.csv` (one row for each
source), one table for each source, and `sound.json`, which says what the columns mean.

Positions are the network's, in metres: x east, y north, z up. A source's place is the middle of
its body on the ground; methods of road noise put sources at heights of their own above that.
"""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from sumo3dviz_pt.files.atomic import write_atomically
from sumo3dviz_pt.job.surroundings import SoundSettings
from sumo3dviz_pt.model.geometry import Floats, Ints
from sumo3dviz_pt.model.network import Network
from sumo3dviz_pt.model.traffic import UNKNOWN_TYPES, Polygon, VehicleType
from sumo3dviz_pt.model.trajectory import Trajectory
from sumo3dviz_pt.pipeline.films.frames import film_name
from sumo3dviz_pt.pipeline.films.orders import Pace
from sumo3dviz_pt.pipeline.reading import motion_of, read_files

if TYPE_CHECKING:
    from sumo3dviz_pt.pipeline.production import Production


_SLACK = 30.0
"""Distance between where somebody is and the line between two samples, at most [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class Nearby:
    """Who comes near a camera.

    Attributes:
        trajectories: The smoothed motion of each.
        types: Their vTypes.
        network: Where they are.
        polygons: Of the scenario, buildings among them.
    """

    trajectories: tuple[Trajectory, ...]
    types: tuple[VehicleType, ...]
    network: Network
    polygons: tuple[Polygon, ...] = ()


def nearby(production: Production, eyes: Floats, *, radius: float) -> Nearby:
    """Return everyone who may come as near to a shot's camera as a radius.

    Args:
        production: The shot.
        eyes: Where the camera is in each frame, (n, 3) [m].
        radius: On the plan [m].
    """
    times = production.times
    _, scenario = read_files(production.job, begin=float(times[0]), end=float(times[-1]))
    near = np.zeros(len(scenario.traffic.traces), dtype=np.bool_)
    for k, trace in enumerate(scenario.traffic.traces):
        there = [np.interp(times, trace.times, trace.positions[:, axis]) for axis in range(2)]
        away = np.hypot(there[0] - eyes[:, 0], there[1] - eyes[:, 1])
        near[k] = away.min() <= radius + _SLACK
    trajectories = motion_of(production.job, scenario).smooth(near)
    types = tuple(
        scenario.vehicle_types.get(each.type_id, UNKNOWN_TYPES[each.kind]) for each in trajectories
    )
    return Nearby(trajectories, types, scenario.network, scenario.polygons)


_NUDGE = 0.05  # over which speeds are compared [s]

_MEANINGS = {
    "film_time": "seconds of film from the shot's first frame",
    "time": "SUMO's time [s]",
    "x, y, z": "network coordinates [m]: east, north, up; of a source the middle of its body on"
    " the ground, of the listener the camera's eye",
    "speed": "along the path [m/s]; empty where the log has none",
    "acceleration": "change of speed along the path [m/s2]; braking is negative",
    "yaw": "where the source heads, counter-clockwise from east [rad]",
    "class": "SUMO's vClass",
    "forward_*, up_*": "unit vectors: where the listener looks, and what is up there",
}


@dataclass(frozen=True, slots=True, eq=False)
class SourceTrack:
    """How one source moves.

    Attributes:
        id: SUMO's.
        kind: `vehicle`, `person` or `container`.
        type: Its vType.
        samples: Numbers of the samples at which it exists, (n,).
        places: Middle of its body on the ground, (n, 3) [m].
        speeds: (n,) [m/s]; NaN where the log has none.
        accelerations: Along the path, (n,) [m/s2]; NaN where they are not known.
        yaws: (n,) [rad].
        nearest: Distance from the camera at its least [m].
    """

    id: str
    kind: str
    type: VehicleType
    samples: Ints
    places: Floats
    speeds: Floats
    accelerations: Floats
    yaws: Floats
    nearest: float


def sound_folder(path: Path) -> Path:
    """Return where a film's sound tracks go."""
    return film_name(path).with_suffix(".sound")


def recording_file(path: Path) -> Path:
    """Return where the sound of a film goes."""
    return film_name(path).with_suffix(".wav")


def write_tracks(path: Path, production: Production, pace: Pace) -> None:
    """Write the sound tracks of a film; nothing where none are asked for.

    Args:
        path: The film.
        production: What it shows.
        pace: How its time runs.
    """
    wanted = production.job.output.sound
    if wanted is None:
        return
    folder = sound_folder(path)
    folder.mkdir(exist_ok=True)
    film_times, times = sample_times(production.times, pace, wanted)
    views = [production.shot.frame_at(at).view for at in times.tolist()]
    eyes = np.array([view.position for view in views])
    tracks = _tracks(production, times, eyes, wanted.radius)
    clock = np.column_stack([film_times, times])
    directions = [[*view.forward, *view.world_from_camera.matrix[:3, 2]] for view in views]
    names = [f"{what}_{axis}" for what in ("forward", "up") for axis in "xyz"]
    columns = ["film_time", "time", "x", "y", "z"]
    location = production.shot.fleet.location
    rows = np.column_stack([clock, location.outside(eyes), directions]).tolist()
    _write_table(folder / "listener.csv", [*columns, *names], rows)
    tracks = [replace(track, places=location.outside(track.places)) for track in tracks]
    for stale in folder.glob("source_*.csv"):
        stale.unlink()
    files = [f"source_{number:04d}.csv" for number in range(1, len(tracks) + 1)]
    for file, track in zip(files, tracks, strict=True):
        _write_source(folder / file, track, clock)
    _write_index(folder / "sources.csv", files, tracks, clock)
    _write_meaning(folder / "sound.json", wanted, pace, count=len(times))


def sample_times(times: Floats, pace: Pace, wanted: SoundSettings) -> tuple[Floats, Floats]:
    """Return the film's and SUMO's times of samples, (n,) [s] each.

    Args:
        times: SUMO's, of all frames.
        pace: How the film's time runs.
        wanted: How many samples a second.
    """
    rate = float(pace.fps) if wanted.rate is None else wanted.rate
    length = (len(times) - 1) / float(pace.fps)
    film_times = np.arange(int(np.floor(length * rate + 1e-6)) + 1) / rate
    return film_times, times[0] + film_times * float(pace.speed)


def _tracks(
    production: Production, times: Floats, eyes: Floats, radius: float
) -> list[SourceTrack]:
    """Return the tracks of everyone who comes near enough, the nearest first."""
    shot = production.shot
    # Those that the film shows stand on the road that is drawn, not at the log's height.
    drawn = {each.key: each for each in shot.fleet.trajectories}
    frames = np.array([shot.frame_at(at).view.position for at in production.times.tolist()])
    around = nearby(production, frames, radius=radius)
    tracks = [
        track_of(drawn.get(each.key, each), kind, times, eyes)
        for each, kind in zip(around.trajectories, around.types, strict=True)
    ]
    near = [track for track in tracks if track.nearest <= radius]
    return sorted(near, key=lambda track: (track.nearest, track.id))


def track_of(trajectory: Trajectory, kind: VehicleType, times: Floats, eyes: Floats) -> SourceTrack:
    """Return how one source moves.

    Args:
        trajectory: Its smoothed motion.
        kind: Its vType.
        times: SUMO's, of the samples, (n,) [s].
        eyes: Where the listener is, (n, 3) [m].
    """
    motion = trajectory.sample(times)
    alive = motion.alive
    yaws, pitches = motion.yaws[alive], motion.pitches[alive]
    level = np.cos(pitches)
    ahead = np.column_stack([np.cos(yaws) * level, np.sin(yaws) * level, np.sin(pitches)])
    places = motion.positions[alive] - 0.5 * kind.length * ahead
    away = np.linalg.norm(places - eyes[alive], axis=1)
    return SourceTrack(
        trajectory.id,
        trajectory.kind,
        kind,
        np.flatnonzero(alive),
        places,
        motion.speeds[alive],
        accelerations_of(trajectory, times[alive]),
        yaws,
        float(away.min()) if len(away) else np.inf,
    )


def accelerations_of(trajectory: Trajectory, times: Floats) -> Floats:
    """Return the change of speed along the path, (n,) [m/s2]: centred, one-sided at ends."""
    before, now, after = (
        trajectory.sample(times + nudge).speeds for nudge in (-_NUDGE, 0.0, _NUDGE)
    )
    first, last = ~np.isnan(before), ~np.isnan(after)
    steps = _NUDGE * (first.astype(float) + last)
    change = np.where(last, after, now) - np.where(first, before, now)
    unknown = np.full(len(times), np.nan)
    return np.asarray(np.divide(change, steps, out=unknown, where=steps > 0))


# Files -------------------------------------------------------------------------------------


def _write_source(path: Path, track: SourceTrack, clock: Floats) -> None:
    """Write the table of one source."""
    rows: list[list[object]] = [
        [*values, track.type.vclass]
        for values in np.column_stack(
            [clock[track.samples], track.places, track.speeds, track.accelerations, track.yaws]
        ).tolist()
    ]
    columns = ["film_time", "time", "x", "y", "z", "speed", "acceleration", "yaw", "class"]
    _write_table(path, columns, rows)


def _write_index(
    path: Path, files: Sequence[str], tracks: Sequence[SourceTrack], clock: Floats
) -> None:
    """Write the table of all sources."""
    columns = ["file", "id", "kind", "type", "class", "length", "width", "height"]
    rows = [
        [
            *(file, track.id, track.kind, track.type.id, track.type.vclass),
            *(track.type.length, track.type.width, track.type.height),
            *(clock[track.samples[0], 0], clock[track.samples[-1], 0], track.nearest),
        ]
        for file, track in zip(files, tracks, strict=True)
    ]
    _write_table(path, [*columns, "film_time_first", "film_time_last", "nearest"], rows)


def _write_meaning(path: Path, wanted: SoundSettings, pace: Pace, *, count: int) -> None:
    """Write what the tables hold."""
    content: Mapping[str, object] = {
        "samples": count,
        "samples_per_film_second": float(pace.fps) if wanted.rate is None else wanted.rate,
        "sumo_seconds_per_film_second": float(pace.speed),
        "radius": wanted.radius,
        "columns": _MEANINGS,
        "note": "film_time 0 is the shot's first frame; overlays may put frames before it, which"
        " the film's account counts as frames_before",
    }
    write_atomically(path, json.dumps(content, indent=1) + "\n")


def _write_table(path: Path, columns: Sequence[str], rows: Sequence[Sequence[object]]) -> None:
    """Write a table; what is not known is empty."""
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(columns)
    table.writerows([_cell(value) for value in row] for row in rows)
    write_atomically(path, text.getvalue())


def _cell(value: object) -> object:
    """Return a cell: numbers to a hundredth of a millimetre, NaN as nothing."""
    if isinstance(value, float):
        return "" if np.isnan(value) else round(value, 5)
    return value
