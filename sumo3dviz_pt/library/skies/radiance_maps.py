"""Reads equirectangular radiance maps: OpenEXR and Radiance HDR files.

References:
    G. Ward, "Real pixels", Graphics Gems II, 1991 (the shared-exponent format).
"""

from __future__ import annotations

import logging
import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.files.quiet import silenced
from sumo3dviz_pt.files.whole import read_plain, refuse_special
from sumo3dviz_pt.library.materials.picture_files import MOST_PIXELS
from sumo3dviz_pt.model.geometry import Image

logger = logging.getLogger(__name__)

_BRIGHTEST = 65504.0
_SIZE = re.compile(rb"-Y (\d{1,9}) \+X (\d{1,9})\n")


def read_radiance_map(path: Path) -> Image:
    """Read a map of the whole sphere.

    Args:
        path: An .exr or .hdr file, twice as wide as high.

    Returns:
        Linear radiance, (h, w, 3), finite and >= 0.

    Raises:
        InputError: If the file is missing, damaged, of another kind or shape.
    """
    image = read_linear(path)
    height, width = image.shape[:2]
    if abs(width - 2 * height) > 0.02 * width:
        message = f"is {width} x {height}; an equirectangular map is twice as wide as high"
        raise InputError(message, file=path)
    return image


def read_linear(path: Path) -> Image:
    """Read a picture of linear values, of any shape.

    Args:
        path: An .exr or .hdr file.

    Returns:
        Linear values, (h, w, 3), finite and >= 0.

    Raises:
        InputError: If the file is missing, damaged or of another kind.
    """
    check_radiance_file(path)
    return _sane(_READERS[path.suffix.lower()](path), path)


def check_radiance_file(path: Path) -> None:
    """Refuse a file that is not there or of a kind that cannot be read.

    Raises:
        InputError: Says which kinds can.
    """
    if path.suffix.lower() not in _READERS:
        raise InputError(f"a radiance map must be one of {', '.join(_READERS)}", file=path)
    refuse_special(path)
    if not path.is_file():
        raise InputError("no such file", file=path)


def read_exr_map(path: Path) -> Image:
    """Read the colours of an OpenEXR file, (h, w, 3), as they are.

    Raises:
        InputError: If the file is damaged or has no colours.
    """
    import OpenEXR

    try:
        # The library says by itself, and more than once, what is wrong.
        with silenced():
            with OpenEXR.File(str(path), header_only=True) as file:
                _check_size(file.header().get("dataWindow"), path)
            with OpenEXR.File(str(path)) as file:
                channels = file.channels()
                layer = channels.get("RGB") or channels.get("RGBA")
                pixels = None if layer is None else np.array(layer.pixels, dtype=np.float32)
    except (RuntimeError, ValueError, TypeError, IndexError) as error:
        raise InputError("not a readable OpenEXR file; save it again", file=path) from error
    if pixels is None or pixels.ndim != 3 or not pixels.size:
        raise InputError("holds no R, G and B channels", file=path)
    return np.ascontiguousarray(pixels[..., :3])


def _check_size(window: Any, path: Path) -> None:
    """Refuse a map that announces too many pixels; `window` is its first and last pixel."""
    (left, top), (right, bottom) = np.asarray(window, dtype=np.float64).tolist()
    _check_pixels(right - left + 1.0, bottom - top + 1.0, path)


def _check_pixels(width: float, height: float, path: Path) -> None:
    """Refuse what has no pixels, or too many."""
    if not (width >= 1.0 and height >= 1.0 and width * height <= MOST_PIXELS):
        raise InputError(
            f"says that it is {width:.0f} x {height:.0f}, and at most {MOST_PIXELS:,} pixels"
            " are read",
            file=path,
        )


def _sane(image: Image, path: Path) -> Image:
    """Replace values that are no radiance, and log how many."""
    broken = int(np.count_nonzero(~np.isfinite(image) | (image < 0)))
    if broken:
        logger.warning("%s: %d values are negative or not finite and were replaced", path, broken)
    return np.clip(np.nan_to_num(image, posinf=_BRIGHTEST, neginf=0.0), 0.0, None)


def _read_hdr(path: Path) -> Image:
    """Read a Radiance HDR file, (h, w, 3)."""
    data = read_plain(path, most=4 * MOST_PIXELS)
    size = _SIZE.search(data, 0, 4096)
    if not data.startswith(b"#?") or size is None:
        raise InputError("not a Radiance HDR file with rows from the top", file=path)
    height, width = int(size[1]), int(size[2])
    _check_pixels(width, height, path)
    body = np.frombuffer(data, np.uint8, offset=size.end())
    try:
        rgbe = _unpacked(body, height, width)
    except (IndexError, ValueError) as error:
        raise InputError("the file is cut off or damaged", file=path) from error
    exponent = rgbe[..., 3:].astype(np.int32)
    # A zero exponent means black; 136 = 128 (bias) + 8 (bits of the mantissa).
    scale = np.where(exponent > 0, np.ldexp(np.float32(1.0), exponent - 136), 0.0)
    return np.asarray(rgbe[..., :3] * scale, dtype=np.float32)


def _unpacked(body: NDArray[np.uint8], height: int, width: int) -> NDArray[np.uint8]:
    """Unpack shared-exponent pixels, (h, w, 4), run-length coded or flat."""
    mark = [2, 2, width >> 8, width & 255]
    if not 8 <= width < 32768 or body[:4].tolist() != mark:
        return body[: height * width * 4].reshape(height, width, 4)
    if len(body) < height * (4 + width // 16):
        # A run is at most 127 long and takes two bytes.
        raise ValueError("the file is too short for its rows")
    rows = np.empty((height, 4, width), np.uint8)
    place = 0
    for row in rows:
        if body[place : place + 4].tolist() != mark:
            raise ValueError("a row does not start with its mark")
        place += 4
        for channel in row:
            place = _unpack_channel(body, place, channel)
    return np.moveaxis(rows, 1, 2)


def _unpack_channel(body: NDArray[np.uint8], place: int, channel: NDArray[np.uint8]) -> int:
    """Fill one channel of a row from its runs; return where the next one begins."""
    filled = 0
    while filled < len(channel):
        count = int(body[place])
        if count > 128:
            count -= 128
            channel[filled : filled + count] = body[place + 1]
            place += 2
        else:
            channel[filled : filled + count] = body[place + 1 : place + 1 + count]
            place += 1 + count
        if count == 0:
            raise ValueError("an empty run")
        filled += count
    return place


_READERS: Mapping[str, Callable[[Path], Image]] = {".exr": read_exr_map, ".hdr": _read_hdr}
