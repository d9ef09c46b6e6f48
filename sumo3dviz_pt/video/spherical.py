"""Boxes that tell players of a film in all directions, or of one for both eyes.

References:
    Spherical Video V2, https://github.com/google/spatial-media/blob/master/docs/spherical-video-v2-rfc.md:
        `st3d` and `sv3d` lie in the visual sample entry.
    ISO/IEC 14496-12, 8.5.2 (sample entries), 8.7.5 (`stco`, `co64`): where media lie behind the
        boxes that grow, their offsets grow, too.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from sumo3dviz_pt.errors import RenderError
from sumo3dviz_pt.files.atomic import put_in_place
from sumo3dviz_pt.model.lens import Lens

ENDINGS = frozenset({".mp4", ".m4v", ".mov"})
"""Of films that can have these boxes."""

_HEADERS = {b"moov": 8, b"trak": 8, b"mdia": 8, b"minf": 8, b"stbl": 8, b"stsd": 16}
"""Boxes on the way to a sample entry, and how long what precedes their contents is."""

ENTRIES = frozenset({b"avc1", b"avc3", b"hev1", b"hvc1", b"av01", b"vp09", b"apch", b"apcn"})
"""Sample entries of pictures."""

ENTRY_HEADER = 8 + 78
"""Length of what precedes the boxes of a visual sample entry: of the box, and its own fields."""

_MODES = {"none": 0, "top_bottom": 1, "side_by_side": 2}
_MADE_BY = b"sumo3dviz_pt"


@dataclass(frozen=True, slots=True)
class Spherical:
    """What players must know.

    Attributes:
        stereo: 0 for one eye, 1 for the left eye's picture on top, 2 for it on the left.
        cropped: Which share of 360 degrees is missing on each side; None for no sphere.
    """

    stereo: int = 0
    cropped: float | None = None

    @property
    def boxes(self) -> bytes:
        """The boxes, as they lie in a sample entry."""
        content = _full(b"st3d", bytes([self.stereo]))
        if self.cropped is None:
            return content
        side = round(self.cropped * 2**32)
        pose = _full(b"prhd", struct.pack(">iii", 0, 0, 0))
        bounds = _full(b"equi", struct.pack(">IIII", 0, 0, side, side))
        return content + _box(
            b"sv3d", _full(b"svhd", _MADE_BY + b"\0") + _box(b"proj", pose + bounds)
        )


def spherical_of(lens: Lens) -> Spherical | None:
    """Return what players must know of a lens's pictures; None for ordinary ones."""
    if lens.projection == "equirectangular":
        return Spherical(_MODES[lens.stereo], 0.5 * (1.0 - lens.turn))
    return None if lens.stereo == "none" else Spherical(_MODES[lens.stereo])


def write_boxes(path: Path, what: Spherical) -> None:
    """Put boxes into a film.

    Args:
        path: An MP4 or MOV file; it is replaced when the new one is whole.
        what: The boxes.

    Raises:
        RenderError: If it is no such film.
        OSError: If it cannot be read or written.
    """
    part = path.with_name(f"{path.stem}.boxes{path.suffix}")
    try:
        with path.open("rb") as old, part.open("wb") as new:
            _copy(old, new, what.boxes, name=path.name)
        put_in_place(part, path)
    finally:
        part.unlink(missing_ok=True)


# Writing ----------------------------------------------------------------------------------------


def _box(name: bytes, content: bytes) -> bytes:
    """Return a box."""
    return struct.pack(">I4s", 8 + len(content), name) + content


def _full(name: bytes, content: bytes) -> bytes:
    """Return a box with a version and flags, all 0."""
    return _box(name, bytes(4) + content)


def _copy(old: BinaryIO, new: BinaryIO, boxes: bytes, *, name: str) -> None:
    """Copy a film, with boxes in the sample entries of its pictures."""
    outer = list(_outer(old, name=name))
    names = [each for each, _, _ in outer]
    if b"moov" not in names or b"mdat" not in names:
        raise RenderError(f"{name} is no film that can tell players of its projection")
    before = names.index(b"moov") < names.index(b"mdat")
    for each, start, size in outer:
        old.seek(start)
        if each != b"moov":
            _copy_bytes(old, new, size)
            continue
        content = old.read(size)
        grown = _with_boxes(content, boxes, shift=0)
        # The media lie as much further behind as the boxes before them grew.
        shift = len(grown) - len(content) if before else 0
        if grown == content:
            raise RenderError(f"{name} has no pictures of a known codec")
        new.write(_with_boxes(content, boxes, shift=shift))


def _with_boxes(content: bytes, boxes: bytes, *, shift: int) -> bytes:
    """Return boxes that lie in each other, with some more in each sample entry."""
    parts = []
    for name, start, size in inner_boxes(content):
        one = content[start : start + size]
        if name in _HEADERS:
            header = _HEADERS[name]
            inside = _with_boxes(one[header:], boxes, shift=shift)
            one = struct.pack(">I", header + len(inside)) + one[4:header] + inside
        elif name in ENTRIES:
            one = _entry(one, boxes)
        elif name in (b"stco", b"co64"):
            one = _shifted(one, shift)
        parts.append(one)
    return b"".join(parts)


def _entry(entry: bytes, boxes: bytes) -> bytes:
    """Return a sample entry with boxes before those that may come last: `clap`, `pasp`, `btrt`."""
    at = len(entry)
    for name, start, _ in inner_boxes(entry[ENTRY_HEADER:]):
        if name in (b"clap", b"pasp", b"btrt"):
            at = ENTRY_HEADER + start
            break
    return struct.pack(">I", len(entry) + len(boxes)) + entry[4:at] + boxes + entry[at:]


def _shifted(table: bytes, shift: int) -> bytes:
    """Return a table of offsets, each further by so many bytes."""
    kind = "I" if table[4:8] == b"stco" else "Q"
    (count,) = struct.unpack(">I", table[12:16])
    form = f">{count}{kind}"
    offsets = struct.unpack(form, table[16 : 16 + struct.calcsize(form)])
    return table[:16] + struct.pack(form, *(offset + shift for offset in offsets))


def _copy_bytes(old: BinaryIO, new: BinaryIO, size: int) -> None:
    """Copy so many bytes, a few at a time."""
    while size > 0:
        some = old.read(min(size, 1 << 20))
        if not some:
            return
        new.write(some)
        size -= len(some)


# Reading ----------------------------------------------------------------------------------------


def _outer(film: BinaryIO, *, name: str) -> Iterator[tuple[bytes, int, int]]:
    """Yield the outermost boxes of a file: name, where it starts and its size, in bytes."""
    film.seek(0, 2)
    end, at = film.tell(), 0
    while at < end:
        film.seek(at)
        head = film.read(16)
        if len(head) < 8:
            raise RenderError(f"{name} is damaged or no film")
        size, kind = struct.unpack(">I4s", head[:8])
        if size == 1 and len(head) == 16:
            (size,) = struct.unpack(">Q", head[8:])
        size = size or end - at
        if size < 8 or at + size > end:
            raise RenderError(f"{name} is damaged or no film")
        yield kind, at, size
        at += size


def inner_boxes(content: bytes) -> Iterator[tuple[bytes, int, int]]:
    """Yield the boxes that lie one behind another: name, where it starts and its size."""
    at = 0
    while at + 8 <= len(content):
        size, kind = struct.unpack(">I4s", content[at : at + 8])
        if size < 8 or at + size > len(content):
            return
        yield kind, at, size
        at += size
