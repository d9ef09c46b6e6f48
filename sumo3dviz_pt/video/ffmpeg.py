"""Runs the ffmpeg that imageio-ffmpeg brings along, and reads pictures and facts of films by it.

It never runs through a shell. The wheel of imageio-ffmpeg has no ffprobe, so what a film says about
itself comes from ffmpeg's log.
"""

from __future__ import annotations

import contextlib
import re
import subprocess
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from pathlib import Path
from types import TracebackType

import numpy as np
from numpy.typing import NDArray

from sumo3dviz_pt.errors import InputError, RenderError


def ffmpeg_path() -> str:
    """Return the path of ffmpeg.

    Raises:
        RenderError: If this platform's imageio-ffmpeg has none.
    """
    import imageio_ffmpeg

    try:
        return str(imageio_ffmpeg.get_ffmpeg_exe())
    except RuntimeError as error:
        raise RenderError(f"no ffmpeg found: {error}") from error


@cache
def has_encoder(name: str) -> bool:
    """Return whether this ffmpeg has an encoder; builds differ."""
    command = [ffmpeg_path(), "-hide_banner", "-h", f"encoder={name}"]
    done = subprocess.run(command, capture_output=True, check=False, stdin=subprocess.DEVNULL)
    return done.stdout.startswith(b"Encoder ")


def raw_input(pixels: str, *, size: tuple[int, int], rate: Fraction) -> list[str]:
    """Return the arguments with which ffmpeg takes raw pictures that it is fed.

    Args:
        pixels: Their format, by ffmpeg's name.
        size: Width and height [px].
        rate: Frames per second.
    """
    form = ["-f", "rawvideo", "-pix_fmt", pixels, "-s", f"{size[0]}x{size[1]}"]
    return [*form, "-r", f"{rate.numerator}/{rate.denominator}", "-i", "pipe:0"]


class Ffmpeg:
    """A running ffmpeg that is fed bytes; after the `with` block it has ended.

    Args:
        arguments: Everything after the program's name.
    """

    def __init__(self, arguments: Sequence[str]) -> None:
        # A file, because a full pipe of messages would stop ffmpeg.
        self._messages = tempfile.TemporaryFile()  # noqa: SIM115 (closed by __exit__)
        self._process = subprocess.Popen(
            [ffmpeg_path(), "-hide_banner", "-loglevel", "error", *arguments],
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=self._messages,
        )

    def __enter__(self) -> Ffmpeg:
        return self

    def write(self, data: bytes) -> None:
        """Feed bytes.

        Raises:
            RenderError: If ffmpeg has given up, with its own reason.
        """
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(data)
        except OSError as error:
            self._process.wait()
            raise RenderError(f"ffmpeg failed: {self._reason()}") from error

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Finish the film, or kill ffmpeg if there was an error.

        Raises:
            RenderError: If ffmpeg failed, with its own reason.
        """
        assert self._process.stdin is not None
        with self._messages:
            if kind is not None:
                self._process.kill()
            # Closing the input of a process that has ended fails; its status says why it ended.
            with contextlib.suppress(OSError):
                self._process.stdin.close()
            if self._process.wait() and kind is None:
                raise RenderError(f"ffmpeg failed: {self._reason()}")

    def _reason(self) -> str:
        """Return the last line that ffmpeg printed."""
        self._messages.seek(0)
        lines = self._messages.read().decode("utf-8", errors="replace").strip().splitlines()
        return lines[-1] if lines else "it gave no reason"


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


def film_picture(path: Path, time: float, *, size: tuple[int, int]) -> NDArray[np.uint8]:
    """Return a film's picture at a time, scaled, (h, w, 3).

    Args:
        path: The film.
        time: From its beginning on [s].
        size: Width, height [px].

    Raises:
        InputError: If it has no picture then, or cannot be read.
    """
    width, height = size
    command = [
        *(ffmpeg_path(), "-hide_banner", "-loglevel", "error", "-ss", f"{time:.6f}"),
        *("-i", str(path), "-frames:v", "1", "-vf", _scaled(size)),
        *("-f", "rawvideo", "-pix_fmt", "rgb24", "pipe:1"),
    ]
    done = subprocess.run(command, capture_output=True, check=False, stdin=subprocess.DEVNULL)
    if done.returncode or len(done.stdout) != width * height * 3:
        why = done.stderr.decode("utf-8", "replace").strip().splitlines()
        raise InputError(f"has no picture at {time:.12g} s {why[-1:] or ''}".rstrip(), file=path)
    return np.frombuffer(done.stdout, dtype=np.uint8).reshape(height, width, 3)


def film_pictures(path: Path, *, size: tuple[int, int]) -> Iterator[NDArray[np.uint8]]:
    """Yield all pictures of a film in order, scaled, (h, w, 3) each.

    Args:
        path: The film.
        size: Width, height [px].

    Raises:
        InputError: If it cannot be read.
    """
    width, height = size
    command = [
        *(ffmpeg_path(), "-hide_banner", "-loglevel", "error", "-i", str(path)),
        *("-vf", _scaled(size), "-fps_mode", "passthrough"),
        *("-f", "rawvideo", "-pix_fmt", "rgb24", "pipe:1"),
    ]
    with tempfile.TemporaryFile() as messages:
        process = subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=messages
        )
        assert process.stdout is not None
        try:
            while len(read := process.stdout.read(width * height * 3)) == width * height * 3:
                yield np.frombuffer(read, dtype=np.uint8).reshape(height, width, 3)
        finally:
            process.stdout.close()
            failed = process.wait()
        if failed or read:
            messages.seek(0)
            why = messages.read().decode("utf-8", "replace").strip().splitlines()
            raise InputError(f"cannot be read to its end {why[-1:] or ''}".rstrip(), file=path)


def _scaled(size: tuple[int, int]) -> str:
    """Return the filter that makes pictures of a size, in full range."""
    return f"scale={size[0]}:{size[1]}:flags=area:in_color_matrix=bt709:out_range=pc"
