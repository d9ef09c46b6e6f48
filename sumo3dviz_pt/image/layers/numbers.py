"""PNG files of numbers: classes and flow. They are no pictures, so no colours are said of them.

References:
    PNG specification, third edition: https://www.w3.org/TR/png-3/
"""

from __future__ import annotations

import struct
import zlib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.files.whole import whole
from sumo3dviz_pt.image.png import SIGNATURE, chunk

_UP = 2
"""The filter that all rows have: differences from the row above."""

_LEVEL = 6


def write_numbers(path: Path, numbers: NDArray[Any]) -> None:
    """Write numbers; a half-written file never stays.

    Args:
        path: Where to.
        numbers: (h, w) or (h, w, 3), of 8 or 16 bits without a sign.

    Raises:
        ValueError: If they are of another kind.
        OSError: If the file cannot be written.
    """
    if numbers.dtype not in (np.uint8, np.uint16) or numbers.shape[2:] not in ((), (3,)):
        raise ValueError(f"cannot store {numbers.shape} {numbers.dtype} as PNG")
    height, width = numbers.shape[:2]
    bits, kind = 8 * numbers.dtype.itemsize, 2 if numbers.ndim == 3 else 0
    rows = _bytes_of(numbers).reshape(height, -1)
    rows[1:] = rows[1:] - rows[:-1]
    data = np.concatenate([np.full((height, 1), _UP, np.uint8), rows], axis=1).tobytes()
    content = [
        chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, bits, kind, 0, 0, 0)),
        chunk(b"IDAT", zlib.compress(data, _LEVEL)),
        chunk(b"IEND", b""),
    ]
    with whole(path) as part:
        part.write_bytes(SIGNATURE + b"".join(content))


def read_numbers(path: Path) -> NDArray[Any]:
    """Return the numbers of a file that `write_numbers` wrote, (h, w) or (h, w, 3).

    Raises:
        InputError: If it is missing, damaged or of another kind.
    """
    try:
        data = path.read_bytes()
        width, height, bits, kind = struct.unpack(">IIBB", data[16:26])
        (length,) = struct.unpack(">I", data[33:37])
        rows = np.frombuffer(zlib.decompress(data[41 : 41 + length]), np.uint8)
        rows = rows.reshape(height, -1)
        if not data.startswith(SIGNATURE) or not (rows[:, 0] == _UP).all():
            raise InputError("was not written by sumo3dviz_pt", file=path)
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", file=path) from error
    except (struct.error, zlib.error, ValueError) as error:
        raise InputError("is no PNG, or a damaged one", file=path) from error
    whole_rows = np.cumsum(rows[:, 1:], axis=0, dtype=np.uint8)
    numbers = whole_rows if bits == 8 else whole_rows.reshape(-1).view(">u2").astype(np.uint16)
    shape = (height, width, 3) if kind == 2 else (height, width)
    return np.ascontiguousarray(numbers.reshape(shape))


def _bytes_of(numbers: NDArray[Any]) -> NDArray[np.uint8]:
    """Return the numbers' bytes, the higher ones first, as a new array."""
    order = numbers if numbers.dtype == np.uint8 else numbers.astype(">u2")
    return np.frombuffer(np.ascontiguousarray(order).tobytes(), np.uint8).copy()
