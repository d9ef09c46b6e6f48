"""Reads and writes OpenEXR frames of linear radiance.

Only the OpenEXR package touches these files: Mitsuba's own writer deadlocked in
worker threads (measured), and both must not write at once. The same pixels and
attributes give the same bytes, because no clock goes into the file.

References:
    Rec. ITU-R BT.709-6, item 1.3 (chromaticities of the primaries and of D65).
"""

from __future__ import annotations

import io
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, redirect_stdout
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.files.atomic import put_in_place
from sumo3dviz_pt.files.quiet import silenced
from sumo3dviz_pt.model.geometry import Image

HALF_MAX = 65504.0
"""Largest finite half-precision number (IEEE 754 binary16)."""

PROVENANCE = "sumo3dviz_pt"
"""Name of the string attribute that says how a frame was made."""

_COLOURS = "RGB"
"""What the library calls the channels R, G and B together."""

_PRECISION = 4  # bytes of a number, once it is read

_DENSEST, _ROOM = 2 * 1032, 1_000_000
"""How many times denser than the numbers that are read of it a file can be (deflate's 1032, and
half precision), and what is allowed in any case [bytes]."""

_PRINTING = threading.Lock()
"""Held while the process's streams are not ours."""

_BT709 = (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290)


def write_exr(
    path: Path,
    layers: Mapping[str, Image],
    *,
    half: bool = True,
    lossy: float | None = None,
    attributes: Mapping[str, str] | None = None,
) -> None:
    """Write a frame, ZIP-compressed; a half-written file never stays.

    Args:
        path: Where to.
        layers: `radiance`, (h, w, 3) in linear sRGB primaries, goes to the channels R, G and B;
            others to channels of their names: (h, w, 3) like colours, (h, w) in the
            precision that they have, half or single. All are finite.
        half: Store colours in half precision, clipped to +-65504; else in single.
        lossy: Level of DWAB compression instead of ZIP; 45 is OpenEXR's own default.
        attributes: Strings to store by name; provenance goes under `PROVENANCE`.

    Raises:
        ValueError: If the radiance is not (h, w, 3).
        OSError: If the file cannot be written.
    """
    import OpenEXR

    radiance = layers["radiance"]
    if radiance.ndim != 3 or radiance.shape[2] != 3:
        raise ValueError(f"radiance must be (h, w, 3), not {radiance.shape}")
    header = _zipped(attributes or {}) | {"chromaticities": _BT709}
    if lossy is not None:
        header |= {"compression": OpenEXR.DWAB_COMPRESSION, "dwaCompressionLevel": float(lossy)}
    channels = {
        _COLOURS if name == "radiance" else name: _stored(layer, half=half)
        for name, layer in layers.items()
    }
    _write(path, header, channels)


def write_channels(
    path: Path, channels: Mapping[str, NDArray[Any]], attributes: Mapping[str, str]
) -> None:
    """Write channels as they are, ZIP-compressed; a half-written file never stays.

    Args:
        path: Where to.
        channels: (h, w) each, in half or single precision, or whole numbers of 32 bits.
        attributes: Strings to store by name.

    Raises:
        OSError: If the file cannot be written.
    """
    _write(path, _zipped(attributes), _whole(channels))


def write_parts(path: Path, parts: Mapping[str, Mapping[str, NDArray[Any]]]) -> None:
    """Write a file of several parts, ZIP-compressed; a half-written file never stays.

    Args:
        path: Where to.
        parts: Channels by the name of their part and their own, (h, w) each, in half or single
            precision, or whole numbers of 32 bits.

    Raises:
        OSError: If the file cannot be written.
    """
    import OpenEXR

    _write(path, [OpenEXR.Part(_zipped({}), _whole(own), name) for name, own in parts.items()])


def read_channels(path: Path) -> tuple[dict[str, NDArray[Any]], dict[str, str]]:
    """Return all channels of a file, (h, w) each, as they are, and its string attributes.

    A part's name, where it has one, comes before those of its channels: `depth.Z`.

    Raises:
        InputError: If it is missing or damaged.
    """
    with _opened(path, separate=True) as file:
        channels = {
            f"{part.name()}.{name}" if part.name() else name: np.array(one.pixels)
            for part in file.parts
            for name, one in part.channels.items()
        }
        return channels, _strings(file)


def _zipped(attributes: Mapping[str, str]) -> dict[str, Any]:
    """Return the header of what is ZIP-compressed."""
    import OpenEXR

    return {
        **attributes,
        "compression": OpenEXR.ZIP_COMPRESSION,
        "type": OpenEXR.scanlineimage,
    }


def _whole(channels: Mapping[str, NDArray[Any]]) -> dict[str, Any]:
    """Return channels as the library takes them."""
    return {name: np.ascontiguousarray(one) for name, one in channels.items()}


def _write(path: Path, *content: Any) -> None:
    """Write a header with channels, or a list of parts, as a whole or not at all."""
    import OpenEXR

    unfinished = path.with_name(path.name + ".part")
    try:
        with OpenEXR.File(*content) as file:
            file.write(str(unfinished))
        put_in_place(unfinished, path)
    except RuntimeError as error:
        raise OSError(f"cannot write {path}: {error}") from error
    finally:
        unfinished.unlink(missing_ok=True)


def _stored(values: NDArray[Any], *, half: bool) -> NDArray[Any]:
    """Return a layer in the precision that it is stored with."""
    if (half and values.ndim == 3) or values.dtype == np.float16:
        return np.ascontiguousarray(np.clip(values, -HALF_MAX, HALF_MAX), dtype=np.float16)
    return np.ascontiguousarray(values, dtype=np.float32)


def read_exr(path: Path) -> tuple[Image, dict[str, str]]:
    """Read a frame's radiance, (h, w, 3), and its string attributes.

    Raises:
        InputError: If the file is missing, damaged or has no colours.
    """
    with _opened(path) as file:
        strings, channels = _strings(file), file.channels()
        layer = channels.get(_COLOURS) or channels.get("RGBA")
        pixels = None if layer is None else np.array(layer.pixels, dtype=np.float32)
    if pixels is None:
        raise InputError("holds no R, G and B channels", file=path)
    return np.ascontiguousarray(pixels[..., :3]), strings


def read_layers(path: Path) -> tuple[dict[str, Image], dict[str, str]]:
    """Read all layers that `write_exr` wrote, in single precision, and the string attributes.

    Raises:
        InputError: If the file is missing, damaged or has no colours.
    """
    with _opened(path) as file:
        strings = _strings(file)
        layers = {
            "radiance" if name == _COLOURS else name: np.array(channel.pixels, dtype=np.float32)
            for name, channel in file.channels().items()
        }
    if "radiance" not in layers:
        raise InputError("holds no R, G and B channels", file=path)
    return layers, strings


def read_attributes(path: Path) -> dict[str, str]:
    """Read a frame's string attributes alone, without its pixels.

    Raises:
        InputError: If the file is missing or damaged.
    """
    with _opened(path, header_only=True) as file:
        return _strings(file)


@contextmanager
def _opened(path: Path, *, header_only: bool = False, separate: bool = False) -> Iterator[Any]:
    """Open an OpenEXR file; an error says in one sentence what is wrong with it."""
    import OpenEXR

    if not path.is_file():
        raise InputError("no such file", file=path)
    try:
        with _quiet():
            with OpenEXR.File(str(path), header_only=True) as file:
                _check_size(file, path)
            file = OpenEXR.File(str(path), header_only=header_only, separate_channels=separate)
        with file:
            yield file
    except (
        ArithmeticError,
        LookupError,
        MemoryError,
        RuntimeError,
        TypeError,
        ValueError,
    ) as error:
        raise InputError("not a readable OpenEXR file; render it again", file=path) from error


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep to ourselves what the library prints of damage, on both streams and more than once."""
    with _PRINTING, silenced(), redirect_stdout(io.StringIO()):
        yield


def _check_size(file: Any, path: Path) -> None:
    """Refuse a file whose header promises more than its bytes can hold, before that is allocated.

    Raises:
        InputError: If it does.
    """
    promised = 0
    for number in range(len(file.parts)):
        header = file.header(number)
        first, last = header["dataWindow"]
        width, height = (int(end) - int(begin) + 1 for begin, end in zip(first, last, strict=True))
        promised += max(width, 0) * max(height, 0) * len(header["channels"]) * _PRECISION
    if promised > _DENSEST * path.stat().st_size + _ROOM:
        raise InputError("its header is damaged: it promises too much; render it again", file=path)


def _strings(file: Any) -> dict[str, str]:
    """Return the string attributes of an open file."""
    return {key: value for key, value in file.header().items() if isinstance(value, str)}
