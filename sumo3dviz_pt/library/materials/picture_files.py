"""Looks at users' pictures before Mitsuba reads them: whether they are whole, and how large.

References:
    PNG specification, third edition: https://www.w3.org/TR/png-3/
    ITU-T T.81 (JPEG), annex B.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable, Mapping
from pathlib import Path

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.files.whole import read_plain

MOST_PIXELS = 1 << 26
"""Of a picture or a map: 8192 x 8192, which take a gigabyte as numbers."""

_MOST_BYTES = 500_000_000
_PNG = b"\x89PNG\r\n\x1a\n"
_FRAMES = frozenset({0xC0, 0xC1, 0xC2, 0xC3, 0xC5, 0xC6, 0xC7, 0xC9, 0xCA, 0xCB, 0xCD, 0xCE, 0xCF})
"""Markers of JPEG that hold the size."""

Size = tuple[int, int]


def check_picture(path: Path) -> None:
    """Refuse a picture that is damaged or larger than any.

    Raises:
        ConfigError: Names the file and what is wrong with it.
    """
    size_of = _KINDS.get(path.suffix.lower())
    if size_of is None:
        return
    try:
        width, height = size_of(read_plain(path, most=_MOST_BYTES))
    except OSError as error:
        raise ConfigError(f"{path} cannot be read: {error.strerror}") from error
    except (struct.error, IndexError, ValueError, zlib.error) as error:
        raise ConfigError(f"{path} is damaged or of another kind; save it again") from error
    if width * height > MOST_PIXELS or not width * height:
        most = f"at most {MOST_PIXELS:,} pixels are read"
        raise ConfigError(f"{path} is {width} x {height}, and {most}; make it smaller")


def _png_size(data: bytes) -> Size:
    """Read width and height of a PNG whose chunks are whole."""
    if not data.startswith(_PNG):
        raise ValueError("no PNG")
    size, place = None, len(_PNG)
    packed = zlib.decompressobj()
    while True:
        length, kind = struct.unpack_from(">I4s", data, place)
        body = data[place + 8 : place + 8 + length]
        (check,) = struct.unpack_from(">I", data, place + 8 + length)
        if zlib.crc32(kind + body) != check:
            raise ValueError("a chunk is damaged")
        if kind == b"IHDR":
            width, height, *_ = struct.unpack_from(">II5B", body)
            size = width, height
        if kind == b"IDAT":
            # Only the beginning: the checksums vouch for the rest.
            packed.decompress(body, 1 << 16)
            packed = zlib.decompressobj() if packed.eof else packed
        if kind == b"IEND":
            break
        place += 12 + length
    if size is None:
        raise ValueError("no header")
    return size


def _jpeg_size(data: bytes) -> Size:
    """Read width and height of a JPEG that has an end."""
    if data[:2] != b"\xff\xd8" or b"\xff\xd9" not in data[-1024:]:
        raise ValueError("no JPEG, or cut off")
    place = 2
    while True:
        mark, kind, length = struct.unpack_from(">BBH", data, place)
        if mark != 0xFF:
            raise ValueError("no marker")
        if kind == 0xFF:
            place += 1
        elif kind in _FRAMES:
            height, width = struct.unpack_from(">HH", data, place + 5)
            return width, height
        else:
            place += 2 + length


def _bmp_size(data: bytes) -> Size:
    """Read width and height of a BMP."""
    if data[:2] != b"BM":
        raise ValueError("no BMP")
    width, height, _, bits, packing = struct.unpack_from("<iiHHI", data, 18)
    (begin,) = struct.unpack_from("<I", data, 10)
    row = (abs(width) * bits + 31) // 32 * 4
    if packing == 0 and len(data) < begin + row * abs(height):
        raise ValueError("cut off")
    return abs(width), abs(height)


def _tga_size(data: bytes) -> Size:
    """Read width and height of a TGA."""
    width, height, bits = struct.unpack_from("<HHB", data, 12)
    if data[2] in (2, 3) and len(data) < 18 + data[0] + width * height * bits // 8:
        raise ValueError("cut off")
    return width, height


_KINDS: Mapping[str, Callable[[bytes], Size]] = {
    ".png": _png_size,
    ".jpg": _jpeg_size,
    ".jpeg": _jpeg_size,
    ".bmp": _bmp_size,
    ".tga": _tga_size,
}
