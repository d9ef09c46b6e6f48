"""A rendered picture: what notebooks show of it is what is saved."""

from __future__ import annotations

import io
import json
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from builders import complaints, write_scenario
from PIL import Image

from sumo3dviz_pt.cli import main
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.pipeline.still import Still

GREY = Still(np.ones((4, 6, 3), np.float32), 0.0, "srgb", 0.0, True, {"seed": 3}, None)


def test_notebooks_show_the_developed_picture(tmp_path):
    radiance = np.random.default_rng(3).random((9, 16, 3)).astype(np.float32)
    still = Still(radiance, 0.0, "srgb", 0.0, True, {"seed": 3}, None)
    shown = still._repr_png_()
    with Image.open(io.BytesIO(shown)) as picture:
        picture.load()
        assert json.loads(picture.text["provenance"]) == {"seed": 3}
        np.testing.assert_array_equal(np.asarray(picture), still.develop())
    still.save(tmp_path / "a.png")
    with Image.open(tmp_path / "a.png") as saved:
        np.testing.assert_array_equal(np.asarray(saved), still.develop())


def a_pipe(folder: Path) -> Path:
    os.mkfifo(folder / "pipe.png")
    return folder / "pipe.png"


def a_link_to_a_device(folder: Path) -> Path:
    (folder / "link.png").symlink_to(os.devnull)
    return folder / "link.png"


def a_file(folder: Path) -> Path:
    (folder / "file.png").write_bytes(b"mine")
    return folder / "file.png"


def a_folder(folder: Path) -> Path:
    (folder / "folder.png").mkdir()
    return folder / "folder.png"


PLACES = {
    "no folder": lambda folder: folder / "none" / "a.png",
    "another ending": lambda folder: folder / "a.jpg",
    "a file": a_file,
    "a folder": a_folder,
    **({"a pipe": a_pipe, "a device": a_link_to_a_device} if hasattr(os, "mkfifo") else {}),
}


def there(folder: Path) -> list[tuple[object, ...]]:
    """What lies in a folder, links unfollowed."""
    found = sorted((each.name, each.lstat()) for each in folder.iterdir())
    return [(name, one.st_mode, one.st_ino, one.st_size) for name, one in found]


@pytest.mark.parametrize("place", PLACES)
def test_a_picture_is_refused_a_place_as_the_command_refuses_it(place, tmp_path, capsys):
    """Before anything is touched, in one sentence, which is the command's but for its option."""
    scene, path = write_scenario(tmp_path), PLACES[place](tmp_path)
    before = there(tmp_path)
    with pytest.raises(ConfigError) as caught:
        GREY.save(path, overwrite=False)
    assert main(["still", str(scene), "--time", "4", "-o", str(path)]) == 2
    (said,) = complaints(capsys.readouterr().err)
    assert str(caught.value).replace("overwrite=True", "--overwrite") in said
    assert there(tmp_path) == before


@pytest.mark.parametrize("place", [name for name in PLACES if name not in ("a file", "no folder")])
def test_who_may_overwrite_may_not_replace_what_is_no_file(place, tmp_path):
    path = PLACES[place](tmp_path)
    before = there(tmp_path)
    with pytest.raises(ConfigError):
        GREY.save(path)
    assert there(tmp_path) == before


def test_a_picture_does_not_replace_what_it_was_made_from(tmp_path):
    """By whatever name, and whoever may overwrite."""
    texture, link = a_file(tmp_path), tmp_path / "other.png"
    link.symlink_to(texture)
    still = replace(GREY, reads=(tmp_path / "gone.xml", texture))
    for path in (texture, link):
        with pytest.raises(ConfigError, match=r"file\.png is read for this, and would be lost"):
            still.save(path)
    assert texture.read_bytes() == b"mine" and link.is_symlink()
