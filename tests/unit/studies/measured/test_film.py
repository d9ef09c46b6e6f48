"""What stands for a whole film."""

from sumo3dviz_pt.studies.measured.film import MEASURES, TABLES, FilmMeasures, _ridden
from sumo3dviz_pt.studies.measured.report import ReportPage, write_page
from sumo3dviz_pt.studies.measured.safety import safety_words


def test_the_speed_of_the_ridden_vehicle_has_the_unit_that_is_said():
    rows = [
        {"speed": x, "logged_speed": log, "gap": "", "headway": 2.0, "time_to_collision": ""}
        for x, log in ((9, ""), (11, 10.0))
    ]
    assert (_ridden(rows)["speed"], _ridden(rows)["logged_speed"]) == (36.0, 36.0)
    assert "as drawn [km/h]" in MEASURES["speed"] and "log says" in MEASURES["logged_speed"]


def film(name, **tables):
    whole = {**dict.fromkeys(MEASURES, 1.0), "share car": 0.25}
    safety = {**dict.fromkeys(safety_words((5.0,)), float("nan")), "red_flash_rate": 0.0}
    frames = ({"frame": 0, "time": 50.0}, {"frame": 1, "time": 51.0})
    empty = dict.fromkeys(TABLES, ())
    return FilmMeasures(
        name, whole, safety | {"flash_rate": 4.0}, {**empty, "frames": frames, **tables}
    )


def test_the_page_tells_gaps_arrivals_and_flashes_and_escapes_names(tmp_path):
    gap = {"follower": "a@b:1", "leader": "<c>", "moved": "<c>", "at": 50.5, "asked": 2.0}
    names = ("kept_at", "time_gap_mean", "time_gap_min", "time_gap_max", "gap_mean")
    came = {"observer": "kerb", "road_user": "vehicle:x", "from": "left", "arrives_in_film": 0.5}
    came |= {"gap_before": "", "speed": 9.0, "arrives": 50.5}
    films = [
        film("one", gaps=({**gap, **dict.fromkeys(names, "")},), arrivals=(came,)),
        film("two", arrivals=({**came, "arrives": 99.0}, {**came, "from": "behind"})),
    ]
    words = {**MEASURES, "share car": "share of the picture that shows car"}
    write_page(tmp_path / "r.html", ReportPage(films, [], 100.0, words, safety_words((5.0,))))
    page = (tmp_path / "r.html").read_text("utf-8")
    assert "<td>a@b:1</td><td>&lt;c&gt;</td><td>&lt;c&gt;</td><td>50.50</td>" in page
    assert page.count("<td>vehicle:x</td>") == 1 and "<c>" not in page and ">nan" not in page
    assert "two has too many flashes." in page and "red flashes.</strong>" not in page


def test_effects_and_pages_do_without_gaps_and_arrivals(tmp_path):
    words = {**MEASURES, "share car": "share of the picture that shows car"}
    write_page(tmp_path / "r.html", ReportPage([film("one")], [], 1.0, words, safety_words(())))
    page = (tmp_path / "r.html").read_text("utf-8")
    assert "<h2>Gaps</h2>" not in page and "Who arrives" not in page
    assert "The design" not in page


def test_the_page_tells_how_far_factors_tell_each_other(tmp_path):
    words = {**MEASURES, "share car": "share of the picture that shows car"}
    told = {"factor": {"factor": 1.0, "<b>": 0.25}, "<b>": {"factor": 0.25, "<b>": 1.0}}
    design = ReportPage([film("one")], [], 1.0, words, safety_words(()), told, "D-error 0.5")
    write_page(tmp_path / "r.html", design)
    page = (tmp_path / "r.html").read_text("utf-8")
    assert "<tr><td>&lt;b&gt;</td><td>0.25</td><td>1.00</td></tr>" in page
    assert "Choice tasks: D-error 0.5." in page and "<b>" not in page
