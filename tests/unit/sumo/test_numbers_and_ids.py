"""Numbers are written in ASCII and ids are not empty, wherever SUMO's files hold them.

Python reads digits of any script, and `1_0` as ten; SUMO does neither.
"""

import pytest

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.sumo import read_network, read_trajectories
from sumo3dviz_pt.sumo.belonging import first_rows
from sumo3dviz_pt.sumo.stream import Element
from sumo3dviz_pt.sumo.values import parse_colour, parse_number, parse_points, parse_time

ODD = {"arabic": "١", "wide": "１", "underscore": "1_0", "space": "1 0"}
ROW = {"id": "a", "x": "1", "y": "2", "z": "0", "angle": "90", "type": "car", "speed": "5"}
ROW |= {"pos": "1", "lane": "e_0", "slope": "0", "signals": "0"}
NUMBERS = ("x", "y", "z", "angle", "speed", "pos", "slope", "signals")


def attributes(row):
    return " ".join(f'{name}="{value}"' for name, value in row.items())


def regular(rows):
    body = "\n".join(f"        <vehicle {attributes(row)}/>" for row in rows)
    return f'<fcd-export>\n    <timestep time="0.00">\n{body}\n    </timestep>\n</fcd-export>\n'


def parsed(rows):
    return regular(rows).replace("<fcd-export>", "<fcd-export><!-- read row by row -->")


def table(rows):
    lines = [";".join(["0", *row.values()]) for row in rows]
    return "\n".join([";".join(["time", *ROW]), *lines, ""])


FORMS = {"regular.xml": regular, "parsed.xml": parsed, "table.csv": table}


def read(folder, form, *rows):
    path = folder / form
    path.write_text(FORMS[form](rows), encoding="utf-8")
    return read_trajectories([path])


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("odd", ODD.values(), ids=ODD)
def test_rows_of_a_log(tmp_path, form, odd):
    good = ROW | {"id": "ü١_1", "x": "-7e1", "type": "Ünal_١", "lane": "straße_١_0"}
    (trace,) = read(tmp_path, form, good).traces
    assert (trace.id, trace.positions[0, 0]) == ("ü١_1", -70.0)
    for name in NUMBERS:
        with pytest.raises(InputError, match=rf'{form}:\d: vehicle "a": {name}="{odd}"'):
            read(tmp_path, form, good, ROW | {name: odd})


@pytest.mark.parametrize("form", FORMS)
def test_a_road_user_without_a_name(tmp_path, form):
    with pytest.raises(InputError, match=rf"{form}:\d: .*the id is empty"):
        read(tmp_path, form, ROW, ROW | {"id": ""}, ROW | {"id": "b"})


@pytest.mark.parametrize("odd", ODD.values(), ids=ODD)
def test_values(tmp_path, odd):
    wrong = {
        parse_number: odd,
        parse_time: f"0:{odd}:0",
        parse_points: f"1,2 3,{odd.replace(' ', 'x')}",
        parse_colour: f"0.5,{odd},0.5",
    }
    for reader, text in wrong.items():
        with pytest.raises(ValueError, match=r"not a|could not"):
            reader(text)
    with pytest.raises(InputError, match=r'k="1.?.?" must be|must be a finite number'):
        Element("e", {"k": odd}, 0, tmp_path, 1).number("k")
    time = regular([ROW]).replace('time="0.00"', f'time="{odd}"')
    (tmp_path / "t.xml").write_text(time, encoding="utf-8")
    with pytest.raises(InputError, match=f'time="{odd}"'):
        read_trajectories([tmp_path / "t.xml"])


def test_the_first_rows_are_read_as_all_are(tmp_path):
    path = tmp_path / "a.xml"
    path.write_text(regular([ROW | {"x": "١"}, ROW]), encoding="utf-8")
    assert len(first_rows(path).places) == 1


@pytest.mark.parametrize("tag", ["edge", "lane", "junction"])
def test_a_network_with_an_empty_id(tmp_path, tag):
    text = (
        '<net><edge id="e"><lane id="e_0" index="0" speed="9" length="9" shape="0,0 9,0"/></edge>'
        '<junction id="j" type="dead_end" x="0" y="0" incLanes="" shape="0,0 1,1"/></net>'
    )
    path = tmp_path / "a.net.xml"
    path.write_text(text, encoding="utf-8")
    read_network(path)
    path.write_text(
        text.replace(f'{tag} id="{"e_0" if tag == "lane" else tag[0]}"', f'{tag} id=""')
    )
    with pytest.raises(InputError, match=rf'{tag} "": the id is empty'):
        read_network(path)
