"""PNG files of numbers keep all of them."""

import numpy as np
import pytest
from needed import package

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.image.layers import read_numbers, write_numbers


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
@pytest.mark.parametrize("shape", [(7, 5), (7, 5, 3), (1, 1)])
def test_all_numbers_come_back(tmp_path, dtype, shape):
    numbers = np.random.default_rng(3).integers(0, np.iinfo(dtype).max, shape, dtype, endpoint=True)
    write_numbers(tmp_path / "a.png", numbers)
    found = read_numbers(tmp_path / "a.png")
    assert found.dtype == dtype
    np.testing.assert_array_equal(found, numbers)


def test_another_program_reads_the_same(tmp_path):
    pillow = package("PIL.Image")
    numbers = np.random.default_rng(4).integers(0, 65535, (9, 8), np.uint16)
    write_numbers(tmp_path / "a.png", numbers)
    np.testing.assert_array_equal(np.asarray(pillow.open(tmp_path / "a.png")), numbers)


@pytest.mark.parametrize("numbers", [np.zeros((2, 2)), np.zeros((2, 2, 4), np.uint8)])
def test_what_no_png_holds_is_refused(tmp_path, numbers):
    with pytest.raises(ValueError, match="as PNG"):
        write_numbers(tmp_path / "a.png", numbers)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("content", [b"", b"no PNG", None])
def test_damaged_files_are_named(tmp_path, content):
    path = tmp_path / "a.png"
    write_numbers(path, np.arange(6, dtype=np.uint8).reshape(2, 3))
    path.write_bytes(path.read_bytes()[:-20] if content is None else content)
    with pytest.raises(InputError, match=r"a\.png"):
        read_numbers(path)
    with pytest.raises(InputError, match=r"b\.png"):
        read_numbers(tmp_path / "b.png")
