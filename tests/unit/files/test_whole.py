"""Files are whole or not there."""

import pytest

from sumo3dviz_pt.files.whole import whole, write_whole


def test_what_exists_is_replaced_as_a_whole(tmp_path):
    path = tmp_path / "a.json"
    for text in ("old and longer", "näw\n"):
        write_whole(path, text)
        assert path.read_bytes() == text.encode() and list(tmp_path.iterdir()) == [path]


def test_nothing_half_written_stays(tmp_path):
    path = tmp_path / "a.json"
    write_whole(path, "old")
    with pytest.raises(UnicodeEncodeError):
        write_whole(path, "new" * 100_000 + "\ud800")
    assert path.read_text() == "old" and list(tmp_path.iterdir()) == [path]


def test_the_file_stays_as_it_was_until_the_end(tmp_path):
    path = tmp_path / "a.bin"
    path.write_bytes(b"old")
    with whole(path) as part:
        part.write_bytes(b"new")
        assert path.read_bytes() == b"old" and part.parent == path.parent
    assert path.read_bytes() == b"new" and list(tmp_path.iterdir()) == [path]
