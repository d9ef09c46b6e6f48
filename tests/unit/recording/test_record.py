"""SUMO is run with what a film needs, and nothing of its owner's is changed."""

import gzip
import math
import re
import shutil
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest
from needed import package
from small_simulations import KINDS

from sumo3dviz_pt.cli import main
from sumo3dviz_pt.errors import ConfigError, InputError
from sumo3dviz_pt.recording.run import RecordOrder, record

sumo = package("sumo", "needs the extra sumo")

pytestmark = pytest.mark.slow

HOME = Path(sumo.SUMO_HOME)


@pytest.fixture(scope="module")
def city(tmp_path_factory):
    """A grid with signals, cars, a pedestrian, a detector and a log of its owner's."""
    folder = tmp_path_factory.mktemp("city")
    generate = ["--grid", "--grid.number", "3", "--default-junction-type", "traffic_light"]
    walks = ["--sidewalks.guess", "--crossings.guess", "-o", str(folder / "net.net.xml")]
    run(str(HOME / "bin" / "netgenerate"), *generate, *walks)
    cars = "".join(
        f'<flow id="f{k}" type="car" begin="{k}" end="60" period="7" from="{a}" to="{b}"/>'
        for k, (a, b) in enumerate([("A0A1", "C1C2"), ("B0B1", "B1B2"), ("C2B2", "A1A0")])
    )
    (folder / "city.rou.xml").write_text(
        '<routes><vType id="car" length="4.7"/>'
        f'{cars}<person id="p" depart="3"><walk from="A0A1" to="A1B1"/></person></routes>'
    )
    (folder / "own.add.xml").write_text(
        '<additional><inductionLoop id="d" lane="B1B2_1" pos="20" period="10" file="loop.xml"/>'
        "</additional>"
    )
    (folder / "loop.xml").write_text("what an earlier run said")
    (folder / "trips.xml").write_text("what an earlier run said")
    (folder / "city.sumocfg").write_text(
        '<configuration><input><net-file value="net.net.xml"/><route-files value="city.rou.xml"/>'
        '<additional-files value="own.add.xml"/></input><time><begin value="0"/><end value="90"/>'
        '<step-length value="0.5"/></time><output><tripinfo-output value="trips.xml"/></output>'
        "</configuration>"
    )
    return folder


@pytest.fixture(scope="module")
def buses(tmp_path_factory):
    """A city with people and containers that ride; its configuration."""
    return KINDS["buses"](tmp_path_factory.mktemp("buses"))


def run(*words):
    subprocess.run(words, check=True, capture_output=True)


def rows(log):
    """What a log says, by time, kind and id."""
    text = gzip.decompress(log.read_bytes())
    return {
        (float(step.attrib["time"]), row.tag, row.attrib.pop("id")): dict(row.attrib)
        for step in ElementTree.fromstring(text)
        for row in step
    }


def places(log, *kinds):
    """Places by time and id."""
    return {
        (time, name): (float(row["x"]), float(row["y"]))
        for (time, kind, name), row in rows(log).items()
        if kind in (kinds or ("vehicle",))
    }


def states(log):
    """Changes of signals: time, id, state."""
    found, last = [], {}
    for line in gzip.decompress(log.read_bytes()).decode().splitlines():
        said = re.search(r'time="([\d.]+)" id="([^"]+)".* state="([^"]+)"', line)
        if said and last.get(said[2]) != said[3]:
            last[said[2]] = said[3]
            found.append((float(said[1]), said[2], said[3]))
    return sorted(found)


def test_a_recording_is_all_that_init_needs(city, tmp_path):
    from sumo3dviz_pt.pipeline.reading import read_files
    from sumo3dviz_pt.pipeline.scene_file import make_job

    before = {path.name: path.read_bytes() for path in city.iterdir()}
    files = record(city / "city.sumocfg", RecordOrder(tmp_path / "out"))
    assert [path.name for path in files] == [
        *("city.sumocfg", "fcd.xml.gz", "signals.xml.gz", "signals.add.xml")
    ]
    job = make_job({"scenario": {"folder": str(tmp_path / "out")}})
    _, scenario = read_files(job)
    assert scenario.traffic.step == 0.5 and scenario.signals
    assert {trace.kind for trace in scenario.traffic.traces} == {"vehicle", "person"}
    assert scenario.vehicle_types["car"].length == 4.7
    # Nothing of the owner's was written or changed, and nothing else is left behind.
    assert {path.name: path.read_bytes() for path in city.iterdir()} == before
    assert {path.name for path in (tmp_path / "out").iterdir()} == {path.name for path in files}


def test_the_simulation_is_the_same_as_without_recording(city, tmp_path):
    record(city / "city.sumocfg", RecordOrder(tmp_path / "out"))
    run(
        str(HOME / "bin" / "sumo"), "-c", str(city / "city.sumocfg"), "--output-prefix", "TMP_",
        "--fcd-output", str(tmp_path / "plain.xml.gz"), "--precision", "3",
    )  # fmt: skip
    for path in city.glob("TMP_*"):
        path.unlink()
    assert places(tmp_path / "TMP_plain.xml.gz") == places(tmp_path / "out" / "fcd.xml.gz")


def test_a_window_has_the_margin_that_motion_needs(city, tmp_path):
    record(city / "city.sumocfg", RecordOrder(tmp_path / "out", start=30.0, end=40.0))
    times = {time for time, *_ in rows(tmp_path / "out" / "fcd.xml.gz")}
    assert min(times) == 18.0 and 51.0 <= max(times) <= 52.0


def test_a_window_is_one_for_people_too(city, tmp_path):
    record(city / "city.sumocfg", RecordOrder(tmp_path / "out", start=30.0, end=40.0))
    found = places(tmp_path / "out" / "fcd.xml.gz", "person")
    assert found and min(time for time, _ in found) == 18.0


def test_a_place(buses, tmp_path):
    record(buses, RecordOrder(tmp_path / "a", around=(100.0, 100.0, 40.0)))
    kinds = {kind for _, kind, _ in rows(tmp_path / "a" / "fcd.xml.gz")}
    assert kinds == {"vehicle", "person", "container"}
    near = places(tmp_path / "a" / "fcd.xml.gz", *kinds)
    assert all((x - 100) ** 2 + (y - 100) ** 2 < 60**2 for x, y in near.values())


def test_around_a_vehicle_are_those_near_it_and_in_it(buses, tmp_path):
    record(buses, RecordOrder(tmp_path / "all"))
    record(buses, RecordOrder(tmp_path / "f", follow="bus0", radius=80.0))
    found, everything = (rows(tmp_path / name / "fcd.xml.gz") for name in ("f", "all"))
    own = {t: place(row) for (t, _, name), row in everything.items() if name == "bus0"}
    for key, row in everything.items():
        away = abs(place(row) - own[key[0]]) if key[0] in own else math.inf
        assert (key in found) == (away <= 80.0), (key, away)
        assert key not in found or found[key] == row
    assert {kind for _, kind, _ in found} == {"vehicle", "person", "container"}
    riding = {name for (t, kind, name) in found if kind == "person" and t > 90.0}
    assert "rider0" in riding and len(found) < len(everything) / 2


def place(row):
    """Where somebody is, as a complex number [m]."""
    return complex(float(row["x"]), float(row["y"]))


def test_who_is_not_there_cannot_be_followed(buses, tmp_path, capsys):
    for name, said in [("nobody", ""), ("rider0", "; it is a person, and only a vehicle")]:
        words = ["record", str(buses), "-o", str(tmp_path / "out"), "--follow", name]
        assert main(words) == 2
        told = capsys.readouterr().err.splitlines()
        assert (
            len(told) == 1 and f"follow: no vehicle '{name}' drives in this window{said}" in told[0]
        )
    assert not (tmp_path / "out").exists()


OWN_CHOICES = {
    "person-fcd-output": "people.xml", "fcd-output.attributes": "x,y,angle",
    "fcd-output.geo": "true", "fcd-output.utm": "true", "fcd-output.distance": "true",
    "fcd-output.speed-relative": "true", "fcd-output.max-leader-distance": "50",
    "fcd-output.params": "has.fcd.device", "fcd-output.skip-empty": "true",
    "fcd-output.filter-edges.input-file": "edges.txt", "fcd-output.filter-shapes": "square",
    "fcd-output.acceleration": "false", "fcd-output.signals": "false", "precision": "1",
    "device.fcd.period": "5", "device.fcd.begin": "20", "device.fcd.probability": "0.1",
    "device.fcd.explicit": "f.1", "device.fcd.radius": "30",
    "person-device.fcd.probability": "0", "person-device.fcd.period": "5",
    "output.format": "csv", "human-readable-time": "true", "H": "true",
}  # fmt: skip
"""Choices of an owner's that change a log."""


@pytest.fixture(scope="module")
def expected(buses, tmp_path_factory):
    """The rows of a recording when its owner chooses nothing."""
    return rows(record(buses, RecordOrder(tmp_path_factory.mktemp("plain") / "r", end=40.0))[1])


@pytest.mark.parametrize(
    "names", [*((name,) for name in OWN_CHOICES), ("fcd-output.geo", *OWN_CHOICES)]
)
def test_what_the_owner_keeps_is_no_matter(buses, expected, tmp_path, names):
    folder = tmp_path / "own"
    shutil.copytree(buses.parent, folder)
    (folder / "edges.txt").write_text("edge:A0A1\n")
    square = '<poly id="square" shape="0,0 9,0 9,9 0,9" color="0,0,0"/></additional>'
    more = folder / "own.add.xml"
    more.write_text(more.read_text().replace("</additional>", square))
    choices = {name: OWN_CHOICES[name] for name in names}
    if len(choices) > 1:
        del choices["H"]  # a second name of an option
    output = "".join(f'<{name} value="{value}"/>' for name, value in choices.items())
    path = folder / buses.name
    path.write_text(path.read_text().replace("</configuration>", f"{output}</configuration>"))
    before = {each.name: each.read_bytes() for each in folder.iterdir()}
    _, log, *signals = record(path, RecordOrder(tmp_path / "out", end=40.0))
    assert rows(log) == expected
    assert states(signals[0])
    assert {each.name: each.read_bytes() for each in folder.iterdir()} == before
    assert gzip.decompress(log.read_bytes()).count(b"<timestep") == 104


def test_a_seed_makes_another_day(city, tmp_path):
    logs = [
        rows(record(city / "city.sumocfg", RecordOrder(tmp_path / str(seed), seed=seed))[1])
        for seed in (1, 1, 2)
        if not (tmp_path / str(seed)).exists() or seed == 2
    ]
    assert logs[0] != logs[1]


def test_mistakes_are_refused_in_words(city, tmp_path):
    out = RecordOrder(tmp_path / "out")
    with pytest.raises(InputError, match=r"does not exist; give a \.sumocfg"):
        record(city / "town.sumocfg", out)
    with pytest.raises(InputError, match="not a configuration of SUMO"):
        record(city / "net.net.xml", out)
    with pytest.raises(InputError, match="nobody was on the road"):
        record(city / "city.sumocfg", RecordOrder(tmp_path / "out", around=(900.0, 900.0, 5.0)))
    with pytest.raises(ConfigError, match="holds the simulation itself"):
        record(city / "city.sumocfg", RecordOrder(city))
    assert not [path for path in (tmp_path / "out").glob("*") if path.is_file()]
    record(city / "city.sumocfg", out)
    with pytest.raises(ConfigError, match="exists already; --overwrite"):
        record(city / "city.sumocfg", out)
    record(city / "city.sumocfg", RecordOrder(tmp_path / "out", overwrite=True, end=20.0))


def test_words_of_sumo_are_passed_on(city, tmp_path):
    wrong = (city / "city.sumocfg").read_text().replace("city.rou.xml", "none.rou.xml")
    for name in ("net.net.xml", "own.add.xml"):
        wrong = wrong.replace(f'"{name}"', f'"{(city / name).as_posix()}"')
    (tmp_path / "wrong.sumocfg").write_text(wrong)
    with pytest.raises(InputError, match=r"SUMO stopped: .*none\.rou\.xml"):
        record(tmp_path / "wrong.sumocfg", RecordOrder(tmp_path / "out"))
    assert not (tmp_path / "out").exists()


def test_warnings_of_sumo_are_passed_on_once(city, tmp_path, capsys):
    late = '<vehicle id="late{}" depart="1"><route edges="A0A1"/></vehicle>'
    for name in ("net.net.xml", "own.add.xml", "city.rou.xml", "city.sumocfg"):
        shutil.copy(city / name, tmp_path)
    routes = tmp_path / "city.rou.xml"
    ends = routes.read_text().replace("</routes>", late.format(1) + late.format(2) + "</routes>")
    routes.write_text(ends)
    assert main(["record", str(tmp_path / "city.sumocfg"), "-o", str(tmp_path / "out")]) == 0
    notes = [line for line in capsys.readouterr().err.splitlines() if "note: " in line]
    assert len(notes) == 1 and "SUMO warns: Route file should be sorted" in notes[0]
    assert "ignoring 'late1'! (1 more of this kind)" in notes[0]


def test_the_commands(city, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shutil.copytree(city, tmp_path / "city")
    words = ["record", "city/city.sumocfg", "-o", "rec", "--from", "20", "--to", "40"]
    assert main([*words, "--around", "100,100,90", "--seed", "5"]) == 0
    said = capsys.readouterr().out
    assert "wrote rec/city.sumocfg, rec/fcd.xml.gz" in said
    assert "next: sumo3dviz-pt init rec/city.sumocfg -o scene.yaml" in said
    assert main(words) == 2 and "--overwrite replaces it" in capsys.readouterr().err
    assert main([*words, "--overwrite", "--around", "1,2"]) == 2
    assert "--around takes X,Y,R in metres" in capsys.readouterr().err
    assert main(["init", "city/city.sumocfg", "--record", "-o", "scene.yaml"]) == 0
    capsys.readouterr()
    assert {path.name for path in (tmp_path / "scene.recorded").iterdir()} == {
        *("city.sumocfg", "fcd.xml.gz", "signals.xml.gz", "signals.add.xml")
    }
    assert main(["check", "scene.yaml"]) == 0
    assert main(["vehicles", "scene.yaml"]) == 0
    assert "f0.0" in capsys.readouterr().out
    assert main(["init", "city/city.sumocfg", "--record", "-o", "scene.yaml"]) == 2
    assert main(["init", "city/none.sumocfg", "--record", "-o", "other.yaml"]) == 2
    assert not (tmp_path / "other.recorded").exists()


LOOP = """
import sys; sys.path.append({tools!r})
import {module} as connection
from sumo3dviz_pt import Recorder
connection.start([{program!r}, "-c", {path!r}, "--no-step-log"])
connection.simulationStep(10.0)
with Recorder(connection, {folder!r}) as recorder:
    while connection.simulation.getTime() < connection.simulation.getEndTime():
        connection.simulationStep()
        recorder.step()
    camera = {{"mode": "eulerian", "position": [0, 0, 5], "heading": 0}}
    scene = recorder.scene(cameras={{"a": camera}})
connection.close()
print(len(scene.vehicles))
"""


@pytest.fixture(scope="module", params=KINDS)
def recorded(request, tmp_path_factory):
    """A simulation of each kind, its configuration and what `record` keeps of it."""
    folder = tmp_path_factory.mktemp(request.param)
    path = KINDS[request.param](folder)
    return path, record(path, RecordOrder(folder / "out"))


@pytest.mark.parametrize("module", ["libsumo", "traci"])
def test_a_recorder_in_a_loop_keeps_what_record_does(recorded, tmp_path, module):
    package(module if module == "libsumo" else "sumo", "needs the extra sumo")
    path, files = recorded
    program = LOOP.format(
        tools=str(HOME / "tools"), module=module, program=str(HOME / "bin" / "sumo"),
        path=str(path), folder=str(tmp_path / "own"),
    )  # fmt: skip
    run(sys.executable, "-c", program)
    own = rows(tmp_path / "own" / "fcd.xml.gz")
    # Containers are beyond a connection's reach, and the loop begins at 10 s.
    known = {k: row for k, row in rows(files[1]).items() if k[0] >= 10.0 and k[1] != "container"}
    assert own.keys() == known.keys() and own
    for key, row in own.items():
        other = known[key]
        # SUMO computes it from its own numbers, the recorder from a difference of two.
        sideways = [float(each.pop("accelerationLat", "nan")) for each in (row, other)]
        assert sideways == pytest.approx([sideways[1]] * 2, abs=0.0011, nan_ok=True)
        assert row == other, key
    signals = tmp_path / "own" / "signals.xml.gz"
    assert signals.is_file() == (len(files) > 2)
    if signals.is_file():
        # The first entries of the loop's log say what was shown then.
        found, changes = ([c for c in states(log) if c[0] > 10.0] for log in (signals, files[2]))
        assert found == changes
