"""Makes pictures and films from stored EXR frames, without rendering again."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.model.ratios import Ratio
from sumo3dviz_pt.pipeline.films.encoding import developed
from sumo3dviz_pt.pipeline.films.frames import (
    StoredFilm,
    masters_folder,
    read_account,
    stored_film,
)
from sumo3dviz_pt.pipeline.films.sequences import is_sequence, pictures_of, write_sequence
from sumo3dviz_pt.pipeline.overlays.files import overlaid, read_facts
from sumo3dviz_pt.pipeline.production import check_target, check_tone
from sumo3dviz_pt.pipeline.stills.still import check_free
from sumo3dviz_pt.video.codecs import FILM_SUFFIXES

_FPS = 25
"""Frames per second where the frames do not tell."""


@dataclass(frozen=True, slots=True)
class DevelopOrder:
    """What `develop` is to make.

    Attributes:
        path: A .png (of the first frame), a film, or `name_{frame}.png`.
        exposure: EV instead of the stored one.
        tone: Tone curve instead of the stored one.
        fps: Frames per second instead of the film's own.
        codec: Of a film; `auto` goes by its ending.
        overwrite: Whether a picture or film that exists is replaced.
        final_exr: Whether finished frames are written as EXR files, too.
        overlays: Whether the overlays that frames were rendered with are drawn.
    """

    path: Path
    exposure: float | None = None
    tone: str | None = None
    fps: Ratio | None = None
    codec: str = "auto"
    overwrite: bool = False
    final_exr: bool = False
    overlays: bool = True


def develop_frames(source: Path, order: DevelopOrder) -> list[Path]:
    """Develop one frame to a .png, or a folder of frames to a film or numbered pictures.

    Args:
        source: An .exr, or a folder of them; of a folder, the frames of its film.
        order: What to make of it.

    Returns:
        The files that were written: one, or all numbered pictures.

    Raises:
        InputError: If there are no frames, they cannot be read, or belong to several films.
        ConfigError: If a choice is unknown or the target cannot or must not be written to.
    """
    target = order.path
    check_target(target, suffixes=(".png", *FILM_SUFFIXES), overwrite=order.overwrite)
    if order.tone is not None:
        check_tone(order.tone)

    # Read the frames, which are developed one by one as they are written.
    film = _film(source)
    account = film.account
    pictures = developed(
        film.files,
        tone=order.tone or account.get("tone"),
        exposure=order.exposure,
        glare=account.get("glare"),
        masters=_masters(film, order) if order.final_exr else None,
    )

    facts = read_facts(film.files[0].parent) if order.overlays else None
    if facts is not None:
        whole = target.suffix.lower() in FILM_SUFFIXES
        pictures = overlaid(pictures, film.files, facts, whole=whole)

    # Write numbered pictures, one picture, or a film.
    if is_sequence(target):
        places = pictures_of(target, film.files)
        if not order.overwrite:
            check_free(*places)
        write_sequence(target, film.files, pictures)
        return places
    if target.suffix.lower() == ".png":
        from sumo3dviz_pt.image.png import write_png

        write_png(target, (next(pictures) * 255 + 0.5).astype("uint8"))
        return [target]
    from sumo3dviz_pt.image.exr import read_exr
    from sumo3dviz_pt.video import check_film, encode

    height, width = read_exr(film.files[0])[0].shape[:2]
    rate = order.fps or film.fps or _FPS
    check_film(target, size=(width, height), fps=rate, codec=order.codec)
    encode(pictures, target, size=(width, height), fps=rate, codec=order.codec)
    return [target]


def _masters(film: StoredFilm, order: DevelopOrder) -> Path:
    """Return the folder for finished frames; it may not hold them already."""
    folder = masters_folder(order.path)
    if not order.overwrite:
        check_free(*(folder / file.name for file in film.files))
    folder.mkdir(exist_ok=True)
    return folder


def _film(source: Path) -> StoredFilm:
    """Return what is to be developed."""
    if source.is_file():
        return StoredFilm(read_account(source), (source,))
    if not source.is_dir():
        raise InputError("there is no such folder or frame", file=source)
    return stored_film(source)
