"""Says whether a film's container shows its pictures as they are: when, how large, in what colours.

The same pictures are another film where a player is told another rhythm, another matrix of colours
or another crop. What ffmpeg decodes by is held against what every film of ours has; and since it
tells only what it goes by itself, the boxes of MP4 and MOV files, and the colours that Matroska
files tell, are read, too.

References:
    ISO/IEC 14496-12: 8.2.2 (`mvhd`), 8.3.2 (`tkhd`), 8.6.1.2 (`stts`), 8.6.6 (`elst`),
        12.1.4 (`pasp`, `clap`), 12.1.5 (`colr`).
    RFC 9559, 5.1.4.1.28.24 to 5.1.4.1.28.37: `Colour` and its elements in Matroska.
    ITU-T H.273, tables 2 to 4: 1 is BT.709.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

from sumo3dviz_pt.video.codecs import Codec
from sumo3dviz_pt.video.spherical import ENDINGS, ENTRIES, ENTRY_HEADER, inner_boxes

_TIME = re.compile(r"\bn:\s*\d+ pts:\s*-?\w+\s+pts_time:(-?[\d.]+)")
_SIZE = re.compile(r"Video: .*?, (\d+)x(\d+)")
_TAGS = re.compile(r"color_range:(\S+) color_space:(\S+) color_primaries:(\S+) color_trc:(\S+)")
_ASPECT, _SIDE = re.compile(r"\bsar:(\d+)/(\d+)"), re.compile(r"\bs:(\d+)x(\d+)")
_STREAM = re.compile(r"^  Stream #0:\d+.*?: (\w+): ", re.MULTILINE)
_DURATION = re.compile(r"^  Duration: (\d+):(\d+):(\d+\.\d+), start: (-?[\d.]+)", re.MULTILINE)
_TURNED = re.compile(r"displaymatrix|Display Matrix|Frame Cropping", re.IGNORECASE)

_BT709 = "tv bt709 bt709 bt709"
_SHOWN = "range, matrix, primaries, transfer"

_TICK = {".mkv": 6e-4, ".webm": 6e-4, ".gif": 6e-3}
"""How far times may be from those wanted, because containers round them [s]."""

_LEAST_TICK, _ROUNDED = 2e-5, 0.011
"""The same of all other containers; and of a film's length, as ffmpeg tells it [s]."""

_PACKET = 0.022
"""How long a packet of sound is, at most [s]."""

_KNOWN_BOXES = {
    b"moov": frozenset({b"mvhd", b"trak", b"udta"}),
    b"trak": frozenset({b"tkhd", b"edts", b"mdia"}),
    b"entry": frozenset(
        {b"avcC", b"hvcC", b"colr", b"btrt", b"fiel", b"pasp", b"st3d", b"sv3d", b"glbl", b"SmDm"}
    ),
}
"""Boxes that films of ours may have; others may crop, turn or cut what is shown."""

_INTO = {b"moov": 8, b"trak": 8, b"edts": 8, b"mdia": 8, b"minf": 8, b"stbl": 8, b"stsd": 16}
_UPRIGHT = struct.pack(">9i", 1 << 16, 0, 0, 0, 1 << 16, 0, 0, 0, 1 << 30)

_COLOURS = {0xB1: "matrix", 0xB9: "range", 0xBA: "transfer", 0xBB: "primaries"}
_IN_MATROSKA = re.compile(rb"\x55([\xb1\xb9\xba\xbb])\x81(.)", re.DOTALL)
_CROPS = re.compile(rb"\x54[\xaa\xbb\xcc\xdd][\x81\x82].", re.DOTALL)
_CLUSTER = b"\x1f\x43\xb6\x75"


@dataclass(frozen=True, slots=True)
class FilmWords:
    """What a film says of itself, as ffmpeg reads it.

    Attributes:
        times: At which its pictures are shown [s].
        size: Width, height of what is stored [px].
        tags: Range, matrix, primaries and transfer of all of its pictures, each once.
        sides: Width and height of all of its pictures, each once [px].
        aspects: Of their pixels, each once; `0/1` and `1/1` are squares.
        streams: What it holds, such as `Video`.
        duration: Of the film [s]; below 0 where it does not tell.
        start: When it begins [s].
        turned: Whether it says that it is to be turned or cropped.
    """

    times: tuple[float, ...]
    size: tuple[int, int]
    tags: frozenset[str]
    sides: frozenset[tuple[int, int]]
    aspects: frozenset[str]
    streams: tuple[str, ...]
    duration: float
    start: float
    turned: bool


def words_in(log: str) -> FilmWords | None:
    """Return what ffmpeg's log, with `showinfo`, tells of a film; None where it tells nothing."""
    size = _SIZE.search(log)
    if size is None:
        return None
    source = log.partition("Stream mapping:")[0]
    long = _DURATION.search(source)
    hours, minutes, seconds, start = map(float, long.groups()) if long else (0.0, 0.0, -1.0, 0.0)
    return FilmWords(
        tuple(map(float, _TIME.findall(log))),
        (int(size[1]), int(size[2])),
        frozenset(" ".join(each) for each in _TAGS.findall(log)),
        frozenset((int(width), int(height)) for width, height in _SIDE.findall(log)),
        frozenset("/".join(each) for each in _ASPECT.findall(log)),
        tuple(_STREAM.findall(source)),
        3600 * hours + 60 * minutes + seconds,
        start,
        _TURNED.search(source) is not None,
    )


@dataclass(frozen=True, slots=True)
class Wanted:
    """What a film of ours tells players.

    Attributes:
        codec: Its pictures are stored as this one does.
        size: Width and height [px].
        rate: Frames per second.
        sound: Whether it has sound.
    """

    codec: Codec
    size: tuple[int, int]
    rate: Fraction
    sound: bool = False

    @property
    def streams(self) -> tuple[str, ...]:
        """What it holds."""
        return ("Video", "Audio") if self.sound else ("Video",)


def container_faults(
    path: Path, words: FilmWords, wanted: Wanted
) -> Iterator[tuple[str, int | None]]:
    """Yield what a film tells players that no film of ours does, with a picture's number or None.

    Args:
        path: The film.
        words: What it says of itself.
        wanted: What it should say.
    """
    codec, size = wanted.codec, wanted.size
    if words.size != size or words.sides - {size}:
        other = next(iter(words.sides - {size}), words.size)
        yield f"is {'x'.join(map(str, other))} pixels large, not {'x'.join(map(str, size))}", None
    yield from _rhythm(path, words, wanted)
    strange = words.tags - ({_BT709} if not codec.palette else words.tags)
    if strange:
        yield f"tells players other colours ({_SHOWN}): {min(strange)}, not {_BT709}", None
    if words.aspects - {"0/1", "1/1"} or words.turned:
        yield "tells players to stretch, turn or crop its pictures", None
    if words.streams != wanted.streams:
        also = " and one of sound" if wanted.sound else ""
        yield f"holds {', '.join(words.streams)}, not one stream of pictures{also}", None
    if path.suffix.lower() in ENDINGS:
        yield from ((what, None) for what in _boxes(path, wanted, len(words.times)))
    elif not codec.palette:
        yield from ((what, None) for what in _matroska(path))


def _rhythm(path: Path, words: FilmWords, wanted: Wanted) -> Iterator[tuple[str, int | None]]:
    """Yield that pictures are shown at other times, or for longer."""
    rate, ending = wanted.rate, path.suffix.lower()
    tick = _TICK.get(ending, _LEAST_TICK)
    for number, time in enumerate(words.times):
        if abs(time - float(number / rate)) > tick:
            yield f"is shown at {time:.12g} s, not at {float(number / rate):g} s", number
            break
    length = float(len(words.times) / rate)
    longer = words.duration - length
    # Matroska files end with the last packet of sound, which is not cut.
    packet = _PACKET if wanted.sound and ending in _TICK else 0.0
    if not -tick - _ROUNDED <= longer <= tick + _ROUNDED + packet:
        yield f"lasts {words.duration:g} s, not {length:g} s", None


# MP4 and MOV --------------------------------------------------------------------------------


def _boxes(path: Path, wanted: Wanted, count: int) -> Iterator[str]:
    """Yield what is strange in the boxes of a film."""
    content = path.read_bytes()
    if wanted.sound:
        content = b"".join(_without_sound(content))
    boxes: dict[bytes, bytes] = {}
    strange = set(_strange(content, boxes))
    if strange:
        words = ", ".join(sorted(each.decode("latin-1") for each in strange))
        yield f"holds boxes that no film of ours has ({words})"
    try:
        yield from _numbers(boxes, wanted.size, wanted.rate, count)
    except (KeyError, IndexError, ZeroDivisionError, struct.error):
        yield "does not say in full how it is to be shown"


def _without_sound(content: bytes) -> Iterator[bytes]:
    """Yield the boxes of a film, but for one track of sound."""
    heard = False
    for name, start, length in inner_boxes(content):
        one = content[start : start + length]
        if name == b"moov":
            inside = b"".join(_without_sound(one[8:]))
            yield struct.pack(">I4s", 8 + len(inside), name) + inside
        elif name == b"trak" and b"hdlr" in one and _handler(one) == b"soun" and not heard:
            heard = True
        else:
            yield one


def _handler(track: bytes) -> bytes:
    """Return what a track is of: `vide` or `soun`."""
    at = track.index(b"hdlr") + 12
    return track[at : at + 4]


def _strange(content: bytes, boxes: dict[bytes, bytes]) -> Iterator[bytes]:
    """Yield boxes that a film should not have, or not twice; collect the others by name."""
    for name, one in _all_boxes(content, b""):
        if name in boxes or name in (b"moof", b"clap", b"mvex"):
            yield name
        boxes[name] = one
    for name, start, length in inner_boxes(content):
        if name == b"moov":
            yield from _unknown(content[start : start + length])


def _unknown(box: bytes) -> Iterator[bytes]:
    """Yield boxes of an unknown name within a box, and within those in it."""
    name = bytes(box[4:8])
    known = _KNOWN_BOXES.get(b"entry" if name in ENTRIES else name)
    header = ENTRY_HEADER if name in ENTRIES else _INTO.get(name)
    if header is None:
        return
    for own, start, length in inner_boxes(box[header:]):
        if known is not None and own not in known:
            yield own
        yield from _unknown(box[header + start : header + start + length])


def _all_boxes(content: bytes, outside: bytes) -> Iterator[tuple[bytes, bytes]]:
    """Yield boxes that tell how a film is shown, and what is in them."""
    for name, start, length in inner_boxes(content):
        one = content[start : start + length]
        if name in (b"hdlr", b"free", b"wide", b"mdat", b"udta", b"ftyp", b"dinf"):
            continue
        inside = ENTRY_HEADER if name in ENTRIES else _INTO.get(name)
        if inside is not None and (name != b"stsd" or outside == b"stbl"):
            yield from _all_boxes(one[inside:], name)
        yield name, one


def _numbers(
    boxes: dict[bytes, bytes], size: tuple[int, int], rate: Fraction, count: int
) -> Iterator[str]:
    """Yield numbers of the boxes that are others than they should be."""
    scale, length, speed = _header(boxes[b"mvhd"], ">IIi", 12)
    if speed != 1 << 16 or boxes[b"mvhd"][44:80] != _UPRIGHT:
        yield "tells players another speed, or to turn its pictures"
    track = boxes[b"tkhd"]
    sides = struct.unpack(">II", track[-8:])
    if not track[11] & 1 or track[-44:-8] != _UPRIGHT or sides != tuple(n << 16 for n in size):
        yield "tells players to hide, turn, crop or stretch its pictures"
    per_second, _ = _header(boxes[b"mdhd"], ">II", 12)
    _, entries, *steps = struct.unpack(
        f">{2 + (len(boxes[b'stts']) - 16) // 4}I", boxes[b"stts"][8:]
    )
    if entries != 1 or steps[0] != count or Fraction(per_second, steps[1]) != rate:
        yield "tells players times that are not those of its frame rate"
    if abs(Fraction(length, scale) - count / rate) > Fraction(2, scale):
        yield f"tells players that it lasts {length / scale:g} s, not {float(count / rate):g} s"
    yield from _edits(boxes, length)
    kind, *colours = _colours(boxes[b"colr"])
    if kind not in (b"nclx", b"nclc") or colours != [1, 1, 1, 0]:
        yield "tells players other colours in its box `colr`"
    if b"pasp" in boxes and len(set(struct.unpack(">II", boxes[b"pasp"][8:16]))) > 1:
        yield "tells players that its pixels are no squares"


def _edits(boxes: dict[bytes, bytes], length: int) -> Iterator[str]:
    """Yield that an edit list shows anything but the whole film, once, from its first picture."""
    edits = boxes.get(b"elst")
    if edits is None:
        return
    (entries,) = struct.unpack(">I", edits[12:16])
    form = ">QqI" if edits[8] else ">IiI"
    whole, start, speed = struct.unpack(form, edits[16 : 16 + struct.calcsize(form)])
    table = boxes.get(b"ctts", b"")
    first = struct.unpack(">i", table[20:24])[0] if table else 0
    if (entries, speed, start) != (1, 1 << 16, first) or abs(whole - length) > 1:
        yield "tells players by an edit list not to show it from its beginning to its end"


def _header(box: bytes, form: str, at: int) -> tuple[int, ...]:
    """Return numbers of a header that stand behind two times, which take 4 or 8 bytes each."""
    if box[8]:
        raise struct.error("films of ours have no headers of version 1")
    return struct.unpack(form, box[at + 8 : at + 8 + struct.calcsize(form)])


def _colours(box: bytes) -> tuple[bytes, int, int, int, int]:
    """Return the kind of a box of colours, and primaries, transfer, matrix and full range."""
    full = box[18] >> 7 if len(box) > 18 else 0
    return (box[8:12], *struct.unpack(">HHH", box[12:18]), full)


# Matroska -----------------------------------------------------------------------------------


def _matroska(path: Path) -> Iterator[str]:
    """Yield colours and crops that a Matroska or WebM file tells beside its pictures."""
    head = path.read_bytes().partition(_CLUSTER)[0]
    other = {_COLOURS[key[0]] for key, value in _IN_MATROSKA.findall(head) if value != b"\x01"}
    if other:
        yield f"tells players other colours ({', '.join(sorted(other))})"
    if _CROPS.search(head):
        yield "tells players to crop its pictures"
