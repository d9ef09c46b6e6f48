"""Reads single pictures out of films."""

from __future__ import annotations

import subprocess
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
    scale = f"scale={width}:{height}:flags=area:in_color_matrix=bt709:out_range=pc"
    command = [
        *(ffmpeg_path(), "-hide_banner", "-loglevel", "error", "-ss", f"{time:.6f}"),
        *("-i", str(path), "-frames:v", "1", "-vf", scale),
        *("-f", "rawvideo", "-pix_fmt", "rgb24", "pipe:1"),
    ]
    done = subprocess.run(command, capture_output=True, check=False, stdin=subprocess.DEVNULL)
    if done.returncode or len(done.stdout) != width * height * 3:
        why = done.stderr.decode("utf-8", "replace").strip().splitlines()
        raise InputError(f"has no picture at {time:g} s {why[-1:] or ''}".rstrip(), file=path)
    return np.frombuffer(done.stdout, dtype=np.uint8).reshape(height, width, 3)
