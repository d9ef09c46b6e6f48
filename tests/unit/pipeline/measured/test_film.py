"""What stands for a whole film."""

from sumo3dviz_pt.pipeline.measured.film import MEASURES, _ridden


def test_the_speed_of_the_ridden_vehicle_has_the_unit_that_is_said():
    rows = [
        {"speed": x, "logged_speed": log, "gap": "", "headway": 2.0, "time_to_collision": ""}
        for x, log in ((9, ""), (11, 10.0))
    ]
    assert (_ridden(rows)["speed"], _ridden(rows)["logged_speed"]) == (36.0, 36.0)
    assert "as drawn [km/h]" in MEASURES["speed"] and "log says" in MEASURES["logged_speed"]
