"""Reading a scenario as a whole."""

import numpy as np
import pytest

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.model.traffic import ScenarioFiles, TypeGuess
from sumo3dviz_pt.sumo import find_scenario, read_scenario

HILLS = '<net><edge id="a"><lane id="a_0" shape="0,0,10 100,0,20"/></edge></net>'
FLAT = '<net><edge id="a"><lane id="a_0" shape="0,0 100,0"/></edge></net>'
ROW = '<{kind} id="{id}" x="{x}" y="0" angle="90" {more}/>'


def read(tmp_path, rows, *, net=HILLS, extra="", **window):
    (tmp_path / "n.net.xml").write_text(net, encoding="utf-8")
    steps = "".join(f'<timestep time="{t}">{row}</timestep>' for t, row in enumerate(rows))
    (tmp_path / "fcd.xml").write_text(f"<fcd-export>{steps}</fcd-export>", encoding="utf-8")
    (tmp_path / "a.add.xml").write_text(f"<additional>{extra}</additional>", encoding="utf-8")
    return read_scenario(find_scenario(tmp_path), **window)


def row(name="v", x=0.0, kind="vehicle", more=""):
    return ROW.format(kind=kind, id=name, x=x, more=more)


def test_every_trace_has_a_type(tmp_path):
    rows = [
        row(name="bare")
        + row(name="known", x=1, more='type="t"')
        + row(name="odd", x=2, more='type="nowhere"')
        + row(name="w", x=50, kind="person")
        + row(name="b", x=60, more='type="DEFAULT_BIKETYPE"')
    ]
    scenario = read(tmp_path, rows, extra='<vType id="t" vClass="bus"/>')
    classes = {t.id: scenario.vehicle_types[t.type_id].vclass for t in scenario.traffic.traces}
    assert classes == {
        "bare": "passenger",
        "known": "bus",
        "odd": "passenger",
        "w": "pedestrian",
        "b": "bicycle",
    }
    assert scenario.guesses == (TypeGuess("nowhere", 1),)


def test_log_without_z_is_put_onto_the_road(tmp_path):
    scenario = read(tmp_path, [row(x=x) for x in (0, 25, 100)])
    (trace,) = scenario.traffic.traces
    np.testing.assert_allclose(trace.positions[:, 2], [10, 12.5, 20], atol=0.11)
    np.testing.assert_array_equal(trace.positions[:, 0], [0, 25, 100])


def test_logged_heights_and_flat_networks_stay(tmp_path):
    logged = read(tmp_path, [row(x=5, more='z="11.25"')])
    assert logged.traffic.traces[0].positions[0, 2] == 11.25
    assert read(tmp_path, [row(x=5)], net=FLAT).traffic.traces[0].positions[0, 2] == 0


def test_window_and_objects(tmp_path):
    scenario = read(
        tmp_path,
        [row()] * 10,
        begin=2,
        end=4,
        extra='<poi id="p" x="1" y="2"/><poly id="q" shape="0,0 1,1"/>',
    )
    np.testing.assert_array_equal(scenario.traffic.traces[0].times, [2, 3, 4])
    assert (len(scenario.pois), len(scenario.polygons), scenario.signals) == (1, 1, {})


def test_log_of_another_network(tmp_path):
    with pytest.raises(InputError, match=r"the log does not lie on the network"):
        read(tmp_path, [row(x=450_000)])


def test_log_in_degrees(tmp_path):
    rows = [row(x=11.3 + t * 1e-4, more='speed="10"') for t in range(9)]
    with pytest.raises(InputError, match=r"written without --fcd-output.geo"):
        read(tmp_path, rows)
    assert read(tmp_path, [row(x=11.3, more='speed="0"')] * 9).traffic.traces


def test_empty_traffic_is_a_scenario(tmp_path):
    assert read(tmp_path, ["", ""]).traffic.traces == ()


def test_truncated_only_on_demand(tmp_path):
    read(tmp_path, [row()] * 3)
    log = tmp_path / "fcd.xml"
    log.write_text(log.read_text()[:-20])
    files = ScenarioFiles(network=tmp_path / "n.net.xml", trajectories=(log,))
    with pytest.raises(InputError, match="allow_truncated"):
        read_scenario(files)
    assert read_scenario(files, allow_truncated=True).traffic.end == 1
