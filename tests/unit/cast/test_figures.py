"""People in all their poses: what is kept is what was built, to the last bit."""

import numpy as np
import pytest

from sumo3dviz_pt import catalog
from sumo3dviz_pt.cast import figures
from sumo3dviz_pt.library.people.people import figure
from sumo3dviz_pt.library.vehicles.cycles.pedalling import pedalling

LOOK, BIKE = "girl", "bicycle"


@pytest.fixture
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv("SUMO3DVIZ_PT_CACHE", str(tmp_path))
    figures.person.cache_clear()
    yield tmp_path
    figures.person.cache_clear()


def assert_same(kept, built):
    """Down to the last bit: pixels hang on it."""
    (parts, poses), (others, shapes) = kept, built
    assert [part.material for part in parts] == [part.material for part in others]
    for one, other in zip(parts, others, strict=True):
        pairs = [(getattr(one.mesh, key), getattr(other.mesh, key))
                 for key in ("vertices", "faces", "normals", "uvs")]  # fmt: skip
        for a, b in (*pairs, (one.tint, other.tint)):
            assert (a is None) == (b is None)
            assert a is None or (a.dtype == b.dtype and np.array_equal(a, b))
    assert np.array_equal(poses.vertices, shapes.vertices)
    assert np.array_equal(poses.normals, shapes.normals)


def test_a_person_from_the_cache_is_the_one_that_is_built(cache):
    first = figures.person(LOOK)
    figures.person.cache_clear()
    again = figures.person(LOOK)
    recipe = catalog.find("people", LOOK).meta["recipe"]
    for made in (first, again):
        assert_same((made.parts, made.poses), figure(recipe))
        assert_same((made.far, made.far_poses), figure(recipe, "far"))
    assert [folder.name.split("-")[0] for folder in (cache / "people").iterdir()] == [LOOK]


def test_a_cyclist_from_the_cache_is_the_one_that_is_built(cache):
    entry = catalog.find("vehicles", BIKE)
    built = pedalling(entry.meta)
    for _ in range(2):
        assert_same(figures.cyclist(entry), built)


def test_what_is_kept_is_read_and_not_built_again(cache, monkeypatch):
    figures.person(LOOK)
    figures.person.cache_clear()
    monkeypatch.setattr(figures, "figure", None)
    assert figures.person(LOOK).parts
