"""Puts a recording into a film; its pictures are copied as they are.

Two channels become AAC, in WebM Opus. The four of first-order ambisonics become Opus of channel
mapping family 2, which says itself that it is AmbiX, and which browsers and most players do not
play; in MOV they are PCM of 24 bits, of which nothing says so. A GIF has no sound.

References:
    RFC 8486: ambisonics in an Ogg Opus container, channel mapping family 2.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

from sumo3dviz_pt.files.atomic import put_in_place
from sumo3dviz_pt.video.ffmpeg import Ffmpeg

RATE = 48_000
"""Samples in a second [Hz]."""

SILENT = frozenset({".gif"})
"""Endings of films that have no sound."""

_AAC, _OPUS = ["aac", "-b:a", "256k"], ["libopus", "-b:a", "256k"]
_AMBIX = ["libopus", "-mapping_family", "2", "-b:a", "512k"]
_STEREO = {".webm": _OPUS}
_AMBISONICS = {".mov": ["pcm_s24le"]}


@dataclass(frozen=True, slots=True)
class Soundtrack:
    """A recording, and where in a film it lies.

    Attributes:
        file: WAV.
        ambisonics: Whether it is first-order ambisonics, AmbiX, rather than two channels.
        before: Pictures of the film before it begins.
        pictures: Of the whole film.
    """

    file: Path
    ambisonics: bool
    before: int
    pictures: int


def add_sound(path: Path, track: Soundtrack, *, rate: Fraction) -> None:
    """Put a recording into a film.

    Args:
        path: The film; it is replaced when the new one is whole.
        track: The recording.
        rate: Pictures in a second.

    Raises:
        RenderError: If ffmpeg fails.
    """
    ending = path.suffix.lower()
    count, late = (round(each * RATE / rate) for each in (track.pictures, track.before))
    ways = [f"adelay={late}S:all=1"] if late else []
    ways += [f"apad=whole_len={count}", f"atrim=end_sample={count}"]
    layout = ["-channel_layout:a", "ambisonic 1"] if track.ambisonics else []
    codec = _AMBISONICS.get(ending, _AMBIX) if track.ambisonics else _STEREO.get(ending, _AAC)
    part = path.with_name(f"{path.stem}.heard{path.suffix}")
    flags = ["-movflags", "+faststart"] if ending in (".mp4", ".mov") else ["-fflags", "+bitexact"]
    try:
        arguments = ["-y", "-i", str(path), *layout, "-i", str(track.file)]
        arguments += ["-map", "0:v:0", "-map", "1:a:0", "-c:v", "copy"]
        arguments += ["-c:a", *codec, "-flags:a", "+bitexact", "-af", ",".join(ways)]
        with Ffmpeg([*arguments, *flags, str(part)]):
            pass
        put_in_place(part, path)
    finally:
        part.unlink(missing_ok=True)
