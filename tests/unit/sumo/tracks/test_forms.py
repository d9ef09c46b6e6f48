"""The same traffic in the forms of many tools is the same traffic.

What is compared is SUMO's own log of a crossing with cars, buses, bicycles and people: positions,
headings and classes must come back from every form, whatever its units, its point on the body, and
its order of rows.
"""

from __future__ import annotations

import gzip
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from table_writers import (
    Row,
    common_road,
    drone,
    feet,
    nameless,
    open_scenario,
    own_centres,
    own_metres,
    parquet,
    vissim,
    vissim_german,
)

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.model.traffic import TableChoices, TableColumn, Trace
from sumo3dviz_pt.pipeline.production import example
from sumo3dviz_pt.sumo.fcd import read_trajectories
from sumo3dviz_pt.sumo.tracks import converted
from sumo3dviz_pt.sumo.types import read_vehicle_types

_FOLDER = example("crossing").parent
BEGIN, END = 440.0, 470.0


@pytest.fixture(scope="module")
def rows() -> list[Row]:
    """Some seconds of the example, of those who are never aboard something."""
    log = read_trajectories([_FOLDER / "fcd.xml.gz"], begin=BEGIN, end=END)
    types = read_vehicle_types([_FOLDER / "crossing.rou.xml"])
    found = []
    for trace in log.traces:
        if trace.id in {other.id for other in log.traces if other is not trace}:
            continue
        own = types[trace.type_id]
        for at, time in enumerate(trace.times.tolist()):
            x, y, _ = trace.positions[at].tolist()
            yaw, speed = float(trace.yaws[at]), float(trace.speeds[at])
            size = (round(own.length, 1), round(own.width, 1))
            found.append(Row(time, trace.key, x, y, yaw, speed, *size, own.vclass))
    assert len({row.vclass for row in found}) >= 4
    return found


FRONT = TableChoices(point="front")
PLAIN = TableChoices()
FORMS: dict[str, tuple[Callable[[Path, list[Row]], Path], TableChoices]] = {
    "own, front": (own_metres, FRONT),
    "own, middle": (own_centres, PLAIN),
    "inD": (drone, PLAIN),
    "NGSIM": (feet, PLAIN),
    "NGSIM without names": (nameless, PLAIN),
    "Vissim": (vissim, PLAIN),
    "Vissim, German": (vissim_german, PLAIN),
    "Parquet": (parquet, PLAIN),
    "CommonRoad": (common_road, PLAIN),
    "OpenSCENARIO": (open_scenario, PLAIN),
}


@pytest.mark.parametrize("name", FORMS)
def test_every_form_gives_the_same_traffic(name: str, rows: list[Row], tmp_path: Path) -> None:
    """Positions within a centimetre, headings within a fifth of a degree, classes."""
    write, choices = FORMS[name]
    made = converted(write(tmp_path, rows), choices)
    assert made is not None
    log = read_trajectories(made.files[:1])
    types = read_vehicle_types([made.files[1]])
    keys = _keys(name, rows)
    expected: dict[str, list[Row]] = {}
    for row in rows:
        expected.setdefault(keys[row.id], []).append(row)
    off: list[float] = []
    for trace in log.traces:
        own = expected[trace.id]
        assert types[trace.type_id].vclass == own[0].vclass
        assert types[trace.type_id].length == pytest.approx(own[0].length, abs=0.051)
        off += _differences(trace, own)
    assert len(off) > 1000
    if name.startswith("NGSIM"):  # it has no headings, so they follow the way of the front
        assert np.median(off) < np.radians(1.0) and np.quantile(off, 0.95) < np.radians(15.0)
    else:
        assert max(off) < np.radians(0.2)


def _keys(name: str, rows: list[Row]) -> dict[str, str]:
    """Return the ids under which a form has road users, by their own."""
    own = dict.fromkeys(row.id for row in rows)
    numbered = name in ("inD", "NGSIM", "NGSIM without names")
    return {key: str(number) if numbered else key for number, key in enumerate(own)}


def _differences(trace: Trace, own: list[Row]) -> list[float]:
    """Compare the places of one road user; return by how much headings differ [rad]."""
    assert trace.kind == ("person" if own[0].vclass == "pedestrian" else "vehicle")
    offset = own[0].time - float(trace.times[0])  # of tables that count from elsewhere
    at = {round(r.time - offset, 1): r for r in own}
    assert set(np.round(trace.times, 1).tolist()) == set(at)
    off: list[float] = []
    for time, place, yaw in zip(trace.times, trace.positions, trace.yaws, strict=True):
        row = at[round(float(time), 1)]
        assert np.hypot(place[0] - row.x, place[1] - row.y) < 0.01
        off.append(abs((yaw - row.yaw + np.pi) % (2 * np.pi) - np.pi))
    return off


def test_what_is_guessed_is_said(
    rows: list[Row], tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """Columns, units and compass of a table of one's own."""
    made = converted(own_centres(tmp_path, rows), PLAIN)
    assert made is not None and not made.told
    assert "yaw looks like radians from east, counter-clockwise" in caplog.text
    assert "id is ObjectID" in caplog.text
    angle = made.choices.columns["angle"]
    assert angle == TableColumn("yaw", "rad", "east", "left")


def test_what_was_understood_leaves_nothing_to_guess(
    rows: list[Row], tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """A scene file that states it has no note, and the same log."""
    file = own_centres(tmp_path, rows)
    first = converted(file, PLAIN)
    assert first is not None
    caplog.clear()
    second = converted(file, first.choices)
    assert second is not None and second.told and not caplog.records
    assert second.files[0].read_bytes() == first.files[0].read_bytes()


@pytest.mark.parametrize("packed", [False, True])
@pytest.mark.parametrize("end", ["", "\n2,1,1,0\n"])
def test_one_endless_row_is_refused_before_memory_ends(
    end: str, packed: bool, tmp_path: Path
) -> None:
    """Some kilobytes, packed, may be gigabytes of cells."""
    text = ("time,id,x,y\n1,1,0,0\n" + "1," * 1_000_000 + end).encode()
    path = tmp_path / "table.csv"
    path.write_bytes(gzip.compress(text) if packed else text)
    with pytest.raises(InputError, match=r"table.csv:3: the row is longer than 64 kB"):
        converted(path, PLAIN)
