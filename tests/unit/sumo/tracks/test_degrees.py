"""Tables with longitudes and latitudes, as receivers of satellites write them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from needed import package

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.model.traffic import TableChoices, TableColumn
from sumo3dviz_pt.sumo.fcd import read_trajectories
from sumo3dviz_pt.sumo.network import network_of
from sumo3dviz_pt.sumo.tracks import converted, in_sumos_form

pyproj = package("pyproj", "needs the extra geo")

PLAIN = TableChoices()
UTM = "+proj=utm +zone=33 +ellps=WGS84 +datum=WGS84 +units=m +no_defs"
OFFSET = (-389_000.0, -5_819_000.0)
NETWORK = """<net version="1.20">
    <location netOffset="{},{}" convBoundary="0.00,0.00,2000.00,2000.00"
        origBoundary="13,52,14,53" projParameter="{}"/>
    <edge id="e" from="a" to="b" priority="1"><lane id="e_0" index="0" speed="13.9"
        length="1900.00" shape="50.00,990.00 1950.00,990.00"/></edge>
    <junction id="a" type="dead_end" x="50" y="990" incLanes="" intLanes="" shape=""/>
    <junction id="b" type="dead_end" x="1950" y="990" incLanes="e_0" intLanes="" shape=""/>
</net>"""


def driven() -> Floats:
    """Net coordinates of the middle of a car that goes round a bend, (n, 2) [m]."""
    angle = np.linspace(0.0, 1.2, 40)
    return np.column_stack([900 + 300 * np.sin(angle), 1000 + 300 * (1 - np.cos(angle))])


def table(folder: Path, names: str = "time,id,lat,lon,heading") -> Path:
    """The car's table: degrees, and headings from true north."""
    geodesic = pyproj.Geod(ellps="WGS84")
    x, y = (driven() - OFFSET).T
    lon, lat = pyproj.Proj(UTM)(x, y, inverse=True)
    course = geodesic.inv(lon[:-1], lat[:-1], lon[1:], lat[1:])[0]
    course = np.append(course, course[-1])
    rows = [
        f"{k},car,{a:.9f},{o:.9f},{c % 360:.4f}"
        for k, (a, o, c) in enumerate(zip(lat, lon, course, strict=True))
    ]
    file = folder / "gps.csv"
    file.write_text("\n".join([names, *rows, ""]), encoding="utf-8")
    return file


def network(folder: Path, projection: str = UTM) -> Path:
    file = folder / "net.net.xml"
    file.write_text(NETWORK.format(*OFFSET, projection), encoding="utf-8")
    return file


@pytest.mark.parametrize("names", ["time,id,lat,lon,heading", "t,veh,Breitengrad,Längengrad,hdg"])
def test_degrees_lie_where_the_network_has_them(tmp_path: Path, names: str) -> None:
    files = in_sumos_form(network(tmp_path), [table(tmp_path, names)], PLAIN)
    (trace,) = read_trajectories([files.trajectories[0]]).traces
    course = np.arctan2(*np.diff(driven(), axis=0).T[::-1])
    np.testing.assert_allclose(trace.yaws[:-1], course, atol=np.radians(0.1))
    ways = np.column_stack([np.cos(trace.yaws), np.sin(trace.yaws)])
    np.testing.assert_allclose(trace.positions[:, :2] - 2.5 * ways, driven(), atol=2e-3)


def test_without_a_network_the_place_on_the_earth_stays(tmp_path: Path) -> None:
    files = in_sumos_form(None, [table(tmp_path)], PLAIN)
    place = network_of(files.network).location.place
    assert place is not None
    lon, lat = pyproj.Proj(UTM)(*(driven().mean(axis=0) - OFFSET), inverse=True)
    np.testing.assert_allclose(place, (lat, lon), atol=2e-3)
    (trace,) = read_trajectories([files.trajectories[0]]).traces
    steps = np.linalg.norm(np.diff(driven(), axis=0), axis=1)
    moved = np.linalg.norm(np.diff(trace.positions[:, :2], axis=0), axis=1)
    # A UTM zone is up to .04 % smaller than the Earth.
    np.testing.assert_allclose(moved, steps, rtol=0.02)


def test_two_tables_without_a_network_meet_on_the_ways_of_the_larger_one(tmp_path: Path) -> None:
    """As of vehicles and of people; each alone would have another middle."""
    cars = table(tmp_path)
    walker = cars.read_text(encoding="utf-8").replace(",car,", ",walker,").splitlines()
    people = tmp_path / "people.csv"
    people.write_text("\n".join([*walker[:1], *walker[30:], ""]), encoding="utf-8")
    files = in_sumos_form(None, [people, cars], PLAIN)
    assert len(files.tables) == 2 and len({str(log) for log in files.trajectories}) == 2
    (second,), (first,) = (read_trajectories([log]).traces for log in files.trajectories)
    same = first.positions[-len(second.times) :] - second.positions
    assert np.abs(same[:, :2]).max() < 0.01


def test_a_column_that_a_user_names(tmp_path: Path) -> None:
    columns = {"x": TableColumn("east", "deg"), "y": TableColumn("north", "deg")}
    file = table(tmp_path, "time,id,north,east,heading")
    made = converted(file, TableChoices(columns), network=network(tmp_path))
    assert made is not None
    (trace,) = read_trajectories(made.files[:1]).traces
    assert np.abs(trace.positions[:, :2] - driven()).max() < 3.0


def test_degrees_that_cannot_be_placed(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no projection; take one that netconvert made"):
        converted(table(tmp_path), PLAIN, network=network(tmp_path, "!"))
    file = tmp_path / "off.csv"
    file.write_text("time,id,lat,lon\n0,a,52,13\n1,a,95,13\n", encoding="utf-8")
    with pytest.raises(InputError, match="none on the Earth"):
        converted(file, PLAIN)
    file.write_text("time,id,lat,lon\n0,a,,\n1,a,,\n", encoding="utf-8")
    with pytest.raises(InputError, match="nobody in it has a place"):
        converted(file, PLAIN)


def test_rows_of_pneuma_hold_a_road_user_each(tmp_path: Path) -> None:
    """Four cells of the road user, then six for each of its moments."""
    x, y = (driven() - OFFSET).T
    lon, lat = pyproj.Proj(UTM)(x, y, inverse=True)
    names = "track_id; type; traveled_d; avg_speed; lat; lon; speed; lon_acc; lat_acc; time"
    moments = "".join(
        f" {a:.9f}; {o:.9f}; 32.4; 0.0; 0.0; {0.04 * k:.6f};"
        for k, (a, o) in enumerate(zip(lat, lon, strict=True))
    )
    file = tmp_path / "20181024_d1_0830_0900.csv"
    rows = [f"1; Car; 48.85; 9.77;{moments}", f"2; Heavy Vehicle; 9.0; 9.0;{moments[:500]}"]
    file.write_text("\n".join([names, *rows, ""]), encoding="utf-8")
    made = converted(file, PLAIN, network=network(tmp_path))
    assert made is not None
    first, second = sorted(read_trajectories(made.files[:1]).traces, key=lambda each: each.id)
    assert (first.type_id.split()[0], second.type_id.split()[0]) == ("passenger", "truck")
    assert len(first.times) == 40 and len(second.times) < 20
    ways = np.column_stack([np.cos(first.yaws), np.sin(first.yaws)])
    off = first.positions[:, :2] - 2.5 * ways - driven()
    assert np.abs(off).max() < 0.3
    # Minutes of a road user are a row of many kilobytes.
    rows.append(f"3; Bus; 1.0; 1.0;{moments * 40}")
    file.write_text("\n".join([names, *rows, ""]), encoding="utf-8")
    longer = converted(file, PLAIN, network=network(tmp_path))
    assert longer is not None and len(rows[-1]) > 1 << 16
    assert len(read_trajectories(longer.files[:1]).traces) == 3


def test_a_damaged_moment_of_pneuma_is_named_with_its_line(tmp_path: Path) -> None:
    names = "track_id; type; traveled_d; avg_speed; lat; lon; speed; lon_acc; lat_acc; time"
    row = "1; Car; 48.85; 9.77; 52.1; 13.1; 4; 0; 0; 0.0; 52.1; east; 4; 0; 0; 0.04"
    file = tmp_path / "p.csv"
    file.write_text(f"{names}\n{row}\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"p.csv:2: ' east' in the column 'lon' is not a number"):
        converted(file, PLAIN, network=network(tmp_path))
