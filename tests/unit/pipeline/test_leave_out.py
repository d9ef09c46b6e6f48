"""A scene holds nothing that it does not need."""

import subprocess
import sys

import pytest
from builders import write_scenario

from sumo3dviz_pt.catalog import names
from sumo3dviz_pt.inspection.checks import check_scene, in_words
from sumo3dviz_pt.library.vehicles.plates import LETTER
from sumo3dviz_pt.pipeline.production import Request, frame_times, prepare
from sumo3dviz_pt.pipeline.scene_file import load_job

PEOPLE = set(names("people"))
PLANTS = {"trees", "shrubs", "hedges"}
FAMILIES = {"signals", *PLANTS, "homes", "shops", "blocks", "buildings", "fences"}


def data_of(tmp_path, **content):
    scene = write_scenario(tmp_path, **content)
    return prepare(load_job(scene), Request(camera="post"), frame_times(4, 5, 10)).shot.data


def test_without(tmp_path):
    data = data_of(tmp_path)
    assert {part.family for part in data.static} & FAMILIES == set()
    assert data.lamps == ()
    assert not PEOPLE & set(data.prototypes)
    # What is posed vertex by vertex are letters of plates, where there are vehicles.
    assert set(data.slots.deforming) <= {LETTER}
    # Leaves stay: grass blades and woods on the horizon are part of the ground. Lenses stay:
    # vehicles have lamps.
    for word in ("bark", "signal_h", "signal_p", "signal_b", "cloth", "skin"):
        assert not any(word in name for name in data.materials), word
    said = {item.what: item.why for item in data.left_out}
    assert {"persons", "guard rails"} <= set(said) and any("signal" in what for what in said)


def test_a_scene_without_overlays_loads_nothing_for_them():
    code = (
        "import sys, sumo3dviz_pt.pipeline.films.film, sumo3dviz_pt.pipeline.films.encoding;"
        "assert not [m for m in sys.modules if m.startswith(('PIL', 'sumo3dviz_pt.overlays'))]"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


@pytest.mark.parametrize("kind", ["signals", "trees", "persons"])
def test_with(tmp_path, kind):
    data = data_of(tmp_path, **{kind: 2 if kind == "persons" else True})
    families = {part.family for part in data.static}
    if kind == "persons":
        assert PEOPLE & set(data.prototypes)
        assert set(data.slots.deforming) <= {*PEOPLE, LETTER}
        assert "persons" not in {item.what for item in data.left_out}
    else:
        assert families & FAMILIES == {kind}
    assert bool(data.lamps) == (kind == "signals")
    if kind == "signals":
        assert {lamp.split("/")[0] for lamp in data.lamps[0].lamps} == {"m"}
    if kind == "trees":
        assert any("bark" in name for name in data.materials)


def test_every_material_is_used(tmp_path):
    data = data_of(tmp_path, signals=True, trees=True, persons=2)
    used = {part.part.material for part in data.static}
    for prototype in data.prototypes.values():
        used |= {part.material for part in (*prototype.parts, *prototype.far)}
    assert set(data.materials) == used | {"signal_lens"}
    slots = data.slots
    assert slots.deforming
    assert {*slots.near, *slots.far, *slots.deforming} == set(data.prototypes)


def test_states_are_the_logs(tmp_path):
    scene = write_scenario(tmp_path, signals=True)
    job = load_job(scene, {"signals.yellow": "log"})
    shot = prepare(job, Request(camera="post"), frame_times(4, 8, 10)).shot
    assert shot.states_at(5.0) == {"m": "Gr"} and shot.states_at(6.0) == {"m": "rG"}
    names = shot.data.lamps[0].lamps
    for time, state in ((4.0, "Gr"), (7.0, "rG")):
        radiance = shot.frame_at(time).lamps[shot.data.lamps[0].id]
        for name, shown in zip(names, radiance, strict=True):
            _, link, _, colour = name.split("/")
            letter = state[int(link)]
            lit = {"G": "green", "r": "red"}[letter] == colour
            assert (shown.max() > 0) == lit, (name, letter)


def test_check_tells_what_is_there_and_what_it_costs(tmp_path):
    scene = write_scenario(tmp_path, signals=True, persons=1)
    report = check_scene(load_job(scene))
    assert report["network"]["signals"] == 1
    assert report["log"]["road_users"] == {"vehicle": 6, "person": 1}
    (shot,) = report["shots"]
    assert shot["frames"] == 10 and shot["camera"] == "post"
    triangles = dict(shot["triangles"])
    assert triangles.pop("total") == sum(triangles.values()) and not shot["over_budget"]
    costs = {name: cost["cpu_seconds_per_frame"] for name, cost in shot["forecast"].items()}
    assert costs["draft"] < costs["standard"] < costs["reference"]
    words = in_words(report)
    assert "1 person, 6 vehicles" in words and "left out" in words and "draft" in words


def test_check_tells_what_leaving_out_saves(tmp_path):
    """Ten trees behind the camera are not built, and what this shot lacks is not compiled."""
    scene = write_scenario(tmp_path, trees=True)
    behind = "".join(f'<poi id="b{k}" type="tree" x="{60 + 4 * k}" y="-150"/>' for k in range(10))
    trees = tmp_path / "trees.add.xml"
    trees.write_text(trees.read_text("utf-8").replace("</additional>", f"{behind}</additional>"),
                     encoding="utf-8")  # fmt: skip
    (shot,) = check_scene(load_job(scene), presets=["draft"])["shots"]
    unseen = next(item for item in shot["left_out"] if item["what"] == "10 trees")
    standing = shot["triangles"]["trees"]
    assert 0 < unseen["triangles"] < 10 * standing
    assert unseen["cpu_seconds_per_frame"] == pytest.approx(0.42e-6 * unseen["triangles"], abs=1e-4)
    unknown = next(item for item in shot["left_out"] if item["what"] == "persons")
    assert unknown["triangles"] is None and unknown["cpu_seconds_per_frame"] is None
    absent = {item["what"]: item for item in shot["not_compiled"]}
    assert {"beams", "fog", "snow", "wetness", "moments of an open shutter"} <= set(absent)
    assert not {"instances", "leaves"} & set(absent)
    assert absent["fog"]["operations"] > 0


def test_what_is_switched_off_would_take_about_what_it_takes(tmp_path):
    scene = write_scenario(tmp_path, trees=True)
    (with_them,), (without,) = (
        check_scene(load_job(scene, changes), presets=["draft"])["shots"]
        for changes in ({}, {"objects.trees": "null"})
    )
    (off,) = (item for item in without["left_out"] if item["what"] == "trees")
    assert 0.5 < off["triangles"] / with_them["triangles"]["trees"] < 2.0


def test_check_knows_what_weather_and_shutters_compile(tmp_path):
    scene = write_scenario(tmp_path)
    changes = {
        "weather": "{fog: {visibility: 200}, wetness: 0.5}",
        "cameras.post.shutter": "{angle: 180}",
    }
    (shot,) = check_scene(load_job(scene, changes), presets=["draft"])["shots"]
    absent = {item["what"] for item in shot["not_compiled"]}
    assert "snow" in absent
    assert not {"fog", "wetness", "moments of an open shutter"} & absent


def test_check_without_shots_takes_all_cameras(tmp_path):
    scene = write_scenario(tmp_path)
    job = load_job(scene, {"shots": "[]"})
    assert [shot["camera"] for shot in check_scene(job)["shots"]] == ["post", "driver"]
