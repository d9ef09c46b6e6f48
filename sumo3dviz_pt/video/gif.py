"""Films of 256 colours that any web page shows: GIF, with a palette made for the film.

The palette must be known before the first picture is written. If ffmpeg split its stream for
that, it would hold all pictures in memory; so they are first stored on disk without loss.
"""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

from sumo3dviz_pt.video.ffmpeg import Ffmpeg, raw_input


def keeping(*, size: tuple[int, int], rate: Fraction, part: Path) -> list[str]:
    """Return the arguments with which ffmpeg keeps RGB pictures without loss.

    Args:
        size: Width and height [px].
        rate: Frames per second.
        part: The file that keeps them.
    """
    source = raw_input("rgb24", size=size, rate=rate)
    return ["-y", *source, "-c:v", "ffv1", "-pix_fmt", "bgr0", "-f", "nut", str(part)]


def paint(kept: Path, target: Path) -> None:
    """Turn kept pictures into a GIF that repeats for ever.

    Raises:
        RenderError: If ffmpeg fails.
    """
    palette = target.with_suffix(".palette.png")
    try:
        _run("-i", str(kept), "-vf", "palettegen=stats_mode=full", str(palette))
        dithered = "paletteuse=dither=sierra2_4a:diff_mode=rectangle"
        _run("-i", str(kept), "-i", str(palette), "-lavfi", dithered, "-loop", "0", str(target))
    finally:
        palette.unlink(missing_ok=True)


def _run(*arguments: str) -> None:
    """Run ffmpeg on files."""
    with Ffmpeg(["-y", *arguments]):
        pass
