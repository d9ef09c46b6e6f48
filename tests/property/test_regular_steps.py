"""A vehicle log gives the same traces, or the same error, with and without the quick reader."""

import gzip

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.sumo import read_trajectories
from sumo3dviz_pt.sumo.formats import xml

IDS = st.text(alphabet="ab_ü车/#[1]", min_size=1, max_size=3)
NUMBERS = st.one_of(
    st.integers(-99999, 99999).map(lambda number: f"{number / 100:.2f}"),
    st.sampled_from(["7", "1e2", "-0.00", " 3 "]),
)
ODD = st.sampled_from(
    [
        ("", ""),  # nothing
        ("/>", "></vehicle>"),
        ("<person", "<!-- </timestep> --><person"),
        ('x="', 'x = "'),
        ("\n", "\r\n"),
        ("\n        ", " "),
        ('id="', 'id="&amp;'),
        ("<vehicle", '<param key="a" value="b"/><vehicle'),
        (" y=", ' y="1" y='),
        ('angle="', 'angle="nan'),
        ("signals", "waiting"),
        ("</timestep>", "</timestep><timestep time='99'/>"),
        ("    <timestep", "<![CDATA[<timestep]]><timestep"),
        ("</timestep>", ""),
        ("</fcd-export>", ""),
        ('"/>', '"'),
        ('x="', 'x="a<'),
        ('type="', 'type="a\n'),
        ('speed="', 'speed="\x01'),
    ]
)


@st.composite
def rows(draw):
    kind = draw(st.sampled_from(["vehicle", "vehicle", "person", "container"]))
    number = lambda: draw(NUMBERS)  # noqa: E731
    text = f'        <{kind} id="{draw(IDS)}" x="{number()}" y="{number()}" angle="{number()}"'
    text += f' type="{draw(st.sampled_from(["car", ""]))}" speed="{number()}"'
    if kind == "vehicle":
        text += f' lane="{draw(IDS)}_0" signals="{draw(st.integers(-1, 9))}"'
    else:
        text += f' edge="{draw(IDS)}" vehicle="{draw(st.sampled_from(["", "bus"]))}"'
        text += f' stage="{draw(st.sampled_from(["driving", "walking"]))}"'
    return text + "/>\n"


@st.composite
def logs(draw):
    text = '<?xml version="1.0" encoding="UTF-8"?>\n<!-- by SUMO\n<a/> -->\n<fcd-export>\n'
    for time in range(draw(st.integers(0, 5))):
        body = "".join(draw(st.lists(rows(), max_size=5)))
        step = f'    <timestep time="{time}.00">\n{body}    </timestep>\n'
        if not body and draw(st.booleans()):
            step = f'    <timestep time="{time}.00"/>\n'
        old, new = draw(ODD) if draw(st.integers(0, 3)) == 0 else ("", "")
        text += step.replace(old, new, 1) if old else step
    return text + draw(st.sampled_from(["</fcd-export>\n", "", "<oops"]))


def outcome(path, **window):
    """What reading gives, as plain values."""
    try:
        log = read_trajectories([path], **window)
    except InputError as error:
        return str(error)
    traces = [
        (
            *(trace.key, trace.type_id, trace.times.tolist(), trace.positions.tolist()),
            *(trace.yaws.tolist(), str(trace.speeds.tolist()), trace.lanes.tolist()),
            *(trace.signals.tolist(), trace.slopes.tolist(), str(trace.offsets.tolist())),
        )
        for trace in log.traces
    ]
    return traces, log.lane_names, log.begin, log.end, log.step


@settings(max_examples=60, deadline=None)
@given(
    text=logs(),
    begin=st.sampled_from([None, 0, 2]),
    end=st.sampled_from([None, 3]),
    truncated=st.booleans(),
    packed=st.booleans(),
)
def test_both_ways_agree(tmp_path_factory, text, begin, end, truncated, packed):
    path = tmp_path_factory.mktemp("log") / "log.xml"
    path.write_bytes(gzip.compress(text.encode(), 1) if packed else text.encode())
    window = {"begin": begin, "end": end, "allow_truncated": truncated}
    quick = outcome(path, **window)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(xml.RegularSteps, "_rows", lambda *_: None)
        slow = outcome(path, **window)
    assert quick == slow


@pytest.mark.parametrize("size", [1, 7, 50, 333])
def test_chunks_of_any_size_give_the_same(tmp_path, size):
    steps = "".join(
        f'    <timestep time="{t}.00">\n'
        + "".join(f'        <vehicle id="v{n}" x="{t}" y="{n}" angle="0"/>\n' for n in range(t % 4))
        + "    </timestep>\n"
        for t in range(9)
    )
    text = f"<fcd-export>\n{steps}</fcd-export>\n".encode()
    taken = []

    class Sink(xml.ElementSink):
        def take(self, tag, attributes):
            taken.append((self.sieve.line, attributes.get("time") or attributes["id"]))

        def take_rows(self, rows):
            names = rows.columns["id"]
            taken.extend((rows.line_of(at), name) for at, name in enumerate(names))

    sink = Sink()
    sink.sieve = sieve = xml.RegularSteps(sink)
    left = b"".join(
        part for at in range(0, len(text), size) for part in sieve.left(text[at : at + size])
    )
    left += b"".join(sieve.rest())
    assert left.split() == [b"<fcd-export>", b"</fcd-export>"]
    lines = text.decode().splitlines()
    assert [line for line, _ in taken] == sorted({line for line, _ in taken})
    assert all(name in lines[line - 1] for line, name in taken)
    assert len(taken) == sum(1 for line in lines if "=" in line)


def test_steps_that_sumo_writes_are_read_quickly(tmp_path, monkeypatch):
    """The parser sees no row, whatever the mixture of kinds."""
    row = '        <{} id="i{}" x="{}" y="2.00" angle="0.00" lane="a_0"/>\n'
    kinds = ["vehicle", "person", "vehicle", "container", "vehicle", "person"]
    body = "".join(row.format(kind, n, n) for n, kind in enumerate(kinds))
    step = '    <timestep time="{}.00">\n{}    </timestep>\n'
    text = "".join(step.format(t, body if t % 3 else "") for t in range(6))
    path = tmp_path / "log.xml"
    path.write_text(f"<fcd-export>\n{text}</fcd-export>", encoding="utf-8")
    found = []
    original = xml.RegularSteps._rows

    def watched(self, data, line):
        found.append(original(self, data, line))
        return found[-1]

    monkeypatch.setattr(xml.RegularSteps, "_rows", watched)
    log = read_trajectories([path])
    assert len(found) == 6 and None not in found
    assert len(log.traces) == 6
    np.testing.assert_array_equal(log.traces[0].times, [1, 2, 4, 5])
