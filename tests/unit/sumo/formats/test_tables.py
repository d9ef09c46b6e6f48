"""Vehicle logs as tables give the same as in XML."""

import gzip
import re

import numpy as np
import pytest
from needed import package

from sumo3dviz_pt.errors import InputError, MissingExtraError
from sumo3dviz_pt.sumo import find_scenario, read_roster, read_trajectories, whereabouts
from sumo3dviz_pt.sumo.find import vehicle_logs
from sumo3dviz_pt.sumo.formats import is_log
from sumo3dviz_pt.sumo.formats import table as parquet
from sumo3dviz_pt.sumo.guesses import TypesOfUsers

NAMES = ["time", "id", "x", "y", "z", "angle", "type", "speed", "pos", "lane", "edge", "slope"]
ROWS = [
    "0.00;ü/车;1.50;-2.00;0.00;90.00;car;4.00;1.50;a_0;;0.00",
    "0.00;walker;9.00;3.00;0.00;0.00;ped;1.00;2.00;;a;0.00",
    "0.00;box;8.00;4.00;0.00;0.00;DEFAULT_CONTAINERTYPE;0.00;2.00;;a;0.00",
    "1.00;ü/车;5.50;-2.00;0.50;45.00;car;4.10;5.50;a_0;;5.00",
    "1.00;walker;9.00;4.00;0.00;0.00;ped;1.00;3.00;;a;0.00",
    "2.00;;;;;;;;;;;",
    "3.00;ü/车;7.50;-2.00;0.50;45.00;bus;4.10;5.50;b_0;;5.00",
]
ELEMENTS = {
    "car": "vehicle",
    "bus": "vehicle",
    "ped": "person",
    "DEFAULT_CONTAINERTYPE": "container",
}


def heads(style):
    prefixes = {"plain": ("", ""), "tag": ("timestep_", "vehicle_")}
    prefixes["full"] = ("timestep_", "timestep_vehicle_")
    first, others = prefixes[style]
    return [f"{first}time", *(others + name for name in NAMES[1:])]


def text(rows=ROWS, style="tag", separator=";"):
    return "\n".join([separator.join(heads(style)), *(r.replace(";", separator) for r in rows), ""])


def write(tmp_path, content, name="log.csv"):
    path = tmp_path / name
    data = content.encode()
    path.write_bytes(gzip.compress(data) if name.endswith("gz") else data)
    return path


def write_xml(tmp_path, rows=ROWS):
    body, last = "", None
    for row in rows:
        cells = dict(zip(NAMES, row.split(";"), strict=True))
        time = cells.pop("time")
        if time != last:
            body += ("</timestep>" if last else "") + f'<timestep time="{time}">\n'
            last = time
        if cells["id"]:
            words = " ".join(f'{name}="{cell}"' for name, cell in cells.items() if cell)
            body += f"<{ELEMENTS[cells['type']]} {words}/>\n"
    path = tmp_path / "log.xml"
    path.write_text(f"<fcd-export>\n{body}</timestep>\n</fcd-export>", encoding="utf-8")
    return path


def write_parquet(tmp_path, rows=ROWS, style="tag", times=float):
    arrow = package("pyarrow")
    import pyarrow.parquet

    columns = [list(cells) for cells in zip(*(row.split(";") for row in rows), strict=True)]
    texts = {"id", "type", "lane", "edge"}
    table = {
        head: [None if not cell else times(cell) if name == "time"
               else cell if name in texts else float(cell) for cell in cells]
        for head, name, cells in zip(heads(style), NAMES, columns, strict=True)
    }  # fmt: skip
    path = tmp_path / "log.parquet"
    pyarrow.parquet.write_table(arrow.table(table), path)
    return path


def plain(log):
    return [
        (t.key, t.type_id, t.times.tolist(), t.positions.tolist(), t.yaws.tolist(),
         t.speeds.tolist(), t.lanes.tolist(), t.slopes.tolist(), t.offsets.tolist())
        for t in log.traces
    ] + [log.lane_names, log.begin, log.end, log.step]  # fmt: skip


@pytest.mark.parametrize("style", ["plain", "tag", "full"])
@pytest.mark.parametrize("separator", [";", ",", "\t", "|", "\\", ", "])
def test_csv_equals_xml(tmp_path, style, separator):
    path = write(tmp_path, text(style=style, separator=separator))
    expected = plain(read_trajectories([write_xml(tmp_path)]))
    assert is_log(path)
    assert plain(read_trajectories([path])) == expected
    assert [each[0] for each in expected[:4]] == [
        *("vehicle:ü/车", "person:walker", "container:box", "vehicle:ü/车")
    ]


@pytest.mark.parametrize("style", ["plain", "tag", "full"])
def test_parquet_equals_xml(tmp_path, style):
    path = write_parquet(tmp_path, style=style)
    assert is_log(path)
    assert plain(read_trajectories([path])) == plain(read_trajectories([write_xml(tmp_path)]))


def test_gzip_and_windows_are_the_same(tmp_path):
    path = write(tmp_path, text(), "log.csv.gz")
    expected = plain(read_trajectories([write_xml(tmp_path)], begin=1, end=1))
    assert plain(read_trajectories([path], begin=1, end=1))[:-3] == expected[:-3]
    other = write(tmp_path, text().replace("\n", "\r\n"))
    assert plain(read_trajectories([path])) == plain(read_trajectories([other]))


def test_quoted_tables_are_read(tmp_path):
    rows = ['"' + row.replace(";", '";"') + '"' for row in ROWS]
    path = write(
        tmp_path, '"' + text(rows).replace(";vehicle", '";"vehicle').replace("\n", '"\n', 1)
    )
    assert plain(read_trajectories([path])) == plain(
        read_trajectories([write(tmp_path, text(), "a")])
    )


def test_clock_times(tmp_path):
    rows = [re.sub("^1.00;", "1:00:00:01;", row) for row in ROWS[:5]]
    assert read_trajectories([write(tmp_path, text(rows))]).end == 86_401
    assert read_trajectories([write_parquet(tmp_path, rows, times=str)]).end == 86_401


def test_tags_tell_kinds_wherever_they_stand(tmp_path):
    """SUMO fills a person's cells one after the other, under the names of a vehicle's."""
    head = "time;id;x;y;angle;edge;signals;acceleration;tag\n"
    rows = "0;v;1;2;3;;8;1.0;vehicle\n0;p;1;3;3;a;;walking;person\n0;c;9;3;3;a;;waiting;container\n"
    log = read_trajectories([write(tmp_path, head + rows)])
    assert [trace.key for trace in log.traces] == ["vehicle:v", "person:p", "container:c"]
    assert [trace.signals[0] for trace in log.traces] == [8, -1, -1]


def test_mesoscopic_vehicles_are_no_persons(tmp_path):
    rows = [row.replace("a_0;", ";a") for row in ROWS[:1]]
    assert read_trajectories([write(tmp_path, text(rows))]).traces[0].kind == "vehicle"


def test_logs_of_persons_alone(tmp_path):
    people = [row for row in ROWS if ";;a;" in row]
    path = write(tmp_path, text(people).replace("vehicle_", "person_"))
    assert [t.kind for t in read_trajectories([path]).traces] == ["person", "container"]


def test_riders_are_left_out(tmp_path):
    rows = [*ROWS[:2], ROWS[1].replace("9.00;3.00", "1.50;-2.00").replace("walker", "rider")]
    ids = {t.id for t in read_trajectories([write(tmp_path, text(rows))]).traces}
    assert ids == {"ü/车", "walker"}


def test_rosters_and_whereabouts(tmp_path):
    logs = [write(tmp_path, text()), write_parquet(tmp_path), write_xml(tmp_path)]
    assert len({repr(read_roster([log], types=TypesOfUsers({}))) for log in logs}) == 1
    assert len({whereabouts([log], "person:walker").spans for log in logs}) == 1


def test_folders_are_searched_by_content(tmp_path):
    net = '<net><edge id="a"><lane id="a_0" shape="0,0 9,0"/></edge></net>'
    (tmp_path / "n").write_text(net, encoding="utf-8")
    (tmp_path / "notes.csv").write_text("time;sound\n1;loud\n", encoding="utf-8")
    people = [row for row in ROWS if ";;a;" in row]
    cars = [row for row in ROWS if ";;a;" not in row]
    first = write(tmp_path, text(people).replace("vehicle_", "person_"), "a.csv")
    second = write(tmp_path, text(cars), "b.txt")
    assert find_scenario(tmp_path).trajectories == (second, first)
    assert vehicle_logs((first, second)) == (second, first)


@pytest.mark.parametrize(
    ("row", "words"),
    [
        ("1.00;bad;1;2;0", "has 5 cells, and the header 12"),
        ("1.00;bad;nan;2;0;0;;1;1;a_0;;0", "x=.nan. must be a finite number"),
        ("1.00;bad;;2;0;0;;1;1;a_0;;0", "x=.. must be a finite number"),
        ("1.00;bad;1;2;0;0;;fast;1;a_0;;0", "speed=.fast. must be"),
        ("soon;bad;1;2;0;0;;1;1;a_0;;0", "time=.soon. must be seconds"),
    ],
)
def test_bad_rows_are_named(tmp_path, row, words):
    with pytest.raises(InputError, match=words) as caught:
        read_trajectories([write(tmp_path, text([*ROWS[:3], row]))])
    assert caught.value.line == 5


def test_tables_that_break_off(tmp_path):
    whole = text().encode()
    path = tmp_path / "log.csv"
    path.write_bytes(whole[:-20])
    with pytest.raises(InputError, match="breaks off after 2 complete time steps"):
        read_trajectories([path])
    assert read_trajectories([path], allow_truncated=True).end == 1
    (tmp_path / "log.csv.gz").write_bytes(gzip.compress(whole)[:-20])
    with pytest.raises(InputError, match="breaks off"):
        read_trajectories([tmp_path / "log.csv.gz"])


def test_tables_that_are_none(tmp_path):
    with pytest.raises(InputError, match=r"output\.column-header plain"):
        read_trajectories([write(tmp_path, "\n".join(["", *ROWS, ""]))])
    with pytest.raises(InputError, match="no time step"):
        read_trajectories([write(tmp_path, text([]))])
    broken = tmp_path / "log.parquet"
    broken.write_bytes(write_parquet(tmp_path).read_bytes()[:-100])
    with pytest.raises(InputError, match="breaks off"):
        read_trajectories([broken])


def test_a_missing_package_is_named(tmp_path, monkeypatch):
    path = write_parquet(tmp_path)

    def missing():
        raise MissingExtraError("vehicle logs in Parquet need pyarrow", extra="parquet")

    monkeypatch.setattr(parquet, "_arrow", missing)
    assert is_log(path)
    with pytest.raises(MissingExtraError, match=r"pip install .*\[parquet\]"):
        read_trajectories([path])


def test_many_rows_of_many_steps(tmp_path):
    """More rows than are packed at once."""
    count, steps = 70, 400
    rows = [
        f"{t / 10:.2f};v{n};{n}.00;{t}.00;0.00;0.00;car;1.00;1.00;a_{n % 3};;0.00"
        for t in range(steps)
        for n in range(count)
    ]
    log = read_trajectories([write(tmp_path, text(rows))])
    assert len(log.traces) == count
    for number, trace in enumerate(log.traces):
        np.testing.assert_array_equal(trace.positions[:, 0], number)
        np.testing.assert_array_equal(trace.positions[:, 1], np.arange(steps))


def test_an_endless_line_is_refused_before_memory_ends(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("time;id;x;y;angle\n0;a;1;2;3\n0;" + "b" * (3 << 20))
    with pytest.raises(InputError, match=r"a.csv:3: the line is longer than 1 MB"):
        read_trajectories([path])
