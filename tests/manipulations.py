"""What can be done to films and to the folder of a study after it was made, one thing at a time.

Films are changed with all digests of theirs written anew, so that only their pictures and their
containers tell it. Most of what is done to folders was found by somebody who knew the manual alone;
there, too, digests are written anew where that is said.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from builders import write_scenario

from sumo3dviz_pt.pipeline.films.encoding import sealed
from sumo3dviz_pt.pipeline.provenance import file_hash
from sumo3dviz_pt.studies.certificate.delivered import film_faults
from sumo3dviz_pt.studies.tools.datasets import read_digests, write_checksums
from sumo3dviz_pt.video.ffmpeg import ffmpeg_path

OUTSIDER = "outsider: "
"""Stands before what was found by somebody who knew the manual alone."""

# Films --------------------------------------------------------------------------------------


@dataclass(frozen=True)
class FilmChange:
    """What is done to a delivered film.

    Attributes:
        said: What `verify` says of it, a pattern.
        after: ffmpeg's arguments for the film that takes its place.
        before: The same before its input.
        more: Further inputs; `OTHER` stands for the other film of the pair.
    """

    said: str
    after: Sequence[str]
    before: Sequence[str] = ()
    more: Sequence[str] = ()


OTHER = "OTHER"
_AGAIN = ("-c:v", "libx264", "-crf", "4", "-preset", "slow", "-pix_fmt", "yuv420p")
_COPY, _DEVELOPED = ("-c", "copy"), "not the one that was developed"
_CHEQUERS = "lum(X\\,Y)+3*(1-2*mod(X+Y\\,2)):cb=cb(X\\,Y):cr=cr(X\\,Y)"
_COLOURED = "lum(X\\,Y):cb=cb(X\\,Y)+4*(1-2*mod(X+Y\\,2)):cr=cr(X\\,Y)"


def _tagged(tags: str) -> tuple[str, ...]:
    """Return arguments that write other tags into a stream."""
    return (*_COPY, "-bsf:v", f"h264_metadata={tags}")


FILMS = {
    "colours a tenth less saturated": FilmChange(
        _DEVELOPED, ("-vf", "eq=saturation=0.9", *_AGAIN)),
    "chequers of 3 codes": FilmChange(_DEVELOPED, ("-vf", f"geq=lum={_CHEQUERS}", *_AGAIN)),
    "chequers of 4 codes, of colour alone": FilmChange(
        _DEVELOPED, ("-vf", f"geq=lum={_COLOURED}", *_AGAIN)),
    "a hundredth faster": FilmChange("is shown at", _COPY, ("-itsscale", "0.99")),
    "a tenth of a picture later": FilmChange(
        "is shown at", (*_COPY, "-bsf:v", r"setts=pts=PTS+51*gt(N\,0):dts=DTS")),
    "the last picture for longer": FilmChange(
        "lasts|frame rate", (*_COPY, "-bsf:v", r"setts=duration=DURATION*(1+9*eq(N\,1))")),
    "matrix of BT.601": FilmChange("other colours", _tagged("matrix_coefficients=6")),
    "primaries of BT.2020": FilmChange("other colours", _tagged("colour_primaries=9")),
    OUTSIDER + "full range, BT.2020 and PQ": FilmChange("other colours", _tagged(
        "video_full_range_flag=1:colour_primaries=9:transfer_characteristics=16")),
    OUTSIDER + "pixels twice as wide": FilmChange(
        "stretch", _tagged("sample_aspect_ratio=2/1")),
    OUTSIDER + "a tone added": FilmChange(
        "holds", ("-map", "0:v", "-map", "1:a", "-c:v", "copy", "-c:a", "aac"),
        more=("-f", "lavfi", "-t", "0.08", "-i", "sine=1000")),
    OUTSIDER + "a second picture track": FilmChange(
        "holds", ("-map", "0:v", "-map", "1:v", *_COPY, "-disposition:v:0", "0",
                  "-disposition:v:1", "default"), more=("-i", OTHER)),
}  # fmt: skip
"""Seeded into the film of a frame or two; its digest is that of the account."""


def judge_film(change: FilmChange, film: Path, other: Path, folder: Path) -> tuple[str, ...]:
    """Return what is said of a film that was changed, and signed anew.

    Args:
        change: What is done to it.
        film: The film, beside its account.
        other: The other one of the pair.
        folder: Where the changed one goes.
    """
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / film.name
    more = [str(other) if each == OTHER else each for each in change.more]
    command = [ffmpeg_path(), "-y", "-loglevel", "error", *change.before, "-i", str(film), *more]
    subprocess.run([*command, *change.after, str(path)], check=True)
    account = json.loads(film.with_suffix(".json").read_bytes())
    account["delivered"][film.name]["sha256"] = file_hash(path)
    found = film_faults(path, account, sha256=file_hash(path), develop=False)
    return tuple(str(each.what) for each in found.faults)


# Folders ------------------------------------------------------------------------------------

STUDY = """scene: scene.yaml
clip: {camera: driver, from: 2, to: 2.6}
common: {quality: draft, output.size: [96, 54], output.fps: 10}
factors:
  light:
    about: the sky, clear or closed
    levels:
      clear: {sky: {preset: sky_blue}}
      grey: {sky: {preset: sky_overcast}}
certificate: {frames: 2}
report: {write: false}
calibration: null
tools: {write: [psychds, jspsych, psychopy, bids]}
about: {title: Two skies, authors: [Ada Example], date: 2026-11-27}
"""
CLEAR, GREY = "materials/clear.mp4", "materials/grey.mp4"


def write_small_study(folder: Path) -> Path:
    """Write a study of two films; return its file."""
    write_scenario(folder, vehicles=2)
    (folder / "study.yaml").write_text(STUDY, encoding="utf-8")
    return folder / "study.yaml"


@dataclass(frozen=True)
class FolderChange:
    """What is done to a study's folder.

    Attributes:
        said: What `verify` says of it, a pattern.
        change: Does it.
        published: Whether the certificate's digest is known from elsewhere; then no other one
            helps.
    """

    said: str
    change: Callable[[Path], Any]
    published: bool = True


def edited(path: Path, change: Callable[[Any], Any]) -> None:
    """Change a file of JSON, and sign it."""
    content = json.loads(path.read_bytes())
    change(content)
    path.write_text(json.dumps(sealed(content)), encoding="utf-8")


def listed_anew(folder: Path) -> None:
    """Write the list of digests anew, of what is there."""
    known = [folder / name for name in read_digests(folder / "checksums.sha256")]
    write_checksums(folder, [path for path in known if path.is_file()])


def signed_anew(folder: Path) -> None:
    """Write all digests anew, of accounts, record and certificate, too."""
    record, certificate = (folder / name for name in ("study.json", "certificate.json"))
    said = json.loads(certificate.read_bytes())
    digests = said["digests"]
    for name, film in json.loads(record.read_bytes())["films"].items():
        account = folder / "materials" / f"{name}.json"
        edited(account, lambda each: None)
        own = {"account": json.loads(account.read_bytes())["digest"],
               "sha256": file_hash(folder / film["file"])}  # fmt: skip
        edited(record, lambda each, name=name, own=own: each["films"][name].update(own))
        digests["accounts"][name], digests["films"][film["file"]] = own.values()
    digests["study.json"] = json.loads(record.read_bytes())["digest"]
    for kind in ("inputs", "others"):
        digests[kind] = {name: file_hash(folder / name) for name in digests[kind]}
    certificate.write_text(json.dumps(sealed(said)), encoding="utf-8")
    listed_anew(folder)


def _text(name: str, found: str, instead: str) -> Callable[[Path], None]:
    """Return what changes a text, and lists it anew."""

    def change(folder: Path) -> None:
        path = next(folder.glob(name))
        text = path.read_text("utf-8")
        after = re.sub(found, instead, text)
        assert after != text, name
        path.write_text(after, encoding="utf-8")
        listed_anew(folder)

    return change


def _swapped(*names: str) -> Callable[[Path], None]:
    """Return what swaps the two films' names in files, and lists them anew."""

    def change(folder: Path) -> None:
        paths = [path for name in names for path in folder.glob(name)]
        assert paths
        for path in paths:
            text = (
                path.read_text("utf-8").replace("clear.mp4", "\0").replace("grey.mp4", "clear.mp4")
            )
            path.write_text(text.replace("\0", "grey.mp4"), encoding="utf-8")
        listed_anew(folder)

    return change


def _gone_from_list(folder: Path) -> None:
    """Replace the page, and leave it out of the list."""
    (folder / "index.html").write_text("<h1>no films</h1>", encoding="utf-8")
    path = folder / "checksums.sha256"
    lines = [line for line in path.read_text().splitlines() if not line.endswith(" index.html")]
    path.write_text("\n".join(lines) + "\n")


def _other_bids_film(folder: Path) -> None:
    """Put one film of the BIDS folder in the place of the other."""
    one, other = sorted(folder.glob("bids/stimuli/*.mp4"))
    shutil.copy(one, other)
    listed_anew(folder)


def _pipe(folder: Path) -> None:
    """Put a named pipe in the place of a frame."""
    path = folder / "materials" / "grey.frames" / "000002.exr"
    path.unlink()
    os.mkfifo(path)


def _levels_swapped(folder: Path) -> None:
    """Swap the levels that films stand for."""

    def swap(said: Any) -> None:
        one, other = said["films"].values()
        one["profiles"], other["profiles"] = other["profiles"], one["profiles"]

    edited(folder / "study.json", swap)
    signed_anew(folder)


def _pairs_gone(folder: Path) -> None:
    """Leave out what was found of pairs."""
    for name in ("study.json", "certificate.json"):
        edited(folder / name, lambda said: said.update(pairs=[]))
    signed_anew(folder)


def _longer(folder: Path) -> None:
    """Say that films last longer."""
    edited(
        folder / "study.json",
        lambda said: [each.update(duration=10, frames=50) for each in said["films"].values()],
    )
    signed_anew(folder)


def _brighter(folder: Path) -> None:
    """Say that all films were developed with another exposure."""
    for name in ("clear", "grey"):
        edited(folder / "materials" / f"{name}.json", lambda said: said.update(exposure=9.0))
    signed_anew(folder)


def _all_tested(folder: Path) -> None:
    """Say that all was tested, and that limits were others."""

    def change(said: Any) -> None:
        said["limits"]["codes"] = 200
        for pair in said["pairs"]:
            pair.update(not_tested=[], light=0.0, codes=0.0)

    edited(folder / "certificate.json", change)
    signed_anew(folder)


def _other_layers(folder: Path) -> None:
    """Put something else into a layer: half of it is farther away."""
    import OpenEXR

    for path in sorted(folder.glob("materials/grey.layers/frames/*.exr")):
        with OpenEXR.File(str(path)) as file:
            header = dict(file.parts[0].header)
            channels = {name: each.pixels for name, each in file.channels().items()}
        depth = next(name for name in channels if name == "Z" or "depth" in name.lower())
        channels[depth][: len(channels[depth]) // 2] += 1.0
        OpenEXR.File(header, channels).write(str(path))
    account = folder / "materials" / "grey.json"
    edited(
        account,
        lambda said: said.update(
            files={name: file_hash(folder / "materials" / name) for name in said["files"]}
        ),
    )
    signed_anew(folder)


FOLDERS = {
    "films swapped on the page": FolderChange("index.html", _swapped("index.html")),
    "films swapped in all playlists": FolderChange(
        "playlist", _swapped("psychopy/*.csv", "data/*.csv")),
    "the page replaced, and not listed": FolderChange("index.html", _gone_from_list),
    "another film in the BIDS folder": FolderChange("bids/", _other_bids_film),
    "the certificate's page reworded": FolderChange(
        r"certificate\.html", _text("certificate.html", "[Nn]ot judged", "proven")),
    "numbers of a table edited": FolderChange(
        "data/|conditions", _text("data/*stimuli_data.csv", "grey", "gray")),
    "a film more beside the others": FolderChange(
        "is no file of this study",
        lambda folder: shutil.copy(folder / CLEAR, folder / "materials" / "blue.mp4")),
    "captions beside a film": FolderChange(
        "is no file of this study",
        lambda folder: (folder / "materials" / "grey.vtt").write_text("WEBVTT\n\nDANGER\n")),
    "a link that leads nowhere beside a film": FolderChange(
        "is no file of this study",
        lambda folder: (folder / "materials" / "loop").symlink_to(folder / "materials" / "loop")),
    "a pipe in the place of a frame": FolderChange("no file that can be read", _pipe),
    "the account beside frames edited": FolderChange(
        r"film\.json", _text("materials/grey.frames/film.json", '"seed": ', '"seed": 1')),
    "levels of two films swapped, all signed anew": FolderChange(
        "other levels than inputs", _levels_swapped, published=False),
    "no pairs any more, all signed anew": FolderChange(
        "names 0 pairs", _pairs_gone, published=False),
    "films said to be longer, all signed anew": FolderChange(
        "another length", _longer, published=False),
    "another exposure in all accounts, all signed anew": FolderChange(
        "developed again, is not the picture", _brighter, published=False),
    "more said to be tested, all signed anew": FolderChange(
        "other limits|otherwise than its frames", _all_tested, published=False),
    "layers written anew, all signed anew": FolderChange(
        "cannot be compared again|shape or colour differs", _other_layers, published=False),
}  # fmt: skip
"""Done to the folder of a small study; all by the outsider, the last after what they advised."""


def is_said(said: str, faults: Sequence[str]) -> bool:
    """Return whether a fault tells it."""
    return any(re.search(said, fault) for fault in faults)
