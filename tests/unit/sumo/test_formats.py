"""A format of vehicle logs is added in one place: a class, and its entry in `FORMATS`."""

import numpy as np
import pytest

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.sumo import formats, read_roster, read_trajectories, whereabouts
from sumo3dviz_pt.sumo.belonging import first_rows
from sumo3dviz_pt.sumo.find import survey_files, vehicle_logs
from sumo3dviz_pt.sumo.formats import LogFormat
from sumo3dviz_pt.sumo.guesses import TypesOfUsers
from sumo3dviz_pt.sumo.stream import Element, TruncatedError

XML = (
    '<fcd-export>\n<timestep time="{time}">\n'
    '<{kind} id="a&amp;b" x="1" y="2" angle="90" speed="4" lane="e_0"/>\n</timestep>\n</fcd-export>'
)


class WordsFormat(LogFormat):
    """A line of words for each row: time, kind, then attributes; a last line says `end`."""

    def recognises(self, file):
        return file.read_bytes().startswith(b"words\n")

    def elements(self, file):
        now = None
        lines = file.read_text(encoding="utf-8").splitlines()
        for line, text in enumerate(lines[1:], start=2):
            if text == "end":
                return
            time, kind, *words = text.split()
            if time != now:
                now = time
                yield Element("timestep", {"time": time}, 1, file, line)
            yield Element(kind, dict(word.split("=") for word in words), 2, file, line)
        raise TruncatedError("the file ends in the middle", file=file, line=len(lines))


@pytest.fixture(autouse=True)
def words(monkeypatch):
    monkeypatch.setattr(formats, "FORMATS", (WordsFormat(), *formats.FORMATS))


def write(tmp_path, *rows, name="log.txt", end="end"):
    path = tmp_path / name
    path.write_text("\n".join(["words", *rows, end]), encoding="utf-8")
    return path


def row(time, x, kind="vehicle", rest=""):
    return f"{time} {kind} id=a&b x={x} y=2 angle=90 speed=4 lane=e_0 {rest}"


def write_xml(tmp_path, name="log.xml", **values):
    path = tmp_path / name
    path.write_text(XML.format(**{"time": 0, "kind": "vehicle"} | values), encoding="utf-8")
    return path


def test_its_rows_become_traces(tmp_path):
    path = write(tmp_path, *(row(time, 4 * time) for time in range(5)))
    traffic = read_trajectories([path], begin=1, end=3)
    (trace,) = traffic.traces
    np.testing.assert_array_equal(trace.times, [1, 2, 3])
    np.testing.assert_array_equal(trace.positions[:, 0], [4, 8, 12])
    assert (trace.key, traffic.lane_names) == ("vehicle:a&b", ("e_0",))


def test_both_formats_give_the_same(tmp_path):
    logs = write(tmp_path, row(0, 1)), write_xml(tmp_path)
    one, other = (read_trajectories([log]) for log in logs)
    np.testing.assert_array_equal(one.traces[0].positions, other.traces[0].positions)
    assert one.lane_names == other.lane_names
    assert first_rows(logs[0]) == first_rows(logs[1])
    assert read_roster([logs[0]], types=TypesOfUsers({})) == read_roster(
        [logs[1]], types=TypesOfUsers({})
    )
    assert whereabouts([logs[0]], "a&b") == whereabouts([logs[1]], "a&b")


def test_both_formats_are_read_together(tmp_path):
    logs = write(tmp_path, row(0, 1)), write_xml(tmp_path, time=1)
    (trace,) = read_trajectories(logs).traces
    np.testing.assert_array_equal(trace.times, [0, 1])


def test_errors_name_its_lines(tmp_path):
    path = write(tmp_path, row(0, 1), row(1, "nan"))
    with pytest.raises(InputError, match='x="nan" must be a finite number') as caught:
        read_trajectories([path])
    assert (caught.value.file, caught.value.line) == (path, 3)


def test_a_log_that_breaks_off(tmp_path):
    path = write(tmp_path, row(0, 1), row(1, 2), end=row(2, 3))
    with pytest.raises(InputError, match="breaks off after 2 complete time steps"):
        read_trajectories([path])
    assert read_trajectories([path], allow_truncated=True).end == 1


def test_it_is_found_and_told_apart_by_content(tmp_path):
    people = write_xml(tmp_path, name="people.xml", kind="person")
    cars = write(tmp_path, row(0, 1))
    (tmp_path / "notes.txt").write_text("nothing", encoding="utf-8")
    logs = survey_files(sorted(tmp_path.iterdir())).trajectories
    assert logs == (cars, people)
    assert vehicle_logs((people, cars)) == (cars, people)


def test_what_no_format_recognises_is_explained(tmp_path):
    path = tmp_path / "odd.txt"
    path.write_text("<odd/>", encoding="utf-8")
    with pytest.raises(InputError, match="its root element is <odd>, not <fcd-export>"):
        read_trajectories([path])
    assert formats.format_of(path) is formats.FORMATS[-1]
