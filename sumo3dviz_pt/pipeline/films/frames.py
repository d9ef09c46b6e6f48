"""Reads a folder of stored frames: to which film they belong, which fit, which are missing.

Beside the frames lies `film.json`, the account of the film that they belong to. Frames of other
films, and frames beyond its end, never get into it. A film can also be numbered pictures:
`drive_{frame}.png`, or `drive_%06d.png` as in ffmpeg.
"""

from __future__ import annotations

import json
import logging
import re
import zlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal

from sumo3dviz_pt.errors import ConfigError, InputError, RenderError, cut
from sumo3dviz_pt.files.atomic import write_atomically
from sumo3dviz_pt.model.geometry import Image
from sumo3dviz_pt.model.numbers import Ratio, counted, ratio_of
from sumo3dviz_pt.pipeline.provenance import FILM_RECORD, differences

_PLACE = re.compile(r"\{frame\}|%(?:0(\d))?d")
_DIGITS = 6
SUFFIX = ".png"

FINISHED_AT_ONCE = 2
"""Frames that are finished while the next one is read and helped."""


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
    in_digits = all(file.stem.isdigit() for file in files)
    numbers = [int(file.stem) for file in files] if in_digits else range(len(files))
    return [numbered(path, number) for number in numbers]


def write_pictures(
    places: Sequence[Path],
    files: Sequence[Path],
    pictures: Iterable[Image],
    *,
    look: Mapping[str, Any] = MappingProxyType({}),
) -> None:
    """Write pictures of stored frames, each at once or not at all.

    Args:
        places: Where they go.
        files: EXR frames.
        pictures: What they develop to, (h, w, 3) in [0, 1].
        look: How they were developed: exposure, tone, response; default as the frames say.
    """
    from sumo3dviz_pt.image.exr import PROVENANCE, read_attributes
    from sumo3dviz_pt.image.png import write_png

    for place, file, picture in zip(places, files, pictures, strict=True):
        text = read_attributes(file).get(PROVENANCE, "{}")
        account = parsed(text.encode(), file)
        if any(account.get(key) != value for key, value in look.items()):
            text = json.dumps(_looking(account, look), sort_keys=True)
        pixels = (picture * 255 + 0.5).astype("uint8")
        write_png(place, pixels, text={"provenance": text}, level=6)


def _looking(account: Account, look: Mapping[str, Any]) -> dict[str, Any]:
    """An account of a picture that was developed otherwise than its frame says."""
    changed = {**account, **look}
    chosen = {key: look[key] for key in ("tone", "response") if key in look}
    if chosen and isinstance(scene := account.get("scene"), Mapping):
        output = {**scene.get("output", {}), **chosen}
        changed["scene"] = {**scene, "output": output}
    return changed


log = logging.getLogger(__name__)

NOTE = "film.json"
"""The film's account, beside its frames."""

_MOST_FRAMES = 10_000_000
"""Of a film; more are damage."""

SAME_TIME = 1e-9
"""Times of frames that differ by less count as equal [s]."""

Account = Mapping[str, Any]
State = Literal["absent", "damaged", "other", "elsewhere", "done"]


@dataclass(frozen=True, slots=True)
class StoredFilm:
    """The frames of one film.

    Attributes:
        account: What they are made from.
        files: In order, at least one.
    """

    account: Account
    files: tuple[Path, ...]

    @property
    def fps(self) -> Ratio | None:
        """Frames per second; None where nothing is known of it."""
        rate: Ratio | None = self.account.get("shot", {}).get("frame_rate")
        return rate


def frames_folder(path: Path) -> Path:
    """Return where a film's frames go."""
    return film_name(path).with_suffix(".frames")


def masters_folder(path: Path) -> Path:
    """Return where a film's finished frames go, where they are wanted."""
    return film_name(path).with_suffix(".final")


def account_file(path: Path) -> Path:
    """Return where a film's account goes."""
    return film_name(path).with_suffix(".json")


def frame_file(folder: Path, number: int) -> Path:
    """Return a frame's file."""
    return folder / f"{number:06d}.exr"


def frame_numbers(folder: Path) -> list[int]:
    """Return the numbers of the frames in a folder, which need not exist."""
    return sorted(int(path.stem) for path in folder.glob("*.exr") if path.stem.isdecimal())


def read_account(path: Path) -> Account:
    """Return what a frame says of itself; nothing if it says nothing.

    Raises:
        InputError: If it, or what it says, is damaged.
    """
    from sumo3dviz_pt.image.exr import PROVENANCE, read_attributes

    return parsed(read_attributes(path).get(PROVENANCE, "{}").encode(), path)


def account_in(path: Path) -> Account:
    """Return what a picture, a film or a folder of frames says that it was made from.

    Args:
        path: A .png, an .exr, a film's .json, a film beside which that lies, or a folder.

    Raises:
        InputError: If it is missing or damaged, or says nothing.
    """
    from sumo3dviz_pt.image.png import read_text

    if not path.exists():
        raise InputError("there is no such file or folder", file=path)
    if path.is_dir():
        account = film_of(path)
    elif path.suffix.lower() == ".exr":
        account = read_account(path)
    elif path.suffix.lower() == ".png":
        account = parsed(read_text(path).get("provenance", "{}").encode(), path)
    else:
        beside = path.with_suffix(".json")
        account = parsed(beside.read_bytes() if beside.is_file() else b"{}", beside)
    if not account or "scene" not in account:
        raise InputError("does not say what it was made from", file=path)
    return account


def parsed(text: bytes, path: Path) -> Account:
    """Return an account from its JSON."""
    try:
        return _checked(json.loads(text), path)
    except (RecursionError, TypeError, ValueError) as error:
        raise InputError(
            f"its account is damaged ({cut(str(error))}); render it again with --resume", file=path
        ) from error


def _checked(content: Any, path: Path) -> Account:
    """Return an account, and refuse one whose parts are of other kinds.

    Raises:
        ValueError: Says which.
        ConfigError: If a newer version wrote it.
    """
    if not isinstance(content, dict):
        return {}
    account = FILM_RECORD.current(content, path)
    for keys, (kind, what) in _SHAPE.items():
        value: Any = account
        for key in keys:
            value = value.get(key, _ABSENT) if isinstance(value, dict) else _ABSENT
        if value is not _ABSENT and not kind(value):
            raise ValueError(f"{'.'.join(keys)} is no {what}: {cut(repr(value), most=20)}")
    if (rate := StoredFilm(account, ()).fps) is not None:
        ratio_of(rate)
    return account


def _is_count(value: Any) -> bool:
    """Return whether a value is how many frames a film can have."""
    return value is None or (type(value) is int and 0 < value <= _MOST_FRAMES)


def _is_number(value: Any) -> bool:
    """Return whether a value is a finite number."""
    return type(value) in (int, float) and abs(value) < 1e300


_ABSENT = object()
_MAPPING = (lambda value: isinstance(value, dict), "mapping")
_NUMBER = (_is_number, "number")
_WHOLE = (lambda value: type(value) is int, "whole number")
_WORD = (lambda value: value is None or isinstance(value, str), "word")
_SHAPE: Mapping[tuple[str, ...], tuple[Callable[[Any], bool], str]] = {
    **dict.fromkeys([("scene",), ("scene", "output"), ("shot",), ("preset",)], _MAPPING),
    ("versions",): _MAPPING,
    **dict.fromkeys([("exposure",), ("glare",), ("time",), ("shot", "from")], _NUMBER),
    **dict.fromkeys([("seed",), ("spp",), ("frame",)], _WHOLE),
    **dict.fromkeys([("key",), ("tone",), ("response",), ("camera",)], _WORD),
    ("shot", "frames"): (_is_count, "count of frames"),
}
"""What values of an account have to be, where they are there, and that in words."""


@contextmanager
def intact(path: Path) -> Iterator[None]:
    """Say in one sentence that a stored frame, or what it says of itself, is damaged."""
    try:
        yield
    except (ArithmeticError, AttributeError, LookupError, MemoryError, RecursionError) as error:
        raise _damaged(path, error) from error
    except (TypeError, ValueError, zlib.error, RenderError) as error:
        raise _damaged(path, error) from error


def _damaged(path: Path, error: Exception) -> InputError:
    """Return what is said of a damaged frame."""
    why = cut(f"{type(error).__name__}: {error}")
    return InputError(f"is damaged ({why}); render it again with --resume", file=path)


def write_json(path: Path, content: Account, *, indent: int | None = None) -> None:
    """Write a JSON file that is whole or not there.

    Args:
        path: Where to.
        content: What JSON can hold.
        indent: Spaces of each level; None writes a single line.
    """
    write_atomically(path, json.dumps(content, indent=indent))


def film_of(folder: Path) -> Account | None:
    """Return the film of a folder's frames, by its note or by the first frame; or None."""
    try:
        return _checked(json.loads((folder / NOTE).read_bytes()), folder / NOTE)
    except (OSError, RecursionError, TypeError, ValueError):
        first = next(iter(sorted(folder.glob("*.exr"))), None)
    try:
        return None if first is None else read_account(first)
    except InputError:
        return {}


def traced_on(account: Account) -> str:
    """Return what traced a frame, in words: the variant, and of a GPU its name and driver."""
    device = account.get("device")
    return f"{account.get('variant')}{f' on {device}' if device else ''}"


def state_of(path: Path, *, shared: Account, time: float) -> State:
    """Return whether a frame is there, whole, and just what would be rendered.

    Args:
        path: Its file.
        shared: The account that the film's frames share; `elsewhere` is a frame of that film which
            another device traced.
        time: SUMO's [s].
    """
    from sumo3dviz_pt.image.exr import read_exr

    if not path.exists():
        return "absent"
    try:
        account = read_account(path)
        away = abs(float(account.get("time", "nan")) - time)
        if account.get("key") != shared["key"] or not away <= SAME_TIME:
            return "other"
        read_exr(path)
    except (InputError, TypeError, ValueError):
        return "damaged"
    return "done" if traced_on(account) == traced_on(shared) else "elsewhere"


def stored_film(folder: Path) -> StoredFilm:
    """Return the frames that make a film, without those beyond its end; says what is missing.

    Args:
        folder: Of frames.

    Raises:
        InputError: If there are none, they belong to more than one film, or one is damaged.
    """
    files, film = sorted(folder.glob("*.exr")), film_of(folder) or {}
    count = film.get("shot", {}).get("frames")
    within = [path for path in files if count is None or _number(path) < count]
    if not within:
        raise InputError("holds no .exr frames", file=folder)
    if len(within) < len(files):
        beyond = listed(_number(path) for path in files if path not in within)
        log.warning("%s: beyond the film's end, and left out: %s", folder, beyond)
    _check_one_film(folder, film, within)
    missing = sorted(set(range(count or 0)) - {_number(path) for path in within})
    if missing:
        log.warning("%s: missing of %d frames: %s", folder, count, listed(missing))
    return StoredFilm(film, tuple(within))


def _check_one_film(folder: Path, film: Account, files: Sequence[Path]) -> None:
    """Refuse a folder that mixes films."""
    accounts = {path: read_account(path) for path in files}
    strays = [path for path in files if accounts[path].get("key") != film.get("key")]
    if strays:
        which = ", ".join(path.name for path in strays[:3]) + (", ..." if len(strays) > 3 else "")
        raise InputError(
            f"holds {counted(len(strays), 'frame')} of another film ({which}; what differs:"
            f" {why_other(accounts[strays[0]], film)}); render them anew with --resume,"
            " or take them away",
            file=folder,
        )


def why_other(stored: Account, wanted: Account) -> str:
    """Return what tells a stored frame from the one that is wanted, in a few words."""
    if "scene" not in stored or "scene" not in wanted:
        return "an older version made them"
    reasons = differences(stored, wanted, stored=True)
    more = f" and {len(reasons) - 2} more" if len(reasons) > 2 else ""
    return "; ".join(reasons[:2]) + more if reasons else "something that they do not tell"


def listed(numbers: Iterable[int]) -> str:
    """Return numbers in words, such as `3, 7 to 9`."""
    runs = []
    for _, run in groupby(enumerate(sorted(numbers)), key=lambda pair: pair[1] - pair[0]):
        own = [number for _, number in run]
        runs.append(f"{own[0]}" if len(own) == 1 else f"{own[0]} to {own[-1]}")
    return ", ".join(runs)


def _number(path: Path) -> int:
    """Return a frame's number; -1 for another name, which is never beyond an end."""
    return int(path.stem) if path.stem.isdecimal() else -1
