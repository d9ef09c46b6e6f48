"""What an account proves: digests of a film's files, prints of its pictures, and its own digest.

Every EXR frame and every layer has its SHA-256 in the account. Every picture of a film has a print,
as it was developed, and beside it how far the film's own picture is from it: what the codec did.
The account's digest is that of all else in it, so that nothing can change in it unseen.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sumo3dviz_pt.errors import RenderError
from sumo3dviz_pt.pipeline.accounts.provenance import file_hash
from sumo3dviz_pt.pipeline.films.frames import NOTE, frame_numbers, frames_folder, masters_folder
from sumo3dviz_pt.pipeline.films.sequences import is_sequence, pictures_of
from sumo3dviz_pt.pipeline.layers import places
from sumo3dviz_pt.pipeline.overlays.files import FACTS, captions_file
from sumo3dviz_pt.pipeline.sound import sound_folder

if TYPE_CHECKING:
    from sumo3dviz_pt.video.prints import Print

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


def files_beside(path: Path, files: Sequence[Path]) -> dict[str, str]:
    """Return the digests of what lies beside a film, but for its frames: layers, sound, captions.

    Args:
        path: The film, or its numbered pictures.
        files: Its frames; they need not be there any more.
    """
    layers, final = places.beside(frames_folder(path)), masters_folder(path)
    numbers = {int(file.stem) for file in files}
    found = [file for number in sorted(numbers) for file in places.files_of(layers, number)]
    found += [layers / name for name in places.WHOLE] + [
        frames_folder(path) / name for name in (FACTS, NOTE)
    ]
    found += [final / f"{n:06d}.exr" for n in frame_numbers(final) if n in numbers]
    found += [captions_file(path), *sorted(sound_folder(path).glob("*"))]
    if is_sequence(path):
        found += pictures_of(path, files)
    there = [file for file in found if file.is_file()]
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

    found = film_prints(path, codec=codec_named(codec, path=path), size=size).prints
    if len(found) != len(prints):
        raise RenderError(f"{path} has {len(found)} pictures of {len(prints)}; encode it again")
    apart = [Apart.between(own, wanted) for own, wanted in zip(found, prints, strict=True)]
    return {
        "sha256": file_hash(path),
        "codec": codec,
        "size": list(size),
        "pictures": [
            {"print": as_text(wanted), "codec_error": list(by.values)}
            for wanted, by in zip(prints, apart, strict=True)
        ],
    }
