"""Logs that are kept in the user's cache."""

import numpy as np
import pytest

from sumo3dviz_pt.sumo import fcd, read_trajectories, reader


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv("SUMO3DVIZ_PT_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(reader, "_LEAST", 0)
    return tmp_path / "cache" / "logs"


@pytest.fixture
def readings(monkeypatch):
    """Counts how often a log is really read."""
    found = []
    original = fcd.LogReader.read

    def counted(self, **options):
        found.append(self.file)
        original(self, **options)

    monkeypatch.setattr(fcd.LogReader, "read", counted)
    return found


TYPES = ("ü", "ü@v")


def write(path, x=0.0, end="</fcd-export>"):
    rows = "".join(
        f'<timestep time="{t}"><vehicle id="v" x="{x + t}" y="2" angle="90"'
        f' type="{TYPES[t > 4]}" lane="a_0"/><person id="p" x="{t}" y="9" angle="0" edge="a"'
        f' vehicle="{"v" * (t == 4)}"/></timestep>\n'
        for t in range(9)
    )
    path.write_text(f"<fcd-export>\n{rows}{end}", encoding="utf-8")
    return path


def values(log):
    fields = ("times", "positions", "yaws", "speeds", "slopes", "lanes", "signals", "offsets")
    return [
        (t.kind, t.id, t.type_id, *(str(getattr(t, name).tolist()) for name in fields))
        for t in log.traces
    ] + [log.lane_names, log.begin, log.end, log.step, log.changed, log.taken]


def test_a_log_is_read_once(tmp_path, readings):
    path = write(tmp_path / "log.xml")
    first = read_trajectories([path], begin=2, end=5)
    second = read_trajectories([path], begin=2, end=5)
    assert values(first) == values(second)
    assert (second.changed, second.taken) == ({"vehicle:v": 5.0}, {"vehicle:v": ((4.0, 4.0),)})
    assert len(readings) == 1
    for trace in second.traces:
        assert trace.lanes.dtype == np.int64 and not trace.positions.flags.writeable


def test_every_question_has_its_own_answer(tmp_path, readings):
    path = write(tmp_path / "log.xml")
    ends = [read_trajectories([path], end=end).end for end in (3, 4, None, 3)]
    assert ends == [3, 4, 8, 3]
    read_trajectories([path], end=3, margin=1.0)
    assert len(readings) == 4


def test_a_changed_log_is_read_again(tmp_path, readings):
    path = write(tmp_path / "log.xml")
    read_trajectories([path])
    changed = read_trajectories([write(path, x=1.0)])
    assert changed.traces[0].positions[0, 0] == 1.0
    assert len(readings) == 2


@pytest.mark.parametrize("damage", [b"", b"0" * 100])
def test_a_damaged_log_is_read_again(tmp_path, cache, readings, damage):
    path = write(tmp_path / "log.xml")
    first = read_trajectories([path])
    for file in cache.glob("*/positions"):
        file.write_bytes(damage)
    assert values(read_trajectories([path])) == values(first)
    assert values(read_trajectories([path])) == values(first)
    assert len(readings) == 2


def test_a_log_that_breaks_off_is_not_kept(tmp_path, cache):
    path = write(tmp_path / "log.xml", end="")
    read_trajectories([path], allow_truncated=True)
    assert not cache.exists()


def test_the_oldest_logs_are_removed(tmp_path, cache, monkeypatch, readings):
    path = write(tmp_path / "log.xml")
    read_trajectories([path], end=1)
    size = sum(file.stat().st_size for file in cache.glob("*/*"))
    monkeypatch.setattr(reader, "_MOST", int(2.5 * size))
    for end in (2, 3, 4):
        read_trajectories([path], end=end)
    assert 1 <= len(list(cache.iterdir())) <= 2
    read_trajectories([path], end=4)
    assert len(readings) == 4


def test_huge_and_small_logs_are_not_kept(tmp_path, cache, monkeypatch):
    path = write(tmp_path / "log.xml")
    monkeypatch.setattr(reader, "_MOST_ROWS", 3)
    read_trajectories([path])
    monkeypatch.setattr(reader, "_LEAST", 10_000)
    read_trajectories([path])
    assert not cache.exists()


def test_a_folder_that_cannot_be_written_does_not_matter(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("", encoding="utf-8")
    monkeypatch.setenv("SUMO3DVIZ_PT_CACHE", str(tmp_path / "file"))
    assert len(read_trajectories([write(tmp_path / "log.xml")]).traces) == 2


def test_a_log_without_anybody_is_kept(tmp_path, readings):
    path = tmp_path / "log.xml"
    path.write_text('<fcd-export><timestep time="0"/></fcd-export>', encoding="utf-8")
    assert read_trajectories([path]).traces == read_trajectories([path]).traces == ()
    assert len(readings) == 1
