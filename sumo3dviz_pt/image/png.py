"""Writes PNG pictures, and reads their comments, with the standard library alone.

References:
    PNG specification, third edition: https://www.w3.org/TR/png-3/
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.files.atomic import put_in_place, read_plain

SIGNATURE = b"\x89PNG\r\n\x1a\n"
"""How a PNG file begins."""

MOST_BYTES = 2_000_000_000
"""Of a picture that is read."""

_PERCEPTUAL = b"\x00"


def write_png(
    path: Path, pixels: NDArray[np.uint8], *, text: Mapping[str, str] | None = None, level: int = 9
) -> None:
    """Write an 8-bit sRGB picture; a half-written file never stays.

    Args:
        path: Where to.
        pixels: sRGB-encoded, (h, w, 3), or (h, w) for grey.
        text: Comments by keyword (Latin-1, 1 to 79 characters), such as provenance.
        level: Effort of the compression, 0 to 9.

    Raises:
        ValueError: If the pixels are not 8-bit grey or RGB.
    """
    part = path.with_name(path.name + ".part")
    try:
        part.write_bytes(encoded(pixels, text=text, level=level))
        put_in_place(part, path)
    finally:
        part.unlink(missing_ok=True)


def read_text(path: Path) -> dict[str, str]:
    """Return the comments of a PNG that `write_png` wrote, by keyword.

    Raises:
        InputError: If the file cannot be read, or is no PNG or a damaged one.
    """
    try:
        data = read_plain(path, most=MOST_BYTES)
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", file=path) from error
    if not data.startswith(SIGNATURE):
        raise InputError("is no PNG", file=path)
    texts, place = {}, len(SIGNATURE)
    while place + 12 <= len(data):
        length, kind = struct.unpack(">I4s", data[place : place + 8])
        content, place = data[place + 8 : place + 8 + length], place + 12 + length
        if kind == b"iTXt":
            keyword, _, rest = content.partition(b"\x00")
            # Two flags about compression, then language and translated keyword, both empty.
            texts[keyword.decode("latin-1")] = rest[4:].decode("utf-8", errors="replace")
    if place != len(data):
        raise InputError("is cut short", file=path)
    return texts


def encoded(
    pixels: NDArray[np.uint8], *, text: Mapping[str, str] | None = None, level: int = 9
) -> bytes:
    """Return a PNG file's bytes.

    Args:
        pixels: sRGB-encoded, (h, w, 3), or (h, w) for grey.
        text: Comments by keyword (Latin-1, 1 to 79 characters).
        level: Effort of the compression, 0 to 9.

    Raises:
        ValueError: If the pixels are not 8-bit grey or RGB.
    """
    if pixels.dtype != np.uint8 or pixels.ndim not in (2, 3) or pixels.shape[2:] not in ((), (3,)):
        raise ValueError(f"PNG needs (h, w) or (h, w, 3) uint8, not {pixels.shape} {pixels.dtype}")
    height, width = pixels.shape[:2]
    colour_type = 2 if pixels.ndim == 3 else 0
    header = struct.pack(">IIBBBBB", width, height, 8, colour_type, 0, 0, 0)
    comments = [chunk(b"iTXt", _comment(key, value)) for key, value in (text or {}).items()]
    return b"".join(
        [
            SIGNATURE,
            chunk(b"IHDR", header),
            chunk(b"sRGB", _PERCEPTUAL),
            *comments,
            chunk(b"IDAT", zlib.compress(_prepared(pixels), level)),
            chunk(b"IEND", b""),
        ]
    )


def _comment(keyword: str, value: str) -> bytes:
    """Return an uncompressed iTXt chunk's content; it may hold any character."""
    return keyword.encode("latin-1") + b"\x00\x00\x00\x00\x00" + value.encode("utf-8")


def chunk(kind: bytes, data: bytes) -> bytes:
    """Return a chunk: length, kind, data and checksum."""
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def _prepared(pixels: NDArray[np.uint8]) -> bytes:
    """Return rows with or without filters, whichever a quick try packs smaller.

    Filters help photographs and hurt pictures of few colours and pure grain.
    """
    rows = pixels.reshape(len(pixels), -1)
    plain = np.concatenate([np.zeros((len(rows), 1), np.uint8), rows], axis=1).tobytes()
    return min(_filtered(pixels), plain, key=lambda data: len(zlib.compress(data, 1)))


def _filtered(pixels: NDArray[np.uint8]) -> bytes:
    """Return rows with the filter that leaves the smallest differences: none, sub, up or average.

    This is the specification's minimum-sum heuristic (12.7), for all rows at once;
    Paeth is left out because it hardly beats average on photographs.
    """
    height, channels = pixels.shape[0], pixels.shape[2] if pixels.ndim == 3 else 1
    rows = pixels.reshape(height, -1)
    left, above = np.zeros_like(rows), np.zeros_like(rows)
    left[:, channels:] = rows[:, :-channels]
    above[1:] = rows[:-1]
    mean = ((left.astype(np.uint16) + above) // 2).astype(np.uint8)
    tried = np.stack([rows, rows - left, rows - above, rows - mean])
    cost = np.abs(tried.view(np.int8).astype(np.int16)).sum(axis=2, dtype=np.int64)
    best = cost.argmin(axis=0)
    chosen = tried[best, np.arange(height)]
    return np.concatenate([best.astype(np.uint8)[:, None], chosen], axis=1).tobytes()
