"""What columns are called, what their numbers mean, and what is said of wrong tables."""

from __future__ import annotations

import codecs
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sumo3dviz_pt.errors import ConfigError, InputError
from sumo3dviz_pt.model.traffic import TableChoices, TableColumn, TrafficLog
from sumo3dviz_pt.sumo import find_scenario
from sumo3dviz_pt.sumo.fcd import read_trajectories
from sumo3dviz_pt.sumo.tracks import converted, is_table
from sumo3dviz_pt.sumo.tracks.columns import form_of
from sumo3dviz_pt.sumo.tracks.readings import METRES, SPEEDS, TIMES

PLAIN = TableChoices()


@pytest.mark.parametrize(
    ("name", "role", "unit"),
    [
        ("Time [s]", "time", "s"),
        ("timestamp_ms", "time", "ms"),
        ("simTime", "time", ""),
        ("FrameNumber", "frame", ""),
        ("VehicleID", "id", ""),
        ("track-id", "id", ""),
        ("PosX", "x", ""),
        ("x_m", "x", "m"),
        ("Position X (ft)", "x", "ft"),
        ("heading_deg", "angle", "deg"),
        ("psi_rad", "angle", "rad"),
        ("Speed (km/h)", "speed", "km/h"),
        ("speed_kmh", "speed", "km/h"),
        ("vehicleType", "class", ""),
        ("Fahrzeug-Nr", "id", ""),
        ("Rechtswert", "x", ""),
        ("Hochwert", "y", ""),
        ("Ostwert [m]", "x", "m"),
        ("Richtung [°]", "angle", "deg"),
        ("Fahrzeugart", "class", ""),
    ],
)
def test_names_and_units(name: str, role: str, unit: str) -> None:
    others = {"frame": "frame", "id": "id", "x": "x", "y": "y"}
    others.pop(role, None)
    if role == "time":
        others.pop("frame")
    form = form_of([name, *others.values()], PLAIN)
    assert form is not None
    assert form.columns[role] == TableColumn(name, unit)


def test_tables_without_a_place_or_a_time_are_none() -> None:
    for names in (["time", "id", "x"], ["id", "x", "y"], ["time", "x", "y"], ["a", "b", "c", "d"]):
        assert form_of(names, PLAIN) is None


def test_a_column_that_is_not_there(tmp_path: Path) -> None:
    file = tmp_path / "own.csv"
    file.write_text("t,car_id,x,y\n0,a,0,0\n", encoding="utf-8")
    choices = TableChoices({"id": TableColumn("carid")})
    with pytest.raises(
        ConfigError, match=r"columns.id: .*no column 'carid'; did you mean 'car_id'"
    ):
        converted(file, choices)


@pytest.mark.parametrize(
    ("row", "words"),
    [
        ("1,a,zero,0", r"own.csv:3: 'zero' in the column 'x' is not a number"),
        ("1,a,1_0,0", r"own.csv:3: '1_0' in the column 'x' is not a number"),
        ("noon,a,0,0", r"own.csv:3: 'noon' in the column 't' is not a number"),
        ("1,a,0", r"own.csv:3: the row has 3 cells, and the header 4"),
    ],
)
def test_damaged_rows_are_named(tmp_path: Path, row: str, words: str) -> None:
    file = tmp_path / "own.csv"
    file.write_text(f"t,id,x,y_m\n0,a,0,0\n{row}\n", encoding="utf-8")
    assert is_table(file)
    with pytest.raises(InputError, match=words):
        converted(file, PLAIN)


@pytest.mark.parametrize("text", ["t,id,x,y_m\n", "t,id,x,y_m\n0,a,,\n"])
def test_nobody_is_refused(tmp_path: Path, text: str) -> None:
    file = tmp_path / "own.csv"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=r"no rows|nobody in it"):
        converted(file, PLAIN)


def test_a_clock_a_comma_and_empty_cells(tmp_path: Path) -> None:
    """Times of the day, decimal commas, a row without a place."""
    file = tmp_path / "own.csv"
    rows = [f"07:15:{s:02d};a;{3 * s},5;{s},25" for s in range(8)]
    rows[4] = "07:15:04;a;;"
    file.write_text("\n".join(["clock;agent;x;y", *rows, ""]), encoding="utf-8")
    made = converted(file, PLAIN)
    assert made is not None
    (trace,) = read_trajectories(made.files[:1]).traces
    assert trace.times.tolist() == [26100.0 + s for s in range(8)]  # what is missing is filled in
    assert trace.positions[4, 0] == pytest.approx(trace.positions[3, 0] + 3.0, abs=1e-3)
    middle = trace.positions[1, :2] - 2.5 * np.array(
        [math.cos(trace.yaws[1]), math.sin(trace.yaws[1])]
    )
    np.testing.assert_allclose(middle, [3.5, 1.25], atol=1e-3)


@pytest.mark.parametrize("encoding", ["cp1252", "utf-16", "utf-16-be"])
def test_letters_of_windows(tmp_path: Path, encoding: str) -> None:
    """Names and classes in its old encoding, and in that of its tables today; roles by hand."""
    file = tmp_path / "spuren.csv"
    head = "Zeit [s];Fahrzeug-Nr;Rechtswert;Hochwert;Richtung [°];Länge [m];Fahrzeugart"
    rows = [f"{s},0;7;0,0;{12 * s},0;0,0;4,5;Fußgänger" for s in range(5)]
    mark = codecs.BOM_UTF16_BE if encoding == "utf-16-be" else b""
    file.write_bytes(mark + "\n".join([head, *rows, ""]).encode(encoding))
    by_hand = TableChoices({"angle": TableColumn("Richtung [°]", "deg", "north", "right")})
    for choices in (PLAIN, by_hand):
        made = converted(file, choices)
        assert made is not None
        (trace,) = read_trajectories(made.files[:1]).traces
        assert trace.key == "person:7"
        np.testing.assert_allclose(trace.yaws, np.pi / 2, atol=1e-6)


def test_loggers_with_times_of_their_own_meet(tmp_path: Path) -> None:
    """Two cars that are logged once a second, at other fractions of it."""
    file = tmp_path / "gps.csv"
    rows = [
        f"{s + own},{name},{10 * (s + own)},{side}"
        for s in range(20)
        for name, own, side in (("a", 0.1, 0.0), ("b", 0.6, 4.0))
    ]
    file.write_text("\n".join(["t,car_id,x,y", *rows, ""]), encoding="utf-8")
    made = converted(file, PLAIN)
    assert made is not None
    log = read_trajectories(made.files[:1])
    assert log.step == pytest.approx(1.0)
    for trace in log.traces:
        assert len(trace.times) >= 18
        np.testing.assert_allclose(trace.positions[:, 0] - 2.5, 10 * trace.times, atol=1e-3)


def made_of(file: Path, text: str, choices: TableChoices = PLAIN) -> TrafficLog:
    """Return the log that is made of a table."""
    file.write_text(text, encoding="utf-8")
    made = converted(file, choices)
    assert made is not None
    return read_trajectories(made.files[:1])


def test_the_plainest_table_is_one(tmp_path: Path) -> None:
    """SUMO's own words, but no angle: no log of SUMO has that."""
    rows = "".join(f"{s},a,{10 * s},0\n" for s in range(9))
    log = made_of(tmp_path / "own.csv", f"time,id,x,y\n{rows}")
    np.testing.assert_allclose(log.traces[0].yaws, 0.0, atol=1e-6)


@pytest.mark.parametrize(
    ("head", "words"),
    [
        ("when,whom,x,y", "columns when, whom, x, y: none tells the time or who it is; rename"),
        ("time,id,lat", "columns time, id, lat: none tells x or y; rename"),
    ],
)
def test_what_a_table_lacks_is_said(tmp_path: Path, head: str, words: str) -> None:
    file = tmp_path / "own.csv"
    file.write_text(f"{head}\n1,a,2,3\n", encoding="utf-8")
    with pytest.raises(InputError, match=words):
        converted(file, PLAIN)
    with pytest.raises(InputError, match=words):
        find_scenario(file)


def test_a_table_of_carla(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """A left-handed world: y and yaw are turned, and classes have its words."""
    names = "frame,timestamp,id,type_id,location_x,location_y,location_z,rotation_yaw"
    rows = "".join(
        f"{n},{n / 10},7,vehicle.tesla.model3,1.75,{80 - n},0.03,-90.0\n"
        f"{n},{n / 10},8,walker.pedestrian.0001,5,{n / 10},0.9,90.0\n"
        for n in range(40)
    )
    log = made_of(tmp_path / "own.csv", f"{names}\n{rows}")
    car, walker = log.traces
    assert car.kind == "vehicle" and walker.kind == "person" and not caplog.records
    np.testing.assert_allclose(car.yaws, math.pi / 2, atol=1e-6)
    np.testing.assert_allclose(car.positions[:, 1] - 2.5, np.arange(40) - 80.0, atol=1e-3)
    np.testing.assert_allclose(walker.yaws, -math.pi / 2, atol=1e-6)


def test_a_clock_that_passes_midnight(tmp_path: Path) -> None:
    seconds = [86390 + s for s in range(20)]
    rows = "".join(
        f"{s // 3600 % 24:02d}:{s // 60 % 60:02d}:{s % 60:02d},a,{s - 86390}\n" for s in seconds
    )
    log = made_of(tmp_path / "own.csv", "clock,id,x,y\n" + rows.replace("\n", ",0\n"))
    assert log.traces[0].times.tolist() == [float(s) for s in seconds]


def test_who_strolls_is_on_foot_and_that_is_said(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    rows = "".join(f"{s},car,{9 * s},0,1\n{s},walker,4,{1.3 * s:.2f},1\n" for s in range(20))
    log = made_of(tmp_path / "own.csv", f"t,id,x,y,lid\n{rows}")
    assert {trace.id: trace.kind for trace in log.traces} == {"car": "vehicle", "walker": "person"}
    assert (
        "no column tells classes; by speed alone 1 for passenger, 1 for pedestrian" in caplog.text
    )
    assert "not used: lid; x and y are taken for the middle of bodies" in caplog.text


def test_a_column_that_says_front_is_believed(tmp_path: Path) -> None:
    rows = "".join(f"{s},a,{9 * s},0\n" for s in range(9))
    log = made_of(tmp_path / "own.csv", f"t,id,Front X,Front Y\n{rows}")
    np.testing.assert_allclose(log.traces[0].positions[:, 0], 9.0 * np.arange(9))


def test_a_picture_is_turned_upright_where_that_is_said(tmp_path: Path) -> None:
    rows = "".join(f"{s},a,{9 * s},{-s}\n" for s in range(9))
    choices = TableChoices(point="front", downwards=True)
    log = made_of(tmp_path / "own.csv", f"t,id,x,y\n{rows}", choices)
    np.testing.assert_allclose(log.traces[0].positions[:, 1], np.arange(9))


def test_places_have_units_of_their_own(tmp_path: Path) -> None:
    """y and z need not be in x's unit, and what is no length is refused."""
    rows = "".join(f"{s},a,{900 * s},{s / 0.3048},{100 * s}\n" for s in range(9))
    text = f"t_s,id,x_cm,y_ft,z_cm\n{rows}"
    log = made_of(tmp_path / "own.csv", text, TableChoices(point="front"))
    np.testing.assert_allclose(log.traces[0].positions[3], [27.0, 3.0, 3.0], atol=1e-3)
    wrong = TableChoices({"y": TableColumn("y_ft", "deg")})
    with pytest.raises(InputError, match="'y_ft' is said to be in 'deg'; say m, ft"):
        made_of(tmp_path / "own.csv", text, wrong)


def test_impossible_speeds_ask_for_units(tmp_path: Path) -> None:
    rows = "".join(f"{s},a,{9000 * s},0\n" for s in range(9))
    with pytest.raises(InputError, match="would move at 9,000 m/s; say in which unit"):
        made_of(tmp_path / "own.csv", f"time_s,id,x,y\n{rows}")


@given(
    time=st.sampled_from(["s", "ms", "us"]),
    place=st.sampled_from(["m", "ft", "cm"]),
    speed=st.sampled_from(sorted(SPEEDS)),
    angle=st.sampled_from(["deg", "rad"]),
    zero=st.sampled_from(["east", "north"]),
    turn=st.sampled_from(["left", "right"]),
    course=st.floats(-3.1, 3.1),
    said=st.booleans(),
)
def test_whatever_the_units_the_drive_is_the_same(
    tmp_path_factory: pytest.TempPathFactory,
    time: str,
    place: str,
    speed: str,
    angle: str,
    zero: str,
    turn: str,
    course: float,
    *,
    said: bool,
) -> None:
    """A drive in a bend, in any units and compass: told by the user, or found from the values."""
    times = np.arange(0.0, 12.0, 0.5)
    yaws = course + 0.05 * times
    x = np.cumsum(5.0 * np.cos(yaws))
    y = np.cumsum(5.0 * np.sin(yaws))
    turned = yaws - (math.pi / 2 if zero == "north" else 0.0)
    turned = turned if turn == "left" else -turned
    columns = {
        "t": times / TIMES[time],
        f"x_{place}": x / METRES[place],
        f"y_{place}": y / METRES[place],
        "yaw": np.degrees(turned) if angle == "deg" else turned,
        "v": np.full(len(times), 10.0 / SPEEDS[speed]),
    }
    file = tmp_path_factory.mktemp("table") / "own.csv"
    lines = [",".join(["car_id", *columns])]
    lines += [
        ",".join(["a", *(f"{value:.9g}" for value in row)])
        for row in zip(*columns.values(), strict=True)
    ]
    file.write_text("\n".join([*lines, ""]), encoding="utf-8")
    own = {
        "time": TableColumn("t", time),
        "angle": TableColumn("yaw", angle, zero, turn),
        "speed": TableColumn("v", speed),
    }
    made = converted(file, TableChoices(own if said else {}, point="front"))
    assert made is not None
    (trace,) = read_trajectories(made.files[:1]).traces
    np.testing.assert_allclose(trace.times, times, atol=1e-6)
    np.testing.assert_allclose(trace.positions[:, :2], np.column_stack([x, y]), atol=2e-3)
    np.testing.assert_allclose(np.exp(1j * trace.yaws), np.exp(1j * yaws), atol=2e-3)
    np.testing.assert_allclose(trace.speeds, 10.0, atol=2e-3)
