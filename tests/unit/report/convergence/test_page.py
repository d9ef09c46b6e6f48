import math

import pytest
from measurements import depths, ladder, presets

from sumo3dviz_pt.report.convergence.page import PLOTS, PageNotes, verdict, write_page
from sumo3dviz_pt.report.convergence.table import Slope

NOTES = PageNotes(
    title="Error against run time: ronda",
    command="sumo3dviz-pt converge scene.yaml --time 492 -o out",
    facts={"camera": "overview", "time": "492 s"},
    own={"rmse_capped": 0.0012},
    done=31,
    wanted=60,
    stopped="the budget ended",
    remarks=("Flicker was measured for `standard` alone.",),
)


def page(folder, rows, notes=NOTES):
    return write_page(folder, rows, notes).read_text(encoding="utf-8")


def test_the_page_is_complete(tmp_path):
    for name in PLOTS:
        (tmp_path / name).write_bytes(b"x")
    text = page(tmp_path, [*ladder(0.0), *presets(), *depths()])
    assert text.startswith("# Error against run time: ronda\n")
    for part in (
        "measured",
        "reference",
        "Presets",
        "Denoising",
        "Slopes",
        "Ladder",
        "depth",
        "Columns",
    ):
        assert f"{part}\n" in text
    for words in ("480x270", "Some \\| processor", "3.9.1", "12e4567", "4096 spp", "0.0012"):
        assert words in text
    assert all(f"]({name})" in text for name in PLOTS)
    assert "The budget ended: 31 of 60 measurements; the same command goes on." in text
    assert "| draft | 2 | 6 | oidn | fast | 5 |" in text and "1.50" in text
    assert "off by more than 1%: draft (-3.10%)" in text
    assert "| independent | capped RMSE | -0.5" in text and "| inside |" in text
    assert "| multijitter | capped RMSE | -0.6" in text and "at least as steep |" in text
    assert NOTES.remarks[0] in text
    assert "nan" not in text and not list(tmp_path.glob("*.part"))


def test_the_page_is_the_same_again(tmp_path):
    rows = [*ladder(), *presets()]
    assert page(tmp_path, rows) == page(tmp_path, rows)


def test_missing_parts_are_said_and_missing_plots_left_out(tmp_path):
    text = page(tmp_path, [], PageNotes("Nothing yet", wanted=60))
    assert "0 of 60 measurements" in text and text.count("Not measured yet.") == 3
    assert "Too few rungs" in text and "![" not in text


def test_a_finished_page_is_not_called_incomplete(tmp_path):
    good = [item for item in presets() if item["preset"] == "standard"]
    text = page(tmp_path, good, PageNotes("Done", done=60, wanted=60))
    assert "ncomplete" not in text
    assert "every preset is right within 1%" in text


@pytest.mark.parametrize(
    ("value", "low", "high", "sampler", "words"),
    [
        (-0.50, -0.52, -0.48, "independent", "inside"),
        (-0.50, -0.58, -0.46, "independent", "inside, the interval is not"),
        (-0.50, math.nan, math.nan, "independent", "inside"),
        (-0.40, -0.42, -0.38, "independent", "**too flat**"),
        (-0.60, -0.62, -0.58, "independent", "**too steep**"),
        (-0.60, -0.62, -0.58, "multijitter", "at least as steep"),
        (-0.44, -0.46, -0.42, "multijitter", "**too flat**"),
    ],
)
def test_verdicts(value, low, high, sampler, words):
    assert verdict(Slope(value, low, high, 5, (1, 64)), sampler) == words
