"""The shared XML reading."""

import gzip

import pytest

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.sumo.formats import format_of
from sumo3dviz_pt.sumo.stream import TruncatedError, read_elements, root_of


def write(tmp_path, content, name="a.xml"):
    path = tmp_path / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


def tags(path, root=("r",)):
    return [(e.tag, e.depth, e.line) for e in read_elements(path, root=root, what="a thing")]


def test_elements_in_order_with_depth_and_line(tmp_path):
    path = write(tmp_path, "<r>\n<a><b/></a>\n<c/></r>")
    assert tags(path) == [("r", 0, 1), ("a", 1, 2), ("b", 2, 2), ("c", 1, 3)]


def test_gzip_is_known_by_content_not_name(tmp_path):
    path = write(tmp_path, gzip.compress(b"<r><a/></r>", mtime=0), "plain.xml")
    assert [tag for tag, *_ in tags(path)] == ["r", "a"]


def test_elements_across_chunks(tmp_path):
    path = write(tmp_path, "<r>" + '<a k="value"/>\n' * 40_000 + "</r>")
    assert len(tags(path)) == 40_001


def test_several_gzip_members(tmp_path):
    path = write(tmp_path, gzip.compress(b"<r><a/>", mtime=0) + gzip.compress(b"<b/></r>"))
    assert [tag for tag, *_ in tags(path)] == ["r", "a", "b"]


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "empty"),
        (b"PAR1....", "Parquet"),
        (b"\x28\xb5\x2f\xfd1234", "Zstandard"),
        (b"\x00\x01\x02garbage", "is no XML, and no table"),
        (b"time;id;x\n0;a;1\n", "is no XML, and no table"),
        (b"<a b></a>", "not well-formed"),
        (b"<r><a></r>", "mismatched tag"),
        (b"<other/>", "is not a thing: its root element is <other>, not <r>"),
        (b"<r><a/>", "ends in the middle"),
        (b"<r><a k='1", "ends in the middle"),
        (gzip.compress(b"<r><a/></r>", mtime=0)[:-12], "ends in the middle"),
        (gzip.compress(b"", mtime=0)[:10] + b"\xff" * 20, "cannot be read"),
        (b"\x1f\x8b\x09" + b"\0" * 20, "cannot be read"),
    ],
)
def test_bad_content_is_an_input_error(tmp_path, content, words):
    path = write(tmp_path, content)
    with pytest.raises(InputError, match=words) as caught:
        tags(path)
    assert str(path) in str(caught.value)


def test_truncated_gzip_delivers_what_it_had(tmp_path):
    content = "<r>" + "".join(f'<a n="{i * 7919}"/>' for i in range(3000))
    path = write(tmp_path, gzip.compress(content.encode())[:-300])
    seen = []
    with pytest.raises(TruncatedError):
        seen.extend(e.tag for e in read_elements(path, root="r", what="a thing"))
    assert len(seen) > 2000


def test_missing_file_and_folder(tmp_path):
    with pytest.raises(InputError, match="does not exist"):
        tags(tmp_path / "none.xml")
    with pytest.raises(InputError, match="folder"):
        tags(tmp_path)


def test_root_of(tmp_path):
    assert root_of(write(tmp_path, "<net><edge/>")) == "net"
    assert root_of(write(tmp_path, "no xml")) is None
    assert root_of(tmp_path / "none") is None
    assert root_of(tmp_path) is None


def test_element_errors_name_the_place(tmp_path):
    path = write(tmp_path, '<r>\n<lane id="a_0" width="wide" speed="nan" ok="2.5"/></r>')
    lane = list(read_elements(path, root="r", what="a thing"))[1]
    assert lane.number("ok") == 2.5
    assert lane.number("none", 3.0) == 3.0
    for key, words in (("width", "finite number"), ("speed", "finite"), ("none", "is missing")):
        with pytest.raises(InputError, match=words) as caught:
            lane.number(key)
        assert (caught.value.file, caught.value.line) == (path, 2)
        assert caught.value.element == 'lane "a_0"'


def test_entity_bombs_do_not_explode(tmp_path):
    bomb = '<!DOCTYPE r [<!ENTITY a "aaaaaaaaaa">' + "".join(
        f'<!ENTITY {chr(98 + i)} "{("&" + chr(97 + i) + ";") * 10}">' for i in range(9)
    )
    with pytest.raises(InputError):
        tags(write(tmp_path, bomb + ']><r k="&j;"/>'))


@pytest.mark.parametrize(("packed", "inside"), [(True, "attribute"), (False, "text")])
def test_one_endless_tag_or_text_is_refused_before_memory_ends(tmp_path, packed, inside):
    """A file of some kB in gzip can hold an attribute of gigabytes."""
    begin = b'<fcd-export a="' if inside == "attribute" else b"<net>"
    whole = begin + b"x" * (9 << 20)
    path = write(tmp_path, gzip.compress(whole, 1, mtime=0) if packed else whole)
    for reader in (lambda: tags(path, root=()), lambda: list(format_of(path).sightings(path))):
        with pytest.raises(InputError, match="a single tag or text is longer than 8 MB"):
            reader()
