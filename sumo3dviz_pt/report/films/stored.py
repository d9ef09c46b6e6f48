"""A film's stored frames: where they lie, what they are, which belong together."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from sumo3dviz_pt.errors import ConfigError, InputError
from sumo3dviz_pt.model.geometry import Image
from sumo3dviz_pt.pipeline.films.build import FILM_SUFFIXES
from sumo3dviz_pt.pipeline.films.frames import frames_folder, read_account, stored_film
from sumo3dviz_pt.pipeline.films.traced import Shelf

SAME_TIME = 1e-6
"""Times that differ by less are one [s]."""


@dataclass(frozen=True, slots=True)
class Stored:
    """A stored frame.

    Attributes:
        path: Its file.
        time: SUMO's time [s].
        exposure: EV at which to develop it.
        tone: Tone curve's name.
        camera: Its name.
        seed: Of the scene and its samples; -1 if unknown.
        spp: Samples per pixel.
        quality: Preset's name.
        capped_share: Energy that the firefly cap took over all energy; NaN if unknown.
        nonfinite: Broken values found while rendering; NaN if unknown.
        versions: What rendered it.
        shelf: Finishes it, with its neighbours' help where it is stored as it was traced.
    """

    path: Path
    time: float
    exposure: float
    tone: str
    camera: str
    seed: int
    spp: int
    quality: str
    capped_share: float
    nonfinite: float
    versions: Mapping[str, str]
    shelf: Shelf

    def radiance(self) -> Image:
        """Its finished pixels, (h, w, 3), finite.

        Raises:
            InputError: If the file cannot be read or holds broken values.
        """
        radiance, _ = self.shelf.finished(self.path)
        broken = radiance.size - int(np.count_nonzero(np.isfinite(radiance)))
        if broken:
            raise InputError(f"{broken} values are not finite", file=self.path)
        return radiance


def find_frames(place: Path) -> list[Stored]:
    """Find the frames of a film, in order of time.

    Args:
        place: Their folder, or the film or its .json beside which it lies.

    Raises:
        ConfigError: If there is no such place, or no frame in it.
        InputError: If a frame is damaged, does not say what it is, or is another film's.
    """
    folder = _folder_of(place)
    if not any(folder.glob("*.exr")):
        raise ConfigError(f"{folder} holds no .exr frames", key="frames")
    files = stored_film(folder).files
    shelf = Shelf()
    frames = sorted((_stored(path, shelf) for path in files), key=lambda frame: frame.time)
    for one, other in pairwise(frames):
        if other.time - one.time < SAME_TIME:
            both = f"{one.path.name} and {other.path.name}"
            raise ConfigError(f"{folder}: {both} both show {one.time:.12g} s", key="frames")
    return frames


def _folder_of(place: Path) -> Path:
    """Return the folder of frames that a user means."""
    if place.is_dir():
        return place
    folder = frames_folder(place)
    if place.suffix.lower() in (*FILM_SUFFIXES, ".json") and folder.is_dir():
        return folder
    if place.exists():
        raise ConfigError(f"{place} is no folder of frames, nor lies one beside it", key="frames")
    raise ConfigError(f"there is no {place}", key="frames")


def _stored(path: Path, shelf: Shelf) -> Stored:
    """Read the account that is stored in a frame."""
    account = read_account(path)
    try:
        return Stored(
            path,
            time=float(account["time"]),
            exposure=float(account.get("exposure", 0.0)),
            tone=str(account.get("tone", "neutral")),
            camera=str(account.get("camera", "")),
            seed=int(account.get("seed", -1)),
            spp=int(account.get("spp", 0)),
            quality=str(account.get("quality", "")),
            capped_share=float(account.get("capped_share", "nan")),
            nonfinite=float(account.get("nonfinite", "nan")),
            versions=dict(account.get("versions", {})),
            shelf=shelf,
        )
    except (KeyError, TypeError, ValueError) as error:
        raise InputError("does not say which time it shows", file=path) from error


def matched(frames: Sequence[Stored], others: Sequence[Stored]) -> list[tuple[Stored, Stored]]:
    """Pair frames of one time.

    Args:
        frames: Of a film, in order of time, at least one.
        others: Of another.

    Raises:
        ConfigError: If a frame of either has no partner.
    """
    for own, wanted in ((frames, others), (others, frames)):
        lonely = _first_lonely(own, wanted)
        if lonely is not None:
            spans = f"{_span(frames)}, but {_span(others)}"
            alone = f"{lonely.path.name} of {lonely.path.parent.name} has no partner"
            raise ConfigError(f"the films show different times: {spans}; {alone}", key="against")
    return list(zip(frames, others, strict=True))


def _first_lonely(frames: Sequence[Stored], others: Sequence[Stored]) -> Stored | None:
    """Return the first frame without a partner of its time."""
    times = np.array([other.time for other in others])
    return next((frame for frame in frames if np.abs(times - frame.time).min() >= SAME_TIME), None)


def _span(frames: Sequence[Stored]) -> str:
    """Say how many frames there are, from when to when."""
    first, last = frames[0], frames[-1]
    name = first.path.parent.name
    return f"{name} has {len(frames)} frames from {first.time:.12g} s to {last.time:.12g} s"
