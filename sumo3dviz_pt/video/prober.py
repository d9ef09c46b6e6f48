"""Reads back what a film says about itself.

The wheel of imageio-ffmpeg has no ffprobe, so the words come from ffmpeg's log.
"""

from __future__ import annotations

import re
import subprocess
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.video.ffmpeg import ffmpeg_path


@dataclass(frozen=True, slots=True)
class ProbedFilm:
    """What a film says about itself.

    Attributes:
        codec: Such as `h264`.
        pixels: Such as `yuv420p`.
        tags: Range, and matrix/primaries/transfer in one word if equal.
        size: Width and height [px].
        fps: Exact frame rate.
        frames: How many decode.
        comment: The comment, or nothing.
    """

    codec: str
    pixels: str
    tags: str
    size: tuple[int, int]
    fps: Fraction
    frames: int
    comment: str


_STREAM = re.compile(r"Video: (\w+).*?, (\w+)\((.*?)\), (\d+)x(\d+)")
_RATE = re.compile(r"frame_rate: (\d+)/(\d+)")
_COMMENT = re.compile(r"^\s*comment\s*: (.*)$", re.MULTILINE | re.IGNORECASE)


def probe(path: Path) -> ProbedFilm:
    """Decode a film and say what it is.

    Raises:
        InputError: If it is no film.
    """
    command = [ffmpeg_path(), "-hide_banner", "-i", str(path), "-vf", "showinfo", "-f", "null", "-"]
    done = subprocess.run(command, capture_output=True, check=False, stdin=subprocess.DEVNULL)
    log = done.stderr.decode("utf-8", errors="replace")
    stream, rate = _STREAM.search(log), _RATE.search(log)
    if done.returncode or stream is None or rate is None:
        raise InputError("not a film that ffmpeg can decode", file=path)
    codec, pixels, tags, width, height = stream.groups()
    comment = _COMMENT.search(log)
    return ProbedFilm(
        codec,
        pixels,
        tags,
        (int(width), int(height)),
        Fraction(int(rate[1]), int(rate[2])),
        len(re.findall(r"\bn:\s*\d+ pts:", log)),
        comment[1].strip() if comment else "",
    )
