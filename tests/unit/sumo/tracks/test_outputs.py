"""SUMO's other outputs tell the same traffic as its vehicle log."""

from __future__ import annotations

import gzip
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.model.traffic import TableChoices, Trace
from sumo3dviz_pt.pipeline.production import example
from sumo3dviz_pt.sumo import find_scenario
from sumo3dviz_pt.sumo.fcd import read_trajectories
from sumo3dviz_pt.sumo.network import network_of
from sumo3dviz_pt.sumo.signals import read_signals
from sumo3dviz_pt.sumo.tracks import in_sumos_form

_FOLDER = example("crossing").parent
_NETWORK = _FOLDER / "crossing.net.xml.gz"
_SIGNALS = _FOLDER / "signals.xml.gz"
BEGIN, END = 440.0, 460.0


@pytest.fixture(scope="module")
def steps() -> list[ElementTree.Element]:
    """The steps of some seconds of the example's log."""
    root = ElementTree.fromstring(gzip.decompress((_FOLDER / "fcd.xml.gz").read_bytes()))
    return [step for step in root if BEGIN <= float(step.get("time", "")) <= END]


@pytest.fixture(scope="module")
def truth() -> dict[str, Trace]:
    log = read_trajectories([_FOLDER / "fcd.xml.gz"], begin=BEGIN, end=END)
    return {trace.key: trace for trace in log.traces}


def _full(folder: Path, steps: list[ElementTree.Element]) -> Path:
    """As `--full-output` writes it, with the lights of every step."""
    lights = {}
    for state in ElementTree.fromstring(gzip.decompress(_SIGNALS.read_bytes())):
        lights.setdefault(float(state.get("time", "")), []).append(state)
    text = ["<full-export>"]
    for step in steps:
        time = step.get("time", "")
        rows = {kind: [e for e in step if e.tag == kind] for kind in ("vehicle", "person")}
        text.append(f'<data timestep="{time}">')
        for kind, own in rows.items():
            text.append(f"<{kind}s>")
            text += [ElementTree.tostring(each, encoding="unicode") for each in own]
            text.append(f"</{kind}s>")
        text.append('<edges><edge id="a"><lane id="a_0" vehicle_count="0"/></edge></edges><tls>')
        for state in lights.get(float(time), ()):
            text.append(f'<trafficlight id="{state.get("id")}" state="{state.get("state")}"/>')
        text.append("</tls></data>")
    file = folder / "full.xml"
    file.write_text("\n".join([*text, "</full-export>"]), encoding="utf-8")
    return file


def _emissions(folder: Path, steps: list[ElementTree.Element]) -> Path:
    """As `--emission-output` writes it: vehicles only."""
    text = ["<emission-export>"]
    for step in steps:
        text.append(f'<timestep time="{step.get("time")}">')
        text += [ElementTree.tostring(e, encoding="unicode") for e in step if e.tag == "vehicle"]
        text.append("</timestep>")
    file = folder / "emissions.xml"
    file.write_text("\n".join([*text, "</emission-export>"]), encoding="utf-8")
    return file


def _lanes(folder: Path, steps: list[ElementTree.Element]) -> Path:
    """As `--netstate-dump` writes it: places along lanes."""
    text = ["<netstate>"]
    for step in steps:
        text.append(f'<timestep time="{step.get("time")}">')
        for each in (e for e in step if e.tag == "vehicle"):
            lane = each.get("lane", "")
            edge = lane.rpartition("_")[0]
            text.append(
                f'<edge id="{edge}"><lane id="{lane}"><vehicle id="{each.get("id")}"'
                f' pos="{each.get("pos")}" speed="{each.get("speed")}"/></lane></edge>'
            )
        text.append("</timestep>")
    file = folder / "lanes.xml"
    file.write_text("\n".join([*text, "</netstate>"]), encoding="utf-8")
    return file


@pytest.mark.parametrize("write", [_full, _emissions])
def test_outputs_with_places_are_logs(tmp_path, steps, truth, write):
    log = read_trajectories([write(tmp_path, steps)])
    assert {t.key for t in log.traces} == {
        key for key in truth if write is _full or key.startswith("vehicle")
    }
    for trace in log.traces:
        own = truth[trace.key]
        inside = (own.times >= BEGIN) & (own.times <= END)
        np.testing.assert_array_equal(trace.positions, own.positions[inside])
        np.testing.assert_array_equal(trace.yaws, own.yaws[inside])


def test_full_output_has_signals(tmp_path, steps):
    file = _full(tmp_path, steps)
    files = in_sumos_form(_NETWORK, [file], TableChoices())
    assert files.signals == (file,)
    network = network_of(_NETWORK)
    told, logged = read_signals([file], network), read_signals([_SIGNALS], network)
    for name, phases in logged.items():
        at = {
            t: phases.states[np.searchsorted(phases.times, t, side="right") - 1]
            for t in (445.0, 452.0, 459.0)
        }
        own = told[name]
        for time, state in at.items():
            assert own.states[np.searchsorted(own.times, time, side="right") - 1] == state


def test_places_along_lanes_are_places(tmp_path, steps, truth):
    """Within .6 m of the log, which has who changes lanes between them."""
    files = in_sumos_form(_NETWORK, [_lanes(tmp_path, steps)], TableChoices())
    log = read_trajectories(files.trajectories)
    assert len(log.traces) > 5
    off, turned = [], []
    for trace in log.traces:
        own = truth[trace.key]
        inside = (own.times >= BEGIN) & (own.times <= END)
        off += np.linalg.norm(trace.positions - own.positions[inside], axis=1).tolist()
        turned += np.abs(np.angle(np.exp(1j * (trace.yaws - own.yaws[inside])))).tolist()
    assert np.quantile(off, 0.9) < 0.1 and np.median(turned) < np.radians(1.0)


def test_a_lane_of_another_network_is_named(tmp_path, steps):
    file = _lanes(tmp_path, steps)
    file.write_text(
        file.read_text(encoding="utf-8").replace('lane id="', 'lane id="x'), encoding="utf-8"
    )
    with pytest.raises(InputError, match=r"lanes.xml:\d+: .*no lane 'x"):
        in_sumos_form(_NETWORK, [file], TableChoices())


def test_places_along_lanes_are_read_by_name(tmp_path, steps):
    (tmp_path / "net.net.xml.gz").write_bytes(_NETWORK.read_bytes())
    file = _lanes(tmp_path, steps)
    assert [made.table for made in find_scenario(file).tables] == [file]


def test_a_folder_with_one_output_is_a_scenario(tmp_path, steps):
    """The vehicle log wins where there is one."""
    (tmp_path / "net.net.xml.gz").write_bytes(_NETWORK.read_bytes())
    file = _full(tmp_path, steps)
    assert find_scenario(tmp_path).trajectories == (file,)
    (tmp_path / "fcd.xml.gz").write_bytes((_FOLDER / "fcd.xml.gz").read_bytes())
    assert find_scenario(tmp_path).trajectories == (tmp_path / "fcd.xml.gz",)
    assert find_scenario(file).trajectories == (file,)
