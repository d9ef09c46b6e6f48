import numpy as np
import pytest
from PIL import Image as Pillow

from sumo3dviz_pt.image.png import write_png


@pytest.mark.parametrize("shape", [(7, 5, 3), (7, 5), (1, 1, 3), (64, 64, 3)])
def test_other_readers_see_the_same_pixels(tmp_path, shape):
    pixels = np.random.default_rng(1).integers(0, 256, shape, np.uint8)
    write_png(tmp_path / "a.png", pixels)
    with Pillow.open(tmp_path / "a.png") as picture:
        assert np.array_equal(np.asarray(picture), pixels)


def test_smooth_pictures_use_filters(tmp_path):
    ramp = np.add.outer(np.arange(200), np.arange(300)).astype(np.uint8)
    write_png(tmp_path / "a.png", np.stack([ramp, ramp // 2, ramp // 3], axis=-1))
    with Pillow.open(tmp_path / "a.png") as picture:
        assert np.array_equal(np.asarray(picture)[..., 0], ramp)
    assert (tmp_path / "a.png").stat().st_size < 4000


def test_comment_and_colour_space_are_stored(tmp_path):
    write_png(tmp_path / "a.png", np.zeros((2, 2, 3), np.uint8), text={"Comment": '{"é": 1}'})
    with Pillow.open(tmp_path / "a.png") as picture:
        assert picture.info["Comment"] == '{"é": 1}'
        assert picture.info["srgb"] == 0


def test_other_arrays_are_refused(tmp_path):
    for wrong in (np.zeros((2, 2, 3)), np.zeros((2, 2, 4), np.uint8), np.zeros(4, np.uint8)):
        with pytest.raises(ValueError, match="PNG needs"):
            write_png(tmp_path / "a.png", wrong)


def test_nothing_half_written_stays(tmp_path):
    with pytest.raises(FileNotFoundError):
        write_png(tmp_path / "nowhere" / "a.png", np.zeros((2, 2, 3), np.uint8))
    assert not list(tmp_path.iterdir())
