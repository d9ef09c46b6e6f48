"""Holds delivered films against their frames, picture by picture.

A film's account has a print of every picture as it was developed, and how far the encoded picture
was from it. A picture that is farther away now is not the one that was delivered. Where the frames
themselves are there, they are developed again, as they were for the film, and their prints must be
those of the account.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sumo3dviz_pt.errors import ConfigError, InputError
from sumo3dviz_pt.model.geometry import Image
from sumo3dviz_pt.pipeline.films.encoding import Look, developed
from sumo3dviz_pt.pipeline.films.frames import frame_file, frames_folder
from sumo3dviz_pt.pipeline.films.overlays import plain_twin, read_facts, shown_in
from sumo3dviz_pt.pipeline.provenance import file_hash

if TYPE_CHECKING:
    from sumo3dviz_pt.overlays.facts import FilmFacts
    from sumo3dviz_pt.video.codecs import Codec
    from sumo3dviz_pt.video.prints import Apart, FilmPrints, Print


_CODEC_MOST = (1.0, 4.0, 12.0, 48.0, 8.0, 32.0, 1.0)
"""The farthest that a codec may bring a picture from its frame, as in `Apart` [codes]: a GIF, which
has 256 colours, comes to 0.1, 2.1, 9.7 and 33 on textured pictures of 160x90, ProRes to 0.3, 1.6,
3.3 and 11, H.264 to 0.1, 1.5, 1.7 and 4.7."""

_SMALL = 40.0
"""What a block of one pixel may be farther [codes]; of more pixels, over the root of their number:
errors of single pixels cancel in means."""

AGAIN_MOST = (0.05, 0.25, 0.25, 1.0, 0.25, 1.0, 0.05)
"""The farthest that a frame developed on another machine may be from what it was [codes]; on the
same one it is the same to the bit."""

NOT_WRITTEN = "is not the film that was written"
"""What is said of a film with another digest."""

Account = Mapping[str, Any]


def codec_most(size: tuple[int, int]) -> tuple[float, ...]:
    """Return the farthest that a codec may bring pictures of a size from their frames [codes]."""
    from sumo3dviz_pt.video.prints import COLUMNS, ROWS

    pixels = max(size[0] * size[1] / (COLUMNS * ROWS), 1.0)
    shade, block, *others = _CODEC_MOST
    return shade, round(block + _SMALL / math.sqrt(pixels), 1), *others


@dataclass(frozen=True, slots=True)
class FilmFault:
    """What is wrong with a film.

    Attributes:
        film: The file.
        what: Is wrong.
        frame: Number of the frame whose picture is wrong, if it is one; pictures that overlays put
            before a film have numbers below 0.
    """

    film: Path
    what: str
    frame: int | None = None


@dataclass(frozen=True, slots=True)
class FilmTest:
    """What was found of a film and of the one without overlays beside it, if it has one.

    Attributes:
        faults: What is wrong.
        pictures: How many were decoded.
        developed: How many of these were held against a frame that was developed again.
    """

    faults: tuple[FilmFault, ...]
    pictures: int
    developed: int


@dataclass(frozen=True, slots=True, eq=False)
class _Delivery:
    """What an account says of a delivered film."""

    path: Path
    sha256: str
    codec: Codec
    size: tuple[int, int]
    rate: Fraction
    before: int
    prints: tuple[Print, ...]
    bounds: tuple[Apart, ...]
    sound: bool


def film_faults(
    film: Path, account: Account, *, sha256: str, spare: Collection[Path] = (), develop: bool
) -> FilmTest:
    """Decode a film, and say which of its pictures are not its frames.

    Args:
        film: The film.
        account: Its account.
        sha256: Of the film, as the study's record has it.
        spare: Frames that are known to be wrong; neither they nor those that they help are
            developed.
        develop: Whether frames are developed again.
    """
    try:
        claims = {path: _delivered(path, account) for path in _films_of(film, account)}
    except (KeyError, TypeError, ValueError, ConfigError) as error:
        return FilmTest(
            (FilmFault(film, f"its account does not tell its pictures ({error})"),), 0, 0
        )
    faults: list[FilmFault] = []
    pictures = 0
    for path, each in claims.items():
        wanted = {each.sha256} | ({sha256} if path == film else set())
        if not path.is_file():
            faults.append(FilmFault(path, "is not there"))
            continue
        if {file_hash(path)} != wanted:
            faults.append(FilmFault(path, NOT_WRITTEN))
        more, count = _pictures(each)
        faults += more
        pictures += count
    frames = whole_frames(film, account, spare) if develop else []
    again, count = _again(film, account, claims, frames)
    return FilmTest((*faults, *again), pictures, count)


def replayed_faults(film: Path, account: Account, frame: Path) -> list[FilmFault]:
    """Return whether a film's picture is not the frame that was rendered anew for it.

    Args:
        film: The film.
        account: Its account.
        frame: Rendered anew, beside all that help it.
    """
    claims = {path: _delivered(path, account) for path in _films_of(film, account)}
    return _again(film, account, claims, [frame])[0]


def _films_of(film: Path, account: Account) -> list[Path]:
    """Return a film, and the one without overlays beside it."""
    return [film, *([plain_twin(film)] if account.get("overlays") else [])]


def _delivered(path: Path, account: Account) -> _Delivery:
    """Return what an account says of a film.

    Raises:
        KeyError, TypeError, ValueError, ConfigError: If it says nothing of it, or no sense.
    """
    from sumo3dviz_pt.video.codecs import codec_named
    from sumo3dviz_pt.video.prints import Apart, print_in
    from sumo3dviz_pt.video.soundtrack import SILENT

    own = account["delivered"][path.name]
    if not all(math.isfinite(value) for each in own["pictures"] for value in each["codec_error"]):
        raise ValueError("a codec's error is no number")
    whole = bool(account.get("overlays")) and ".plain" not in path.suffixes[-2:-1]
    return _Delivery(
        path,
        str(own["sha256"]),
        codec_named(str(own["codec"]), path=path),
        (int(own["size"][0]), int(own["size"][1])),
        Fraction(str(account["frame_rate"])),
        int(account["overlays"]["frames_before"]) if whole else 0,
        tuple(print_in(each["print"]) for each in own["pictures"]),
        tuple(Apart(*each["codec_error"]) for each in own["pictures"]),
        bool(account.get("sound")) and path.suffix.lower() not in SILENT,
    )


# What was delivered -----------------------------------------------------------------------


def _pictures(film: _Delivery) -> tuple[list[FilmFault], int]:
    """Return which pictures of a film are not those that were developed; and how many it has."""
    from sumo3dviz_pt.video.prints import Apart, film_prints

    try:
        decoded = film_prints(film.path, codec=film.codec, size=film.size)
    except InputError:
        return [FilmFault(film.path, "cannot be decoded to its end")], 0
    faults = list(_form(decoded, film))
    beyond = {}
    for number, (own, wanted) in enumerate(zip(decoded.prints, film.prints, strict=False)):
        apart = Apart.between(own, wanted)
        most = max(a - b for a, b in zip(apart.values, codec_most(film.size), strict=True))
        over = max(apart.beyond(film.bounds[number]), most)
        if over > 0.0:
            beyond[number] = over
    if beyond:
        faults.append(_farthest(beyond, decoded.prints, film))
    return faults, len(decoded.prints)


def _form(decoded: FilmPrints, film: _Delivery) -> Iterator[FilmFault]:
    """Yield that a film has another length, size, rhythm or other colours for players."""
    from sumo3dviz_pt.video.containers import Wanted, container_faults

    if len(decoded.prints) != len(film.prints):
        last = min(len(decoded.prints), len(film.prints)) - film.before
        what = f"has {len(decoded.prints)} pictures of {len(film.prints)}"
        yield FilmFault(film.path, what, last)
    wanted = Wanted(film.codec, film.size, film.rate, film.sound)
    faults = container_faults(film.path, decoded.words, wanted)
    for what, picture in faults:
        yield FilmFault(film.path, what, None if picture is None else picture - film.before)


def _farthest(beyond: Mapping[int, float], prints: Sequence[Print], film: _Delivery) -> FilmFault:
    """Return which pictures are not those that were developed; named by the one farthest away."""
    from sumo3dviz_pt.video.prints import Apart

    number = max(beyond, key=lambda each: beyond[each])
    apart = [Apart.between(prints[number], each) for each in film.prints]
    nearest = min(range(len(apart)), key=lambda each: apart[each].pixel)
    alike = nearest != number and not apart[nearest].beyond(film.bounds[nearest])
    first = min(beyond) - film.before
    what = (
        f"its picture is not the one that was developed, by {beyond[number]:.1f} codes more than"
        " the codec does"
        + (f"; it is that of frame {nearest - film.before}" if alike else "")
        + (f"; of {len(beyond)} such pictures the first is {first}" if len(beyond) > 1 else "")
    )
    return FilmFault(film.path, what, number - film.before)


# What was developed -----------------------------------------------------------------------


def _again(
    film: Path, account: Account, claims: Mapping[Path, _Delivery], frames: Sequence[Path]
) -> tuple[list[FilmFault], int]:
    """Develop frames; return which of them are not the film's, and how many were developed."""
    from sumo3dviz_pt.video.encoder import planes_of
    from sumo3dviz_pt.video.prints import Apart, print_of

    wrong: dict[Path, list[int]] = {}
    count = 0
    try:
        for path, number, picture in _developed(film, account, frames):
            own = claims[path]
            index = number + own.before
            planes = planes_of(picture, index=index, kind=own.codec, size=own.size)
            apart = Apart.between(print_of(planes, bits=own.codec.bits), own.prints[index])
            if any(a > b for a, b in zip(apart.values, AGAIN_MOST, strict=True)):
                wrong.setdefault(path, []).append(number)
            count += 1
    except (InputError, IndexError) as error:
        return [FilmFault(film, f"its frames cannot be developed again ({error})")], count
    what = "its frame, developed again, is not the picture that the account tells"
    return [FilmFault(path, what, numbers[0]) for path, numbers in wrong.items()], count


def _developed(
    film: Path, account: Account, files: Sequence[Path]
) -> Iterator[tuple[Path, int, Image]]:
    """Yield pictures of a film, and of its twin, with the frames' numbers."""
    pictures = developed(
        files,
        Look(
            account["tone"],
            float(account["exposure"]),
            account["glare"],
            account.get("response", "none"),
        ),
        key=account["key"],
    )
    facts = read_facts(files[0].parent) if files and account.get("overlays") else None
    for file, picture in zip(files, pictures, strict=True):
        number = int(file.stem)
        if not account.get("overlays"):
            yield film, number, picture
            continue
        yield plain_twin(film), number, picture
        if facts is not None:
            yield film, number, _overlaid(picture, facts, file)


def _overlaid(picture: Image, facts: FilmFacts, file: Path) -> Image:
    """Return a frame's picture with its overlays."""
    from sumo3dviz_pt.overlays.drawing import drawn, hides

    return drawn(picture, facts, int(file.stem), shown_in(file) if hides(facts) else None)


def whole_frames(film: Path, account: Account, spare: Collection[Path] = ()) -> list[Path]:
    """Return the frames that can be developed as they were: those that help them are there, too.

    Args:
        film: The film.
        account: Its account.
        spare: Frames that count as gone.
    """
    folder, count = frames_folder(film), len(account["frames"])
    files = [frame_file(folder, number) for number in range(count)]
    there = [file.is_file() and file not in spare for file in files]
    around = (helping(account, number) for number in range(count))
    return [file for file, some in zip(files, around, strict=True) if all(there[n] for n in some)]


def helping(account: Account, number: int) -> range:
    """Return the numbers of the frames that a frame is developed with, its own among them."""
    window = int(account.get("preset", {}).get("accumulate", 0))
    return range(max(number - window, 0), min(number + window + 1, len(account["frames"])))
