"""The bundled example scenarios: complete, small, ours, and standing where they should."""

from __future__ import annotations

import gzip
import re
import xml.etree.ElementTree as ET
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import shapely

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
NAMES = ("ronda", "crossing")
BEGIN, END = 420.0, 539.0  # first and last time step of the logs [s]
MIB = 1024 * 1024

pytestmark = pytest.mark.skipif(not EXAMPLES.is_dir(), reason="the examples are not installed")


def files(name: str) -> list[Path]:
    """All files of an example that the repository holds."""
    return sorted(p for p in (EXAMPLES / name).iterdir() if p.is_file())


def text_of(path: Path) -> str:
    """A file's text, unzipped."""
    data = path.read_bytes()
    return (gzip.decompress(data) if path.suffix == ".gz" else data).decode("utf-8")


@cache
def root_of(path: Path) -> ET.Element:
    return ET.fromstring(text_of(path))


@cache
def log_of(name: str) -> ET.Element:
    return root_of(EXAMPLES / name / "fcd.xml.gz")


def outline(words: str) -> np.ndarray:
    return np.array([point.split(",")[:2] for point in words.split()], dtype=np.float64)


@cache
def ground_of(name: str) -> shapely.Geometry:
    """What the lanes of a network cover."""
    parts = []
    for edge in root_of(EXAMPLES / name / f"{name}.net.xml.gz").iter("edge"):
        for lane in edge.iter("lane"):
            line = shapely.LineString(outline(lane.get("shape", "")))
            parts.append(line.buffer(float(lane.get("width", "3.2")) / 2.0, cap_style="flat"))
    return shapely.union_all(parts)


def points_of(name: str, kind: str) -> np.ndarray:
    pois = root_of(EXAMPLES / name / f"{kind}s.add.xml").findall("poi")
    assert {poi.get("type") for poi in pois} == {kind}
    return np.array([[float(poi.attrib["x"]), float(poi.attrib["y"])] for poi in pois])


def test_both_together_are_small() -> None:
    assert sum(path.stat().st_size for name in NAMES for path in files(name)) < 3 * MIB


@pytest.mark.parametrize("name", NAMES)
def test_every_file_that_the_configuration_names_exists(name: str) -> None:
    configuration = root_of(EXAMPLES / name / f"{name}.sumocfg")
    for key in ("net-file", "route-files", "additional-files", "fcd-output"):
        found = configuration.find(f".//{key}")
        assert found is not None
        for file in found.attrib["value"].split(","):
            assert (EXAMPLES / name / file).is_file(), file
    order = root_of(EXAMPLES / name / "signal_log.add.xml").find("timedEvent")
    assert order is not None
    assert (EXAMPLES / name / order.attrib["dest"]).is_file()


@pytest.mark.parametrize("name", NAMES)
def test_every_xml_file_parses_and_tells_nothing_about_the_machine(name: str) -> None:
    for path in files(name):
        text = text_of(path)
        if path.suffix not in {".py", ".yaml"}:
            root_of(path)
            assert "<!--" not in text, path.name
        assert not re.search(r'(?i)[a-z]:\\|["\' ]/(work|home|tmp|root|usr|Users)/', text), (
            path.name
        )


@pytest.mark.parametrize("name", NAMES)
def test_gzip_headers_hold_no_time_and_no_name(name: str) -> None:
    for path in files(name):
        if path.suffix == ".gz":
            head = path.read_bytes()[:10]
            assert head[3] == 0 and head[4:8] == bytes(4), path.name


@pytest.mark.parametrize("name", NAMES)
def test_the_log_has_every_second_of_its_window(name: str) -> None:
    times = [float(step.attrib["time"]) for step in log_of(name)]
    assert times == list(np.arange(BEGIN, END + 1.0))


@pytest.mark.parametrize("name", NAMES)
def test_every_type_in_the_log_is_defined(name: str) -> None:
    known = {kind.get("id") for kind in root_of(EXAMPLES / name / f"{name}.rou.xml").iter("vType")}
    assert {user.get("type") for step in log_of(name) for user in step} <= known


@pytest.mark.parametrize("name", NAMES)
def test_every_signal_is_logged_from_before_the_window_with_a_letter_per_link(name: str) -> None:
    net = root_of(EXAMPLES / name / f"{name}.net.xml.gz")
    links: dict[str, int] = {}
    for link in net.iter("connection"):
        if light := link.get("tl"):
            links[light] = max(links.get(light, 0), int(link.attrib["linkIndex"]) + 1)
    states = root_of(EXAMPLES / name / "signals.xml.gz").findall("tlsState")
    assert {logic.get("id") for logic in net.iter("tlLogic")} == set(links)
    for light, count in links.items():
        mine = [s for s in states if s.get("id") == light]
        assert float(mine[0].attrib["time"]) <= BEGIN
        assert {len(s.attrib["state"]) for s in mine} == {count}
        assert sum(BEGIN < float(s.attrib["time"]) < END for s in mine) >= 3


@pytest.mark.parametrize("name", NAMES)
def test_nothing_stands_on_a_road(name: str) -> None:
    ground = ground_of(name)
    for kind, clear in (("tree", 3.0), ("home", 10.0), ("shop", 10.0), ("block", 15.0)):
        places = shapely.points(points_of(name, kind))
        assert shapely.distance(ground, places).min() >= clear, kind


@pytest.mark.parametrize("name", NAMES)
def test_buildings_do_not_overlap(name: str) -> None:
    radius = {"home": 9.0, "shop": 12.0, "block": 17.0}
    places = [(*point, radius[kind]) for kind in radius for point in points_of(name, kind)]
    x, y, r = np.array(places).T
    gap = np.hypot(x[:, None] - x, y[:, None] - y) - (r[:, None] + r)
    assert gap[np.triu_indices(len(x), 1)].min() >= 0.0


def test_ronda_is_a_busy_but_moving_motorway() -> None:
    for step in log_of("ronda"):
        speeds = [float(v.attrib["speed"]) for v in step if re.match("[ew]_m", v.attrib["lane"])]
        per_lane = len(speeds) / (2.0 * 3.0 * 2.6)
        assert 18.0 < per_lane < 32.0  # vehicles per kilometre and lane
        assert np.mean(speeds) > 14.0


def test_ronda_meters_are_green_for_45_of_60_seconds() -> None:
    net = root_of(EXAMPLES / "ronda" / "ronda.net.xml.gz")
    programs = list(net.iter("tlLogic"))
    assert len(programs) == 4
    for program in programs:
        phases = [(float(p.attrib["duration"]), p.attrib["state"]) for p in program]
        assert phases == [(45.0, "G"), (15.0, "r")]


def test_ronda_fences_cross_no_lane() -> None:
    polys = root_of(EXAMPLES / "ronda" / "fences.add.xml").findall("poly")
    lines = [shapely.LineString(outline(poly.attrib["shape"])) for poly in polys]
    assert sum(line.length for line in lines) > 7000.0
    assert shapely.distance(ground_of("ronda"), lines).min() > 0.5


def test_crossing_has_every_kind_of_road_user() -> None:
    users = {(u.tag, u.attrib["type"]) for step in log_of("crossing") for u in step}
    kinds = {"car_medium", "van", "truck", "citybus", "motorcycle", "bicycle"}
    assert {("vehicle", kind) for kind in kinds} | {("person", "walker")} <= users
    for step in log_of("crossing"):
        assert 60 <= len(step) <= 140


def test_crossing_lights_show_green_permitted_green_yellow_and_red() -> None:
    states = root_of(EXAMPLES / "crossing" / "signals.xml.gz").findall("tlsState")
    assert set("".join(s.attrib["state"] for s in states)) == set("Ggyr")
