"""Gaze over films whose layers are known: hits, dwell, first fixations, boxes."""

import csv
import json

import numpy as np
import pytest

from sumo3dviz_pt.cli import main
from sumo3dviz_pt.image.exr import write_parts
from sumo3dviz_pt.model.layers import Thing, number_of
from sumo3dviz_pt.pipeline.films import layers
from sumo3dviz_pt.pipeline.films.layers import FORM

SIZE = (8, 6)
THINGS = (Thing("sky", "sky"), Thing("vehicle:a@b:1", "car"), Thing("edge:E", "road"))
FPS = 10


@pytest.fixture
def study(tmp_path):
    """Two films of ten frames: sky above, a road below, and a car that goes to the right."""
    for name in ("one", "two"):
        film = tmp_path / "materials" / f"{name}.mp4"
        folder = layers.beside(film.with_suffix(".frames"))
        (folder / "frames").mkdir(parents=True)
        film.write_bytes(b"never read")
        frames = [{"time": 50 + n / FPS} for n in range(10)]
        film.with_suffix(".json").write_text(json.dumps({"fps": FPS, "frames": frames}))
        for n in range(10):
            owner = np.zeros((6, 8), dtype=np.uint32)
            owner[3:] = number_of("edge:E")
            owner[2:4, n // 2 : n // 2 + 2] = number_of("vehicle:a@b:1")
            write_parts(layers.channels_file(folder, n), {"instance": {"id": owner}})
            camera = {"size": SIZE, "focal": 8.0, "centre": [3.5, 2.5]}
            said = {
                "form": FORM,
                "frame": n,
                "time": 50 + n / FPS,
                "camera": {**camera, "world_from_camera": np.eye(4).tolist()},
                "things": {t.number: (t.name, t.label, t.label_id) for t in THINGS},
            }
            layers.said_file(folder, n).write_text(json.dumps(said))
    return tmp_path


def table(path):
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def looked(study, rows, *more, head="film,time,x,y"):
    path = study / "gaze.csv"
    path.write_text("\n".join([head, *rows]) + "\n", encoding="utf-8")
    out = study / "out"
    assert main(["study", "gaze", str(study), str(path), "-o", str(out), "--overwrite", *more]) == 0
    return table(out / "samples.csv"), table(out / "things.csv")


def test_samples_hit_what_their_pixel_shows(study):
    rows = ["one,0.0,0.5,2.5", "one,0.05,0.5,0.1", "one.mp4,0.1,7.9,5.9", "one,0.85,4.2,3.0"]
    rows += ["one,0.9,8.0,1", "one,0.95,-0.1,1", "one,0.97,,", "one,1.0,1,1", "two,0,0,5"]
    samples, _ = looked(study, rows)
    assert [(row["frame"], row["thing"]) for row in samples] == [
        ("0", "vehicle:a@b:1"),
        ("0", "sky"),
        ("1", "edge:E"),
        ("8", "vehicle:a@b:1"),
        ("9", "outside"),
        ("9", "outside"),
        ("9", ""),
        ("", "outside"),
        ("0", "edge:E"),
    ]


def test_dwell_and_first_fixation(study):
    """At 50 Hz: 80 ms on the car, 40 ms on the road, 200 ms on the car again."""
    times = np.arange(0.0, 0.32, 0.02)
    rows = [
        f"p{person},one,{5 + t:.2f},{1.5},{5.5 if 0.075 < t < 0.115 else 2.5}"
        for person in (2, 1)
        for t in times
    ]
    _, things = looked(study, rows, "--start", "5", head="participant,film,time,x,y")
    assert [row["participant"] for row in things] == ["p1", "p1", "p2", "p2"]
    car, road = things[:2]
    assert (car["thing"], car["label"], car["hits"]) == ("vehicle:a@b:1", "car", "14")
    assert float(car["dwell"]) == pytest.approx(0.28) and car["fixations"] == "1"
    assert float(car["first_look"]) == 0.0 and float(car["first_fixation"]) == 0.12
    assert (road["thing"], road["first_fixation"]) == ("edge:E", "")
    _, things = looked(
        study, rows, "--start", "5", "--fixation", "0.04", head="participant,film,time,x,y"
    )
    assert float(things[0]["first_fixation"]) == 0.0 and things[1]["fixations"] == "1"


@pytest.mark.parametrize(
    ("radius", "hits"),
    [("0", "sky"), ("1", "sky"), ("1.6", "vehicle:a@b:1"), ("9", "vehicle:a@b:1")],
)
def test_gaze_near_a_thing_hits_it_within_a_radius(study, radius, hits):
    """The car's nearest pixel has its middle at column 1.5 and row 2.5."""
    samples, _ = looked(study, ["one,0.0,1.5,0.95", "one,0.0,,"], "--radius", radius)
    assert [row["thing"] for row in samples] == [hits, ""]


def test_frames_without_layers_have_no_things(study):
    layers.said_file(study / "materials" / "one.layers", 3).unlink()
    samples, _ = looked(study, ["one,0.3,1.5,2.5", "one,0.4,2.5,2.5"])
    assert [row["thing"] for row in samples] == ["outside", "vehicle:a@b:1"]


def test_breaks_end_a_fixation_and_do_not_count(study):
    _, things = looked(study, ["one,0,0.5,2.5", "one,0.02,0.5,2.5", "one,0.5,2.5,2.5"])
    assert float(things[0]["dwell"]) == pytest.approx(0.02 + 0.1 + 0.1)
    assert float(things[0]["first_fixation"]) == 0.0 and things[0]["fixations"] == "2"


def test_boxes_of_all_frames_without_gaze(study):
    assert main(["study", "gaze", str(study), "-o", str(study / "boxes")]) == 0
    rows = table(study / "boxes" / "boxes.csv")
    assert [path.name for path in (study / "boxes").iterdir()] == ["boxes.csv"]
    assert len(rows) == 20 and {row["thing"] for row in rows} == {"vehicle:a@b:1"}
    assert rows[3] == {
        **{"film": "one", "frame": "3", "time": "50.3", "thing": "vehicle:a@b:1", "label": "car"},
        **{"x0": "1", "y0": "2", "x1": "3", "y1": "4", "pixels": "4"},
    }


@pytest.mark.parametrize(
    ("head", "row", "said"),
    [
        ("film,time,x", "one,0,1", "has no column 'y'; it needs film, time, x and y"),
        ("film,time,x,y", "oen,0,1,1", "gaze.csv:2: no film is called 'oen'; did you mean 'one'"),
        ("film,time,x,y", "one,0,left,1", "gaze.csv:2: x should be a number, not 'left'"),
        ("film,time,x,y", "one,,1,1", "gaze.csv:2: has no time"),
    ],
)
def test_wrong_tables_are_refused_in_words(study, capsys, head, row, said):
    (study / "gaze.csv").write_text(f"{head}\n{row}\n", encoding="utf-8")
    command = ["study", "gaze", str(study), str(study / "gaze.csv"), "-o", str(study / "out")]
    assert main(command) == 2
    assert said in capsys.readouterr().err
    assert not (study / "out").exists()


@pytest.mark.parametrize("option", ["--radius=-1", "--fixation=nan", "--start=inf"])
def test_numbers_that_are_none_are_refused(study, capsys, option):
    assert main(["study", "gaze", str(study), "-o", str(study / "out"), option]) == 2
    assert option.partition("=")[0].removeprefix("--") in capsys.readouterr().err


def test_tables_stay_and_folders_without_films_are_refused(study, capsys):
    command = ["study", "gaze", str(study), "-o", str(study / "out")]
    assert main(command) == 0 and main(command) == 2
    assert "exists; --overwrite replaces it" in capsys.readouterr().err
    assert main(["study", "gaze", str(study / "out"), "-o", str(study / "other")]) == 2
    assert "holds no film with layers" in capsys.readouterr().err
