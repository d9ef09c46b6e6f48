"""Presses of the page, joined with who arrives in the films."""

import csv
import json

import pytest

from sumo3dviz_pt.cli import main
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.pipeline.measured.presses import Coming, press_row, refused_rows, write_presses

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


def test_another_observer_is_asked_for_by_name(study, tmp_path):
    data = tmp_path / "one.csv"
    data.write_text(DATA, "utf-8")
    with pytest.raises(ConfigError, match="did you mean 'crossing'"):
        write_presses(study, data, tmp_path / "a.csv", observer="crosing")
