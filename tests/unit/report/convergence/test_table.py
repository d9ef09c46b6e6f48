import math

import numpy as np
import pytest
from measurements import SEEDS, SLOPES, depths, ladder, presets, row

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.report.convergence.table import (
    COLUMNS,
    LADDER,
    append_row,
    cost,
    markdown,
    read_rows,
    slope,
    summary,
)


def same(one, other):
    """Whether two rows hold the same values, unknown ones included."""
    return list(one) == list(other) and all(
        a == b or (isinstance(a, float) and math.isnan(a) and math.isnan(b))
        for a, b in zip(one.values(), other.values(), strict=True)
    )


def test_columns_are_those_of_the_protocol():
    assert len(COLUMNS) == len(set(COLUMNS)) == 47
    assert COLUMNS[:3] == ("scene", "variant", "git")
    assert COLUMNS[-2:] == ("mean_bias", "flicker_mc")


@pytest.mark.parametrize("legacy", [False, "1.13"])
def test_rows_come_back_as_they_were(legacy, tmp_path):
    with np.printoptions(legacy=legacy):
        come_back(tmp_path)


def come_back(tmp_path):
    """Write rows, read them, and compare."""
    path, rows = tmp_path / "a.csv", [*ladder()[:4], *depths()]
    rows[1] |= {"psnr": math.inf, "cpu": 'a, "b" and ü', "git": "00123"}
    for item in rows:
        append_row(path, item)
    back = read_rows(path)
    assert len(back) == len(rows)
    assert all(same(one, other) for one, other in zip(back, rows, strict=True))
    assert back[1]["git"] == "00123" and back[0]["spp"] == 1


def test_a_column_left_out_is_unknown(tmp_path):
    append_row(tmp_path / "a.csv", {"scene": "ronda", "spp": 4})
    (only,) = read_rows(tmp_path / "a.csv")
    assert tuple(only) == COLUMNS
    assert only["scene"] == "ronda" and only["spp"] == 4 and only["cpu"] == ""
    assert math.isnan(only["seed"]) and math.isnan(only["flip"])


def test_no_file_holds_no_rows(tmp_path):
    assert read_rows(tmp_path / "none.csv") == []


@pytest.mark.parametrize("lost", [1, 5, 60])
def test_a_torn_last_line_is_dropped_and_replaced(tmp_path, lost):
    path = tmp_path / "a.csv"
    for seed in (1, 2, 3):
        append_row(path, row(LADDER, 4, 0.1, seed=seed, cpu="ü" * 40))
    path.write_bytes(path.read_bytes()[:-lost])
    assert [item["seed"] for item in read_rows(path)] == [1, 2]
    append_row(path, row(LADDER, 4, 0.1, seed=7))
    assert [item["seed"] for item in read_rows(path)] == [1, 2, 7]


def test_a_torn_header_is_written_anew(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("scene,vari", encoding="utf-8")
    assert read_rows(path) == []
    append_row(path, row(LADDER, 4, 0.1))
    assert len(read_rows(path)) == 1


def test_wrong_columns_and_values_are_refused(tmp_path):
    path = tmp_path / "a.csv"
    with pytest.raises(ValueError, match="spq"):
        append_row(path, {"spq": 3})
    with pytest.raises(ValueError, match="two lines"):
        append_row(path, {"cpu": "a\nb"})
    path.write_text("spp,seed\n1,2\n", encoding="utf-8")
    with pytest.raises(InputError, match="other columns"):
        append_row(path, {"spp": 3})
    path.write_text(",".join(COLUMNS) + "\n1,2\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"a\.csv:2: damaged"):
        read_rows(path)


def test_cost_is_rendering_and_denoising():
    assert cost({"t_render_cpu": 2.0, "t_denoise_cpu": 1.5}) == 3.5
    assert cost({"t_render_cpu": 2.0, "t_denoise_cpu": math.nan}) == 2.0
    assert math.isnan(cost({"t_denoise_cpu": 1.5}))


@pytest.mark.parametrize("sampler", SLOPES)
def test_slopes_are_found(sampler):
    exact, noisy = (slope(ladder(noise), "rmse_capped")[sampler] for noise in (0.0, 0.05))
    assert exact.value == pytest.approx(SLOPES[sampler], abs=1e-9)
    assert exact.low == pytest.approx(exact.high, abs=1e-9)
    assert noisy.value == pytest.approx(SLOPES[sampler], abs=0.03)
    assert noisy.low < noisy.value < noisy.high
    assert noisy.seeds == len(SEEDS) and noisy.spp == (1, 64)


def test_slopes_of_mean_squares_are_of_their_root():
    assert slope(ladder(0.0), "relmse_trim")["independent"].value == pytest.approx(-0.5, abs=1e-9)


def test_slopes_are_of_raw_rungs_alone_and_repeatable():
    rows = ladder()
    raw = [item for item in rows if item["denoise"] == "none"]
    assert slope([*rows, *presets(), *depths()], "flip") == slope(raw, "flip")


def test_one_seed_has_no_interval_and_one_rung_no_slope():
    one = [item for item in ladder() if item["seed"] == 1]
    assert math.isnan(slope(one, "rmse_capped")["independent"].low)
    assert slope([item for item in ladder() if item["spp"] == 4], "rmse_capped") == {}


def test_summary_shows_medians_and_only_what_was_measured():
    rows = [
        row(LADDER, 4, error, seed=seed, flip=flip)
        for seed, (error, flip) in enumerate(zip((1, 2, 9), (0.1, 0.2, 0.5), strict=True))
    ]
    head, _, line = summary(rows, by=("sampler", "spp"))
    assert "FLIP (quartiles)" in head and "flicker" not in head
    cells = [cell.strip() for cell in line.strip("|").split("|")]
    assert cells[:3] == ["multijitter", "4", "3"]
    assert cells[4] == "2" and "0.2000 (0.1500 to 0.3500)" in cells
    assert len(head.split("|")) == len(line.split("|"))
    assert summary([], by=("spp",)) == []


def test_a_bar_does_not_break_a_table():
    assert markdown(["a"], [["x|y"]])[-1] == "| x\\|y |"
