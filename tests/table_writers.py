"""Writes where road users are in the forms of many tools, for tests of what reads them."""

from __future__ import annotations

import csv
import gzip
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest


class Row(NamedTuple):
    """Where somebody is."""

    time: float
    id: str
    x: float
    y: float
    yaw: float
    speed: float
    length: float
    width: float
    vclass: str


def _moved(row: Row, share: float) -> tuple[float, float]:
    """Return a point behind the front by a share of the length [m]."""
    back = share * row.length
    return row.x - back * np.cos(row.yaw), row.y - back * np.sin(row.yaw)


def _write(file: Path, names: Sequence[str], rows: Iterable[Sequence[object]], mark: str) -> Path:
    with file.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream, delimiter=mark)
        writer.writerow(names)
        writer.writerows(rows)
    return file


def own_metres(folder: Path, rows: list[Row]) -> Path:
    """The front, degrees from north, as a simulator's own table."""
    names = ("t [s]", "vehicle_id", "pos_x", "pos_y", "heading", "type", "length", "width")
    cells = (
        (r.time, r.id, r.x, r.y, 90 - np.degrees(r.yaw), r.vclass, r.length, r.width) for r in rows
    )
    return _write(folder / "own.csv", names, cells, ",")


def own_centres(folder: Path, rows: list[Row]) -> Path:
    """The middle, radians from east, milliseconds, km/h, by vehicle and not by time."""
    names = ("ObjectID", "timestamp_ms", "x_m", "y_m", "yaw", "speed_kmh", "class", "len", "width")
    cells = (
        (
            r.id,
            round(1000 * r.time),
            *_moved(r, 0.5),
            r.yaw,
            3.6 * r.speed,
            r.vclass,
            r.length,
            r.width,
        )
        for r in sorted(rows, key=lambda r: (r.id, r.time))
    )
    return _write(folder / "centres.csv", names, cells, ";")


def drone(folder: Path, rows: list[Row]) -> Path:
    """As inD has it: frames, files beside it that tell classes and rate, no size of people."""
    names = ("recordingId", "trackId", "frame", "trackLifetime", "xCenter", "yCenter", "heading")
    ids = {name: n for n, name in enumerate(dict.fromkeys(r.id for r in rows))}
    cells = [
        (
            0,
            ids[r.id],
            round(10 * r.time),
            0,
            *_moved(r, 0.5),
            np.degrees(r.yaw) % 360,
            r.width,
            r.length,
        )
        for r in rows
    ]
    kinds = {ids[r.id]: r.vclass for r in rows}
    _write(folder / "07_tracksMeta.csv", ("trackId", "class"), kinds.items(), ",")
    _write(folder / "07_recordingMeta.csv", ("recordingId", "frameRate"), [(7, 10)], ",")
    return _write(folder / "07_tracks.csv", (*names, "width", "length"), cells, ",")


def feet(folder: Path, rows: list[Row]) -> Path:
    """As NGSIM has it: feet, tenths of a second, the front; no heading."""
    names = ("Vehicle_ID", "Frame_ID", "Global_Time", "Local_X", "Local_Y")
    more = ("v_Length", "v_Width", "v_Class", "v_Vel")
    classes = {"motorcycle": 1, "passenger": 2, "truck": 3}
    ids = {name: n for n, name in enumerate(dict.fromkeys(r.id for r in rows))}
    cells = (
        (
            *(ids[r.id], round(10 * r.time), round(1e12 + 1000 * r.time)),
            *(value / 0.3048 for value in (r.x, r.y, r.length, r.width)),
            *(classes[r.vclass], r.speed / 0.3048),
        )
        for r in rows
        if r.vclass in classes
    )
    return _write(folder / "ngsim.csv", (*names, *more), cells, ",")


def nameless(folder: Path, rows: list[Row]) -> Path:
    """The first files of NGSIM: 18 columns with blanks between, no header."""
    lines = feet(folder, rows).read_text(encoding="utf-8").splitlines()[1:]
    file = folder / "trajectories.txt"
    with file.open("w", encoding="utf-8") as text:
        for number, frame, time, x, y, length, width, kind, speed in map(_cells, lines):
            local = f"{float(x):.3f}  {float(y):.3f}  6042814.5  2133117.6"
            size = f"{float(length):.2f} {float(width):.1f}"
            head = f"{number:>6} {frame:>6}  99 {time}  {local}"
            text.write(f"{head}  {size} {kind} {float(speed):.2f} 0.00 2 0 0 0.00 0.00 \n")
    return file


def _cells(line: str) -> list[str]:
    return line.split(",")


def vissim(folder: Path, rows: list[Row]) -> Path:
    """As Vissim writes it: remarks, coordinates in one cell, no length."""
    numbers = {"passenger": 100, "truck": 200, "bus": 300, "tram": 400, "bicycle": 610}
    lines = ["$VISION", "* File: test", "$VEHICLE:SIMSEC;NO;POS;COORDFRONT;COORDREAR;VEHTYPE"]
    for r in rows:
        if r.vclass in numbers:
            (bx, by), front = _moved(r, 1.0), f"{r.x:.3f} {r.y:.3f} 0.000"
            lines.append(
                f"{r.time:.2f};{r.id};0.0;{front};{bx:.3f} {by:.3f} 0.000;{numbers[r.vclass]}"
            )
    file = folder / "run.fzp.gz"
    file.write_bytes(gzip.compress("\n".join([*lines, ""]).encode()))
    return file


def vissim_german(folder: Path, rows: list[Row]) -> Path:
    """The same in German, in the encoding of old Windows."""
    text = gzip.decompress(vissim(folder, rows).read_bytes()).decode()
    words = {"VEHICLE": "FAHRZEUG", "SIMSEC": "SIMSEK", ";NO;": ";NR;", "VEHTYPE": "FZTYP"}
    words |= {"COORDFRONT": "KOORDVORNE", "COORDREAR": "KOORDHINTEN", "test": "Süd"}
    for english, german in words.items():
        text = text.replace(english, german)
    file = folder / "lauf.fzp"
    file.write_bytes(text.encode("cp1252"))
    return file


def parquet(folder: Path, rows: list[Row]) -> Path:
    """Columns of numbers and of time stamps."""
    import datetime as dt

    arrow = pytest.importorskip("pyarrow")
    parquet = pytest.importorskip("pyarrow.parquet")
    start = dt.datetime(2026, 6, 1)
    table = {
        "time": [start + dt.timedelta(seconds=r.time) for r in rows],
        "agent_id": [r.id for r in rows],
        "x": [_moved(r, 0.5)[0] for r in rows],
        "y": [_moved(r, 0.5)[1] for r in rows],
        "psi_rad": [r.yaw for r in rows],
        "length": [r.length for r in rows],
        "width": [r.width for r in rows],
        "agent_type": [r.vclass for r in rows],
    }
    parquet.write_table(arrow.table(table), folder / "tracks.parquet")
    return folder / "tracks.parquet"


def common_road(folder: Path, rows: list[Row]) -> Path:
    """A scenario of CommonRoad."""
    parts = ['<commonRoad timeStepSize="0.1">']
    for name, own in _by_user(rows).items():
        kind = own[0].vclass.replace("passenger", "car")
        parts.append(
            f'<dynamicObstacle id="{name}"><type>{kind}</type><shape><rectangle>'
            f"<length>{own[0].length}</length><width>{own[0].width}</width></rectangle></shape>"
        )
        states = []
        for r in own:
            x, y = _moved(r, 0.5)
            states.append(
                f"<position><point><x>{x}</x><y>{y}</y></point></position><orientation><exact>"
                f"{r.yaw}</exact></orientation><time><exact>{round(10 * r.time)}</exact></time>"
                f"<velocity><exact>{r.speed}</exact></velocity>"
            )
        parts.append(f"<initialState>{states[0]}</initialState><trajectory>")
        parts += [f"<state>{state}</state>" for state in states[1:]]
        parts.append("</trajectory></dynamicObstacle>")
    file = folder / "scenario.xml"
    file.write_text("\n".join([*parts, "</commonRoad>"]), encoding="utf-8")
    return file


def open_scenario(folder: Path, rows: list[Row]) -> Path:
    """Trajectories by positions in OpenSCENARIO, of the rear axle."""
    things, acts = [], []
    for name, own in _by_user(rows).items():
        kind = own[0].vclass.replace("passenger", "car")
        ahead = 0.3 * own[0].length
        things.append(
            f'<ScenarioObject name="{name}"><Vehicle vehicleCategory="{kind}"><BoundingBox>'
            f'<Center x="{ahead}" y="0" z="0.8"/><Dimensions width="{own[0].width}"'
            f' length="{own[0].length}" height="1.5"/></BoundingBox></Vehicle></ScenarioObject>'
        )
        acts.append(f'<ManeuverGroup><Actors><EntityRef entityRef="{name}"/></Actors>')
        for r in own:
            x, y = _moved(r, 0.8)
            acts.append(
                f'<Vertex time="{r.time}"><Position><WorldPosition x="{x}" y="{y}" h="{r.yaw}"/>'
                "</Position></Vertex>"
            )
        acts.append("</ManeuverGroup>")
    file = folder / "drive.xosc"
    text = ["<OpenSCENARIO><Entities>", *things, "</Entities>", *acts, "</OpenSCENARIO>"]
    file.write_text("\n".join(text), encoding="utf-8")
    return file


def _by_user(rows: list[Row]) -> dict[str, list[Row]]:
    """Return the rows of each road user."""
    users: dict[str, list[Row]] = {}
    for row in rows:
        users.setdefault(row.id, []).append(row)
    return users
