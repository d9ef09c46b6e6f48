"""Places that are kept in the user's cache."""

import json
import shutil
from dataclasses import fields, replace

import numpy as np
import pytest
from builders import write_scenario

from sumo3dviz_pt import catalog
from sumo3dviz_pt.model.camera import CameraPath
from sumo3dviz_pt.model.scene import LeftOut
from sumo3dviz_pt.pipeline import worlds
from sumo3dviz_pt.pipeline.production import read
from sumo3dviz_pt.pipeline.scene_file import load_job
from sumo3dviz_pt.pipeline.worlds import world_of
from sumo3dviz_pt.world import cache as places

EYE = CameraPath.all_round(np.array([[20.0, 5.0, 30.0]]))


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv("SUMO3DVIZ_PT_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(places, "_LEAST", 0)
    return tmp_path / "cache" / "places"


@pytest.fixture
def built(monkeypatch):
    """Lists the places that are really built."""
    found = []
    original = places.build_place

    def listed(world, camera_path):
        found.append(original(world, camera_path))
        return found[-1]

    monkeypatch.setattr(places, "build_place", listed)
    return found


def world_in(folder, **changes):
    """The world of a small scene."""
    path = folder / "scene.yaml"
    if not path.exists():
        path = write_scenario(folder, vehicles=2, signals=True, trees=True)
    job = load_job(path, changes)
    files, scenario, _ = read(job)
    return world_of(scenario, job, files)


def same(one, other):
    """Whether two values are equal, arrays bit by bit."""
    if isinstance(one, np.ndarray):
        return one.dtype == other.dtype and one.tobytes() == other.tobytes()
    if isinstance(one, tuple | list):
        return len(one) == len(other) and all(map(same, one, other))
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(same(one[k], other[k]) for k in one)
    if hasattr(one, "__dataclass_fields__"):
        return all(same(getattr(one, f.name), getattr(other, f.name)) for f in fields(one))
    return one == other


def test_a_place_is_built_once_and_comes_back_whole(tmp_path, built):
    first = places.place_around(world_in(tmp_path), EYE)
    second = places.place_around(world_in(tmp_path), EYE)
    assert len(built) == 1 and first is built[0] and second is not first
    for part in ("static", "lamps", "left_out", "surface"):
        assert same(getattr(first, part), getattr(second, part))
    assert first.materials == second.materials and len(first.static) > 5
    roads = [part for part in first.static if part.id.startswith("road/")]
    for part in roads:
        things = first.road_owners.things(part.id, part.part.mesh)
        assert things and things == second.road_owners.things(part.id, part.part.mesh)
    points = np.random.default_rng(1).uniform(-60, 60, (200, 2))
    np.testing.assert_array_equal(first.footway(points), second.footway(points))
    assert first.signals.heads
    assert same(first.signals.radiance_at(4.0), second.signals.radiance_at(4.0))


def test_what_a_place_depends_on_makes_another_one(tmp_path, built):
    places.place_around(world_in(tmp_path), EYE)
    places.place_around(world_in(tmp_path, seed=8), EYE)
    places.place_around(world_in(tmp_path), replace(EYE, positions=EYE.positions + 250.0))
    network = next(tmp_path.glob("*.net.xml"))
    network.write_text(network.read_text("utf-8").replace("<net ", "<net  ", 1), encoding="utf-8")
    places.place_around(world_in(tmp_path), EYE)
    assert len(built) == 4
    # What a place does not show makes no difference.
    places.place_around(world_in(tmp_path, **{"quality": "draft", "output.fps": 10}), EYE)
    assert len(built) == 4


def test_pictures_of_another_installation_are_not_named(tmp_path, built, monkeypatch):
    """A place names pictures by their paths; those of an installation may be gone."""
    places.place_around(world_in(tmp_path), EYE)
    there = tmp_path / "venv"
    there.mkdir()
    (there / "assets").symlink_to(catalog.data_root("assets"))
    monkeypatch.setattr(worlds, "data_root", lambda name: there / name)
    places.place_around(world_in(tmp_path), EYE)
    assert len(built) == 2


def test_own_pictures_are_found_where_they_are_now(tmp_path, built):
    picture = catalog.data_root("assets") / "surfaces" / "ground_grass" / "albedo.png"
    named = {}
    for name in ("one", "other"):
        own = tmp_path / f"{name}.png"
        shutil.copy(picture, own)
        world = world_in(tmp_path, **{"ground.texture": str(own)})
        named[own] = repr(places.place_around(world, EYE).materials)
        assert str(own) in named[own]
        own.unlink()
    assert len(built) == 2


def test_worlds_without_a_key_and_small_places_are_not_kept(tmp_path, built, cache, monkeypatch):
    places.place_around(replace(world_in(tmp_path), key=""), EYE)
    assert not cache.exists()
    monkeypatch.setattr(places, "_LEAST", 10**9)
    places.place_around(world_in(tmp_path), EYE)
    assert not cache.exists() and len(built) == 2


def test_damaged_places_are_built_anew(tmp_path, built, cache):
    places.place_around(world_in(tmp_path), EYE)
    (file,) = cache.rglob("arrays.bin")
    content = file.read_bytes()
    file.write_bytes(content[:-10])
    places.place_around(world_in(tmp_path), EYE)
    assert len(built) == 2 and file.read_bytes()[-10:] == content[-10:]


@pytest.mark.parametrize("named", ["os.system", "os.mkdir", "subprocess.Popen", "builtins.exec"])
def test_what_somebody_else_laid_there_runs_no_code(tmp_path, built, cache, named):
    """It may name a module's attribute with or without dots, or be a pickle."""
    places.place_around(world_in(tmp_path), EYE)
    (folder,) = cache.iterdir()
    shutil.rmtree(folder)
    made = tmp_path / "made"
    words = pickled(f"mkdir {made}", named)
    tree = ["kind", named, {"path": str(made), "command": f"mkdir {made}", "args": str(made)}]
    files = {"tree.json": json.dumps(tree).encode(), "arrays.bin": b""}
    places.write_folder(folder, {**files, "place.pickle": words})
    places.place_around(world_in(tmp_path), EYE)
    assert len(built) == 2 and not made.exists()


def pickled(command, named):
    """A pickle that calls `os.system` through a module of ours that imports `os`."""
    return b"\x80\x04" + f"csumo3dviz_pt.world.cache\n{named}\n(V{command}\ntR.".encode()


def test_surprises_are_told_every_time(tmp_path, monkeypatch, caplog):
    original = places.build_place
    gone = LeftOut("signals of 2 links", "of a reason", surprising=True)
    monkeypatch.setattr(
        places, "build_place", lambda *given: replace(original(*given), left_out=(gone,))
    )
    for _ in range(2):
        caplog.clear()
        places.place_around(world_in(tmp_path), EYE)
        assert "left out signals of 2 links: of a reason" in caplog.text


def test_another_level_of_fog_or_wetness_builds_no_place_anew(tmp_path, built):
    """Only what of the weather has a shape makes another place, such as a season."""
    dry = world_in(tmp_path)
    places.place_around(dry, EYE)
    for weather in ("{preset: fog}", "{preset: dense_fog}", "{preset: after_rain}"):
        world = world_in(tmp_path, weather=weather)
        assert world.key == dry.key and world.weather is not None
        places.place_around(world, EYE)
    assert len(built) == 1
    assert world_in(tmp_path, weather="{season: winter}").key != dry.key
