"""What stands for a whole film."""

from sumo3dviz_pt.pipeline.measured.film import MEASURES, _ridden


def test_the_speed_of_the_ridden_vehicle_has_the_unit_that_is_said():
    rows = [
        {"speed": speed, "gap": "", "headway": 2.0, "time_to_collision": ""} for speed in (9, 11)
    ]
    assert _ridden(rows)["speed"] == 36.0
    assert "km/h" in str(MEASURES["speed"])
