"""What `check` says is said once."""

from sumo3dviz_pt.pipeline.checks import in_words

FENCES = {"what": "fences", "why": "the scenario has none"}
GRASS = {"what": "grass", "why": "no camera comes near"}


def report(*left_out):
    shot = {"camera": "a", "from": 0.0, "to": 1.0, "frames": 25, "fps": 25, "size": [4, 4]}
    shot |= {"triangles": {"total": 1}, "parts": {}, "over_budget": False, "forecast": {}}
    log = {"begin": 0.0, "end": 9.0, "step": 1.0, "road_users": {}}
    return {
        "network": {"file": "n", "lanes": 1, "signals": 0},
        "log": log,
        "sun": None,
        "weather": {"text": "none", "moments": [], "left_out": []},
        "missing_files": [],
        "nobody": [],
        "shots": [{**shot, "left_out": list(each)} for each in left_out],
    }


def test_what_all_shots_leave_out_is_said_once():
    said = in_words(report([FENCES, GRASS], [FENCES], [FENCES, GRASS])).splitlines()
    assert [line for line in said if "fences" in line] == [
        "left out of all shots  fences: the scenario has none"
    ]
    assert sum("grass" in line for line in said) == 2


def test_a_single_shot_names_its_own():
    assert "  left out  fences: the scenario has none" in in_words(report([FENCES]))
