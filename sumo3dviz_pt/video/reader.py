"""Reads all pictures of a film, one after the other."""

from __future__ import annotations

import subprocess
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.video.ffmpeg import ffmpeg_path


def film_pictures(path: Path, *, size: tuple[int, int]) -> Iterator[NDArray[np.uint8]]:
    """Yield a film's pictures, scaled, (h, w, 3), in memory that does not grow.

    Args:
        path: The film.
        size: Width, height [px].

    Raises:
        InputError: If it is no film, or breaks off within a picture.
    """
    width, height = size
    scale = f"scale={width}:{height}:flags=area:in_color_matrix=bt709:out_range=pc"
    command = [
        *(ffmpeg_path(), "-hide_banner", "-loglevel", "quiet", "-i", str(path)),
        *("-vf", scale, "-f", "rawvideo", "-pix_fmt", "rgb24", "pipe:1"),
    ]
    count, length = 0, width * height * 3
    with subprocess.Popen(command, stdout=subprocess.PIPE, stdin=subprocess.DEVNULL) as process:
        assert process.stdout is not None
        try:
            while len(data := process.stdout.read(length)) == length:
                count += 1
                yield np.frombuffer(data, dtype=np.uint8).reshape(height, width, 3)
        except GeneratorExit:
            process.kill()
            raise
    if process.returncode or data or not count:
        raise InputError("not a film that ffmpeg can decode", file=path)
