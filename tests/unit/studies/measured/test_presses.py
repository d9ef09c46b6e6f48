"""Presses of the page, joined with who arrives in the films."""

import csv
import json

import pytest

from sumo3dviz_pt.cli import main
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.studies.measured.presses import Coming, press_row, refused_rows, write_presses

NAN = float("nan")
COMING = (
    Coming("vehicle:a", 2.0, 2.4, NAN, is_offered=False),
    Coming("vehicle:b", 5.4, 5.8, 3.0),
    Coming("vehicle:c", 12.0, 12.4, 6.2, is_offered=False),  # after the film
)


@pytest.mark.parametrize(
    ("time", "next_", "margin", "gap", "accepted", "since"),
    [
        (1.0, "vehicle:a", 1.0, "", "", ""),
        (2.2, "vehicle:b", 3.2, "", "", ""),
        (2.4, "vehicle:b", 3.0, 3.0, 1, 0.0),
        (4.0, "vehicle:b", 1.4, 3.0, 1, 1.6),
        (5.5, "vehicle:c", 6.5, "", "", 3.1),
        (9.0, "vehicle:c", 3.0, "", "", 3.2),
        (13.0, "", "", "", "", 0.6),
    ],
)
def test_a_press_accepts_the_gap_in_which_it_lies_if_the_film_shows_all_of_it(
    time, next_, margin, gap, accepted, since
):
    row = press_row(time, COMING)
    assert (row["next"], row["margin"], row["gap_offered"]) == (next_, margin, gap)
    assert row["accepted"] == accepted and row["since_last"] == since
    assert row["on_the_way"] == int(time in (2.2, 5.5))
    refused = [each["next"] for each in refused_rows([row], COMING)]
    assert refused == ([] if accepted else ["vehicle:b"])


@pytest.fixture
def study(tmp_path):
    """A folder as `study` leaves it, with a title of half a second before the films."""
    out = tmp_path / "out"
    (out / "report").mkdir(parents=True)
    (out / "materials").mkdir()
    names = ("short", "long")
    films = {name: {"file": f"materials/{name}.mp4", "profiles": [{"gap": name}]} for name in names}
    (out / "study.json").write_text(json.dumps({"films": films}), "utf-8")
    for name in names:
        account = {"fps": 10, "frames": [{}] * 80, "overlays": {"frames_before": 5}}
        (out / "materials" / f"{name}.json").write_text(json.dumps(account), "utf-8")
    rows = [
        "stimulus,observer,road_user,arrives_in_film,leaves_in_film,gap_before",
        "short,camera,vehicle:a,2.0,2.4,",
        "short,camera,vehicle:b,5.4,5.8,3.0",
        "long,crossing,vehicle:c,5.0,5.5,4.0",
    ]
    (out / "report" / "arrivals.csv").write_text("\n".join(rows), "utf-8")
    return out


DATA = """participant,row_kind,film,gap,press_film_times
7,start,,,
7,practice,short,short,1.0
7,answer,short,short,1.5;4.5
7,answer,long,long,
"""


def test_the_pages_table_becomes_a_row_for_each_press(study, tmp_path, capsys):
    data = tmp_path / "data"
    data.mkdir()
    (data / "one.csv").write_text(DATA, "utf-8")
    out = tmp_path / "presses.csv"
    asked = ["study", "presses", str(data), "--study", str(study), "-o", str(out)]
    assert main(asked) == 0
    assert "3 rows" in capsys.readouterr().out
    rows = list(csv.DictReader(out.read_text("utf-8").splitlines()))
    told = [(r["film"], r["press"], r["press_time"], r["next"], r["margin"]) for r in rows]
    assert told == [
        ("short", "1", "1.0", "vehicle:a", "1.0"),
        ("short", "2", "4.0", "vehicle:b", "1.4"),
        ("long", "0", "", "", ""),
    ]
    assert [row["gap"] for row in rows] == ["short", "short", "long"]  # the factor
    assert [row["gap_offered"] for row in rows] == ["", "3.0", ""] and rows[0]["participant"] == "7"
    (study / "index.html").write_text('{"digest": "0123456789abcdef"}', "utf-8")
    text = DATA.replace("participant,", "study_digest,participant,").replace("\n7", "\nff,7")
    (data / "one.csv").write_text(text, "utf-8")
    assert main([*asked, "--overwrite"]) == 0
    assert "was saved by another page" in capsys.readouterr().err
    assert main(asked) == 2 and "exists" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("film,time\nshort,1\n", "has no column 'row_kind'"),
        (DATA.replace("long,long", "lang,lang"), "no film is called 'lang'; did you mean 'long'?"),
        (DATA.replace("4.5", "soon"), "press_film_times should be a number, not 'soon'"),
        ("row_kind,film,press_film_times\nend,,\n", "tells of no film of the study"),
    ],
)
def test_tables_that_are_wrong_are_refused(study, tmp_path, capsys, content, said):
    data = tmp_path / "one.csv"
    data.write_text(content, "utf-8")
    out = str(tmp_path / "presses.csv")
    assert main(["study", "presses", str(data), "--study", str(study), "-o", out]) == 2
    assert said in capsys.readouterr().err


SAVED = """study_digest,visit,visit_row,participant,row_kind,film,film_skipped,press_film_times
d,12-34,1,7,start,,,
d,12-34,2,7,answer,short,0,1.5;4.5
d,12-34,3,7,answer,long,0,
"""


def presses_of(study, folder, *more):
    """The rows that the command writes; it succeeds."""
    out = study.parent / "rows.csv"
    asked = ["study", "presses", str(folder), "--study", str(study), "-o", str(out), "--overwrite"]
    assert main([*asked, *more]) == 0
    return list(csv.DictReader(out.read_text("utf-8").splitlines()))


def test_rows_that_were_saved_twice_count_once(study, tmp_path, capsys):
    data = tmp_path / "data"
    data.mkdir()
    (data / "answers.csv").write_text(SAVED, "utf-8")
    once = presses_of(study, data)
    assert "twice" not in capsys.readouterr().err
    more = SAVED + "d,12-34,4,7,answer,short,0,4.5\n" + "d,56-78,2,8,answer,short,0,1.5;4.5\n"
    (data / "answers (1).csv").write_text(more, "utf-8")
    both = presses_of(study, data)
    assert len(both) == len(once) + 1 + 2
    assert "3 rows were saved twice" in capsys.readouterr().err


def test_other_tables_in_a_folder_are_left_out_by_name(study, tmp_path, capsys):
    data = tmp_path / "data"
    data.mkdir()
    (data / "answers.csv").write_text(SAVED, "utf-8")
    once = presses_of(study, data)
    (data / "presses.csv").write_bytes((tmp_path / "rows.csv").read_bytes())
    (data / "raw.csv").write_bytes(b"\xff\xfe\x00")
    capsys.readouterr()
    assert presses_of(study, data) == once
    said = capsys.readouterr().err
    assert "presses.csv is left out" in said and "raw.csv is left out" in said
    (data / "answers.csv").unlink()
    out = str(tmp_path / "none.csv")
    assert main(["study", "presses", str(data), "--study", str(study), "-o", out]) == 2
    assert "holds no table" in capsys.readouterr().err


@pytest.mark.parametrize("sign", [";", "\t"])
def test_tables_of_spreadsheets_are_read(study, tmp_path, sign):
    """With semicolons or tabs between columns, and decimal commas."""
    (tmp_path / "a.csv").write_text(SAVED, "utf-8")
    rows = [[cell.replace(".", ",") for cell in row] for row in csv.reader(SAVED.splitlines())]
    with (tmp_path / "b.csv").open("w", encoding="utf-8-sig", newline="") as file:
        csv.writer(file, delimiter=sign).writerows(rows)
    first = presses_of(study, tmp_path / "a.csv")
    assert presses_of(study, tmp_path / "b.csv") == first


def test_a_press_after_the_film_is_no_press(study, tmp_path, capsys):
    """A spreadsheet has taken the point for one between thousands."""
    (tmp_path / "a.csv").write_text(SAVED.replace("1.5;4.5", "4500"), "utf-8")
    asked = ["study", "presses", str(tmp_path / "a.csv"), "--study", str(study)]
    assert main([*asked, "-o", str(tmp_path / "out.csv")]) == 2
    assert "a.csv:3: press_film_times 4500 lies after the film's end" in capsys.readouterr().err


def test_films_that_people_went_on_without_are_left_out(study, tmp_path, capsys):
    text = SAVED.replace("short,0,1.5;4.5", "short,1,")
    (tmp_path / "a.csv").write_text(text, "utf-8")
    assert [row["film"] for row in presses_of(study, tmp_path / "a.csv")] == ["long"]
    assert "1 film that people went on without is left out" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("time", "early", "accepted"),
    [(2.2, 0.0, ""), (2.2, 0.1, ""), (2.2, 0.2, 1), (1.9, 0.5, 1), (1.8, 0.5, ""), (2.4, 0.5, 1)],
)
def test_a_press_shortly_before_the_first_has_left_may_accept_the_gap_behind_it(
    time, early, accepted
):
    row = press_row(time, COMING, early=early)
    assert row["accepted"] == accepted
    if accepted:
        assert (row["next"], row["gap_offered"]) == ("vehicle:b", 3.0)
        assert row["since_last"] == pytest.approx(time - 2.4)
        assert row["margin"] == pytest.approx(5.4 - time)
    assert row["on_the_way"] == int(2.0 <= time < 2.4)
    refused = [each["next"] for each in refused_rows([row], COMING)]
    assert refused == ([] if accepted else ["vehicle:b"])


def test_how_early_is_asked_by_an_option(study, tmp_path, capsys):
    text = SAVED.replace("1.5;4.5", "2.7")  # 2.2 without the title; the first leaves at 2.4
    data = tmp_path / "a.csv"
    data.write_text(text, "utf-8")
    late, early = (presses_of(study, data, "--early", each)[0] for each in ("0.1", "0.3"))
    assert (late["accepted"], early["accepted"]) == ("", "1")
    asked = ["study", "presses", str(data), "--study", str(study), "-o", str(tmp_path / "o.csv")]
    for wrong in ("-1", "nan"):
        assert main([*asked, "--early", wrong]) == 2
        assert "early" in capsys.readouterr().err


def test_another_observer_is_asked_for_by_name(study, tmp_path):
    data = tmp_path / "one.csv"
    data.write_text(DATA, "utf-8")
    with pytest.raises(ConfigError, match="did you mean 'crossing'"):
        write_presses(study, data, tmp_path / "a.csv", observer="crosing")
