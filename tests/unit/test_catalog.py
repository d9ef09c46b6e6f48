"""The catalogue: what is kept of it says what its files say."""

import pytest
import yaml

from sumo3dviz_pt import catalog


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv("SUMO3DVIZ_PT_CACHE", str(tmp_path / "cache"))
    catalog._load_yaml.cache_clear()
    yield tmp_path / "cache" / "catalogue"
    catalog._load_yaml.cache_clear()


def read_again(path):
    catalog._load_yaml.cache_clear()
    return catalog._load_yaml(path)


QUICK = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
ASSETS = sorted(catalog.data_root("assets").rglob("*.yaml"))


@pytest.mark.parametrize("path", ASSETS, ids=[f"{p.parent.name}-{p.stem}" for p in ASSETS])
def test_a_second_reading_says_the_same(path, cache):
    said = yaml.load(path.read_text(encoding="utf-8"), Loader=QUICK)
    assert read_again(path) == said
    assert len(list(cache.iterdir())) == 1
    assert read_again(path) == said


def test_the_second_reading_reads_no_yaml(monkeypatch):
    said = read_again(ASSETS[0])
    monkeypatch.delattr(yaml, "load")
    assert read_again(ASSETS[0]) == said


@pytest.mark.parametrize("text", ["", "{", "\x00", '{"changed": 1}'])
def test_a_damaged_copy_is_passed_over(text, cache):
    said = read_again(ASSETS[0])
    (kept,) = cache.rglob("content.json")
    kept.write_text(text)
    assert read_again(ASSETS[0]) == said


@pytest.mark.parametrize("text", ["1: a\n2: b\n", "day: 2026-01-01\n"])
def test_what_json_cannot_say_is_not_kept(text, tmp_path, cache):
    path = tmp_path / "asset.yaml"
    path.write_text(text)
    for _ in range(2):
        assert read_again(path) == yaml.safe_load(text)
    assert not cache.exists()


def test_where_nothing_can_be_written_it_is_read_all_the_same(tmp_path, cache):
    cache.parent.mkdir()
    cache.write_text("no folder")
    assert read_again(ASSETS[0]) == yaml.safe_load(ASSETS[0].read_text(encoding="utf-8"))
