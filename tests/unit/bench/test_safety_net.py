"""What two stores of pictures differ in is said, and so is what one of them lacks."""

import json

import numpy as np
import pytest
from bench.safety_net import compare

from sumo3dviz_pt.image.exr import write_exr
from sumo3dviz_pt.image.png import write_png


def stored(folder, *names, level=0.5, built="digest"):
    """A folder as `store` leaves it, of grey pictures."""
    folder.mkdir()
    for name in names:
        case, _, number = name.partition(".")
        content = {"built": {"part": ["(3,)", built]}, "costs": {"build": 1.0}}
        (folder / f"{case}.json").write_text(json.dumps(content), encoding="utf-8")
        if number:
            layers = {"radiance": np.full((9, 16, 3), level, np.float32)}
            write_exr(folder / f"{name}.exr", layers, half=False)
            write_png(folder / f"{name}.png", np.full((9, 16, 3), 255 * level, np.uint8))
    return folder


def test_equal_stores_differ_in_nothing(tmp_path):
    one, two = (stored(tmp_path / name, "day.0", "night.0") for name in ("one", "two"))
    assert list(compare(one, two)) == []


@pytest.mark.parametrize("lacking", ["one", "two"])
def test_a_case_that_one_store_lacks_is_a_difference(tmp_path, lacking):
    cases = {
        name: ["day.0"] if name == lacking else ["day.0", "night.0"] for name in ("one", "two")
    }
    one, two = (stored(tmp_path / name, *cases[name]) for name in ("one", "two"))
    having = "two" if lacking == "one" else "one"
    assert list(compare(one, two)) == [f"night: only in {having}"]
    assert list(compare(one, two, only=["day"])) == []


def test_a_picture_that_one_store_lacks_is_a_difference(tmp_path):
    one, two = stored(tmp_path / "one", "day.0", "day.1"), stored(tmp_path / "two", "day.0")
    assert list(compare(one, two)) == ["day.1.exr: missing in two"]
    assert list(compare(two, one)) == ["day.1.exr: missing in two"]


def test_other_parts_and_pixels_are_differences(tmp_path):
    one = stored(tmp_path / "one", "day.0")
    two = stored(tmp_path / "two", "day.0", level=0.25, built="another")
    parts, pixels = compare(one, two)
    assert parts == "day: part: other values" and pixels.startswith(
        "day.0.exr: 144 pixels (100.00%)"
    )
    assert (two / "day.0.differs.png").exists()
