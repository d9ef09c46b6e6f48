"""SUMO is run with what a film needs, and nothing of its owner's is changed."""

import gzip
import re
import subprocess
import sys
from pathlib import Path

import pytest

from sumo3dviz_pt.errors import ConfigError, InputError
from sumo3dviz_pt.pipeline.recording.run import RecordOrder, record
from sumo3dviz_pt.pipeline.recording.settings import read_settings

sumo = pytest.importorskip("sumo", reason="needs the extra sumo")

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


def run(*words):
    subprocess.run(words, check=True, capture_output=True)


def rows(log, kind="vehicle"):
    """Places by time and id."""
    found, time = {}, None
    for line in gzip.decompress(log.read_bytes()).decode().splitlines():
        step = re.search(r'timestep time="([\d.]+)"', line)
        time = float(step[1]) if step else time
        who = re.search(rf'<{kind} id="([^"]+)" x="([-\d.]+)" y="([-\d.]+)"', line)
        if who:
            found[time, who[1]] = (float(who[2]), float(who[3]))
    return found


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
    assert rows(tmp_path / "TMP_plain.xml.gz") == rows(tmp_path / "out" / "fcd.xml.gz")


def test_a_window_has_the_margin_that_motion_needs(city, tmp_path):
    record(city / "city.sumocfg", RecordOrder(tmp_path / "out", start=30.0, end=40.0))
    times = {time for time, _ in rows(tmp_path / "out" / "fcd.xml.gz")}
    assert min(times) == 18.0 and 51.0 <= max(times) <= 52.0


def test_a_place_and_a_vehicle(city, tmp_path):
    record(city / "city.sumocfg", RecordOrder(tmp_path / "a", around=(100.0, 100.0, 40.0)))
    near = rows(tmp_path / "a" / "fcd.xml.gz")
    assert near and all((x - 100) ** 2 + (y - 100) ** 2 < 50**2 for x, y in near.values())
    record(city / "city.sumocfg", RecordOrder(tmp_path / "f", follow="f0.1", radius=60.0))
    found = rows(tmp_path / "f" / "fcd.xml.gz")
    own = {time: place for (time, who), place in found.items() if who == "f0.1"}
    assert len({who for _, who in found}) > 1
    for (time, _), (x, y) in found.items():
        assert (x - own[time][0]) ** 2 + (y - own[time][1]) ** 2 < 70**2


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
    with pytest.raises(ConfigError, match="must be later than"):
        RecordOrder(tmp_path, start=5.0, end=5.0)
    with pytest.raises(ConfigError, match="either --around or --follow"):
        RecordOrder(tmp_path, around=(0.0, 0.0, 5.0), follow="a")
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


@pytest.mark.parametrize("module", ["libsumo", "traci"])
def test_a_recorder_in_a_loop_keeps_what_record_does(city, tmp_path, module):
    pytest.importorskip("libsumo", reason="needs the extra sumo")
    record(city / "city.sumocfg", RecordOrder(tmp_path / "out", end=40.0))
    program = f"""
import sys; sys.path.append({str(HOME / "tools")!r})
import {module} as connection
from sumo3dviz_pt import Recorder
connection.start([{str(HOME / "bin" / "sumo")!r}, "-c", {str(city / "city.sumocfg")!r},
                  "--no-step-log", "--output-prefix", "TMP_"])
with Recorder(connection, {str(tmp_path / "own")!r}) as recorder:
    while connection.simulation.getTime() < 40.0:
        connection.simulationStep()
        recorder.step()
    camera = {{"mode": "eulerian", "position": [0, 0, 5], "heading": 0}}
    scene = recorder.scene(cameras={{"a": camera}})
connection.close()
print(len(scene.vehicles))
"""
    run(sys.executable, "-c", program)
    for path in city.glob("TMP_*"):
        path.unlink()
    for kind in ("vehicle", "person"):
        own, other = (rows(tmp_path / name / "fcd.xml.gz", kind) for name in ("own", "out"))
        other = {key: place for key, place in other.items() if key[0] < 40.0}
        assert own == other and own
    changes = [change for change in states(tmp_path / "out" / "signals.xml.gz") if change[0] < 40.0]
    assert states(tmp_path / "own" / "signals.xml.gz") == changes


def test_days_are_times_too(tmp_path):
    times = '<b value="1:00:00:30"/><end value="-1"/>'
    text = f'<configuration><net-file value="n"/>{times}</configuration>'
    (tmp_path / "a.sumocfg").write_text(text)
    settings = read_settings(tmp_path / "a.sumocfg")
    assert settings.begin == 86_430.0 and settings.end is None
