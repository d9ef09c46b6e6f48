import json

import numpy as np
import pytest

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.image.exr import (
    HALF_MAX,
    PROVENANCE,
    read_channels,
    read_exr,
    write_channels,
    write_exr,
    write_parts,
)


@pytest.fixture
def radiance():
    return np.random.default_rng(3).gamma(0.5, 2.0, (13, 21, 3)).astype(np.float32)


def test_float_round_trip_is_exact(tmp_path, radiance):
    write_exr(tmp_path / "a.exr", {"radiance": radiance}, half=False)
    assert np.array_equal(read_exr(tmp_path / "a.exr")[0], radiance)


def test_half_round_trip_rounds_to_11_bits(tmp_path, radiance):
    write_exr(tmp_path / "a.exr", {"radiance": radiance})
    again, _ = read_exr(tmp_path / "a.exr")
    assert np.allclose(again, radiance, rtol=2**-11, atol=1e-7)
    assert not np.array_equal(again, radiance)


def test_half_clips_the_sun(tmp_path):
    bright = np.array([[[1e9, -1e9, 1.0]]], np.float32)
    write_exr(tmp_path / "a.exr", {"radiance": bright})
    assert read_exr(tmp_path / "a.exr")[0].tolist() == [[[HALF_MAX, -HALF_MAX, 1.0]]]


def test_attributes_survive(tmp_path, radiance):
    made = json.dumps({"seed": 7, "place": "Zürich"}, ensure_ascii=False)
    write_exr(tmp_path / "a.exr", {"radiance": radiance}, attributes={PROVENANCE: made})
    strings = read_exr(tmp_path / "a.exr")[1]
    assert strings[PROVENANCE] == made


def test_same_pixels_same_bytes_and_no_leftovers(tmp_path, radiance):
    for name in ("a.exr", "b.exr"):
        write_exr(tmp_path / name, {"radiance": radiance}, attributes={PROVENANCE: "x"})
    assert (tmp_path / "a.exr").read_bytes() == (tmp_path / "b.exr").read_bytes()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.exr", "b.exr"]


def test_extra_layers_are_stored_beside_the_colours(tmp_path, radiance):
    import OpenEXR

    depth = np.full((13, 21), 1e6, np.float32)
    write_exr(tmp_path / "a.exr", {"radiance": radiance, "depth": depth, "albedo": radiance})
    with OpenEXR.File(str(tmp_path / "a.exr")) as file:
        channels = file.channels()
        assert np.array_equal(channels["depth"].pixels, depth)
        assert channels["albedo"].pixels.dtype == np.float16
    assert read_exr(tmp_path / "a.exr")[0].shape == (13, 21, 3)


def test_missing_and_damaged_files_are_named(tmp_path, radiance):
    with pytest.raises(InputError, match="no such file"):
        read_exr(tmp_path / "none.exr")
    (tmp_path / "bad.exr").write_bytes(b"not an image")
    with pytest.raises(InputError, match=r"bad\.exr: not a readable OpenEXR"):
        read_exr(tmp_path / "bad.exr")


def test_file_without_colours_is_refused(tmp_path):
    import OpenEXR

    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    with OpenEXR.File(header, {"Z": np.zeros((2, 2), np.float32)}) as file:
        file.write(str(tmp_path / "z.exr"))
    with pytest.raises(InputError, match="no R, G and B"):
        read_exr(tmp_path / "z.exr")


def test_wrong_shape_is_refused(tmp_path):
    with pytest.raises(ValueError, match=r"\(h, w, 3\)"):
        write_exr(tmp_path / "a.exr", {"radiance": np.zeros((4, 4), np.float32)})


def test_unwritable_folder_leaves_an_os_error(tmp_path, radiance):
    with pytest.raises(OSError, match="cannot write"):
        write_exr(tmp_path / "nowhere" / "a.exr", {"radiance": radiance})


def test_parts_have_names_and_their_channels_come_back_as_they_were(tmp_path):
    import OpenEXR

    depth = np.linspace(0, 9, 12, dtype=np.float32).reshape(3, 4)
    parts = {
        "depth": {"Z": depth},
        "normals": {"X": depth.astype(np.float16), "Y": -depth.astype(np.float16)},
        "instance": {"id": np.full((3, 4), 2**32 - 1, np.uint32)},
    }
    for name in ("a.exr", "b.exr"):
        write_parts(tmp_path / name, parts)
    assert (tmp_path / "a.exr").read_bytes() == (tmp_path / "b.exr").read_bytes()
    with OpenEXR.File(str(tmp_path / "a.exr")) as file:
        assert [part.name() for part in file.parts] == [*parts]
        assert {part.compression() for part in file.parts} == {OpenEXR.ZIP_COMPRESSION}
    found, _ = read_channels(tmp_path / "a.exr")
    assert {*found} == {"depth.Z", "normals.X", "normals.Y", "instance.id"}
    for name, values in found.items():
        part, _, channel = name.partition(".")
        assert values.dtype == parts[part][channel].dtype
        np.testing.assert_array_equal(values, parts[part][channel])


def test_files_of_one_part_give_the_same_channels_as_files_of_several(tmp_path):
    """What earlier versions wrote can still be read."""
    depth = np.ones((3, 4), np.float32)
    write_channels(tmp_path / "old.exr", {"depth.Z": depth}, {"made": "x"})
    write_parts(tmp_path / "new.exr", {"depth": {"Z": depth}})
    for name in ("old.exr", "new.exr"):
        channels, _ = read_channels(tmp_path / name)
        assert [*channels] == ["depth.Z"]
    assert read_channels(tmp_path / "old.exr")[1]["made"] == "x"
