"""`converge` on a tiny scene: complete, resumable, within a budget, honest about both."""

import csv
import json

import numpy as np
import pytest
from builders import write_scenario

from sumo3dviz_pt.cli import main
from sumo3dviz_pt.report.convergence.plan import groups
from sumo3dviz_pt.report.convergence.table import COLUMNS

pytestmark = pytest.mark.slow

CHOICES = ["--camera", "post", "--size", "32x18", "--top", "2"]
ERRORS = ("rmse_capped", "relmse_trim", "flip", "ssim", "mean_bias")


def run(place, folder, *more, time="4.5"):
    """Call the command; the page's text."""
    arguments = ["converge", str(place), "--time", time, *CHOICES, "-o", str(folder), *more]
    assert main(arguments) == 0
    return (folder / "report.md").read_text(encoding="utf-8")


def rows_in(folder):
    with (folder / "convergence.csv").open(encoding="utf-8") as stream:
        return list(csv.DictReader(stream))


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    """A scene, its complete report, and one that a budget cut short."""
    base = tmp_path_factory.mktemp("converge")
    place = write_scenario(base, vehicles=4)
    whole, cut = base / "whole", base / "cut"
    pages = run(place, whole), run(place, cut, "--budget", "0.001")
    return place, whole, cut, pages


def test_everything_is_measured(measured):
    _, whole, _, (page, _) = measured
    rows = rows_in(whole)
    # The columns of facts/denoising.md, section 7.
    assert tuple(rows[0]) == COLUMNS
    # With --top 2 the ladder has two rungs.
    assert len(rows) == sum(group.rows for group in groups(2))
    assert "Incomplete" not in page
    for name in ("error.png", "crops.png", "flip.jpg", "depth.png"):
        assert (whole / name).stat().st_size > 5000 and name in page


def test_the_reference_is_better_than_what_it_judges(measured):
    _, whole, _, (page, _) = measured
    plan = json.loads((whole / "plan.json").read_text(encoding="utf-8"))
    stored = np.load(whole / "reference.npz")
    halves = [stored[f"capped{half}"] / stored["count"][half] for half in (0, 1)]
    difference = np.sqrt(np.mean((halves[0] - halves[1]) ** 2))
    assert difference <= plan["target"] == pytest.approx(plan["noise"] / 3)
    assert "Its own capped RMSE" in page


def test_noise_falls_and_samplers_and_denoisers_differ(measured):
    _, whole, _, _ = measured
    raw = [row for row in rows_in(whole) if row["preset"] == "ladder" and row["denoise"] == "none"]
    median = {
        (sampler, spp): np.median(
            [float(r["rmse_capped"]) for r in raw if (r["sampler"], r["spp"]) == (sampler, spp)]
        )
        for sampler in ("independent", "multijitter")
        for spp in ("1", "2")
    }
    fall = median["independent", "2"] / median["independent", "1"]
    assert fall == pytest.approx(np.sqrt(0.5), rel=0.12)
    assert median["multijitter", "2"] < median["independent", "2"]


def test_a_presets_flicker_is_measured_once(measured):
    _, whole, _, _ = measured
    found = {}
    for label, seeds in (("draft", 2), ("draft still", 5)):
        rows = [row for row in rows_in(whole) if row["preset"] == label]
        known = [float(row["flicker_mc"]) for row in rows if row["flicker_mc"]]
        assert len(rows) == seeds and len(known) == 1
        (found[label],) = known
    # Frames that help each other are calmer than twice their samples alone.
    assert 0 < found["draft"] < found["draft still"] < 100


def test_a_budget_is_kept_and_the_same_command_goes_on(measured, capsys):
    place, whole, cut, (_, page) = measured
    assert "Incomplete" in page and "the same command goes on" in page
    assert "Incomplete" not in run(place, cut, "--budget", "10000")
    assert len(rows_in(cut)) >= len(rows_in(whole)) / 2
    before = rows_in(whole)
    run(place, whole)
    assert rows_in(whole) == before, "nothing is measured twice"


def test_an_interrupted_group_is_measured_again(measured):
    place, whole, _, _ = measured
    before = rows_in(whole)
    path = whole / "convergence.csv"
    lines = path.read_text(encoding="utf-8").splitlines(keepends=True)
    path.write_text("".join(lines[:-2]) + lines[-2][:40], encoding="utf-8")
    run(place, whole)
    after = rows_in(whole)
    for old, new in zip(before, after, strict=True):
        for name in ERRORS:
            assert float(new[name]) == pytest.approx(float(old[name]), rel=1e-6)


def test_another_pictures_folder_is_refused(measured, capsys):
    place, whole, _, _ = measured
    arguments = ["converge", str(place), "--time", "5", *CHOICES, "-o", str(whole)]
    assert main(arguments) == 2
    assert "choose another folder" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("option", "value"), [("--top", "0"), ("--top", "4096"), ("--budget", "0")]
)
def test_numbers_out_of_range_are_refused(measured, tmp_path, capsys, option, value):
    arguments = ["converge", str(measured[0]), "--time", "4", "-o", str(tmp_path / "r")]
    assert main([*arguments, option, value]) == 2
    assert option[2:] in capsys.readouterr().err


def test_bad_choices_are_refused(measured, tmp_path, capsys):
    place = measured[0]
    for more, word in (
        (["--time", "500"], "log goes from"),
        (["--time", "4", "--camera", "x"], "x"),
    ):
        assert main(["converge", str(place), *more, "-o", str(tmp_path / "r")]) == 2
        assert word in capsys.readouterr().err
        assert not (tmp_path / "r").exists()
    assert main(["converge", str(place), "--time", "4", "-o", str(tmp_path / "no" / "r")]) == 2
    assert "create it" in capsys.readouterr().err


def test_a_report_begins_anew_only_when_asked(measured, capsys):
    """What exists is gone on with; another picture's report goes with --overwrite."""
    place, _, cut, _ = measured
    before = (cut / "plan.json").read_text(encoding="utf-8")
    run(place, cut, "--budget", "0.001", "--overwrite", time="5")
    assert (cut / "plan.json").read_text(encoding="utf-8") != before
    (cut / "plan.json").unlink()
    arguments = ["converge", str(place), "--time", "5", *CHOICES, "-o", str(cut)]
    assert main(arguments) == 2
    assert "exists already" in capsys.readouterr().err
