"""Films as numbered pictures: `drive_{frame}.png`, or `drive_%06d.png` as in ffmpeg."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from pathlib import Path

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.model.geometry import Image

_PLACE = re.compile(r"\{frame\}|%(?:0(\d))?d")
_DIGITS = 6
SUFFIX = ".png"


def is_sequence(path: Path) -> bool:
    """Return whether a name is that of numbered pictures."""
    return path.suffix.lower() == SUFFIX and _PLACE.search(path.name) is not None


def numbered(path: Path, number: int) -> Path:
    """Return the picture of a frame."""

    def digits(place: re.Match[str]) -> str:
        width = _DIGITS if place.group() == "{frame}" else int(place.group(1) or 0)
        return f"{number:0{width}d}"

    return path.with_name(_PLACE.sub(digits, path.name))


def film_name(path: Path) -> Path:
    """Return the name that frames and account of a film go by: without the number."""
    if not is_sequence(path):
        return path
    stem = _PLACE.sub("", path.stem).strip("_-. ")
    return path.with_name(f"{stem or path.resolve().parent.name}{path.suffix}")


def check_sequence(path: Path) -> None:
    """Refuse a name that would be the same for all frames.

    Raises:
        ConfigError: If it is a picture's name without a number.
    """
    if path.suffix.lower() == SUFFIX and not is_sequence(path):
        example = path.with_name(f"{path.stem}_{{frame}}{SUFFIX}")
        raise ConfigError(
            f"a film as pictures needs {{frame}} in its name, such as {example}", key="output"
        )


def pictures_of(path: Path, files: Sequence[Path]) -> list[Path]:
    """Return where pictures of stored frames go.

    Args:
        path: With a place for the number.
        files: EXR frames; their numbers are the pictures', else these count from 0.
    """
    counted = all(file.stem.isdigit() for file in files)
    numbers = [int(file.stem) for file in files] if counted else range(len(files))
    return [numbered(path, number) for number in numbers]


def write_sequence(path: Path, files: Sequence[Path], pictures: Iterable[Image]) -> None:
    """Write numbered pictures of stored frames, each at once or not at all.

    Args:
        path: With a place for the number.
        files: EXR frames.
        pictures: What they develop to, (h, w, 3) in [0, 1].
    """
    from sumo3dviz_pt.image.exr import PROVENANCE, read_attributes
    from sumo3dviz_pt.image.png import write_png

    places = pictures_of(path, files)
    for place, file, picture in zip(places, files, pictures, strict=True):
        text = read_attributes(file).get(PROVENANCE, "{}")
        pixels = (picture * 255 + 0.5).astype("uint8")
        write_png(place, pixels, text={"provenance": text}, level=6)
