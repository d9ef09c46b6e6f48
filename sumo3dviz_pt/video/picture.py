"""Reads pictures out of films: one, or all of them."""

from __future__ import annotations

import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.video.ffmpeg import ffmpeg_path


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
