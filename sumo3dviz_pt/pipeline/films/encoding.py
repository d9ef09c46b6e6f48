"""Makes films and numbered pictures from stored EXR frames, without rendering again.

What proves them stands in their account. Every EXR frame and every layer has its SHA-256 there.
Every picture of a film has a print, as it was developed, and beside it how far the film's own
picture is from it: what the codec did. The account's digest is that of all else in it, so that
nothing can change in it unseen.
"""

from __future__ import annotations

import hashlib
import json
from collections import deque
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sumo3dviz_pt.errors import InputError, RenderError
from sumo3dviz_pt.job.settings import Job, OutputSettings
from sumo3dviz_pt.model.geometry import Image
from sumo3dviz_pt.model.numbers import Ratio
from sumo3dviz_pt.model.random import frame_seed
from sumo3dviz_pt.pipeline.films import layers as places
from sumo3dviz_pt.pipeline.films.frames import (
    FINISHED_AT_ONCE,
    NOTE,
    StoredFilm,
    frame_numbers,
    frames_folder,
    intact,
    is_sequence,
    masters_folder,
    pictures_of,
    read_account,
    stored_film,
    write_pictures,
)
from sumo3dviz_pt.pipeline.films.heard import has_soundtrack
from sumo3dviz_pt.pipeline.films.overlays import (
    FACTS,
    captions_file,
    extra_frames,
    overlaid,
    plain_twin,
    read_facts,
    write_both,
    write_captions,
)
from sumo3dviz_pt.pipeline.films.sound import recording_file, sound_folder
from sumo3dviz_pt.pipeline.films.traced import HelpedFrame, Shelf
from sumo3dviz_pt.pipeline.production import Production, check_response, check_target, check_tone
from sumo3dviz_pt.pipeline.provenance import file_hash, versions
from sumo3dviz_pt.pipeline.still import check_free, response_of
from sumo3dviz_pt.video.codecs import FILM_SUFFIXES
from sumo3dviz_pt.video.spherical import ENDINGS, Spherical, spherical_of, write_boxes

if TYPE_CHECKING:
    from sumo3dviz_pt.video.prints import Print
    from sumo3dviz_pt.video.soundtrack import Soundtrack


DIGEST = "digest"
"""Key of what an account, or another file of JSON, says of itself."""

Account = Mapping[str, Any]


def sealed(content: Account) -> dict[str, Any]:
    """Return what a file of JSON holds, with its digest."""
    plain = json.loads(json.dumps(content, default=str))
    return {**plain, DIGEST: digest_in(plain)}


def digest_in(content: Account) -> str:
    """Return the SHA-256 of what a file of JSON holds, but for its digest, in canonical JSON."""
    rest = {key: value for key, value in content.items() if key != DIGEST}
    text = json.dumps(rest, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()


def noted(files: Iterable[Path], digests: dict[str, str]) -> Iterator[Path]:
    """Yield files, each when its digest was noted by its name below its folder's folder."""
    for file in files:
        digests[f"{file.parent.name}/{file.name}"] = file_hash(file)
        yield file


def files_beside(path: Path, files: Sequence[Path], *, heard: bool = False) -> dict[str, str]:
    """Return the digests of what lies beside a film, but for its frames: layers, sound, captions.

    Args:
        path: The film, or its numbered pictures.
        files: Its frames; they need not be there any more.
        heard: Whether its sound is beside it.
    """
    layers, final = places.beside(frames_folder(path)), masters_folder(path)
    numbers = {int(file.stem) for file in files}
    paths = [file for number in sorted(numbers) for file in places.files_of(layers, number)]
    paths += [layers / name for name in places.WHOLE] + [
        frames_folder(path) / name for name in (FACTS, NOTE)
    ]
    paths += [final / f"{n:06d}.exr" for n in frame_numbers(final) if n in numbers]
    paths += [captions_file(path), *sorted(sound_folder(path).glob("*"))]
    paths += [recording_file(path)] if heard else []
    if is_sequence(path):
        paths += pictures_of(path, files)
    there = [file for file in paths if file.is_file()]
    return {file.relative_to(path.parent).as_posix(): file_hash(file) for file in there}


def delivered(
    path: Path, prints: Sequence[Print], *, codec: str, size: tuple[int, int]
) -> dict[str, Any]:
    """Decode a film that was just written; return what it can be held against.

    Args:
        path: The film.
        prints: Of its pictures, as they were developed.
        codec: A name in `CODECS`, or `auto`.
        size: Width and height [px].

    Raises:
        RenderError: If the film does not have all of these pictures.
    """
    from sumo3dviz_pt.video.codecs import codec_named
    from sumo3dviz_pt.video.prints import Apart, as_text, film_prints

    decoded = film_prints(path, codec=codec_named(codec, path=path), size=size).prints
    if len(decoded) != len(prints):
        raise RenderError(f"{path} has {len(decoded)} pictures of {len(prints)}; encode it again")
    apart = [Apart.between(own, wanted) for own, wanted in zip(decoded, prints, strict=True)]
    return {
        "sha256": file_hash(path),
        "codec": codec,
        "size": list(size),
        "pictures": [
            {"print": as_text(wanted), "codec_error": list(by.values)}
            for wanted, by in zip(prints, apart, strict=True)
        ],
    }


def encode_frames(
    files: Sequence[Path],
    path: Path,
    *,
    production: Production,
    fps: Fraction,
    turns: Iterable[Path],
    masters: Path | None = None,
) -> dict[str, Any]:
    """Develop stored frames and encode them in constant memory; with overlays, also without them.

    Args:
        files: EXR frames, in order.
        path: The film, or its numbered pictures.
        production: What the frames show; says size, codec, tone, glare, response and overlays.
        fps: Frames per second.
        turns: The same files, each when it can be developed.
        masters: Folder for the finished frames' radiance, or None.

    Returns:
        What each film that was written can be held against, by its name.

    Raises:
        InputError: If a frame is of another film by now, missing or damaged.
    """
    output = production.job.output
    pictures = developed(
        turns,
        Look(tone=output.tone, glare=output.glare, response=output.response),
        key=production.key,
        masters=masters,
    )
    film = None if production.job.overlays is None else read_facts(files[0].parent)
    lens = production.shot.frame_at(float(production.times[0])).view.lens
    main = path
    films: dict[str, Any] = {}

    def write(pictures: Iterable[Image], path: Path) -> None:
        if is_sequence(path):
            write_pictures(pictures_of(path, files), files, pictures)
            return
        track = _soundtrack(production.job, main, len(files), rate=fps, plain=path != main)
        how = _Form(fps, spherical_of(lens), track)
        films[path.name] = _film(pictures, path, output, how=how)

    if film is None:
        write(pictures, path)
    elif is_sequence(path):
        both = _with_plain(pictures, files, plain_twin(path))
        write(overlaid(both, files, film, whole=False), path)
    else:
        write_both(
            pictures,
            lambda some: write(overlaid(some, files, film, whole=True), path),
            lambda some: write(some, plain_twin(path)),
        )
    if film is not None:
        write_captions(film, path)
    return films


def _with_plain(pictures: Iterable[Image], files: Sequence[Path], path: Path) -> Iterator[Image]:
    """Yield pictures, each when it lies under its number, too; its frame may go at the next."""
    for picture, file in zip(pictures, files, strict=True):
        write_pictures(pictures_of(path, [file]), [file], [picture])
        yield picture


@dataclass(frozen=True, slots=True)
class _Form:
    """What a film has beside its pictures.

    Attributes:
        fps: Frames per second.
        spherical: What players must know of its projection, or None.
        track: Its sound, or None.
    """

    fps: Fraction
    spherical: Spherical | None
    track: Soundtrack | None


def _soundtrack(
    job: Job, path: Path, count: int, *, rate: Fraction, plain: bool
) -> Soundtrack | None:
    """Return a film's sound, or None.

    Args:
        job: With the request's choices.
        path: The film; with overlays, the one that has them.
        count: Of its frames.
        rate: Frames per second.
        plain: Whether it is the one without overlays.
    """
    from sumo3dviz_pt.video.soundtrack import Soundtrack

    wanted = job.output.sound
    if wanted is None or not has_soundtrack(job, path):
        return None
    before, after = (0, 0) if plain else extra_frames(job.overlays, float(rate))
    ambisonics = wanted.play == "ambisonics"
    return Soundtrack(recording_file(path), ambisonics, before, before + count + after)


def _film(
    pictures: Iterable[Image], path: Path, output: OutputSettings, *, how: _Form
) -> dict[str, Any]:
    """Write developed pictures as a film; return what it can be held against."""
    from sumo3dviz_pt.video import encode
    from sumo3dviz_pt.video.soundtrack import add_sound

    prints = encode(
        pictures,
        path,
        size=output.size,
        fps=how.fps,
        codec=output.codec,
        comment={"made_by": "sumo3dviz_pt", "versions": versions()},
    )
    if how.track is not None:
        add_sound(path, how.track, rate=how.fps)
    if how.spherical is not None and path.suffix.lower() in ENDINGS:
        write_boxes(path, how.spherical)
    return delivered(path, prints, codec=output.codec, size=output.size)


@dataclass(frozen=True, slots=True)
class Look:
    """How frames are developed; None takes what is stored with them.

    Attributes:
        tone: Tone curve's name.
        exposure: EV.
        glare: Share of light that the lens spreads.
        response: What a camera adds, by its name.
    """

    tone: str | None = None
    exposure: float | None = None
    glare: float | None = None
    response: str | None = None


AS_STORED = Look()
"""All as it is stored with the frames."""


def developed(
    files: Iterable[Path],
    look: Look = AS_STORED,
    *,
    key: str | None = None,
    masters: Path | None = None,
) -> Iterator[Image]:
    """Develop stored frames to display-encoded pictures.

    While a frame is read and helped by its neighbours, those before it are finished.

    Args:
        files: EXR frames, in order.
        look: How.
        key: That all frames must have.
        masters: Folder for the finished frames' radiance, or None.

    Raises:
        InputError: If a frame is missing, damaged or has another key.
    """
    from sumo3dviz_pt.image.exr import PROVENANCE, write_exr
    from sumo3dviz_pt.image.optics import Optics
    from sumo3dviz_pt.image.tonemap import develop_float

    shelf = Shelf()

    def picture(file: Path, frame: HelpedFrame) -> Image:
        with intact(file):
            radiance, account = frame.finished(), frame.account
            if masters is not None:
                text = {PROVENANCE: json.dumps(account, sort_keys=True)}
                half = bool(account.get("scene", {}).get("output", {}).get("half", True))
                write_exr(masters / file.name, {"radiance": radiance}, half=half, attributes=text)
            at = float(account.get("exposure", 0.0)) if look.exposure is None else look.exposure
            optics = Optics.from_dict(account.get("optics"))
            if optics is not None:
                seed = frame_seed(int(account.get("seed", 0)), float(account.get("time", 0.0)))
                radiance = optics.on(radiance, exposure=at, seed=seed)
            return develop_float(
                radiance,
                exposure=at,
                tone=look.tone or str(account.get("tone", "neutral")),
                glare=float(account.get("glare", 0.0)) if look.glare is None else look.glare,
                response=response_of(account, look.response),
            )

    coming: deque[Future[Image]] = deque()
    with ThreadPoolExecutor(FINISHED_AT_ONCE) as pool:
        for file in files:
            with intact(file):
                frame = shelf.helped(file)
            if key is not None and frame.account.get("key") != key:
                raise InputError("has become a frame of another film", file=file)
            coming.append(pool.submit(picture, file, frame))
            if len(coming) > FINISHED_AT_ONCE:
                yield coming.popleft().result()
        while coming:
            yield coming.popleft().result()


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
        response: What a camera adds, by its name, instead of the stored one.
    """

    path: Path
    exposure: float | None = None
    tone: str | None = None
    fps: Ratio | None = None
    codec: str = "auto"
    overwrite: bool = False
    final_exr: bool = False
    overlays: bool = True
    response: str | None = None


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
    if order.response is not None:
        check_response(order.response)

    # Read the frames, which are developed one by one as they are written.
    film = _develop_film(source)
    account = film.account
    look = Look(
        order.tone or account.get("tone"),
        order.exposure,
        account.get("glare"),
        order.response or account.get("response"),
    )
    pictures = developed(
        film.files,
        look,
        masters=_masters(film, order) if order.final_exr else None,
    )

    facts = read_facts(film.files[0].parent) if order.overlays else None
    if facts is not None:
        whole = target.suffix.lower() in FILM_SUFFIXES
        pictures = overlaid(pictures, film.files, facts, whole=whole)

    # Write numbered pictures, one picture, or a film.
    chosen = {"exposure": look.exposure, "tone": look.tone, "response": look.response}
    said = {key: value for key, value in chosen.items() if value is not None}
    if is_sequence(target):
        places = pictures_of(target, film.files)
        if not order.overwrite:
            check_free(*places)
        write_pictures(places, film.files, pictures, look=said)
        return places
    if target.suffix.lower() == ".png":
        write_pictures([target], film.files[:1], [next(pictures)], look=said)
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


def _develop_film(source: Path) -> StoredFilm:
    """Return what is to be developed."""
    if source.is_file():
        return StoredFilm(read_account(source), (source,))
    if not source.is_dir():
        raise InputError("there is no such folder or frame", file=source)
    return stored_film(source)
