"""Streams XML files, plain or gzipped, through expat.

The meaning of elements is left to the readers. Readers of small files use
`read_elements`; the reader of the vehicle log, which can have gigabytes, passes a parser of
its own to `feed`, and a `Sieve` that takes out what need not be parsed. No tree is ever built,
so memory does not grow with the file.

Files that users take for networks or vehicle logs are known, too: what each is, and what to do with
it.
"""

from __future__ import annotations

import codecs
import gzip
import math
import zlib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO, Protocol, cast
from xml.parsers import expat

from sumo3dviz_pt.errors import InputError, cut
from sumo3dviz_pt.files.atomic import open_plain
from sumo3dviz_pt.sumo.values import ANY, Range, parse_number

PBF = "osm.pbf"
"""Stands for the root element of a map that is packed and has none."""

_LOG = "run sumo with --fcd-output fcd.xml.gz, too, and name that file"


@dataclass(frozen=True, slots=True)
class OtherFile:
    """A kind of file.

    Attributes:
        what: What it is, in words.
        option: Of netconvert that reads it; empty for what is no network.
    """

    what: str
    option: str = ""


def _output(option: str, holds: str) -> OtherFile:
    """Return an output of SUMO that holds no places of vehicles that can be drawn."""
    return OtherFile(f"SUMO's --{option}, which holds {holds}")


OTHERS: Mapping[str, OtherFile] = {
    # Other networks.
    "OpenDRIVE": OtherFile("a road network in OpenDRIVE", "opendrive-files"),
    "osm": OtherFile("a map of OpenStreetMap", "osm-files"),
    PBF: OtherFile("a map of OpenStreetMap, packed as PBF", "osm-files"),
    "network": OtherFile("a network of MATSim", "matsim-files"),
    "nodes": OtherFile("the junctions of a network that is not built", "node-files"),
    "edges": OtherFile("the roads of a network that is not built", "edge-files"),
    # Other outputs of a simulation.
    "queue-export": _output("queue-output", "queues by lane"),
    "battery-export": _output("battery-output", "batteries"),
    "tripinfos": _output("tripinfo-output", "one row for each trip"),
    "summary": _output("summary-output", "counts of vehicles"),
    "meandata": OtherFile("mean values of edges or lanes of SUMO"),
    "detector": OtherFile("the output of a detector of SUMO"),
    "collisions": _output("collision-output", "collisions"),
    "lanechanges": _output("lanechange-output", "lane changes"),
    "stops": _output("stop-output", "stops"),
    "SSMLog": OtherFile("SUMO's log of surrogate safety measures"),
    "instantE1": OtherFile("the output of a detector of SUMO"),
    "trajectories": _output("amitran-output", "speeds of vehicles"),
    "snapshot": _output("save-state", "one moment of a simulation"),
}
"""By root element."""


def is_packed_map(head: bytes) -> bool:
    """Whether first bytes of a file are those of a map of OpenStreetMap in PBF."""
    return head[4:15] == b"\n\tOSMHeader"


def remedy(root: str, file: Path) -> str:
    """Return what to do with a file.

    Args:
        root: Its root element, one of `OTHERS`.
        file: The file.
    """
    option = OTHERS[root].option
    if not option:
        return _LOG
    if root == PBF:
        text = file.with_name(f"{file.name.split('.')[0]}.osm")
        return f"unpack it with osmium cat {file} -o {text}, then {remedy('osm', text)}"
    net = f"{file.name.removesuffix('.gz').split('.')[0]}.net.xml"
    also = {"node-files": " --edge-files FILE.edg.xml", "edge-files": " --node-files FILE.nod.xml"}
    return f"make a network of it: netconvert --{option} {file}{also.get(option, '')} -o {net}"


def advice(files: Mapping[Path, str | None], *, networks: bool) -> str:
    """Return what the first file is that seems to have been meant, and what to do; or nothing.

    Args:
        files: Root elements, all of them in `OTHERS`, by file.
        networks: Whether a network was looked for, else a vehicle log.
    """
    for file, root in files.items():
        if root is not None and bool(OTHERS[root].option) is networks:
            what = f"{file.name} is {OTHERS[root].what}"
            return f"{what}: {remedy(root, file)}" if networks else what
    return ""


CHUNK = 1 << 18
_LONGEST = 1 << 23
"""Longest tag or text that is read [bytes]; shapes of 20,000 points have a million."""

_GZIP_MAGIC = b"\x1f\x8b"
_TEXT_HEADS = (b"<", b"\0<", b"\xef\xbb\xbf", b"\xff\xfe", b"\xfe\xff")
_XML_HEADS = (_GZIP_MAGIC, *_TEXT_HEADS)
_FOREIGN = {
    b"PAR1": "a Parquet file",
    b"\x28\xb5\x2f\xfd": "a Zstandard file",
    b"PK\x03\x04": "a ZIP archive",
    b"BZh": "a bzip2 file",
    b"\xfd7zXZ": "an xz file",
    **dict.fromkeys((b"\x89PNG", b"\xff\xd8\xff", b"II*\0", b"MM\0*"), "a picture"),
    **dict.fromkeys((b"ncols", b"NCOLS"), "a grid of heights, for --heights"),
    b"%PDF": "a PDF",
}
_NAME_IT = (
    "name a log or a network of SUMO, or a table of trajectories with a line that names its columns"
    " (such as time, id, x, y)"
)


class TruncatedError(InputError):
    """The file ends before its last element is closed."""


class Sieve(Protocol):
    """Takes out parts of a file before they are parsed; what is left must still be XML."""

    @property
    def lines(self) -> int:
        """Number of lines that were taken out."""

    def left(self, chunk: bytes) -> Iterable[bytes]:
        """Yield what must be parsed of the next chunk; each part is parsed before the next."""

    def rest(self) -> Iterable[bytes]:
        """Yield what must be parsed after the last chunk."""


class _Everything:
    """A sieve that takes out nothing."""

    lines = 0

    def left(self, chunk: bytes) -> Iterable[bytes]:
        return (chunk,)

    def rest(self) -> Iterable[bytes]:
        return ()


@dataclass(frozen=True, slots=True)
class Element:
    """The start of one XML element.

    Attributes:
        tag: Its name.
        attributes: Its attributes as text.
        depth: Number of elements around it; 0 for the root.
        file: The file that it was read from.
        line: Line in the file, from 1.
    """

    tag: str
    attributes: Mapping[str, str]
    depth: int
    file: Path
    line: int

    def error(self, message: str) -> InputError:
        """Return an error that names file, line and this element."""
        return InputError(message, file=self.file, line=self.line, element=self.name)

    @property
    def name(self) -> str:
        """Its name in messages, such as `lane "a_0"`."""
        own = self.attributes.get("id")
        return f"<{cut(self.tag)}>" if own is None else f'{cut(self.tag)} "{cut(own)}"'

    def text(self, key: str, default: str | None = None) -> str:
        """Return an attribute; without a default it must be there.

        Raises:
            InputError: If it is missing, or an id that is empty.
        """
        value = self.attributes.get(key, default)
        if value is None:
            raise self.error(f'the attribute "{key}" is missing; add it or write the file again')
        if key == "id" and not value and default is None:
            raise self.error("the id is empty; give one or write the file again")
        return value

    def number(self, key: str, default: float | None = None, *, within: Range = ANY) -> float:
        """Return an attribute as a finite number; without a default it must be there.

        Args:
            key: Name of the attribute.
            default: Value where it is missing.
            within: Allowed values.

        Raises:
            InputError: If it is missing, not a finite number, or out of range.
        """
        if default is not None and key not in self.attributes:
            return default
        value = self.text(key)
        try:
            number = parse_number(value)
        except ValueError:
            number = math.nan
        if not math.isfinite(number):
            raise self.error(f'{key}="{cut(value)}" must be a finite number')
        if number not in within:
            raise self.error(f'{key}="{cut(value)}" must lie {within}')
        return number

    def integer(self, key: str, default: int | None = None, *, within: Range) -> int:
        """Return an attribute as a whole number; without a default it must be there.

        Args:
            key: Name of the attribute.
            default: Value where it is missing.
            within: Allowed values.

        Raises:
            InputError: If it is missing, not a whole number, or out of range.
        """
        number = self.number(key, default, within=within)
        if number != int(number):
            raise self.error(f'{key}="{cut(self.text(key))}" must be a whole number')
        return int(number)


def feed(parser: expat.XMLParserType, file: Path, *, sieve: Sieve) -> None:
    """Run a whole file through a parser whose handlers are set.

    Errors of the handlers pass through, so that a handler can stop the reading.

    Args:
        parser: A fresh expat parser.
        file: The XML file; gzip is recognised by its first bytes, not by its name.
        sieve: What takes out parts of the file that need not be parsed.

    Raises:
        TruncatedError: If the file ends too early.
        InputError: If it cannot be read or is not XML.
    """
    for _ in _steps(parser, file, sieve):
        pass


def chunks(file: Path) -> Iterator[bytes]:
    """Yield the unpacked bytes of a file.

    Raises:
        InputError: If it cannot be read.
    """
    try:
        with _opened(file) as stream:
            yield from _within_bounds(stream, file)
    except (EOFError, OSError, zlib.error) as error:
        raise InputError(f"cannot be read ({error}); copy it again", file=file) from error


def unpacked(file: Path) -> Iterator[bytes]:
    """Yield the unpacked bytes of a file; EOFError, OSError and zlib.error are not translated."""
    with _opened(file) as stream:
        while chunk := _chunk(stream):
            yield chunk


def read_elements(file: Path, *, root: str | tuple[str, ...], what: str) -> Iterator[Element]:
    """Yield the elements of a file in order, each one at its start.

    Args:
        file: The XML file, plain or gzipped.
        root: The root elements to accept; an empty tuple accepts all.
        what: What the file should be, for messages, such as "a SUMO network".

    Yields:
        Every element, the root first.

    Raises:
        InputError: If the file cannot be read, is no XML or has another root.
    """
    roots = (root,) if isinstance(root, str) else root
    parser = expat.ParserCreate()
    elements: list[Element] = []
    depth = 0

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal depth
        elements.append(Element(tag, attributes, depth, file, parser.CurrentLineNumber))
        depth += 1

    def end(_tag: str) -> None:
        nonlocal depth
        depth -= 1

    parser.StartElementHandler = start
    parser.EndElementHandler = end
    for _ in _steps(parser, file):
        for element in elements:
            if element.depth == 0:
                check_root(element, roots, what)
            yield element
        elements.clear()


def check_root(element: Element, roots: tuple[str, ...], what: str) -> None:
    """Refuse a root element that is not expected.

    Args:
        element: The root element.
        roots: Expected tags; empty accepts all.
        what: What the file should be, for messages.

    Raises:
        InputError: If its tag is not in `roots`, unless that is empty.
    """
    if roots and element.tag not in roots:
        expected = " or ".join(f"<{name}>" for name in roots)
        if element.tag in OTHERS:
            raise InputError(
                f"is {OTHERS[element.tag].what}, not {what}; {remedy(element.tag, element.file)}",
                file=element.file,
            )
        raise InputError(
            f"is not {what}: its root element is <{element.tag}>, not {expected}; "
            "name the right file",
            file=element.file,
            line=element.line,
        )


def may_be_xml(file: Path) -> bool:
    """Whether the first bytes look like XML; fast, as folders may hold thousands of files."""
    try:
        with open_plain(file) as stream:
            return stream.read(64).lstrip().startswith(_XML_HEADS)
    except (OSError, InputError):
        return False


def may_be_map(file: Path) -> bool:
    """Whether the first bytes are those of a packed map of OpenStreetMap."""
    try:
        with open_plain(file) as stream:
            return is_packed_map(stream.read(16))
    except (OSError, InputError):
        return False


def root_of(file: Path) -> str | None:
    """Return the name of a file's root element, or None where it is no readable XML.

    A packed map of OpenStreetMap, which is no XML, counts as `PBF`.
    """
    if may_be_map(file):
        return PBF
    try:
        return next(read_elements(file, root=(), what="XML")).tag
    except (InputError, StopIteration):
        return None


def _steps(parser: expat.XMLParserType, file: Path, sieve: Sieve | None = None) -> Iterator[None]:
    """Feed a file, pausing after each chunk."""
    sieve = sieve or _Everything()

    def parse(parts: Iterable[bytes]) -> None:
        for part in parts:
            try:
                parser.Parse(part, False)
            except expat.ExpatError as error:
                raise _not_xml(error, file, sieve.lines, part) from None

    try:
        with _opened(file) as stream:
            for chunk in _of_xml(_within_bounds(stream, file), file):
                parse(sieve.left(chunk))
                yield
    except EOFError:
        parse(sieve.rest())
        raise _truncated(parser, file, sieve.lines) from None
    except (OSError, zlib.error) as error:
        raise InputError(f"cannot be read ({error}); copy it again", file=file) from error
    parse(sieve.rest())
    try:
        parser.Parse(b"", True)
    except expat.ExpatError:
        # The bytes were fine until they stopped.
        raise _truncated(parser, file, sieve.lines) from None
    yield


def _of_xml(parts: Iterator[bytes], file: Path) -> Iterator[bytes]:
    """Yield the chunks of a file; refuse one that is no XML from its first byte on."""
    for number, part in enumerate(parts):
        if number == 0 and not part.lstrip().startswith(_TEXT_HEADS):
            raise InputError(f"is no XML, and no table that is known; {_NAME_IT}", file=file)
        yield part


def _opened(file: Path) -> BinaryIO:
    """Open a file that looks like XML, unpacking gzip."""
    if not file.exists():
        raise InputError("the file does not exist; check the path", file=file)
    if file.is_dir():
        raise InputError("is a folder; name a file in it", file=file)
    with open_plain(file) as raw:
        head = raw.read(16)
    if not head:
        raise InputError("the file is empty; write it again", file=file)
    if is_packed_map(head):
        raise InputError(f"is {OTHERS[PBF].what}; {remedy(PBF, file)}", file=file)
    for magic, name in _FOREIGN.items():
        if head.startswith(magic):
            raise InputError(f"is {name}; {_NAME_IT}", file=file)
    if head.startswith(_GZIP_MAGIC):
        return cast(BinaryIO, gzip.open(file, "rb"))
    return file.open("rb")


def _chunk(stream: BinaryIO) -> bytes:
    # `read` would lose what it has unpacked when a gzip stream breaks off; `read1` does not.
    reader = stream.read1 if isinstance(stream, gzip.GzipFile) else stream.read
    return reader(CHUNK)


def _within_bounds(stream: BinaryIO, file: Path) -> Iterator[bytes]:
    """Yield what is in an XML file, unless a single tag or text is so long that memory would end.

    Args:
        stream: The file, open.
        file: For messages.

    Raises:
        InputError: If one is too long.
    """
    length = 0
    while chunk := _chunk(stream):
        last = chunk.rfind(b"<")
        length = len(chunk) - last if last >= 0 else length + len(chunk)
        if length > _LONGEST:
            raise InputError(
                f"a single tag or text is longer than {_LONGEST >> 20} MB, which nothing of SUMO"
                " is; write the file again",
                file=file,
            )
        yield chunk


def _truncated(parser: expat.XMLParserType, file: Path, skipped: int) -> TruncatedError:
    return TruncatedError(
        "the file ends in the middle; copy or write it again",
        file=file,
        line=parser.CurrentLineNumber + skipped,
    )


def _not_xml(error: expat.ExpatError, file: Path, skipped: int, part: bytes) -> InputError:
    """Return what is wrong with a file that cannot be parsed.

    Args:
        error: The parser's.
        file: For messages.
        skipped: Number of lines that were not parsed.
        part: The bytes that were parsed last.
    """
    reason = expat.errors.messages.get(error.code, str(error)) if error.code else str(error)
    message = f"is not well-formed XML ({reason}); give an XML file of SUMO, plain or gzipped"
    if reason == expat.errors.XML_ERROR_INVALID_TOKEN and not _is_utf8(part):
        message = "is not written in UTF-8, as XML is by default; write it again"
    return InputError(message, file=file, line=error.lineno + skipped)


def _is_utf8(part: bytes) -> bool:
    """Whether bytes from the middle of a file may be UTF-8."""
    # The first character may have begun before them, and the last may end after them.
    part = part.lstrip(bytes(range(0x80, 0xC0)))
    try:
        codecs.getincrementaldecoder("utf-8")().decode(part)
    except UnicodeDecodeError:
        return False
    return True
