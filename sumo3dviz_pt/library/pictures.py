"""Pictures of surfaces and skies: users' files, cloud layers, radiance maps.

Users' pictures are looked at before Mitsuba reads them: whether they are whole, and how large.
Cloud layers are stored as the three channels of an image. Radiance maps are equirectangular:
OpenEXR and Radiance HDR files.

References:
    PNG specification, third edition: https://www.w3.org/TR/png-3/
    ITU-T T.81 (JPEG), annex B.
    G. Ward, "Real pixels", Graphics Gems II, 1991 (the shared-exponent format).
"""

from __future__ import annotations

import hashlib
import logging
import re
import struct
import zlib
from collections.abc import Callable, Mapping
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sumo3dviz_pt import catalog
from sumo3dviz_pt.errors import ConfigError, InputError
from sumo3dviz_pt.files.atomic import read_plain, refuse_special
from sumo3dviz_pt.files.quiet import silenced
from sumo3dviz_pt.model.geometry import Image
from sumo3dviz_pt.model.weather import CloudLayer, StoredClouds

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


def cloud_image(layer: CloudLayer) -> Image:
    """Pack cover, and light times cover, into (h, w, 3); nothing jumps where clouds end."""
    light = np.stack([layer.sunlit, layer.skylit], axis=-1) * layer.cover[..., None]
    return np.dstack([layer.cover, light]).astype(np.float32)


def cloud_layer(image: Image, *, lit_from: float) -> CloudLayer:
    """Unpack what `cloud_image` packed, from maps that may have lost a little in a file.

    Args:
        image: From `cloud_image`, (h, w, 3).
        lit_from: Elevation of the sun that the recipe had [rad].
    """
    cover = np.clip(image[..., 0], 0.0, 1.0)
    cover = np.where(cover > 0.992, 1.0, np.where(cover < 0.004, 0.0, cover))
    light = np.maximum(image[..., 1:], 0.0) / np.maximum(cover, 0.02)[..., None]
    sunlit, skylit = (np.ascontiguousarray(light[..., part], np.float32) for part in (0, 1))
    return CloudLayer(np.asarray(cover, np.float32), sunlit, skylit, lit_from)


def stored_clouds(path: Path, *, lit_from: float) -> StoredClouds:
    """Find a layer of clouds in a file that `cloud_image` made.

    Args:
        path: An .exr file.
        lit_from: Elevation of the sun that the recipe had [rad].

    Raises:
        InputError: If the file cannot be read.
    """
    try:
        whole = hashlib.blake2b(path.read_bytes(), digest_size=16)
    except OSError as error:
        raise InputError("cannot be read", file=path) from error
    # What unpacks it counts, too.
    whole.update(f"{lit_from!r} {version('OpenEXR')}".encode() + catalog.code_digest("library"))

    def read() -> CloudLayer:
        return cloud_layer(read_exr_map(path), lit_from=lit_from)

    return StoredClouds(whole.hexdigest(), lit_from, read)


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
