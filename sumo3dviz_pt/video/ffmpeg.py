"""Runs the ffmpeg that imageio-ffmpeg brings along, never through a shell."""

from __future__ import annotations

import contextlib
import subprocess
import tempfile
from collections.abc import Sequence
from fractions import Fraction
from functools import cache
from types import TracebackType

from sumo3dviz_pt.errors import RenderError


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
