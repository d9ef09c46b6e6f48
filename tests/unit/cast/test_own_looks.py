"""`vehicles.by_id`: models and colours of single road users."""

import numpy as np
import pytest
from builders import write_scenario

from sumo3dviz_pt import catalog
from sumo3dviz_pt.cast.choice import FigureChoice, ModelChoice, OwnLooks, idle
from sumo3dviz_pt.cast.colours import paint_of
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.inspection.checks import check_scene, in_words
from sumo3dviz_pt.job.settings import VehicleSettings
from sumo3dviz_pt.library.paints import EUROPEAN
from sumo3dviz_pt.model.traffic import VehicleType
from sumo3dviz_pt.pipeline.scene_file import load_job

CAR = VehicleType("car", "passenger", 5.0, 1.8, 1.5)
LINE = VehicleType("line_7", "bus", 13.0, 2.5, 3.2)
WALKER = VehicleType("ped", "pedestrian", 0.215, 0.478, 1.719)


def looks(**by_id):
    return OwnLooks(VehicleSettings(by_id=by_id).by_id)


def given(own, kind, name, **more):
    return own.choice(kind, name=name, walks=kind is WALKER, **more)


def test_the_exact_id_wins_then_the_first_pattern_that_fits():
    own = looks(
        **{
            "bus_*": {"model": "coach"},
            "*": {"model": "suv"},
            "bus_7": {"model": "city_bus"},
            "line*": {"model": "tram"},
        }
    )
    assert given(own, LINE, "bus_7").model.name == "city_bus"
    assert given(own, LINE, "bus_8").model.name == "coach"
    assert given(own, CAR, "x").model.name == "suv"
    assert given(own, LINE, "x").model.name == "suv", "the first that fits, in the file's order"


def test_patterns_fit_types_too():
    own = looks(**{"line_*": {"model": "coach"}})
    assert given(own, LINE, "veh1").model.name == "coach"
    assert given(own, CAR, "veh1") is None


def test_a_model_of_the_class_is_fitted_and_another_is_as_large_as_it_is():
    own = looks(v={"model": "city_bus"})
    assert given(own, LINE, "v").size == (13.0, 2.5, 3.2)
    foreign = given(own, CAR, "v")
    meta = catalog.find("vehicles", "city_bus").meta
    assert foreign.size == (meta["length"], meta["width"], meta["height"])
    assert foreign.vclass == "bus", "seats and springs are those of a bus"


def test_people_stay_people():
    own = looks(**{"*": {"model": "city_bus"}, "p": {"model": "woman_coat"}})
    assert isinstance(given(own, WALKER, "p"), FigureChoice)
    assert given(own, WALKER, "q") is None and given(own, CAR, "p") is None
    assert isinstance(given(own, CAR, "q"), ModelChoice)


def test_colours_win_over_chance_and_over_sumo(tmp_path):
    own = looks(**{"v*": {"colour": "#aa2211"}})
    red = own.paint("v1", "car")
    assert own.paint("w", "car") is None
    np.testing.assert_allclose(red, [0.402, 0.0159, 0.01], atol=1e-3)
    assert paint_of("passenger", CAR, key="v1", colours="european", seed=0) in EUROPEAN.colours


def test_a_scene_shows_them(tmp_path):
    """Through the whole scene, with bodies built."""
    from sumo3dviz_pt.pipeline.production import Request, prepare

    scene = write_scenario(tmp_path, vehicles=3, persons=1)
    text = scene.read_text(encoding="utf-8")
    by_id = 'vehicles: {by_id: {v1: {model: city_bus, colour: "#0000ff"}, "v*": {model: suv}}}\n'
    scene.write_text(text + by_id, encoding="utf-8")
    fleet = prepare(load_job(scene), Request(), np.array([4.0])).shot.fleet
    shown = {
        t.id: (body.assembly.model, colour)
        for t, body, colour in zip(fleet.trajectories, fleet.bodies, fleet.colours, strict=True)
    }
    assert shown["v1"][0].startswith("city_bus") and shown["v1"][1] == (0.01, 0.01, 0.8)
    assert shown["v0"][0] == shown["v2"][0] == "suv"
    assert fleet.body("vehicle:v1").size[0] == pytest.approx(12.0, abs=0.5)


@pytest.mark.parametrize(
    ("entry", "said"),
    [
        ("{v0: {model: city_buss}}", "did you mean 'city_bus'"),
        ("{v0: {model: bus_rear}}", "only a part"),
        ("{v0: {colour: red}}", "written #rrggbb, not 'red'"),
        ("{v0: {}}", "give model, colour, or both"),
        ("{v0: {modell: suv}}", "did you mean 'model'"),
    ],
)
def test_what_cannot_be(tmp_path, entry, said):
    scene = write_scenario(tmp_path)
    text = scene.read_text(encoding="utf-8")
    scene.write_text(f"{text}vehicles:\n  by_id: {entry}\n", encoding="utf-8")
    with pytest.raises(ConfigError, match=said) as refused:
        load_job(scene)
    assert "vehicles.by_id.v0" in str(refused.value) and "scene.yaml:" in str(refused.value)


def test_check_says_what_fits_nobody(tmp_path):
    assert idle(["a*", "b", "car"], {"abc": "car"}) == ["b"]
    scene = write_scenario(tmp_path)
    text = scene.read_text(encoding="utf-8")
    scene.write_text(f'{text}vehicles: {{by_id: {{"bsu*": {{model: suv}}}}}}\n', encoding="utf-8")
    report = check_scene(load_job(scene))
    assert report["nobody"] == ["bsu*"] and not report["unseen"]
    assert "note     vehicles.by_id: 'bsu*' fits nobody" in in_words(report)


def test_check_says_who_is_in_no_shots_view(tmp_path):
    """The log has it, and a look that nobody sees is no look."""
    scene = write_scenario(tmp_path, vehicles=2)
    away = {"cameras.post.position": "[150, -22, 4]", "cameras.post.look_at": "[190, -22, 1]"}
    look = {"vehicles.by_id": "{v0: {colour: '#b01010'}, car: {colour: '#1010b0'}}"}
    for changed, unseen in ((away, ["v0", "car"]), ({}, [])):
        job = load_job(scene, {**changed, **look})
        shots = tuple(shot for shot in job.shots if shot.camera == "post")[:1]
        report = check_scene(job.model_copy(update={"shots": shots}), presets=["draft"])
        assert (report["nobody"], report["unseen"]) == ([], unseen)
    assert "note     vehicles.by_id: 'v0' is in no shot's view" in in_words(
        {**report, "unseen": ["v0"]}
    )
