"""The readers on the shared scenarios, against what SUMO itself said about them."""

import csv
import json
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from needed import package

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.model.layers import linear_from_srgb
from sumo3dviz_pt.model.traffic import LogChoices, ScenarioFiles
from sumo3dviz_pt.sumo import (
    find_scenario,
    read_additional,
    read_network,
    read_scenario,
    read_signals,
    read_trajectories,
    read_vehicle_types,
)
from sumo3dviz_pt.sumo.plausibility.log import findings

DATA = Path(__file__).parents[2].parent / "shared" / "data"
EDGE = DATA / "edge_cases"
NAMES = ["barcelona", "doerpfeldstr", "bologna_acosta", "monaco_west_hills", "badhersfeld"]
EAST = np.array([25.0, 0.0, 0.0])

pytestmark = [
    pytest.mark.skipif(not DATA.is_dir(), reason="the shared scenarios are not here"),
    pytest.mark.slow,
]


@cache
def scenario(name):
    return read_scenario(find_scenario(DATA / name))


def stats(name):
    return json.loads((DATA / name / "stats.json").read_text(encoding="utf-8"))


@pytest.mark.parametrize("name", NAMES)
def test_traffic_matches_sumos_statistics(name):
    traffic, expected = scenario(name).traffic, stats(name)
    kinds = [trace.kind for trace in traffic.traces]
    assert kinds.count("vehicle") == expected["vehicles"]
    # Persons who only ride have no trace.
    assert kinds.count("person") <= expected["persons"]
    rows = sum(len(trace.times) for trace in traffic.traces)
    hidden = {"bologna_acosta": 8708}.get(name, 0)
    assert rows == expected["rows"] - hidden
    assert [traffic.begin, traffic.end] == pytest.approx(expected["t"])
    assert traffic.step == pytest.approx(expected["dt"])
    found = np.concatenate([t.positions for t in traffic.traces if t.kind == "vehicle"])
    vehicles = scenario(name).network.location.outside(found)
    for axis, key in enumerate("xyz"):
        if expected[key]:
            low, high = expected[key]
            assert low - 1e-6 <= vehicles[:, axis].min() <= vehicles[:, axis].max() <= high + 1e-6


@pytest.mark.parametrize("name", NAMES)
def test_network_matches_sumos_statistics(name):
    network, expected = scenario(name).network, stats(name)
    normal = [edge for edge in network.edges.values() if edge.function == "normal"]
    assert len(normal) == expected["edges"]
    assert sum(len(edge.lanes) for edge in normal) == expected["lanes"]
    lights = {c.tls for c in network.connections if c.tls}
    assert len(lights) == expected["tls"]
    assert all(len(lane.shape) >= 2 and lane.width > 0 for lane in network.lanes.values())


@pytest.mark.parametrize("name", NAMES)
def test_signal_logs_cover_every_link(name):
    read = scenario(name)
    for connection in read.network.connections:
        if connection.tls:
            states = read.signals[connection.tls].states
            assert all(connection.link_index < len(state) for state in states)
            # SUMO writes -1 for a link that its light leaves uncontrolled.
            assert connection.link_index >= -1
    if read.signals:
        assert read.signals == read_signals([DATA / name / "tls_switch_states.xml.gz"])


@pytest.mark.parametrize("name", NAMES)
def test_types_are_as_sumo_resolved_them(name):
    types = scenario(name).vehicle_types
    with (DATA / name / "vtypes_resolved.csv").open(encoding="utf-8") as stream:
        for row in csv.DictReader(stream):
            if row["type"] not in types:
                continue
            found = types[row["type"]]
            for key in ("length", "width", "height"):
                assert getattr(found, key) == pytest.approx(float(row[key])), row["type"]
            assert (found.vclass, found.gui_shape) == (row["vClass"], row["guiShape"])
            if found.colour is not None:
                encoded = [int(v) / 255 for v in row["color"].split(",")[:3]]
                assert found.colour == pytest.approx(
                    [linear_from_srgb(v) for v in encoded], abs=0.01
                )


@pytest.mark.parametrize("name", NAMES)
def test_vehicles_are_as_far_from_their_lanes_as_sumo_says(name):
    read, expected = scenario(name), stats(name)
    names = read.traffic.lane_names
    worst = 0.0
    for trace in [t for t in read.traffic.traces if t.kind == "vehicle"][::10]:
        for place, index in list(zip(trace.positions, trace.lanes, strict=True))[::10]:
            lane = read.network.lanes[names[index]]
            worst = max(worst, distance(place[:2], lane.shape[:, :2]))
    assert worst <= expected["dmax"] + 0.01


def distance(point, line):
    start, step = line[:-1], np.diff(line, axis=0)
    share = ((point - start) * step).sum(axis=1) / np.maximum((step**2).sum(axis=1), 1e-12)
    nearest = start + np.clip(share, 0, 1)[:, None] * step
    return float(np.linalg.norm(nearest - point, axis=1).min())


@pytest.mark.parametrize("name", NAMES)
def test_nothing_is_wrong_with_the_logs(name):
    """Nor with windows of them, nor with a few of their vehicles."""
    found = scenario(name)
    log = found.traffic
    assert findings(log, found.network) == ()
    for first in range(0, 60, 13):
        assert findings(replace(log, traces=log.traces[first::60]), found.network) == ()
    shifted = tuple(replace(t, positions=t.positions + EAST) for t in log.traces)
    (wrong,) = findings(replace(log, traces=shifted), found.network)
    assert wrong.hopeless and "the log lies 25 m east of the network" in wrong.text


def test_a_mesoscopic_log_is_named():
    files = ScenarioFiles(EDGE / "rh.net.xml", (EDGE / "meso.xml",))
    with pytest.raises(InputError, match="mesoscopic simulation"):
        read_scenario(files)
    assert read_scenario(files, choices=LogChoices(allow_misfit=True)).traffic.traces


def test_barcelonas_own_logs():
    files = find_scenario(DATA / "barcelona" / "original" / "Configuration.sumocfg")
    assert files == find_scenario(DATA / "barcelona" / "original")
    assert "Demand.rou.xml" in [path.name for path in files.missing]
    assert files.trajectories[0].name == "vehicle_positions_ci.xml.gz"
    assert files.signals[0].name == "signal_states.xml.gz"
    assert len(files.additional) == 5
    read = read_scenario(files)
    assert (read.traffic.begin, read.traffic.end) == (140, 150)
    assert (len(read.signals), len(read.polygons)) == (5, 13)
    assert len(read.pois) == 1229


def test_rerun_and_original_are_not_mixed():
    files = find_scenario(DATA / "barcelona")
    paths = (files.network, *files.trajectories, *files.signals, *files.additional)
    assert not any("original" in path.parts for path in paths)


def test_window_of_a_shared_log():
    log = read_trajectories([DATA / "badhersfeld" / "fcd.xml.gz"], begin=610, end=611)
    assert {t for trace in log.traces for t in trace.times} == {
        time
        for trace in scenario("badhersfeld").traffic.traces
        for time in trace.times
        if 610 <= time <= 611
    }


@pytest.mark.parametrize(
    ("name", "traces", "rows"),
    [
        ("all_attributes.xml.gz", 9, 829),
        ("concatenated_overlap.xml", 9, 460),
        ("default.xml.gz", 9, 829),
        ("empty_steps.xml", 0, 0),
        ("hms.xml.gz", 9, 520),
        ("hms_day.xml", 0, 0),
        ("lh_sub.xml.gz", 9, 829),
        ("meso.xml", 9, 527),
        ("minimal.xml", 9, 829),
        ("opposite.xml", 2, 119),
        ("period5.xml", 6, 129),
        ("persons_only.xml", 3, 360),
        ("persons_split.xml", 6, 469),
        ("prec6.xml", 9, 829),
        ("really_plain.xml.zst", 9, 829),
        ("reinserted_id.xml", 3, 57),
        ("rh_sub.xml.gz", 9, 832),
        ("riders_tagged.xml.gz", 9, 829),
        ("utm.xml.gz", 842, 4170),
    ],
)
def test_edge_cases_are_read(name, traces, rows):
    log = read_trajectories([EDGE / name])
    assert (len(log.traces), sum(len(t.times) for t in log.traces)) == (traces, rows)


def test_split_logs_equal_the_common_one():
    whole = read_trajectories([EDGE / "default.xml.gz"])
    split = read_trajectories([EDGE / "persons_split.xml", EDGE / "persons_only.xml"])
    assert {t.key: len(t.times) for t in whole.traces} == {
        t.key: len(t.times) for t in split.traces
    }


def test_day_times():
    log = read_trajectories([EDGE / "hms_day.xml"])
    assert (log.begin, log.end) == (100_000, 100_011)


def test_reused_id():
    traces = read_trajectories([EDGE / "reinserted_id.xml"]).traces
    assert {(trace.key, trace.type_id) for trace in traces} == {
        ("vehicle:v0", "car"),
        ("vehicle:v0", "bus"),
        ("person:v0", "DEFAULT_PEDTYPE"),
    }


@pytest.mark.parametrize(("name", "steps"), [("killed.xml.gz", 286), ("killed_plain.xml.gz", 299)])
def test_killed_simulations(name, steps):
    with pytest.raises(InputError, match=f"after {steps} complete time steps"):
        read_trajectories([EDGE / name])
    log = read_trajectories([EDGE / name], allow_truncated=True)
    assert log.end == steps - 1


@pytest.mark.parametrize(
    "name", ["killed_0byte.parquet", "add.xml", "empty_skip.xml", "rh.net.xml", "README.md"]
)
def test_what_is_no_log_is_refused(name):
    with pytest.raises(InputError):
        read_trajectories([EDGE / name])


def test_every_edge_case_is_read_or_refused_in_a_sentence():
    """Of each file, nothing but values or one clear message comes."""
    read = 0
    for file in sorted(EDGE.iterdir()):
        for reader in (read_trajectories, read_vehicle_types, read_additional, read_signals):
            try:
                reader([file])
                read += 1
            except InputError as error:
                message = str(error)
                assert file.name in message and "\n" not in message and ";" in message
    assert read >= 60


def test_edge_networks():
    assert read_network(EDGE / "lh.net.xml").left_hand
    hill = read_network(EDGE / "rh.net.xml")
    assert not hill.left_hand
    assert max(lane.shape[:, 2].max() for lane in hill.lanes.values()) == pytest.approx(20)


def test_geo_and_utm_logs_are_the_same_traffic():
    package("pyproj")
    network = DATA / "bologna_acosta" / "net.net.xml.gz"
    logs = {}
    for name in ("geo.xml.gz", "utm.xml.gz"):
        files = find_scenario(EDGE, network=network, trajectories=[EDGE / name])
        traces = read_scenario(files).traffic.traces
        logs[name] = {trace.key: trace for trace in traces}
    geo, utm = logs.values()
    assert len(geo) == 835 and set(geo) == set(utm)
    for key, trace in geo.items():
        np.testing.assert_allclose(trace.positions, utm[key].positions, atol=0.1)


@pytest.mark.parametrize("name", ["default.csv", "default.csv.gz", "default.parquet"])
def test_tables_equal_xml(name):
    if name.endswith("parquet"):
        package("pyarrow")
    expected = read_trajectories([EDGE / "default.xml.gz"])
    found = read_trajectories([EDGE / name])
    assert [t.key for t in found.traces] == [t.key for t in expected.traces]
    for trace, other in zip(found.traces, expected.traces, strict=True):
        np.testing.assert_array_equal(trace.times, other.times)
        np.testing.assert_allclose(trace.positions, other.positions, atol=0.0051)
        np.testing.assert_allclose(np.cos(trace.yaws - other.yaws), 1.0, atol=1e-6)


def test_minimal_log_is_put_onto_the_hill():
    files = find_scenario(EDGE, network=EDGE / "rh.net.xml", trajectories=[EDGE / "minimal.xml"])
    low = {t.key: t for t in read_scenario(files).traffic.traces}
    for trace in read_trajectories([EDGE / "default.xml.gz"]).traces:
        np.testing.assert_allclose(low[trace.key].positions[:, 2], trace.positions[:, 2], atol=0.6)


def test_types_of_the_edge_cases():
    types = read_vehicle_types([EDGE / "add.xml"])
    assert {t.id: (t.vclass, t.length) for t in types.values()} == {
        "car": ("passenger", 5),
        "bus": ("bus", 12),
        "bike": ("bicycle", 1.6),
        "tram": ("tram", 40),
    }
