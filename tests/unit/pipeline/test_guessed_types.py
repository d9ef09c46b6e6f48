"""What vehicles without a defined type are drawn as is said, kept and correctable."""

from builders import fcd_xml, write_scenario

from sumo3dviz_pt.cli import main
from sumo3dviz_pt.cli.program import notes_on_stderr
from sumo3dviz_pt.model.traffic import TypeGuess
from sumo3dviz_pt.pipeline.production import read
from sumo3dviz_pt.pipeline.reading import guesses_in_words, type_lines
from sumo3dviz_pt.pipeline.scene_file import load_job


def test_one_sentence_for_all():
    found = [TypeGuess(f"t{n}", n + 1) for n in range(5)]
    found += [TypeGuess("veh_bus", 9, "bus", "the names say so")]
    found += [TypeGuess("", 8, "bus", "the names say so")]
    assert guesses_in_words(found, remedy="Do it") == (
        "no file defines the types of these vehicles: 't4', 't3', 't2' and 2 more (15 of them)"
        " drawn as cars because nothing tells what they are; 'veh_bus' (9 of them) drawn as vClass"
        " bus because the names say so; 8 without a type drawn as vClass bus because the names"
        " say so. Do it"
    )
    assert guesses_in_words([], remedy="Do it") == ""


def test_nothing_is_kept_that_nothing_tells():
    assert type_lines([TypeGuess("t0", 3), TypeGuess("", 2, "bus", "x")]) == []


def of_type(folder, type_id):
    scene = write_scenario(folder)
    log = folder / "fcd.xml"
    log.write_text(
        log.read_text(encoding="utf-8").replace('"car"', f'"{type_id}"'), encoding="utf-8"
    )
    return scene


def classes(scene, **overrides):
    _, scenario, _ = read(load_job(scene, overrides), begin=2, end=4)
    return {scenario.vehicle_types[each.type_id].vclass for each in scenario.traffic.traces}


def test_init_writes_what_it_guesses_and_the_scene_obeys(tmp_path, capsys):
    of_type(tmp_path, "Linien-bus")
    scene = tmp_path / "own.yaml"
    assert main(["init", str(tmp_path), "-o", str(scene)]) == 0
    assert "'Linien-bus' (6 of them) drawn as vClass bus" in capsys.readouterr().out
    assert load_job(scene).vehicles.types == {"Linien-bus": "bus"}
    assert classes(scene) == {"bus"}
    assert classes(scene, **{"vehicles.types": {"Linien*": "truck", "Linien-bus": "tram"}}) == {
        "tram"
    }


def test_it_is_said_once_and_not_if_it_is_told(tmp_path, capsys):
    scene = of_type(tmp_path, "veh_truck")
    with notes_on_stderr():
        classes(scene)
        (tmp_path / "fcd.xml").write_text(fcd_xml().replace('"car"', '"bus"'), encoding="utf-8")
        assert classes(scene) == {"bus"}
    said = capsys.readouterr().err
    assert said.count("no file defines") == 1 and "vehicles.types" in said
    with notes_on_stderr():
        assert classes(scene, **{"vehicles.types": {"bus": "truck"}}) == {"truck"}
    assert "no file defines" not in capsys.readouterr().err


def test_a_class_that_sumo_does_not_have(tmp_path, capsys):
    scene = write_scenario(tmp_path)
    assert main(["check", str(scene), "--set", "vehicles.types={a: buss}"]) == 2
    assert "no vClass of SUMO is called 'buss'; did you mean 'bus'" in capsys.readouterr().err


def test_the_list_of_road_users_has_the_same_classes(tmp_path, capsys):
    scene = of_type(tmp_path, "veh_truck")
    assert main(["vehicles", str(scene), "--type", "truck"]) == 0
    assert "v0" in capsys.readouterr().out
