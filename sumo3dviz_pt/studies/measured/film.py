"""Measures one film of a study: rows by frame, and what stands for the whole film."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sumo3dviz_pt.job.sessions import ReportSettings
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.pipeline.accounts import brake_onsets
from sumo3dviz_pt.studies.certificate.evidence import compared_frames, without_overlays
from sumo3dviz_pt.studies.measured.observer import observer_rows
from sumo3dviz_pt.studies.measured.offered import watched_by
from sumo3dviz_pt.studies.measured.pictures import Shown, lens_of, picture_rows, scene_row, shown_in
from sumo3dviz_pt.studies.measured.safety import FIELD, FlashMeter, SignalColours, size_row
from sumo3dviz_pt.studies.measured.traffic import Row, Simulated, gap_rows, simulated, traffic_rows
from sumo3dviz_pt.studies.stimuli import Stimulus

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
        "speed": "mean speed of the ridden vehicle, as drawn [km/h]",
        "logged_speed": "mean speed of the ridden vehicle, as the log says [km/h]",
        "least_gap": "least gap of the ridden vehicle [m]",
        "least_headway": "least headway of the ridden vehicle [s]",
        "least_time_to_collision": "least time to collision of the ridden vehicle [s]",
        "brake_onsets": "onsets of brake lamps in view or near",
        "signal_changes": "changes of traffic lights",
    }
)
"""What is told of a whole film, in words; the first nine are means of columns of the table
`frames`. Shares of classes stand beside."""

SHARE = "share "
"""Begins the names of measures that are shares of classes of things in the picture."""

_KMH = 3.6


@dataclass(frozen=True, slots=True)
class FilmMeasures:
    """What a film shows, in numbers.

    Attributes:
        name: The film's.
        whole: By names as in `MEASURES`, and shares of classes; NaN where there is none.
        safety: What ethics boards ask, by names as in `safety_words`; NaN where there is none.
        tables: Rows by the names of the report's tables, as in `TABLES`.
    """

    name: str
    whole: Mapping[str, float]
    safety: Mapping[str, float]
    tables: Mapping[str, tuple[Row, ...]]


TABLES: Mapping[str, str] = MappingProxyType(
    {
        "frames": "light, contrast, motion energy and clutter by frame",
        "traffic": "the ridden and the nearest road users by frame",
        "observer": "road users as observers see them, by frame",
        "arrivals": "who comes to an observer's way across, when, and the gaps between",
        "gaps": "gaps that the scene file asks for, and what was kept",
        "events": "changes of traffic lights and onsets of brake lamps",
        "shares": "visible shares by frame",
    }
)
"""Tables of the report with a column for the film's name, and what they hold."""


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
    eyes = np.array([camera["position"][:2] for camera in cameras])
    also = [each.position for each in settings.observers.values() if each.position is not None]
    near = np.concatenate([eyes, np.reshape(also, (-1, 2))])
    simulation = simulated(stimulus, near, count=len(eyes))
    traffic = simulation.traffic
    shown = shown_in(film, account, traffic, named=settings.things, within=settings.within)
    meter, colours = _meter(account), SignalColours()
    frames = _frame_rows(film, account, shown, (meter, colours), settings.white, compared)
    tables = {
        "frames": frames,
        "traffic": tuple(traffic_rows(traffic, cameras)),
        **_observer_tables(simulation, account, shown, settings, near),
        "gaps": tuple(gap_rows(stimulus, traffic)),
        "events": tuple(event_rows(account)),
        "shares": shown.shares,
    }
    safety = {
        **meter.result(),
        **colours.differences(),
        "shown_peak": max((float(row["shown_peak"]) for row in frames), default=np.nan),
        **size_row([film], settings.connections),
    }
    return FilmMeasures(stimulus.name, _whole(tables), safety, tables)


def _meter(account: Mapping[str, Any]) -> FlashMeter:
    """Return what counts a film's flashes, which is seen as wide as its lens opens."""
    width, height = account["size"]
    lens = lens_of(account["frames"][0]["camera"])
    across = 2.0 * float(np.tan(FIELD / 2.0)) / lens.pixel_width(width)
    return FlashMeter((width, height), float(account["fps"]), across)


def _observer_tables(
    simulation: Simulated,
    account: Mapping[str, Any],
    shown: Shown,
    settings: ReportSettings,
    near: Floats,
) -> dict[str, tuple[Row, ...]]:
    """Return what observers see by frame, and who arrives at them."""
    cameras, speed = [frame["camera"] for frame in account["frames"]], float(account["speed"])
    around, watched = watched_by(simulation, cameras, settings, near=near, speed=speed)
    rows: list[Row] = []
    for each in watched:
        seen = shown.seen if each is watched[0] else {}
        both = (simulation.traffic, around)
        rows += observer_rows(each.observer, both, each.came, within=settings.within, seen=seen)
    came = tuple(row for each in watched for row in each.rows)
    return {"observer": tuple(rows), "arrivals": came}


def _whole(tables: Mapping[str, Sequence[Row]]) -> dict[str, float]:
    """Return what stands for a whole film."""
    events = tables["events"]
    return {
        **{name: _mean(row[name] for row in tables["frames"]) for name in list(MEASURES)[:9]},
        **_ridden([row for row in tables["traffic"] if row["role"] == "ridden"]),
        "brake_onsets": float(sum(row["kind"] == "brake" for row in events)),
        "signal_changes": float(sum(row["kind"] == "signal" for row in events)),
        **_class_shares(tables["shares"]),
    }


def _frame_rows(
    film: Path,
    account: Mapping[str, Any],
    shown: Shown,
    watching: tuple[FlashMeter, SignalColours],
    white: float,
    compared: int,
) -> tuple[Row, ...]:
    """Return what pictures measure, frame by frame; others watch them, too."""
    count = len(account["frames"])
    lit = compared_frames(count, compared)
    rows: list[Row] = []
    pictures = _watched(film, account, shown, watching)
    for number, row in enumerate(picture_rows(pictures, white=white)):
        scene = scene_row(film, number) if number in lit else _NO_SCENE
        time = round(float(account["frames"][min(number, count - 1)]["time"]), 6)
        rows.append({"frame": number, "time": time, **scene, **row})
    return tuple(rows)


def _watched(
    film: Path,
    account: Mapping[str, Any],
    shown: Shown,
    watching: tuple[FlashMeter, SignalColours],
) -> Iterator[NDArray[np.uint8]]:
    """Yield a film's pictures without overlays; flashes and colours of lights are noted."""
    from sumo3dviz_pt.video.ffmpeg import film_pictures

    width, height = account["size"]
    meter, colours = watching
    for number, picture in enumerate(film_pictures(without_overlays(film), size=(width, height))):
        meter.add(picture)
        colours.add(picture, shown.lenses.get(number, {}))
        yield picture


def event_rows(account: Mapping[str, Any]) -> Iterator[Row]:
    """Yield a row for each change of a traffic light and each onset of brake lamps, by frames.

    What the first frame shows has begun before and is none.

    Args:
        account: The film's.
    """
    times = [float(frame["time"]) for frame in account["frames"]]
    events = [
        (int(change["frame"]), "signal", str(change["tls"]), str(change["state"]))
        for change in account["signal_changes"]
        if change["frame"] > 0
    ]
    for key, user in account["road_users"].items():
        events += [(number, "brake", key, "on") for number in brake_onsets(user["lamps"])]
    for number, kind, who, state in sorted(events):
        yield {"frame": number, "time": times[number], "kind": kind, "id": who, "state": state}


_NO_SCENE = dict.fromkeys(("scene_mean", "scene_p1", "scene_p99"), float("nan"))


def _ridden(rows: Sequence[Row]) -> dict[str, float]:
    """Return what stands for the ridden vehicle in a whole film."""
    least = {
        f"least_{name}": min((float(row[name]) for row in rows if row[name] != ""), default=np.nan)
        for name in ("gap", "headway", "time_to_collision")
    }
    speeds = {name: _KMH * _mean(row[name] for row in rows) for name in ("speed", "logged_speed")}
    return {**speeds, **least}


def _class_shares(rows: Sequence[Row]) -> dict[str, float]:
    """Return the mean share of each class over a film."""
    count = len({row["frame"] for row in rows})
    shares: dict[str, float] = {}
    for row in rows:
        if row["kind"] == "class":
            name = f"{SHARE}{row['name']}"
            shares[name] = shares.get(name, 0.0) + float(row["share"]) / count
    return dict(sorted(shares.items()))


def _mean(values: Iterable[str | int | float]) -> float:
    """Return the mean of the values that there are; NaN if there are none."""
    known = [float(value) for value in values if value == value and value != ""]
    return float(np.mean(known)) if known else float("nan")
