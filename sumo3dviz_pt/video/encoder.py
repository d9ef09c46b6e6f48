"""Encodes frames as a film, one at a time.

sRGB-encoded pictures are converted to BT.709 YUV planes here. swscale's own conversion shifts
colours by up to 1.9 codes (measured); this one is true to 0.05 codes in the mean. The colour tags
go in by ffmpeg's `setparams` filter: as output options they are silently lost (measured).

A GIF is a film of 256 colours that any web page shows, with a palette made for the film. The
palette must be known before the first picture is written. If ffmpeg split its stream for that, it
would hold all pictures in memory; so they are first stored on disk without loss.

References:
    Rec. ITU-R BT.709-6, items 3.2 to 3.5 (matrix, quantisation, narrow range).
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sumo3dviz_pt.errors import ConfigError, RenderError
from sumo3dviz_pt.files.atomic import put_in_place
from sumo3dviz_pt.model.numbers import Ratio
from sumo3dviz_pt.video.codecs import AUTO, Codec, codec_named, frame_rate
from sumo3dviz_pt.video.ffmpeg import Ffmpeg, has_encoder, raw_input
from sumo3dviz_pt.video.prints import Print, print_of


def yuv709(
    rgb: NDArray[Any],
    *,
    bits: int = 8,
    halved: tuple[int, int] = (2, 2),
    rng: np.random.Generator | None = None,
) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
    """Convert a picture to narrow-range BT.709 planes.

    Chroma is the mean of the pixels that share it, so it is sited at their centre.

    Args:
        rgb: sRGB-encoded picture, (h, w, 3) in [0, 1]; h and w divide by `halved`.
        bits: Per sample, 8 or 10.
        halved: Luma samples per chroma sample, (down, across).
        rng: Adds triangular dither of +-1 code; None rounds.

    Returns:
        Y (h, w), Cb and Cr (h / down, w / across); uint8 or little-endian uint16.
    """
    red, green, blue = (np.asarray(rgb[..., i], dtype=np.float32) for i in range(3))
    luma = 0.2126 * red + 0.7152 * green + 0.0722 * blue
    down, across = halved
    small = (luma.shape[0] // down, down, luma.shape[1] // across, across)
    step = 1 << (bits - 8)

    def sampled(plane: NDArray[Any], gain: float, zero: float) -> NDArray[Any]:
        codes = plane * np.float32(gain * step) + np.float32(zero * step)
        if rng is not None:
            codes += rng.random(codes.shape, np.float32) - rng.random(codes.shape, np.float32)
        clipped = np.clip(np.floor(codes + 0.5), 0, 256 * step - 1)
        return np.asarray(clipped.astype(np.uint8 if bits == 8 else "<u2"))

    chroma = [
        (colour - luma).reshape(small).mean(axis=(1, 3)) / np.float32(widest)
        for colour, widest in ((blue, 1.8556), (red, 1.5748))
    ]
    return sampled(luma, 219, 16), sampled(chroma[0], 224, 128), sampled(chroma[1], 224, 128)


def keeping(*, size: tuple[int, int], rate: Fraction, part: Path) -> list[str]:
    """Return the arguments with which ffmpeg keeps RGB pictures without loss.

    Args:
        size: Width and height [px].
        rate: Frames per second.
        part: The file that keeps them.
    """
    source = raw_input("rgb24", size=size, rate=rate)
    return ["-y", *source, "-c:v", "ffv1", "-pix_fmt", "bgr0", "-f", "nut", str(part)]


def paint(film: Path, target: Path) -> None:
    """Turn kept pictures into a GIF that repeats for ever.

    Raises:
        RenderError: If ffmpeg fails.
    """
    palette = target.with_suffix(".palette.png")
    try:
        _run("-i", str(film), "-vf", "palettegen=stats_mode=full", str(palette))
        dithered = "paletteuse=dither=sierra2_4a:diff_mode=rectangle"
        _run("-i", str(film), "-i", str(palette), "-lavfi", dithered, "-loop", "0", str(target))
    finally:
        palette.unlink(missing_ok=True)


def _run(*arguments: str) -> None:
    """Run ffmpeg on files."""
    with Ffmpeg(["-y", *arguments]):
        pass


Picture = NDArray[Any]
"""sRGB-encoded frame, (h, w, 3): uint8, or float in [0, 1]."""

_TAGS = "color_primaries=bt709:color_trc=bt709:colorspace=bt709:range=tv"


def encode(
    frames: Iterable[Picture],
    path: Path,
    *,
    size: tuple[int, int],
    fps: Ratio,
    codec: str = AUTO,
    comment: Mapping[str, Any] | None = None,
) -> tuple[Print, ...]:
    """Encode a film in constant memory; it appears under its name only when complete.

    Pictures of floats are dithered when the codec has 8 bits, seeded by frame index.

    Args:
        frames: sRGB-encoded pictures, (h, w, 3), uint8 or float in [0, 1].
        path: The film.
        size: Width and height [px]; both even where colours are shared among pixels.
        fps: Frames per second; see `frame_rate`.
        codec: A name in `CODECS`, or `auto`.
        comment: Stored as JSON in the film's comment.

    Returns:
        The prints of its frames, as ffmpeg got them.

    Raises:
        ConfigError: If codec, ending, size, rate or folder do not fit.
        RenderError: If a frame is of the wrong size, there is none, or ffmpeg fails.
    """
    kind, rate = check_film(path, size=size, fps=fps, codec=codec)
    part = path.with_name(f"{path.stem}.part{path.suffix}")
    raw = part.with_suffix(".nut")
    try:
        # A palette is chosen from the whole film, so frames are first stored without loss.
        first = (
            keeping(size=size, rate=rate, part=raw)
            if kind.palette
            else _arguments(kind, size=size, rate=rate, comment=comment, part=part)
        )
        prints = _feed(first, frames, kind=kind, size=size)
        if kind.palette:
            paint(raw, part)
        put_in_place(part, path)
    finally:
        part.unlink(missing_ok=True)
        raw.unlink(missing_ok=True)
    return prints


def _feed(
    arguments: list[str], frames: Iterable[Picture], *, kind: Codec, size: tuple[int, int]
) -> tuple[Print, ...]:
    """Run ffmpeg on frames, one at a time; return their prints."""
    prints = []
    with Ffmpeg(arguments) as ffmpeg:
        for index, frame in enumerate(frames):
            planes = planes_of(frame, index=index, kind=kind, size=size)
            for plane in planes:
                ffmpeg.write(plane.tobytes())
            prints.append(print_of(planes, bits=kind.bits))
        if not prints:
            raise RenderError("a film needs at least one frame")
    return tuple(prints)


def check_film(
    path: Path, *, size: tuple[int, int], fps: Ratio, codec: str
) -> tuple[Codec, Fraction]:
    """Refuse what cannot become a film, before any frame is rendered.

    Args:
        path: The film.
        size: Width and height [px].
        fps: Frames per second; see `frame_rate`.
        codec: A name in `CODECS`, or `auto`.

    Returns:
        The codec and the exact frame rate.

    Raises:
        ConfigError: If codec, ending, size, rate or folder do not fit, or this ffmpeg lacks
            the encoder.
    """
    kind = codec_named(codec, path=path)
    shared = kind.halved[1]
    if any(side <= 0 or side % shared for side in size):
        raise ConfigError(
            f"a film's width and height must be even, not {size[0]} x {size[1]}", key="output.size"
        )
    if not path.parent.is_dir():
        raise ConfigError(f"the folder {str(path.parent)!r} does not exist")
    rate = frame_rate(fps, codec=kind)
    if not has_encoder(kind.encoder):
        raise ConfigError(f"this ffmpeg has no encoder {kind.encoder}; choose another codec")
    return kind, rate


def planes_of(
    frame: Picture, *, index: int, kind: Codec, size: tuple[int, int]
) -> tuple[NDArray[Any], ...]:
    """Convert one frame to the planes that ffmpeg gets.

    Args:
        frame: (h, w, 3), uint8 or float in [0, 1].
        index: Of the frame in its film, which seeds the dither.
        kind: The codec.
        size: Width and height [px].

    Returns:
        A plane of luma and two of chroma; or one of all colours, (h, w, 3).

    Raises:
        RenderError: If it is of another size.
    """
    if frame.shape != (size[1], size[0], 3):
        raise RenderError(f"frame {index} is {frame.shape}, not ({size[1]}, {size[0]}, 3)")
    is_bytes = frame.dtype == np.uint8
    if kind.palette:
        return (frame if is_bytes else (np.clip(frame, 0.0, 1.0) * 255 + 0.5).astype(np.uint8),)
    rgb = frame / np.float32(255) if is_bytes else np.clip(frame, 0.0, 1.0)
    # Bytes are rounded already: dither would not remove their steps.
    rng = np.random.default_rng(index) if kind.bits == 8 and not is_bytes else None
    return yuv709(rgb, bits=kind.bits, halved=kind.halved, rng=rng)


def _arguments(
    kind: Codec,
    *,
    size: tuple[int, int],
    rate: Fraction,
    comment: Mapping[str, Any] | None,
    part: Path,
) -> list[str]:
    """Return the arguments for ffmpeg."""
    source = raw_input(kind.pixels, size=size, rate=rate)
    # ffmpeg 7.0 and older know no place of chroma among setparams.
    target = ["-vf", f"setparams={_TAGS}", "-chroma_sample_location", "center"]
    target += [*kind.options, "-pix_fmt", kind.pixels]
    if part.suffix.lower() in (".mp4", ".mov"):
        # The index goes to the front, so that browsers can start at once.
        target += ["-movflags", "+faststart"]
    else:
        # Without this, Matroska files would hold a random number.
        target += ["-fflags", "+bitexact"]
    if comment:
        target += ["-metadata", "comment=" + json.dumps(dict(comment), sort_keys=True)]
    return ["-y", *source, *target, str(part)]
