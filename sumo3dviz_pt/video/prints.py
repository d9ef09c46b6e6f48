"""What pictures are in a few hundred numbers each, so that a film can be held against them.

A print has two things of each of 16 x 9 blocks of a picture, as the encoder got it: the mean of
every plane, which tells a cast, a shade, a person that was painted in; and sums of every plane with
signs that look drawn by lot, which tell lost detail and patterns that leave means what they are.
The difference of two such sums is as large as the difference of all of the block's pixels, on
average over blocks (a random projection); so few numbers tell how far two pictures are apart, pixel
by pixel. All numbers are in codes of 0 to 255, also of films with more bits.

References:
    Achlioptas, "Database-friendly random projections", Journal of Computer and System Sciences 66,
        2003, doi:10.1016/S0022-0000(03)00025-4.
"""

from __future__ import annotations

import base64
import math
import subprocess
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import astuple, dataclass
from functools import cache
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.model.geometry import Floats
from sumo3dviz_pt.video.codecs import Codec
from sumo3dviz_pt.video.containers import FilmWords, words_in
from sumo3dviz_pt.video.ffmpeg import ffmpeg_path

ROWS, COLUMNS = 9, 16
"""Blocks of a picture; smaller pictures have a block for each of their rows and columns."""

_STEPS = 64.0
"""Steps of stored numbers in a code."""

_SUMS = (3, 1, 1)
"""Signed sums of each plane: of luma several, because one alone may hide what lies in a block."""

_NEUTRAL = 128.0
"""Code of a plane of colour that shows none."""

_AGAIN, _CODES = 1.5, (0.1, 0.5, 0.5, 0.5, 0.5, 0.5, 0.1)
"""What a codec may do when a film is encoded once more: this times what it did, and so many codes
more; see `Apart`."""

Print = NDArray[np.int16]
"""(8, blocks) in steps: means of luma and two colours, then their signed sums, as in `_SUMS`."""

Planes = Sequence[NDArray[Any]]


def print_of(planes: Planes, *, bits: int) -> Print:
    """Return the print of a picture.

    Args:
        planes: (h, w) each, as an encoder takes them; or all in one, (h, w, 3).
        bits: Of their samples.
    """
    code = float(1 << (bits - 8))
    if planes[0].ndim == 3:
        planes = _luma_and_colour(planes[0])
    # Planes of colour are smaller, and their blocks belong to the same parts of the picture.
    sides = zip(*(plane.shape for plane in planes), strict=True)
    blocks = tuple(min(most, *own) for most, own in zip(_MOST, sides, strict=True))
    means = [_sums(plane, blocks) / _counts(plane.shape, blocks) for plane in planes]
    signed = [
        _sums(plane * _signs(plane.shape, way), blocks) / np.sqrt(_counts(plane.shape, blocks))
        for plane, count in zip(planes, _SUMS, strict=True)
        for way in range(count)
    ]
    steps = np.stack([*means, *signed]) * (_STEPS / code)
    return np.rint(np.clip(steps, -32767, 32767)).astype(np.int16)


def _luma_and_colour(picture: NDArray[Any]) -> Planes:
    """Return a picture of red, green and blue bytes as three planes, in whole numbers."""
    red, green, blue = (picture[..., n].astype(np.int32) for n in range(3))
    luma = (54 * red + 183 * green + 19 * blue) >> 8
    return [luma, 128 + ((blue - luma) >> 1), 128 + ((red - luma) >> 1)]


@dataclass(frozen=True, slots=True)
class Apart:
    """How far a picture is from another one, in codes.

    Attributes:
        shade: By how much the whole picture is lighter or darker, or of another colour: the plane
            whose mean differs most.
        block: The same of the block that differs most.
        pixel: Root mean square of what pixels differ by in luma, estimated.
        worst: The same of the block that differs most.
        colour: As `pixel`, of the plane of colour that differs more.
        stain: As `worst`, of a plane of colour.
        tone: By how much contrast, saturation or hue of the whole picture differ: root mean square
            of the part of what blocks differ by that is like the picture itself.
    """

    shade: float
    block: float
    pixel: float
    worst: float
    colour: float
    stain: float
    tone: float

    @classmethod
    def between(cls, one: Print, other: Print) -> Apart:
        """Compare two prints; those of other shapes are infinitely far apart."""
        if one.shape != other.shape:
            return cls(*(math.inf,) * 7)
        apart, planes = (one.astype(np.float64) - other) / _STEPS, len(_SUMS)
        means, signed = apart[:planes], apart[planes:] ** 2
        luma, colours = signed[: _SUMS[0]].mean(axis=0), signed[_SUMS[0] :]
        numbers = (
            *(np.abs(means.mean(axis=1)).max(), np.abs(means).max()),
            *(np.sqrt(luma.mean()), np.sqrt(luma.max())),
            *(np.sqrt(colours.mean(axis=1).max()), np.sqrt(colours.max())),
            _tone(means, other[:planes] / _STEPS),
        )
        return cls(*map(_up, numbers))

    @property
    def values(self) -> tuple[float, ...]:
        """All of its numbers."""
        return astuple(self)

    def beyond(self, bound: Apart) -> float:
        """Return by how many codes it exceeds what a codec may do; 0 if it does not.

        A codec errs otherwise each time that a film is encoded: so each number may be half as large
        again, and some part of a code.

        Args:
            bound: What it did when the film was made.
        """
        pairs = zip(self.values, bound.values, _CODES, strict=True)
        return max(0.0, *(own - _AGAIN * limit - code for own, limit, code in pairs))


def _tone(apart: Floats, wanted: Floats) -> float:
    """Return how far contrast, saturation and hue of a picture differ, whichever does most.

    Args:
        apart: What the means of blocks differ by, (3, blocks) [codes].
        wanted: What they should be.
    """
    luma, colour = wanted[0] - wanted[0].mean(), wanted[1:] - _NEUTRAL
    turned = np.stack([-colour[1], colour[0]])
    ways = ((apart[0], luma), (apart[1:], colour), (apart[1:], turned))
    shares = (abs(float((by * way).sum())) / max(_size(way), 1e-9) for by, way in ways)
    return max(shares) / math.sqrt(wanted.shape[1])


def _size(values: Floats) -> float:
    """Return the root of the sum of squares."""
    return float(np.sqrt((values**2).sum()))


def as_text(values: Print) -> str:
    """Return a print as text."""
    return base64.b64encode(values.astype("<i2").tobytes()).decode()


def print_in(text: str) -> Print:
    """Return the print that a text holds.

    Raises:
        ValueError: If it holds none.
    """
    numbers = np.frombuffer(base64.b64decode(text, validate=True), dtype="<i2")
    return numbers.reshape(len(_SUMS) + sum(_SUMS), -1).astype(np.int16)


@dataclass(frozen=True, slots=True)
class FilmPrints:
    """What a film's pictures are.

    Attributes:
        prints: Of all of them.
        words: What the film says of itself.
    """

    prints: tuple[Print, ...]
    words: FilmWords


def film_prints(path: Path, *, codec: Codec, size: tuple[int, int]) -> FilmPrints:
    """Decode a whole film, in memory that holds a picture and the prints.

    Its samples are taken as they are coded: no conversion of colours is between, which programs
    round each in their own way.

    Args:
        path: The film.
        codec: Its pictures are as this one stores them.
        size: Its width and height should be [px]; others are scaled.

    Raises:
        InputError: If it cannot be decoded to its end.
    """
    scale = f"scale={size[0]}:{size[1]}:flags=area"
    command = [
        *(ffmpeg_path(), "-hide_banner", "-nostats", "-i", str(path), "-map", "0:v:0"),
        *("-vf", f"showinfo=checksum=0,{scale}", "-fps_mode", "passthrough"),
        *("-f", "rawvideo", "-pix_fmt", codec.pixels, "pipe:1"),
    ]
    with tempfile.TemporaryFile() as messages:
        process = subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=messages
        )
        assert process.stdout is not None
        with process.stdout as stream:
            pictures = _pictures(stream, codec, size)
            prints = tuple(print_of(planes, bits=codec.bits) for planes in pictures)
        failed = process.wait()
        messages.seek(0)
        text = messages.read().decode("utf-8", "replace")
    words = words_in(text)
    if failed or not prints or words is None:
        raise InputError("is no film that can be decoded to its end", file=path)
    return FilmPrints(prints, words)


def _pictures(stream: IO[bytes], codec: Codec, size: tuple[int, int]) -> Iterator[Planes]:
    """Yield the planes of a decoded film's pictures."""
    width, height = size
    if codec.palette:
        while len(data := stream.read(3 * width * height)) == 3 * width * height:
            yield [np.frombuffer(data, dtype=np.uint8).reshape(height, width, 3)]
        return
    down, across = codec.halved
    small = (height // down, width // across)
    shapes = [(height, width), small, small]
    kind = np.dtype(np.uint8 if codec.bits == 8 else "<u2")
    ends = np.cumsum([high * wide for high, wide in shapes]).tolist()
    length = ends[-1] * kind.itemsize
    while len(data := stream.read(length)) == length:
        whole = np.split(np.frombuffer(data, dtype=kind), ends[:-1])
        yield [plane.reshape(shape) for plane, shape in zip(whole, shapes, strict=True)]


def _sums(plane: NDArray[Any], blocks: tuple[int, ...]) -> Floats:
    """Return the sums of a plane's blocks, so many down and across, (blocks,)."""
    rows, columns = (_starts(*each) for each in zip(plane.shape, blocks, strict=True))
    across = np.add.reduceat(plane, columns, axis=1, dtype=np.int64)
    return np.add.reduceat(across, rows, axis=0).ravel().astype(np.float64)


_MOST = (ROWS, COLUMNS)


@cache
def _counts(shape: tuple[int, int], blocks: tuple[int, ...]) -> Floats:
    """Return how many pixels blocks have."""
    return _sums(np.ones(shape, dtype=np.int64), blocks)


def _starts(side: int, count: int) -> NDArray[np.int64]:
    """Return where so many blocks begin along a side."""
    return np.arange(count) * side // count


@cache
def _signs(shape: tuple[int, int], way: int) -> NDArray[np.int32]:
    """Return a sign for each pixel: a hash of its number, the same everywhere, by SplitMix64."""
    count = shape[0] * shape[1]
    numbers = np.arange(1 + way * count, 1 + (way + 1) * count, dtype=np.uint64)
    mixed = numbers * np.uint64(0x9E3779B97F4A7C15)
    for shift, factor in ((30, 0xBF58476D1CE4E5B9), (27, 0x94D049BB133111EB)):
        mixed = (mixed ^ (mixed >> np.uint64(shift))) * np.uint64(factor)
    odd = (mixed >> np.uint64(63)).astype(np.int32)
    return (2 * odd - 1).reshape(shape)


def _up(value: Any) -> float:
    """Return a number rounded up to hundredths."""
    return math.ceil(float(value) * 100 - 1e-9) / 100
