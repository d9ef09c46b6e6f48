import numpy as np
import pytest
from measurements import depths, ladder, presets
from PIL import Image

from sumo3dviz_pt.report.convergence.table import grouped
from sumo3dviz_pt.report.plots import (
    crops_plot,
    depth_changes,
    depth_plot,
    error_plot,
    flip_maps,
    pair_plot,
    time_plot,
)

RNG = np.random.default_rng(4)


@pytest.fixture(scope="module")
def pictures():
    """A picture with one busy corner, and worse ones, the worst first."""
    truth = np.full((54, 96, 3), 0.5, dtype=np.float32)
    truth[6:30, 60:90] = RNG.uniform(0, 1, (24, 30, 3))
    noise = RNG.normal(0, 1, truth.shape) * (np.arange(96) > 48)[None, :, None]
    worse = {
        name: np.clip(truth + strength * noise, 0, 1).astype(np.float32)
        for name, strength in (("draft", 0.3), ("standard", 0.05))
    }
    return {**worse, "reference": truth}


def drawn(path):
    """A written plot's pixels, if it is a picture of something."""
    pixels = np.asarray(Image.open(path).convert("RGB")) / 255
    assert min(pixels.shape[:2]) > 100
    colours = np.unique((pixels.reshape(-1, 3) * 15).round(), axis=0)
    assert len(colours) > 10 and (pixels < 0.9).any(axis=-1).mean() > 0.02
    assert not list(path.parent.glob("*.part"))
    return pixels


@pytest.mark.slow
def test_error_plot(tmp_path):
    rows = [*ladder(), *presets(), *depths()]
    error_plot(rows, tmp_path / "a.png", own={"flip": 0.03})
    error_plot(rows, tmp_path / "b.png")
    one, other = drawn(tmp_path / "a.png"), drawn(tmp_path / "b.png")
    assert one.shape != other.shape or (one != other).any()


@pytest.mark.slow
def test_plots_do_with_little(tmp_path):
    error_plot(presets(), tmp_path / "a.png", columns=["hdrflip"])
    error_plot(ladder()[:1], tmp_path / "b.png", columns=["relmse_trim"])
    time_plot([3.0], {"x": {"a": [1.0]}, "y": {"b": [float("nan")]}}, tmp_path / "c.png")
    shown = [drawn(tmp_path / f"{name}.png") for name in "abc"]
    assert all(np.ptp(picture) > 0 for picture in shown)


def test_the_same_rows_give_the_same_bytes(tmp_path):
    for name in ("a.png", "b.png"):
        error_plot(ladder(), tmp_path / name)
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()


def test_depth_plot(tmp_path):
    depth_plot([*ladder(), *depths()], tmp_path / "a.png")
    drawn(tmp_path / "a.png")
    with pytest.raises(ValueError, match="depth"):
        depth_plot(ladder(), tmp_path / "b.png")


def test_depths_are_compared_with_the_deepest():
    rows = [{**item, "mean_bias": (1 + item["mean_bias"]) * 0.9 - 1} for item in depths()]
    groups = list(grouped(rows, ["max_depth"]).values())
    changes = depth_changes(groups, "mean_bias")
    assert [float(values[0]) for values in changes] == pytest.approx([-0.086, -0.028, -0.003, 0])


def test_time_plot(tmp_path):
    times = np.arange(20) / 25
    series = {"one": times + 1, "other": np.where(times > 0.1, times, np.nan)}
    time_plot(
        times, {"both": series, "bias": {"bias": times - 2}}, tmp_path / "a.png", signed=["bias"]
    )
    assert drawn(tmp_path / "a.png").std() > 0.02, "there are curves"


def test_crops_show_where_pictures_differ(tmp_path, pictures):
    windows = crops_plot(pictures, tmp_path / "a.png", costs={"draft": 1.0})
    drawn(tmp_path / "a.png")
    assert len(windows) == 3
    assert all(window.column + window.width > 48 for window in windows)


def test_flip_maps(tmp_path, pictures):
    flip_maps(pictures, tmp_path / "a.jpg")
    pixels = drawn(tmp_path / "a.jpg")
    bright = pixels.max(axis=-1) < 0.15
    assert 0.1 < bright.mean() < 0.9, "equal halves are black, others not"


def test_pair_plot(tmp_path, pictures):
    pair_plot(pictures["draft"], pictures["reference"], tmp_path / "a.png", titles=["one", "two"])
    assert drawn(tmp_path / "a.png").std() > 0.02, "there are pictures"
