"""Full detail from the cache: built once, the same each time, never half."""

import logging
import os
import shutil
import subprocess
import sys

import numpy as np
import pytest
from bakery.bake import has_full_detail

from sumo3dviz_pt import catalog
from sumo3dviz_pt.cast import full_detail, kept_bodies
from sumo3dviz_pt.cast.bodies import build_body
from sumo3dviz_pt.cast.choice import ModelChoice, models_for
from sumo3dviz_pt.cast.full_detail import full_bodies, full_prototypes
from sumo3dviz_pt.files.kept import read_whole
from sumo3dviz_pt.library.materials.named import MATERIALS

SMALL = "e_scooter"


@pytest.fixture
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv("SUMO3DVIZ_PT_CACHE", str(tmp_path))
    return tmp_path / "vehicles"


def test_who_has_full_detail():
    assert all(has_full_detail(catalog.find("vehicles", name).meta) for name in ("sedan", SMALL))
    assert not has_full_detail(catalog.find("vehicles", "tram").meta), (
        "coupled vehicles show their units"
    )


def test_body_and_wheel_in_known_materials(cache):
    made = full_prototypes([SMALL])
    assert set(made) == {f"{SMALL}/full", f"{SMALL}/wheel"}
    for name, prototype in made.items():
        assert prototype.name == name and prototype.parts and not prototype.far
        assert {part.material for part in prototype.parts} <= set(MATERIALS)
    body = np.concatenate([p.mesh.vertices for p in made[f"{SMALL}/full"].parts])
    length = catalog.find("vehicles", SMALL).meta["length"]
    assert body[:, 0].min() == pytest.approx(-length, abs=0.3)
    wheel = np.concatenate([p.mesh.vertices for p in made[f"{SMALL}/wheel"].parts])
    radius = catalog.find("vehicles", SMALL).meta["wheels"][0]["radius"]
    assert wheel[:, 2].max() == pytest.approx(radius, rel=0.02)
    assert wheel[:, 2].min() == pytest.approx(-radius, rel=0.02)


def test_built_once_and_read_again(cache, caplog):
    full_detail._built.cache_clear()
    with caplog.at_level(logging.INFO, logger="sumo3dviz_pt"):
        first = full_prototypes([SMALL])
        assert [record.getMessage() for record in caplog.records if "building" in record.msg] == [
            f"building {SMALL} in full detail"
        ]
        stamps = {path: path.stat().st_mtime_ns for path in cache.rglob("*.ply")}
        caplog.clear()
        again = full_prototypes([SMALL])
    assert not caplog.records and stamps
    assert stamps == {path: path.stat().st_mtime_ns for path in cache.rglob("*.ply")}
    for name, prototype in first.items():
        for one, other in zip(prototype.parts, again[name].parts, strict=True):
            np.testing.assert_array_equal(one.mesh.vertices, other.mesh.vertices)
            np.testing.assert_array_equal(one.mesh.faces, other.mesh.faces)


def test_another_recipe_lies_elsewhere(cache, monkeypatch, tmp_path):
    full_prototypes([SMALL])
    entry = catalog.find("vehicles", SMALL)
    changed = tmp_path / "asset.yaml"
    text = (entry.folder / "asset.yaml").read_text(encoding="utf-8")
    changed.write_text(text + "# changed\n", encoding="utf-8")
    monkeypatch.setattr(catalog, "recipe_files", lambda _: (changed,))
    full_prototypes([SMALL])
    assert len(list(cache.iterdir())) == 2


def vertices_of(made):
    return {
        (name, part.material): part.mesh.vertices for name, p in made.items() for part in p.parts
    }


def assert_same_bodies(one, other):
    """Down to the last bit: pixels hang on it."""
    one, other = vertices_of(one), vertices_of(other)
    assert set(one) == set(other)
    for key, vertices in one.items():
        np.testing.assert_array_equal(vertices, other[key], err_msg=str(key))


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
@pytest.mark.parametrize("which", ["*/*.ply", "*"])
def test_a_damaged_cache_heals(cache, harm, which):
    """One file less drew other pixels; a cut one stopped every render for ever."""
    first = full_prototypes([SMALL])
    (folder,) = cache.iterdir()
    stored = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    harm(next(path for path in sorted(folder.glob(which)) if path.is_file()))
    assert_same_bodies(full_prototypes([SMALL]), first)
    assert {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()} == stored
    assert list(cache.iterdir()) == [folder], "nothing is left lying about"


def test_without_a_place_to_write_bodies_stay_in_memory(cache, caplog, tmp_path, monkeypatch):
    """No writable cache ended in errno 2; one note says so, and nothing is built twice."""
    first = full_prototypes([SMALL])
    full_detail._built.cache_clear()
    (tmp_path / "a file").write_text("no folder", encoding="utf-8")
    monkeypatch.setenv("SUMO3DVIZ_PT_CACHE", str(tmp_path / "a file"))
    with caplog.at_level(logging.INFO, logger="sumo3dviz_pt"):
        for _ in range(2):
            assert_same_bodies(full_prototypes([SMALL]), first)
    said = [record.getMessage() for record in caplog.records]
    assert len([words for words in said if words.startswith("building")]) == 1
    (note,) = [record.getMessage() for record in caplog.records if record.levelname == "WARNING"]
    assert "cannot be written" in note and "SUMO3DVIZ_PT_CACHE" in note


def test_a_full_disk_leaves_nothing_and_stops_nothing(cache, monkeypatch, caplog):
    def fail(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("pathlib.Path.write_bytes", fail)
    assert full_prototypes([SMALL])[f"{SMALL}/full"].parts
    assert list(cache.iterdir()) == [] and "No space left" in caplog.text


def test_nobody_near_builds_nothing(cache):
    assert full_prototypes([]) == {}
    assert not cache.exists()


def test_what_old_code_left_goes_after_a_month(cache):
    """Bodies of another version go when they are old; a running film may still read young ones."""
    old, young = (cache / f"{SMALL}-{'0' * 15}{digit}" for digit in "01")
    other = cache / f"sedan-{'0' * 16}"
    for folder in (old, young, other):
        folder.mkdir(parents=True)
    for folder in (old, other):
        os.utime(folder, (1e9, 1e9))
    full_prototypes([SMALL])
    assert not old.exists() and young.is_dir() and other.is_dir()


@pytest.mark.parametrize("broken", [False, True])
def test_two_processes_build_at_once(cache, broken):
    """The slower one takes what the faster one made; both heal a broken one."""
    if broken:
        full_prototypes([SMALL])
        lose(sorted(cache.glob("*/wheel/*.ply"))[0])
    name = "sumo3dviz_pt.cast.full_detail"
    code = f"from {name} import full_prototypes as h; print(len(h(['{SMALL}'])))"
    both = [subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE) for _ in "ab"]
    assert [process.communicate()[0].strip() for process in both] == [b"2", b"2"]
    (folder,) = cache.iterdir()
    assert read_whole(folder) is not None


def test_a_stretched_body_keeps_its_full_detail_and_its_wheels():
    """A van that gives between its axles: wheels where they were on either side, and round."""
    model = next(model for model in models_for({}) if model.name == "delivery_van")
    length, *other = model.size
    own, longer = (
        build_body(ModelChoice(model, "delivery", (size, *other)), {}).assembly.units[0]
        for size in (length, length + 1.0)
    )
    assert own.full != longer.full and own.wheel == longer.wheel
    made = full_bodies([own, longer])
    assert set(made) == {own.full, longer.full, own.wheel}
    rears = [
        min(part.mesh.vertices[:, 0].min() for part in made[u.full].parts) for u in (own, longer)
    ]
    assert rears[0] - rears[1] == pytest.approx(1.0, abs=0.26), "bodies come in half metres"
    moved = [one.at[0] - other.at[0] for one, other in zip(own.wheels, longer.wheels, strict=True)]
    assert min(moved) == 0.0 and max(moved) == pytest.approx(rears[0] - rears[1])
    assert made[longer.full].lamps == longer.prototype.lamps


def test_code_anywhere_in_the_library_is_in_the_names_of_bodies(tmp_path, monkeypatch):
    def known_as():
        catalog.code_digest.cache_clear()
        return kept_bodies.kept_folder(catalog.find("vehicles", SMALL), "vehicles").name

    shutil.copytree(catalog.package_folder("library"), tmp_path / "library")
    own = known_as()
    monkeypatch.setattr(catalog, "package_folder", lambda name: tmp_path / name)
    assert known_as() == own, "not where the library lies"
    car = tmp_path / "library" / "vehicles" / "car"
    (car / "build.py").rename(car / "assembly.py")
    assert known_as() == own, "nor how its files are called"
    with (car / "panels.py").open("a", encoding="utf-8") as file:
        file.write("\n")
    assert known_as() != own
    catalog.code_digest.cache_clear()
