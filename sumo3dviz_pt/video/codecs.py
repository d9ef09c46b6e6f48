"""Which codecs there are, and what a frame rate means exactly."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from types import MappingProxyType

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.model.numbers import Ratio, ratio_of


@dataclass(frozen=True, slots=True)
class Codec:
    """A way to store films.

    Attributes:
        bits: Per sample.
        halved: How many luma samples share a chroma sample, (down, across).
        pixels: ffmpeg's name of that.
        options: Encoder options. Threads are pinned: their number changes the bytes.
        suffixes: Containers it may go into; the first is the usual one.
        palette: Whether it has few colours, which are chosen by looking at the whole film.
    """

    bits: int
    halved: tuple[int, int]
    pixels: str
    options: tuple[str, ...]
    suffixes: tuple[str, ...] = (".mp4", ".mov", ".mkv")
    palette: bool = False

    @property
    def encoder(self) -> str:
        """Its name in ffmpeg."""
        return self.options[self.options.index("-c:v") + 1]


_X264 = ("-c:v", "libx264", "-preset", "medium", "-crf", "14", "-threads", "4")
_X265 = ("-c:v", "libx265", "-preset", "medium", "-crf", "14", "-tag:v", "hvc1")
_X265_QUIET = ("-x265-params", "log-level=error:frame-threads=2:pools=4")
_VP9 = ("-c:v", "libvpx-vp9", "-crf", "22", "-b:v", "0", "-deadline", "good", "-cpu-used", "2")
_VP9_THREADS = ("-row-mt", "1", "-threads", "4", "-tile-columns", "1")
_PRORES = ("-c:v", "prores_ks", "-profile:v", "3", "-vendor", "apl0", "-threads", "4")

CODECS: Mapping[str, Codec] = MappingProxyType(
    {
        "h264": Codec(8, (2, 2), "yuv420p", _X264),
        "h264_10": Codec(10, (2, 2), "yuv420p10le", _X264),
        "h265_10": Codec(10, (2, 2), "yuv420p10le", (*_X265, *_X265_QUIET)),
        "prores": Codec(10, (1, 2), "yuv422p10le", _PRORES, (".mov", ".mkv")),
        "vp9": Codec(8, (2, 2), "yuv420p", (*_VP9, *_VP9_THREADS), (".webm", ".mkv")),
        "gif": Codec(8, (1, 1), "rgb24", ("-c:v", "gif"), (".gif",), palette=True),
    }
)
"""Codecs by the name that users choose; `h264` plays everywhere."""

AUTO = "auto"
"""Stands for the codec that suits a film's ending."""


FILM_SUFFIXES = tuple(dict.fromkeys(ending for c in CODECS.values() for ending in c.suffixes))
"""All endings that films can have."""

_GIF_RATE = 50
"""Frames a second above which browsers slow a GIF down."""


def codec_named(name: str, *, path: Path) -> Codec:
    """Look a codec up and check that it fits into a file.

    Args:
        name: In `CODECS`, or `auto`: the first one that the file's ending suits.
        path: The film.

    Raises:
        ConfigError: If it is unknown or the file's ending does not suit it.
    """
    ending = path.suffix.lower()
    if name == AUTO:
        fitting = [codec for codec in CODECS.values() if ending in codec.suffixes]
        if not fitting:
            known = ", ".join(FILM_SUFFIXES)
            raise ConfigError(f"a film's name ends in one of {known}, not {path.name!r}")
        return fitting[0]
    if name not in CODECS:
        near = difflib.get_close_matches(name, CODECS, n=1)
        hint = f"did you mean {near[0]!r}?" if near else f"known: {', '.join([AUTO, *CODECS])}"
        raise ConfigError(f"no codec is called {name!r}; {hint}", key="output.codec")
    codec = CODECS[name]
    if ending not in codec.suffixes:
        endings = " or ".join(codec.suffixes)
        raise ConfigError(f"codec {name} needs a file ending in {endings}, not {path.name!r}")
    return codec


def frame_rate(fps: Ratio, *, codec: Codec | None = None) -> Fraction:
    """Return the frame rate as written: 29.97 is 2997/100, so that frame n lies at n / fps.

    Args:
        fps: A positive number, or a ratio such as `30000/1001`.
        codec: What it is for.

    Raises:
        ConfigError: If it is not positive and finite, or too high for the codec.
    """
    try:
        rate = ratio_of(fps)
    except ValueError as error:
        raise ConfigError(f"no frame rate: {error}", key="output.fps") from None
    if codec is not None and codec.palette and rate > _GIF_RATE:
        message = f"a GIF shows at most {_GIF_RATE} frames a second, not {float(rate):g}"
        raise ConfigError(message, key="output.fps")
    return rate
