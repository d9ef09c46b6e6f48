"""Pictures from stored EXR frames, without rendering again."""

from __future__ import annotations

from pathlib import Path

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.film import FILM_SUFFIXES, developed
from sumo3dviz_pt.pipeline import check_target, check_tone


def develop_frames(
    source: Path,
    target: Path,
    *,
    exposure: float | None = None,
    tone: str | None = None,
    fps: float = 25.0,
    codec: str = "h264",
) -> None:
    """Develop one frame to a .png, or a folder of frames to a film.

    Args:
        source: An .exr, or a folder of them.
        target: A .png (of the first frame) or a film.
        exposure: EV instead of the stored one.
        tone: Tone curve instead of the stored one.
        fps: Frames per second of a film.
        codec: Of a film.

    Raises:
        InputError: If there are no frames, or they cannot be read.
        ConfigError: If a choice is unknown or the target cannot be written to.
    """
    check_target(target, suffixes=(".png", *FILM_SUFFIXES))
    if tone is not None:
        check_tone(tone)
    files = _frames(source)
    pictures = developed(files, tone=tone, exposure=exposure)
    if target.suffix.lower() == ".png":
        from sumo3dviz_pt.image.png import write_png

        write_png(target, (next(pictures) * 255 + 0.5).astype("uint8"))
        return
    from sumo3dviz_pt.image.exr import read_exr
    from sumo3dviz_pt.video import check_film, encode

    height, width = read_exr(files[0])[0].shape[:2]
    check_film(target, size=(width, height), fps=fps, codec=codec)
    encode(pictures, target, size=(width, height), fps=fps, codec=codec)


def _frames(source: Path) -> list[Path]:
    """EXR files, in order."""
    if source.is_file():
        return [source]
    if not source.is_dir():
        raise InputError("there is no such folder or frame", file=source)
    files = sorted(source.glob("*.exr"))
    if not files:
        raise InputError("holds no .exr frames", file=source)
    return files
