"""Bodies in the cache: built once, the same each time, never half."""

import os
import shutil
import subprocess
import sys

import pytest

from sumo3dviz_pt import catalog
from sumo3dviz_pt.cast.figures import cache_folder, cached_files
from sumo3dviz_pt.files.atomic import read_folder

LOOK = "girl"
FILES = {"near.npz": b"arms and legs" * 20, "far.npz": b"a head" * 20}


@pytest.fixture
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv("SUMO3DVIZ_PT_CACHE", str(tmp_path))
    return tmp_path / "people"


def folder_of(name=LOOK):
    return cache_folder(catalog.find("people", name), "people")


def build():
    return FILES


def never():
    raise AssertionError("built again")


def test_built_once_and_read_again(cache):
    assert cached_files(folder_of(), build) == FILES == cached_files(folder_of(), never)


def test_another_recipe_lies_elsewhere(cache, monkeypatch, tmp_path):
    cached_files(folder_of(), build)
    changed = tmp_path / "asset.yaml"
    text = (catalog.find("people", LOOK).folder / "asset.yaml").read_text(encoding="utf-8")
    changed.write_text(text + "# changed\n", encoding="utf-8")
    monkeypatch.setattr(catalog, "recipe_files", lambda _: (changed,))
    cached_files(folder_of(), build)
    assert len(list(cache.iterdir())) == 2


def lose(path):
    path.unlink()


def cut(path):
    path.write_bytes(path.read_bytes()[:-100])


def flip(path):
    """A single bit, as failing disks do."""
    content = bytearray(path.read_bytes())
    content[-1] ^= 1
    path.write_bytes(content)


@pytest.mark.parametrize("harm", [lose, cut, flip])
@pytest.mark.parametrize("which", ["*.npz", "*.json"])
def test_a_damaged_cache_heals(cache, harm, which):
    """One file less drew other pixels; a cut one stopped every render for ever."""
    cached_files(folder_of(), build)
    (folder,) = cache.iterdir()
    stored = {path: path.read_bytes() for path in folder.iterdir()}
    harm(sorted(folder.glob(which))[0])
    assert cached_files(folder_of(), build) == FILES
    assert {path: path.read_bytes() for path in folder.iterdir()} == stored
    assert list(cache.iterdir()) == [folder], "nothing is left lying about"


def test_without_a_place_to_write_one_note_says_so(caplog, tmp_path, monkeypatch):
    """No writable cache ended in errno 2."""
    (tmp_path / "a file").write_text("no folder", encoding="utf-8")
    monkeypatch.setenv("SUMO3DVIZ_PT_CACHE", str(tmp_path / "a file"))
    for _ in range(2):
        assert cached_files(folder_of(), build) == FILES
    (note,) = [record.getMessage() for record in caplog.records if record.levelname == "WARNING"]
    assert "cannot be written" in note and "SUMO3DVIZ_PT_CACHE" in note


def test_a_full_disk_leaves_nothing_and_stops_nothing(cache, monkeypatch, caplog):
    def fail(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("pathlib.Path.write_bytes", fail)
    assert cached_files(folder_of(), build) == FILES
    assert list(cache.iterdir()) == [] and "No space left" in caplog.text


def test_what_old_code_left_goes_after_a_month(cache):
    """Bodies of another version go when they are old; a running film may still read young ones."""
    old, young = (cache / f"{LOOK}-{'0' * 15}{digit}" for digit in "01")
    other = cache / f"boy-{'0' * 16}"
    for folder in (old, young, other):
        folder.mkdir(parents=True)
    for folder in (old, other):
        os.utime(folder, (1e9, 1e9))
    cached_files(folder_of(), build)
    assert not old.exists() and young.is_dir() and other.is_dir()


@pytest.mark.slow
@pytest.mark.parametrize("broken", [False, True])
def test_two_processes_build_at_once(cache, broken):
    """The slower one takes what the faster one made; both heal a broken one."""
    target = folder_of()
    if broken:
        cached_files(target, build)
        lose(sorted(cache.glob("*/*.npz"))[0])
    code = (
        "import pathlib, time; from sumo3dviz_pt.cast.figures import cached_files as h\n"
        f"def make(): time.sleep(0.3); return {FILES!r}\n"
        f"print(len(h(pathlib.Path({str(target)!r}), make)))"
    )
    both = [subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE) for _ in "ab"]
    assert [process.communicate()[0].strip() for process in both] == [b"2", b"2"]
    (folder,) = cache.iterdir()
    assert read_folder(folder) is not None


def test_code_anywhere_in_the_library_is_in_the_names_of_bodies(tmp_path, monkeypatch):
    def known_as():
        catalog.code_digest.cache_clear()
        return folder_of().name

    shutil.copytree(catalog.package_folder("library"), tmp_path / "library")
    own = known_as()
    monkeypatch.setattr(catalog, "package_folder", lambda name: tmp_path / name)
    assert known_as() == own, "not where the library lies"
    people = tmp_path / "library" / "people"
    (people / "skin.py").rename(people / "curls.py")
    assert known_as() == own, "nor how its files are called"
    with (people / "head.py").open("a", encoding="utf-8") as file:
        file.write("\n")
    assert known_as() != own
    catalog.code_digest.cache_clear()
