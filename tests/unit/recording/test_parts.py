"""What a recording does beside running SUMO: rows near a vehicle, SUMO's words, heights."""

import gzip
import logging

import pytest

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.motion import MARGIN
from sumo3dviz_pt.recording.command import (
    _TAKEN_BACK,
    _when,
    arguments,
    edge_names,
    has_heights,
    read_settings,
)
from sumo3dviz_pt.recording.files import RecordOrder
from sumo3dviz_pt.recording.run import join_steps, keep_near, pass_on
from sumo3dviz_pt.sumo.fcd import read_trajectories

LOG = """<?xml version="1.0" encoding="UTF-8"?>
<!-- <timestep time="9"> what SUMO was told -->
<fcd-export>
    <timestep time="0.00">
        <vehicle id="a&amp;b" x="0.00" y="0.00" angle="0.00" type="t" speed="0.00"/>
        <vehicle id="far" x="30.00" y="41.00" angle="0.00" type="t" speed="0.00"/>
        <vehicle id="near" x="30.00" y="40.00" angle="0.00" type="t" speed="0.00"/>
    </timestep>
    <timestep time="0.00">
        <person id="p" x="0.00" y="50.00" angle="0.00" type="t" speed="0.00"/>
        <person id="q" x="0.00" y="50.10" angle="0.00" type="t" speed="0.00"/>
        <container id="c" x="-50.00" y="0.00" angle="0.00" type="t" speed="0.00"/>
    </timestep>
    <timestep time="1.00"/>
    <timestep time="2.00">
        <person id="p" x="0.00" y="0.00" angle="0.00" type="t" speed="0.00"/>
    </timestep>
</fcd-export>
"""


@pytest.fixture
def log(tmp_path):
    path = tmp_path / "fcd.xml.gz"
    path.write_bytes(gzip.compress(LOG.encode()))
    return path


def text_of(log):
    return gzip.decompress(log.read_bytes()).decode()


def test_near_a_vehicle_are_those_within_a_radius_while_it_is_there(log):
    keep_near(log, "a&b", radius=50.0)
    traces = read_trajectories([log]).traces
    found = {(trace.id, *trace.times) for trace in traces}
    assert found == {("a&b", 0.0), ("near", 0.0), ("p", 0.0), ("c", 0.0)}
    assert text_of(log).count("<timestep") == 3  # that nobody is there is known, too


@pytest.mark.parametrize(
    ("name", "said"),
    [("nobody", "no vehicle 'nobody' drives in this window"), ("p", "'p' drives.*is a person")],
)
def test_who_is_no_vehicle_cannot_be_followed(log, name, said):
    with pytest.raises(ConfigError, match=said):
        keep_near(log, name, radius=50.0)


def test_steps_in_two_elements_become_one(log):
    join_steps(log)
    text = text_of(log)
    assert text.count("<timestep") == 3
    assert [text.count(f"<{kind} ") for kind in ("vehicle", "person", "container")] == [3, 3, 1]


def test_warnings_are_told_once_each_with_a_count(caplog):
    lines = [f"Warning: Vehicle 'v.{k}' brakes on lane 'a_0', time={k}.50." for k in range(4)]
    lines += ["Warning: Environment variable SUMO_HOME is not set properly, ...", "Loading done."]
    lines += ["Warning: The file is odd,", "  and has two lines.", "", "Quitting"]
    with caplog.at_level(logging.WARNING):
        pass_on("\n".join(lines))
    assert [record.getMessage() for record in caplog.records] == [
        "SUMO warns: Vehicle 'v.0' brakes on lane 'a_0', time=0.50. (3 more of this kind)",
        "SUMO warns: The file is odd, and has two lines.",
    ]


def test_a_hundred_kinds_of_warnings_are_cut_short(caplog):
    with caplog.at_level(logging.WARNING):
        pass_on("\n".join(f"Warning: {'a' * k} is odd" for k in range(1, 101)))
    assert len(caplog.records) == 13
    assert "88 times, of 88 kinds" in caplog.records[-1].getMessage()


@pytest.mark.parametrize(
    ("shape", "high"),
    [
        ("0,0 10,0", False), ("0,0,0 10,0,0.00", False), ("0,0,-0.00 9,0,0", False),
        ("0,0,0 10,0,0.5", True), ("0,0,-4 10,0,0", True), ("", False),
    ],
)  # fmt: skip
def test_heights_are_those_of_lanes(tmp_path, shape, high):
    path = tmp_path / "net.net.xml"
    path.write_text(
        f'<net><edge id=":j_0"><lane id=":j_0_0" shape="0,0 1,1"/></edge>'
        f'<edge id="a&amp;b"><lane id="a_0" shape="{shape}"/></edge></net>'
    )
    assert has_heights(path) is high
    assert list(edge_names(path)) == [":j_0", "a&b"]


def test_orders_that_contradict_themselves(tmp_path):
    with pytest.raises(ConfigError, match="must be later than"):
        RecordOrder(tmp_path, start=5.0, end=5.0)
    with pytest.raises(ConfigError, match="either --around or --follow"):
        RecordOrder(tmp_path, around=(0.0, 0.0, 5.0), follow="a")
    with pytest.raises(ConfigError, match="a radius must be above 0 m"):
        RecordOrder(tmp_path, follow="a", radius=0.0)


def test_sumo_is_told_late_times_to_the_millisecond(tmp_path):
    """From 1e+06 s on it was told 1.23457e+06."""
    (tmp_path / "a.sumocfg").write_text('<configuration><net-file value="n"/></configuration>')
    order = RecordOrder(tmp_path, start=12_345_678.125, end=12_345_699.25)
    said = _when(read_settings(tmp_path / "a.sumocfg"), order)
    times = dict(zip(said[::2], map(float, said[1::2]), strict=True))
    assert times["--device.fcd.begin"] == order.start - MARGIN
    assert times["--end"] == order.end + MARGIN


def test_sumo_is_told_every_option_once(tmp_path):
    """SUMO refuses an option twice: a window, where the configuration had `device.fcd.begin`."""
    options = "".join(f'<{name} value="1"/>' for name in _TAKEN_BACK)
    path = tmp_path / "a.sumocfg"
    path.write_text(f'<configuration><net-file value="n"/>{options}</configuration>')
    settings = read_settings(path)
    for follow in (None, "a"):
        order = RecordOrder(tmp_path, start=50.0, end=60.0, follow=follow, seed=3)
        words = arguments(settings, order, tmp_path, "p_")
        names = [word for word in words if word.startswith("--")]
        assert len(names) == len(set(names)), names


def test_days_are_times_too(tmp_path):
    times = '<b value="1:00:00:30"/><end value="-1"/><H value="true"/>'
    text = f'<configuration><net-file value="n"/>{times}</configuration>'
    (tmp_path / "a.sumocfg").write_text(text)
    settings = read_settings(tmp_path / "a.sumocfg")
    assert settings.begin == 86_430.0 and settings.end is None
    assert settings.given >= {"net-file", "begin", "end", "human-readable-time"}
