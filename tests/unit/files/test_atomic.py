"""Files are whole or not there, and only plain ones are read."""

import os
import tracemalloc
from pathlib import Path

import pytest

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.files import atomic


def test_what_exists_is_replaced_as_a_whole(tmp_path):
    path = tmp_path / "a.json"
    for text in ("old and longer", "näw\n"):
        atomic.write_atomically(path, text)
        assert path.read_bytes() == text.encode() and list(tmp_path.iterdir()) == [path]


def test_nothing_half_written_stays(tmp_path):
    path = tmp_path / "a.json"
    atomic.write_atomically(path, "old")
    with pytest.raises(UnicodeEncodeError):
        atomic.write_atomically(path, "new" * 100_000 + "\ud800")
    assert path.read_text() == "old" and list(tmp_path.iterdir()) == [path]


def test_the_file_stays_as_it_was_until_the_end(tmp_path):
    path = tmp_path / "a.bin"
    path.write_bytes(b"old")
    with atomic.atomic_path(path) as part:
        part.write_bytes(b"new")
        assert path.read_bytes() == b"old" and part.parent == path.parent
    assert path.read_bytes() == b"new" and list(tmp_path.iterdir()) == [path]


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="Windows has no such pipes")
def test_pipes_and_devices_are_refused_before_they_are_opened(tmp_path):
    """Opening a pipe that nobody writes to waits for ever, and a device gives zeros for ever."""
    pipe, link = tmp_path / "pipe", tmp_path / "link"
    os.mkfifo(pipe)
    link.symlink_to(pipe)
    for path in (pipe, link):
        with pytest.raises(InputError, match=r"is a pipe and no plain file.* name that"):
            atomic.open_plain(path)
    with pytest.raises(InputError, match="is a device"):
        atomic.open_plain(Path("/dev/zero"))


def test_what_is_no_special_file_is_left_to_its_reader(tmp_path):
    """A folder, a missing file and an impossible name have messages of their own."""
    (tmp_path / "file").write_bytes(b"1")
    with atomic.open_plain(tmp_path / "file") as stream:
        assert stream.read() == b"1"
    for path in (tmp_path, tmp_path / "missing", Path("a\0b")):
        atomic.refuse_special(path)


def test_no_more_than_asked_is_read(tmp_path):
    path = tmp_path / "a"
    path.write_bytes(b"x" * 11)
    assert atomic.read_plain(path, most=11) == b"x" * 11
    for refused in (path, tmp_path):
        with pytest.raises(InputError):
            atomic.read_plain(refused, most=10)


def test_as_much_memory_as_a_file_needs_is_set_aside(tmp_path):
    path = tmp_path / "a"
    path.write_bytes(b"x")
    tracemalloc.start()
    try:
        atomic.read_plain(path, most=4_000_000_000)
        assert tracemalloc.get_traced_memory()[1] < 10_000_000
    finally:
        tracemalloc.stop()


def test_folders_that_were_cut_or_changed_are_not_read(tmp_path):
    folder = tmp_path / "kept"
    atomic.write_folder(folder, {"a.bin": b"some numbers", "b.json": b"{}"})
    assert atomic.read_folder(folder) == {"a.bin": b"some numbers", "b.json": b"{}"}
    for content in (b"some number", b"same numbers", b""):
        (folder / "a.bin").write_bytes(content)
        assert atomic.read_folder(folder) is None
    atomic.write_folder(folder, {"a.bin": b"some numbers", "b.json": b"{}"})
    assert atomic.read_folder(folder) is not None
