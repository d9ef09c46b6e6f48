"""Measures one film of a study: rows by frame, and what stands for the whole film."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from sumo3dviz_pt.job.study import ReportSettings
from sumo3dviz_pt.pipeline.certificate.evidence import compared_frames, without_overlays
from sumo3dviz_pt.pipeline.films.frames import frames_folder
from sumo3dviz_pt.pipeline.layers.places import beside, said_file
from sumo3dviz_pt.pipeline.measured.events import event_rows
from sumo3dviz_pt.pipeline.measured.pictures import picture_rows, scene_row
from sumo3dviz_pt.pipeline.measured.shares import share_rows
from sumo3dviz_pt.pipeline.measured.traffic import traffic_of, traffic_rows
from sumo3dviz_pt.pipeline.studies.stimuli import Stimulus

Row = dict[str, str | int | float]

MEASURES: Mapping[str, str] = MappingProxyType(
    {
        "scene_mean": "mean luminance of the scene [cd/m2]",
        "scene_p1": "1 % of the scene is darker [cd/m2]",
        "scene_p99": "1 % of the scene is brighter [cd/m2]",
        "shown_mean": "mean luminance of the picture [cd/m2]",
        "shown_p1": "1 % of the picture is darker [cd/m2]",
        "shown_p99": "1 % of the picture is brighter [cd/m2]",
        "contrast": "RMS contrast of the picture",
        "motion_energy": "change from frame to frame [cd/m2]",
        "clutter": "edge density",
        "speed": "mean speed of the ridden vehicle [km/h]",
        "least_gap": "least gap of the ridden vehicle [m]",
        "least_headway": "least headway of the ridden vehicle [s]",
        "least_time_to_collision": "least time to collision of the ridden vehicle [s]",
        "brake_onsets": "onsets of brake lamps in view or near",
        "signal_changes": "changes of traffic lights",
    }
)
"""What is told of a whole film, in words; shares of classes stand beside."""

SHARE = "share "
"""Begins the names of measures that are shares of classes of things in the picture."""

_KMH = 3.6


@dataclass(frozen=True, slots=True)
class FilmMeasures:
    """What a film shows, in numbers.

    Attributes:
        name: The film's.
        whole: By names as in `MEASURES`, and shares of classes; NaN where there is none.
        frames: A row for each frame: light, contrast, motion energy, clutter.
        traffic: A row for the ridden and the nearest road users of each frame.
        events: A row for each change of a light and each onset of brake lamps.
        shares: A row for each class and named thing of each frame.
    """

    name: str
    whole: Mapping[str, float]
    frames: tuple[Row, ...]
    traffic: tuple[Row, ...]
    events: tuple[Row, ...]
    shares: tuple[Row, ...]


def measure_film(
    film: Path,
    stimulus: Stimulus,
    account: Mapping[str, Any],
    *,
    settings: ReportSettings,
    compared: int,
) -> FilmMeasures:
    """Measure a film.

    Args:
        film: Its file.
        stimulus: What it shows.
        account: The film's.
        settings: What is asked for.
        compared: In how many frames the scene's light is measured.

    Raises:
        InputError: If the film or a frame is damaged.
    """
    cameras = [frame["camera"] for frame in account["frames"]]
    frames = _frame_rows(film, account, white=settings.white, compared=compared)
    eyes = np.array([camera["position"][:2] for camera in cameras])
    traffic = tuple(traffic_rows(traffic_of(stimulus, eyes), cameras))
    events, shares = tuple(event_rows(account)), tuple(_share_rows(film, account, settings))
    whole = {
        **{name: _mean(row[name] for row in frames) for name in list(MEASURES)[:9]},
        **_ridden([row for row in traffic if row["role"] == "ridden"]),
        "brake_onsets": float(sum(row["kind"] == "brake" for row in events)),
        "signal_changes": float(sum(row["kind"] == "signal" for row in events)),
        **_class_shares(shares),
    }
    return FilmMeasures(stimulus.name, whole, frames, traffic, events, shares)


def _frame_rows(
    film: Path, account: Mapping[str, Any], *, white: float, compared: int
) -> tuple[Row, ...]:
    """Return what pictures measure, frame by frame."""
    width, height = account["size"]
    count = len(account["frames"])
    lit = compared_frames(count, compared)
    rows: list[Row] = []
    seen = without_overlays(film)
    for number, row in enumerate(picture_rows(seen, size=(width, height), white=white)):
        scene = scene_row(film, number) if number in lit else _NO_SCENE
        time = round(float(account["frames"][min(number, count - 1)]["time"]), 6)
        rows.append({"frame": number, "time": time, **scene, **row})
    return tuple(rows)


_NO_SCENE = dict.fromkeys(("scene_mean", "scene_p1", "scene_p99"), float("nan"))


def _share_rows(film: Path, account: Mapping[str, Any], settings: ReportSettings) -> Iterable[Row]:
    """Yield which share of the picture shows what; nothing for frames without layers."""
    folder = beside(frames_folder(film))
    for number in range(len(account["frames"])):
        if said_file(folder, number).is_file():
            yield from share_rows(film, number, settings.things)


def _ridden(rows: Sequence[Row]) -> dict[str, float]:
    """Return what stands for the ridden vehicle in a whole film."""
    least = {
        f"least_{name}": min((float(row[name]) for row in rows if row[name] != ""), default=np.nan)
        for name in ("gap", "headway", "time_to_collision")
    }
    return {"speed": _KMH * _mean(row["speed"] for row in rows), **least}


def _class_shares(rows: Sequence[Row]) -> dict[str, float]:
    """Return the mean share of each class over a film."""
    count = len({row["frame"] for row in rows})
    found: dict[str, float] = {}
    for row in rows:
        if row["kind"] == "class":
            name = f"{SHARE}{row['name']}"
            found[name] = found.get(name, 0.0) + float(row["share"]) / count
    return dict(sorted(found.items()))


def _mean(values: Iterable[str | int | float]) -> float:
    """Return the mean of the values that there are; NaN if there are none."""
    known = [float(value) for value in values if value == value]
    return float(np.mean(known)) if known else float("nan")
