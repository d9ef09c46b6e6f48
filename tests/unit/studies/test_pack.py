"""A pack holds a study's folder, to the byte; nothing else, and nothing outside of it."""

from __future__ import annotations

import os
import stat
import zipfile

import pytest

from sumo3dviz_pt.cli import main
from sumo3dviz_pt.errors import ConfigError, InputError
from sumo3dviz_pt.studies.folder import pack_study, unpack_study
from sumo3dviz_pt.studies.tools.datasets import CHECKSUMS, write_checksums


def finished(folder):
    """A folder such as `study` leaves, with a frame and a lock beside a film."""
    files = {
        "study.json": "{}",
        "inputs/study.yaml": "scene: scene.yaml\n",
        "inputs/net.net.xml": "<net/>" * 500,
        "materials/day.mp4": "film",
        "materials/day.json": '{"frames": []}',
    }
    beside = {
        "materials/day.frames/000000.exr": "frame",
        "materials/day.layers/frames/000000.json": "{}",
        "materials/day.frames/render.lock": "",
        "notes.txt": "mine",
    }
    for name, text in {**files, **beside}.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text, encoding="utf-8")
    write_checksums(folder, [folder / name for name in files])
    return folder


@pytest.fixture
def made(tmp_path):
    return finished(tmp_path / "made")


def everything(folder):
    found = {p.relative_to(folder).as_posix(): p for p in folder.rglob("*") if p.is_file()}
    return {name: path.read_bytes() for name, path in found.items()}


def test_what_is_unpacked_is_what_was_packed(made, tmp_path):
    packed = pack_study(made, tmp_path / "a.zip", frames=False)
    assert (packed.files, packed.beside) == (6, len("frame{}"))
    count = unpack_study(tmp_path / "a.zip", tmp_path / "there")
    own = everything(made)
    assert everything(tmp_path / "there") == {
        name: own[name]
        for name in own
        if ".frames/" not in name and ".layers/" not in name and name != "notes.txt"
    }
    assert count == 6
    pack_study(made, tmp_path / "b.zip", frames=True)
    unpack_study(tmp_path / "b.zip", tmp_path / "whole")
    assert {*everything(tmp_path / "whole")} - {*everything(tmp_path / "there")} == {
        "materials/day.frames/000000.exr",
        "materials/day.layers/frames/000000.json",
    }


def test_the_same_folder_gives_the_same_bytes_at_all_times(made, tmp_path):
    pack_study(made, tmp_path / "a.zip", frames=True)
    for path in made.rglob("*"):
        os.utime(path, (1, 1))
        if path.is_file():
            path.chmod(0o600)
    there = finished(tmp_path / "other" / "place")
    for number, folder in enumerate((made, there)):
        pack_study(folder, tmp_path / f"{number}.zip", frames=True)
        assert (tmp_path / f"{number}.zip").read_bytes() == (tmp_path / "a.zip").read_bytes()


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (
            lambda f: (f / "inputs/net.net.xml").write_text("<net></net>"),
            "1 of them inputs.*net.net",
        ),
        (lambda f: (f / "materials/day.mp4").unlink(), "none of them an input.*materials/day.mp4"),
        (lambda f: (f / "study.json").unlink(), "is no study's folder: it has no study.json"),
        (lambda f: (f / CHECKSUMS).unlink(), "is no finished study, or an older version made it"),
    ],
)
def test_folders_that_are_not_what_they_were_are_refused(made, tmp_path, spoil, words):
    spoil(made)
    with pytest.raises(InputError, match=words):
        pack_study(made, tmp_path / "a.zip", frames=False)
    assert not list(tmp_path.glob("*.zip*"))


def test_nothing_is_overwritten_unasked(made, tmp_path, capsys):
    out = tmp_path / "a.zip"
    words = ["study", "pack", str(made), "-o", str(out)]
    assert main(words) == 0
    assert "--frames packs them" in capsys.readouterr().out
    assert main(words) == 2
    assert "exists already; --overwrite replaces it" in capsys.readouterr().err
    assert main([*words, "--overwrite", "--frames"]) == 0
    assert main(["study", "unpack", str(out), "-o", str(made)]) == 2
    assert "holds something already; give a new folder" in capsys.readouterr().err
    assert main(["study", "unpack", str(out), "-o", str(tmp_path / "new")]) == 0
    with pytest.raises(ConfigError, match=r"a pack is a \.zip, not a\.tar"):
        pack_study(made, tmp_path / "a.tar", frames=False)


def zipped(path, names, *, mode=stat.S_IFREG | 0o644):
    with zipfile.ZipFile(path, "w") as archive:
        for name in names:
            info = zipfile.ZipInfo(name)
            info.external_attr = mode << 16
            archive.writestr(info, b"")
    return path


@pytest.mark.parametrize(
    "name",
    ["../evil", "a/../../evil", "/evil", "C:/evil", "..\\evil", "a//b", "./a", "folder/", ""],
)
def test_no_file_of_a_pack_lies_outside_of_its_folder(tmp_path, name):
    pack = zipped(tmp_path / "a.zip", [CHECKSUMS, name])
    with pytest.raises(InputError, match="no plain file in it"):
        unpack_study(pack, tmp_path / "in" / "there")
    assert {*everything(tmp_path)} == {"a.zip"} and not (tmp_path / "in" / "there").exists()


def test_packs_that_are_none_are_refused(made, tmp_path):
    def refused(words, path):
        with pytest.raises(InputError, match=words):
            unpack_study(path, tmp_path / "there")
        assert not (tmp_path / "there").exists()

    refused(
        "no plain file", zipped(tmp_path / "l.zip", [CHECKSUMS, "a"], mode=stat.S_IFLNK | 0o777)
    )
    refused("'A' twice", zipped(tmp_path / "t.zip", [CHECKSUMS, "a", "A"]))
    refused("it has no checksums", zipped(tmp_path / "n.zip", ["a"]))
    refused("there is no such pack", tmp_path / "gone.zip")
    (tmp_path / "text.zip").write_text("text", encoding="utf-8")
    refused("cannot be unpacked: File is not a zip file", tmp_path / "text.zip")
    pack_study(made, tmp_path / "a.zip", frames=False)
    data = (tmp_path / "a.zip").read_bytes()
    (tmp_path / "bent.zip").write_bytes(data.replace(b"film", b"fil_"))
    refused("cannot be unpacked: Bad CRC-32", tmp_path / "bent.zip")
    (made / "materials" / "day.mp4").write_text("fil_", encoding="utf-8")
    with (
        zipfile.ZipFile(tmp_path / "a.zip") as old,
        zipfile.ZipFile(tmp_path / "n.zip", "w") as new,
    ):
        for name in old.namelist():
            new.writestr(name, old.read(name).replace(b"film", b"fil_"))
    refused("materials/day.mp4 in it is not what it was", tmp_path / "n.zip")
