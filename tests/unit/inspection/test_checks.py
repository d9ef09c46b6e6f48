"""What `check` says is said once."""

from sumo3dviz_pt.inspection.checks import MOMENTS, _sound, in_words
from sumo3dviz_pt.job.surroundings import SoundSettings

UNKNOWN = {"triangles": None, "cpu_seconds_per_frame": None}
FENCES = {"what": "fences", "why": "the scenario has none", **UNKNOWN}
GRASS = {"what": "grass", "why": "no camera comes near", **UNKNOWN}
TREES = {
    "what": "90 trees",
    "why": "no camera sees them",
    "triangles": 120_000,
    "cpu_seconds_per_frame": 0.0504,
}


def report(*left_out, absent=()):
    shot = {"camera": "a", "from": 0.0, "to": 1.0, "frames": 25, "fps": 25, "size": [4, 4]}
    shot |= {"triangles": {"total": 1}, "parts": {}, "over_budget": False, "forecast": {}}
    log = {"begin": 0.0, "end": 9.0, "step": 1.0, "road_users": {}}
    return {
        "network": {"file": "n", "lanes": 1, "signals": 0},
        "log": log,
        "sun": None,
        "weather": {"text": "none", "moments": [], "left_out": []},
        "motion": {"text": ""},
        "missing_files": [],
        "nobody": [],
        "unseen": [],
        "shots": [
            {**shot, "left_out": list(each), "not_compiled": list(absent)} for each in left_out
        ],
    }


def test_what_all_shots_leave_out_is_said_once():
    said = in_words(report([FENCES, GRASS], [FENCES], [FENCES, GRASS])).splitlines()
    assert [line for line in said if "fences" in line] == [
        "left out of all shots  fences: the scenario has none"
    ]
    assert sum("grass" in line for line in said) == 2


def test_what_breaks_the_laws_of_motion_is_a_note():
    said = in_words({**report([]), "motion": {"text": "2 of 9 road users spin"}})
    assert "note     2 of 9 road users spin" in said.splitlines()


def test_a_single_shot_names_its_own():
    assert "  left out  fences: the scenario has none" in in_words(report([FENCES]))


def test_what_is_saved_is_said_where_it_is_known():
    said = in_words(report([TREES, {**TREES, "what": "1 tree", "triangles": 90,
                                    "cpu_seconds_per_frame": 0.0}, FENCES]))  # fmt: skip
    trees = "90 trees: no camera sees them; saves about 120,000 triangles and 0.05 CPU-s a frame"
    assert f"  left out  {trees}\n" in said
    assert "1 tree: no camera sees them; saves about 90 triangles\n" in said
    assert "  left out  fences: the scenario has none\n" in said


def test_what_is_not_compiled_is_listed_with_what_it_would_cost():
    fog = {"what": "fog", "operations": 1180, "cpu_seconds_per_frame": None}
    moments = {"what": MOMENTS, "operations": None, "cpu_seconds_per_frame": 0.3}
    said = in_words(report([], absent=[fog, moments])).splitlines()
    line = "  not compiled  fog (1,180 operations), moments of an open shutter (each 0.30 CPU-s"
    assert any(each == f"{line} a frame)" for each in said)
    assert not any("not compiled" in each for each in in_words(report([])).splitlines())


def test_reasons_and_what_is_built_are_said_on_demand_only():
    fog = {"what": "fog", "operations": 1180, "cpu_seconds_per_frame": None}
    found = report([FENCES, TREES, GRASS], [FENCES, GRASS], absent=[fog])
    found["shots"][0] |= {"triangles": {"roads": 5, "total": 7}, "parts": {"materials": 3}}
    brief, full = in_words(found, details=False), in_words(found)
    assert "left out of all shots  fences, grass (-v says why)\n" in brief
    assert "  left out  90 trees (-v says why)" in brief and "  triangles 7\n" in brief
    for words in ("the scenario has none", "roads 5", "parts", "not compiled", "saves"):
        assert words in full and words not in brief
    assert "left out" not in in_words(report([]), details=False)


def test_it_says_what_sound_a_film_has():
    found = report([])
    assert "sound" not in in_words(found)
    wanted = SoundSettings(play="binaural", murmur=None, full_scale=94)
    found["shots"][0]["sound"] = _sound(wanted)
    assert (
        "binaural, of everybody within 150 m, murmur none; a full-scale sine is 94 dB"
        in in_words(found)
    )
    assert _sound(SoundSettings()) == _sound(None) == ""
