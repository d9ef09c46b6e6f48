"""Reads equirectangular radiance maps: OpenEXR and Radiance HDR files.

References:
    G. Ward, "Real pixels", Graphics Gems II, 1991 (the shared-exponent format).
"""

from __future__ import annotations

import logging
import re
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.model.geometry import Image

logger = logging.getLogger(__name__)

_BRIGHTEST = 65504.0
_SIZE = re.compile(rb"-Y (\d+) \+X (\d+)\n")


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
    reader = _READERS.get(path.suffix.lower())
    if reader is None:
        raise InputError(f"a radiance map must be one of {', '.join(_READERS)}", file=path)
    if not path.is_file():
        raise InputError("no such file", file=path)
    return _sane(reader(path), path)


def read_exr_map(path: Path) -> Image:
    """Read the colours of an OpenEXR file, (h, w, 3), as they are.

    Raises:
        InputError: If the file is damaged or has no colours.
    """
    import OpenEXR

    try:
        with OpenEXR.File(str(path)) as file:
            channels = file.channels()
            layer = channels.get("RGB") or channels.get("RGBA")
            pixels = None if layer is None else np.array(layer.pixels, dtype=np.float32)
    except RuntimeError as error:
        raise InputError(f"not a readable OpenEXR file ({error})", file=path) from error
    if pixels is None:
        raise InputError("holds no R, G and B channels", file=path)
    return np.ascontiguousarray(pixels[..., :3])


def _sane(image: Image, path: Path) -> Image:
    """Replace what is no radiance, and say so."""
    broken = int(np.count_nonzero(~np.isfinite(image) | (image < 0)))
    if broken:
        logger.warning("%s: %d values are negative or not finite and were replaced", path, broken)
    return np.clip(np.nan_to_num(image, posinf=_BRIGHTEST, neginf=0.0), 0.0, None)


def _read_hdr(path: Path) -> Image:
    """Read a Radiance HDR file, (h, w, 3)."""
    data = path.read_bytes()
    size = _SIZE.search(data, 0, 4096)
    if not data.startswith(b"#?") or size is None:
        raise InputError("not a Radiance HDR file with rows from the top", file=path)
    height, width = int(size[1]), int(size[2])
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
    """Shared-exponent pixels, (h, w, 4), run-length coded or flat."""
    mark = [2, 2, width >> 8, width & 255]
    if not 8 <= width < 32768 or body[:4].tolist() != mark:
        return body[: height * width * 4].reshape(height, width, 4)
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
    """Fill one channel of a row from its runs; returns where the next begins."""
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
