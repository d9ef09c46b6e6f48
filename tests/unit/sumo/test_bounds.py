"""Numbers and counts of SUMO's files beyond what anything real has are refused by name."""

import gzip
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from damage import NETWORK, OBJECTS, SIGNALS, TYPES, log_text, write_town

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.model.traffic import ScenarioFiles
from sumo3dviz_pt.sumo import read_scenario, values
from sumo3dviz_pt.sumo.values import parse_points

LONG = "9" * 5000

NETWORKS = {
    "connection from nowhere": ('from="w" to="e"', 'from="x" to="e"', 'no lane "x_1"'),
    "connection to nowhere": ('to="s" fromLane="1"', 'to="z" fromLane="1"', 'no lane "z_0"'),
    "via nowhere": ('via=":m_0_0"', 'via=":m_9_0"', 'no lane ":m_9_0"'),
    "junction's lanes": ('incLanes="e_0"', 'incLanes="e_7"', 'junction "b": the network has no'),
    "edge twice": ('<edge id="s" ', '<edge id="e" ', 'edge "e": the id stands twice'),
    "lane twice": ('<lane id="w_1"', '<lane id="w_0"', 'lane "w_0": the id stands twice'),
    "junction twice": ('<junction id="c"', '<junction id="b"', "the id stands twice"),
    "index twice": ('id="w_1" index="1"', 'id="w_1" index="0"', "have the same index"),
    "no lane": ('<lane id="s_0"', '<line id="s_0"', 'the network has no lane "s_0"'),
    "length below 0": ('length="54.00"', 'length="-1e7"', 'length="-1e7" must lie from -1000000'),
    "length endless": ('length="54.00"', 'length="1e300"', 'length="1e300" must lie'),
    "width": ('width="3.20"', 'width="1e12"', 'width="1e12" must lie from -1 to 200 m'),
    "speed": ('speed="8.33"', 'speed="-1"', 'speed="-1" must lie from 0 to 1000 m/s'),
    "index": ('index="1"', 'index="1e12"', 'index="1e12" must lie from 0 to 10000'),
    "half an index": ('index="1"', 'index="0.5"', 'index="0.5" must be a whole number'),
    "priority": ('priority="2"', f'priority="{LONG}"', "must be a finite number"),
    "link index": ('linkIndex="1"', 'linkIndex="1e9"', 'linkIndex="1e9" must lie'),
    "shape off the Earth": ("1.60,-60.00", "1.60,-6e9", "'1.60,-6e9' lies off the Earth"),
    "height": ("60.00,-1.60,0.50", "60.00,-1.60,1e6", "lies off the Earth"),
    "junction's size": ("5.00,0.00 5.00,-3.20", "5.00,0.00 5e6,1e6", "shape is 5,000 km across"),
    "lane's size": ('shape="-120.00,-1.60', 'shape="1e6,-1.60', "the shape is 1,000 km long"),
    "no number": ("1.60,-60.00", "1.60,south", "'1.60,south' is not a point"),
    "5000 digits": ("1.60,-60.00", f"1.60,{LONG}", "...' is not a point"),
    "junction's place": ('x="-120.00"', 'x="1e300"', 'x="1e300" must lie from -20000000'),
    "location": ("-430000.00,-4580000.00", "nan,0", 'netOffset="nan,0" must be 2 numbers'),
}


def town(folder, name, text):
    """The scenario's files with one of them changed."""
    write_town(folder)
    (folder / name).write_text(text, encoding="utf-8")
    return ScenarioFiles(
        folder / "net.net.xml",
        (folder / "fcd.xml",),
        (folder / "tls.xml",),
        (folder / "objects.add.xml",),
        (folder / "types.rou.xml",),
    )


def complaint(folder, name, text):
    with pytest.raises(InputError) as caught:
        read_scenario(town(folder, name, text))
    said = str(caught.value)
    assert name in said and "\n" not in said and len(said) < 400 + len(str(folder))
    return caught.value


def test_the_town_itself_is_fine(tmp_path):
    assert len(read_scenario(town(tmp_path, "a", "")).traffic.traces) == 4


@pytest.mark.parametrize("name", NETWORKS)
def test_networks(name, tmp_path):
    old, new, words = NETWORKS[name]
    assert old in NETWORK
    error = complaint(tmp_path, "net.net.xml", NETWORK.replace(old, new, 1))
    assert words in str(error) and error.line is not None


def shape(points):
    return " ".join(f"{x:.2f},{y:.2f}" for x, y in points)


def test_shapes_without_end(tmp_path):
    tangle = shape(np.random.default_rng(1).uniform(-150, 150, (3000, 2)))
    for name, text, old in (
        ("net.net.xml", NETWORK, "1.60,-6.00 1.60,-60.00"),
        ("net.net.xml", NETWORK, "120.00,-3.20 120.00,0.00"),
        ("objects.add.xml", OBJECTS, "10.00,-8.00 40.00,-8.00 40.00,-20.00"),
    ):
        error = complaint(tmp_path, name, text.replace(old, tangle))
        assert "these go to and fro" in str(error) and error.element
    many = shape([(k, 0) for k in range(values.MOST_POINTS + 1)])
    error = complaint(tmp_path, "objects.add.xml", OBJECTS.replace("-40.00,4.00 -20.00,4.00", many))
    assert f"at most {values.MOST_POINTS} can be drawn" in str(error)


def test_long_shapes_of_roads_stay():
    turn = np.linspace(0.0, 12 * np.pi, 900)
    helix = np.column_stack([20 * np.cos(turn), 20 * np.sin(turn)])
    assert len(parse_points(shape(helix))) == 900


def test_more_roads_than_there_are(tmp_path):
    lanes = "".join(
        f'<edge id="l{k}"><lane id="l{k}_0" index="0" length="1e6" shape="-1e7,{k} 1e7,{k}"/>'
        "</edge>"
        for k in range(12)
    )
    error = complaint(tmp_path, "net.net.xml", NETWORK.replace("</net>", lanes + "</net>"))
    assert "all lanes together are 240," in str(error) and "cut the network" in str(error)


LOGS = {
    "time": ('time="5.00"', 'time="1e300"', 'time="1e300" must be seconds, h:m:s or d:h:m:s, from'),
    "x": ('x="-15.00"', 'x="1e300"', 'x="1e300" cannot be: from -20000000 to 20000000 m'),
    "angle": ('angle="90.00"', 'angle="1e6"', 'angle="1e6" cannot be: from -3600 to 3600'),
    "slope": ('slope="0.00"', 'slope="1e300"', 'slope="1e300" cannot be'),
    "signals": ('signals="8"', f'signals="{"9" * 300}"', "cannot be: from -1 to 2147483647"),
    "5000 digits": ('signals="8"', f'signals="{LONG}"', "must be a finite number"),
}


@pytest.mark.parametrize("name", LOGS)
def test_logs(name, tmp_path):
    old, new, words = LOGS[name]
    error = complaint(tmp_path, "fcd.xml", log_text().replace(old, new, 1))
    assert words in str(error) and error.line is not None


@pytest.mark.parametrize("value", ["1e300", "-1073741824.00", "nan", "inf"])
def test_impossible_speeds_and_places_on_lanes_count_as_none(value, tmp_path):
    text = (
        log_text()
        .replace('speed="9.00"', f'speed="{value}"')
        .replace('pos="', f'pos="{value}" o="')
    )
    traces = read_scenario(town(tmp_path, "fcd.xml", text)).traffic.traces
    driving = [trace for trace in traces if trace.kind == "vehicle"]
    assert all(np.isnan(trace.speeds).all() for trace in driving)
    limit = values.COORDINATE.high
    assert all((np.isnan(t.offsets) | (np.abs(t.offsets) <= limit)).all() for t in driving)


TYPE_CASES = {
    "length": ('length="4.6"', 'length="1e300"', 'length="1e300" must lie from 0.01 to 5000 m'),
    "height": ('height="1.5"', 'height="inf"', 'height="inf" must be a finite number'),
    "carriage": ('carriageLength="9.5"', 'carriageLength="1e-9"', "must lie from 2 to 5000 m"),
    "locomotive": ('locomotiveLength="10"', 'locomotiveLength="x"', "must be a finite number"),
    "gap": ('carriageGap="0.5"', 'carriageGap="1e9"', "must lie from 0 to 100 m"),
    "param": ('key="a" value="b"', 'key="carriageLength" value="0.01"', "must lie from 2 to 5000"),
}


@pytest.mark.parametrize("name", TYPE_CASES)
def test_types(name, tmp_path):
    old, new, words = TYPE_CASES[name]
    assert words in str(complaint(tmp_path, "types.rou.xml", TYPES.replace(old, new, 1)))


OBJECT_CASES = {
    "place": ('x="-20.00"', 'x="1e300"', 'poi "t0": x="1e300" must lie'),
    "angle": ('angle="30"', 'angle="1e300"', "must lie from -3600 to 3600 degrees"),
    "stop": ('startPos="20"', 'startPos="1e300"', 'startPos="1e300" must lie'),
}


@pytest.mark.parametrize("name", OBJECT_CASES)
def test_objects(name, tmp_path):
    old, new, words = OBJECT_CASES[name]
    assert words in str(complaint(tmp_path, "objects.add.xml", OBJECTS.replace(old, new, 1)))


@pytest.mark.parametrize(
    ("state", "words"),
    [("G?", "holds '?'"), ("G名", "holds '名'"), ("G" * 500 + "q", "holds 'q'")],
)
def test_odd_letters_of_signals(state, words, tmp_path):
    error = complaint(tmp_path, "tls.xml", SIGNALS.replace('state="GG"', f'state="{state}"', 1))
    assert words in str(error) and "each letter is one of rugGyYsoO" in str(error)
    assert error.line == 2


def test_long_ids_are_cut_in_messages(tmp_path):
    text = NETWORK.replace('<lane id="s_0"', f'<lane id="{"s" * 4000}"').replace("54.00", "1e9", 1)
    assert "sss..." in str(complaint(tmp_path, "net.net.xml", text))


def test_entities_do_not_explode(tmp_path):
    """Nine entities of nine each are a few hundred bytes, and a gigabyte when written out."""
    lines = ['<!ENTITY a "aaaaaaaaaa">']
    for one, other in zip("abcdefgh", "bcdefghi", strict=True):
        lines.append(f'<!ENTITY {other} "{f"&{one};" * 10}">')
    head = "<!DOCTYPE net [" + "".join(lines) + "]>"
    tracemalloc.start()
    complaint(tmp_path, "net.net.xml", head + '<net><edge id="&i;"/></net>')
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 100e6


def test_logs_of_zeros_are_no_xml(tmp_path):
    path = tmp_path / "log.xml"
    path.write_bytes(gzip.compress(bytes(1 << 24)))
    files = ScenarioFiles(Path(town(tmp_path, "a", "").network), (path,), (), (), ())
    with pytest.raises(InputError, match=r"log\.xml"):
        read_scenario(files)
