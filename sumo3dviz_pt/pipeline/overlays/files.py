"""The files of a film with overlays: its twin without them, its captions, and what they show.

`drive.mp4` has overlays, `drive.plain.mp4` has none: it is what was rendered, from the shot's first
frame to its last. `overlays.json` lies beside the frames, so that `develop` draws the same.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.files.whole import write_whole
from sumo3dviz_pt.model.geometry import Image
from sumo3dviz_pt.pipeline.films.sequences import film_name

if TYPE_CHECKING:
    from sumo3dviz_pt.job.overlays import OverlaySettings
    from sumo3dviz_pt.overlays.facts import FilmFacts
    from sumo3dviz_pt.overlays.following import Shown
    from sumo3dviz_pt.pipeline.production import Production

FACTS = "overlays.json"
"""What overlays show, beside the frames."""

_LEAST_SHARE = 1e-5
"""Share of a picture that shows a road user which is not hidden."""


def plain_twin(path: Path) -> Path:
    """Return where a film without overlays goes, by the name of the one that has them."""
    return path.with_name(f"{path.stem}.plain{path.suffix}")


def captions_file(path: Path) -> Path:
    """Return where a film's captions go."""
    return film_name(path).with_suffix(".vtt")


def extra_files(path: Path, wanted: OverlaySettings | None) -> list[Path]:
    """Return the files that overlays put beside a film; none without overlays."""
    if wanted is None:
        return []
    return [plain_twin(path), *([captions_file(path)] if wanted.captions else [])]


def extra_frames(wanted: OverlaySettings | None, rate: float) -> tuple[int, int]:
    """Return how many frames overlays put before and after a film.

    Args:
        wanted: The overlays, or None.
        rate: Frames per second.
    """
    if wanted is None:
        return 0, 0
    from sumo3dviz_pt.overlays.around import still_count

    return still_count(wanted.before, rate), still_count(wanted.after, rate)


def read_facts(folder: Path) -> FilmFacts | None:
    """Return what the overlays of stored frames show; None where they have none.

    Raises:
        InputError: If the file is damaged.
    """
    path = folder / FACTS
    if not path.is_file():
        return None
    from sumo3dviz_pt.overlays.facts import facts_of

    try:
        return facts_of(path.read_bytes())
    except ValueError as error:
        raise InputError(f"{error}; render the film again", file=path) from error


def overlaid(
    pictures: Iterable[Image], files: Iterable[Path], film: FilmFacts, *, whole: bool
) -> Iterator[Image]:
    """Yield pictures with their overlays.

    Args:
        pictures: Of stored frames, (h, w, 3) in [0, 1].
        files: These frames.
        film: What overlays show.
        whole: Whether what stands before and after the film is yielded, too.
    """
    from sumo3dviz_pt.overlays.around import still_frames
    from sumo3dviz_pt.overlays.build import drawn, hides

    if whole:
        yield from still_frames(film.settings.before, film)
    for picture, file in zip(pictures, files, strict=True):
        number = number_of(file, film)
        yield drawn(picture, film, number, shown_in(file) if hides(film) else None)
    if whole:
        yield from still_frames(film.settings.after, film)


def note_overlays(folder: Path, production: Production, *, rate: float) -> None:
    """Write what a film's overlays show beside its frames; what lay there goes if it has none.

    Args:
        folder: Of the frames.
        production: The film's.
        rate: Its frames per second.
    """
    path = folder / FACTS
    if production.job.overlays is None:
        path.unlink(missing_ok=True)
        return
    from sumo3dviz_pt.overlays.facts import facts_text
    from sumo3dviz_pt.pipeline.overlays.gather import film_facts

    write_whole(path, facts_text(film_facts(production, production.job.overlays, rate=rate)))


def write_captions(film: FilmFacts, path: Path) -> None:
    """Write the captions of a film beside it, if it has any."""
    if film.settings.captions:
        from sumo3dviz_pt.overlays.around import captions_text

        write_whole(captions_file(path), captions_text(film.settings.captions, film))


def number_of(file: Path, film: FilmFacts) -> int:
    """Return a stored frame's number in its film.

    Raises:
        InputError: If the film has no such frame.
    """
    number = int(file.stem) if file.stem.isdecimal() else -1
    if not 0 <= number < len(film.frames):
        raise InputError("is no frame of the film that its overlays are of", file=file)
    return number


def shown_in(file: Path) -> Shown | None:
    """Return whom a stored frame shows; None where it does not tell.

    Raises:
        InputError: If it is missing or damaged.
    """
    import numpy as np

    from sumo3dviz_pt.image.accumulation.storage import unpacked
    from sumo3dviz_pt.overlays.following import Shown
    from sumo3dviz_pt.pipeline.films.traced import TRACED, StoredFrame

    stored = StoredFrame.read(file)
    if not stored.traced:
        return None
    try:
        frame = unpacked(stored.layers, stored.strings[TRACED])
    except ValueError as error:
        raise InputError(f"{error}; render it again", file=file) from error
    ids = np.squeeze(frame.layers["ids"]).astype(np.int64)
    pixels: dict[str, int] = {}
    for number, count in enumerate(np.bincount(ids.ravel(), minlength=1)[1:].tolist()):
        key = frame.parts[number].name.rpartition("/")[0]
        pixels[key] = pixels.get(key, 0) + count
    least = max(_LEAST_SHARE * ids.size, 1.0)
    return Shown(frozenset(key for key, count in pixels.items() if count >= least), ids > 0)
