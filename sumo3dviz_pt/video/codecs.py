"""Which codecs there are, and what a frame rate means exactly."""

from __future__ import annotations

import difflib
import math
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from types import MappingProxyType

from sumo3dviz_pt.errors import ConfigError


@dataclass(frozen=True, slots=True)
class Codec:
    """A way to store films.

    Attributes:
        bits: Per sample.
        halved: How many luma samples share a chroma sample, (down, across).
        pixels: ffmpeg's name of that.
        options: Encoder options. Threads are pinned: their number changes the bytes.
        suffixes: Containers it may go into; the first is the usual one.
    """

    bits: int
    halved: tuple[int, int]
    pixels: str
    options: tuple[str, ...]
    suffixes: tuple[str, ...] = (".mp4", ".mov", ".mkv")


_X264 = ("-c:v", "libx264", "-preset", "medium", "-crf", "14", "-threads", "4")
_X265 = ("-c:v", "libx265", "-preset", "medium", "-crf", "14", "-tag:v", "hvc1")
_X265_QUIET = ("-x265-params", "log-level=error:frame-threads=2:pools=4")
_PRORES = ("-c:v", "prores_ks", "-profile:v", "3", "-vendor", "apl0", "-threads", "4")

CODECS: Mapping[str, Codec] = MappingProxyType(
    {
        "h264": Codec(8, (2, 2), "yuv420p", _X264),
        "h264_10": Codec(10, (2, 2), "yuv420p10le", _X264),
        "h265_10": Codec(10, (2, 2), "yuv420p10le", (*_X265, *_X265_QUIET)),
        "prores": Codec(10, (1, 2), "yuv422p10le", _PRORES, (".mov", ".mkv")),
    }
)
"""By the name that users choose; `h264` plays everywhere."""


def codec_named(name: str, *, path: Path) -> Codec:
    """Look a codec up and check that it fits into a file.

    Raises:
        ConfigError: If it is unknown or the file's ending does not suit it.
    """
    if name not in CODECS:
        near = difflib.get_close_matches(name, CODECS, n=1)
        hint = f"did you mean {near[0]!r}?" if near else f"known: {', '.join(CODECS)}"
        raise ConfigError(f"no codec is called {name!r}; {hint}", key="output.codec")
    codec = CODECS[name]
    if path.suffix.lower() not in codec.suffixes:
        fitting = " or ".join(codec.suffixes)
        raise ConfigError(f"codec {name} needs a file ending in {fitting}, not {path.name!r}")
    return codec


def frame_rate(fps: float) -> Fraction:
    """The frame rate as written: 29.97 is 2997/100, so that frame n lies at n / fps.

    Raises:
        ConfigError: If it is not positive and finite.
    """
    if not (math.isfinite(fps) and fps > 0):
        raise ConfigError(f"the frame rate must be positive, not {fps}", key="output.fps")
    return Fraction(repr(float(fps)))
