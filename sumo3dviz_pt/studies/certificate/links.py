"""The links of a certificate's proof: inputs, frames, films, pictures. Each can fail alone.

All of them are read off a study's folder, so that another person can follow them on another machine
without rendering. docs/internals/certificate.md says what each of them claims.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any, Literal

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.files.forms import Form
from sumo3dviz_pt.model.progress import Doing, announce
from sumo3dviz_pt.pipeline.films.encoding import DIGEST, digest_in
from sumo3dviz_pt.pipeline.films.frames import account_file
from sumo3dviz_pt.pipeline.provenance import FILM_RECORD, file_hash
from sumo3dviz_pt.studies.certificate.accounts import account_faults
from sumo3dviz_pt.studies.certificate.acts import Acts, Subject
from sumo3dviz_pt.studies.certificate.delivered import NOT_WRITTEN, FilmFault, film_faults
from sumo3dviz_pt.studies.folder import FOLDER as INPUTS
from sumo3dviz_pt.studies.foresight import subject_of_pair
from sumo3dviz_pt.studies.plan import StudyPlan
from sumo3dviz_pt.studies.records import MATERIALS, RECORD, STUDY_RECORD
from sumo3dviz_pt.studies.tools.datasets import CHECKSUMS, read_digests

CERTIFICATE = "certificate.json"
CERTIFIED = Form("certificate")
"""The version of that file, and what makes it of older ones."""

Link = Literal["inputs", "frames", "films", "pictures", "replay", "folder"]

CLAIMS: Mapping[Link, str] = {
    "inputs": "scenes of a pair differ in what its levels set, and input files are the same bytes",
    "frames": "every stored frame and layer is the one that was rendered",
    "films": "every picture of every film is its frame, but for what the codec did",
    "pictures": "in the compared frames, shape, colour and light differ only where factors act",
}
"""What each link claims, in words."""

Content = Mapping[str, Any]

_LEFT_BY_SYSTEMS = frozenset({"thumbs.db", "desktop.ini"})
"""Files that systems put into folders that people look at, in small letters."""


@dataclass(frozen=True, slots=True)
class Fault:
    """What is wrong in a study's folder.

    Attributes:
        link: Of the proof that is broken.
        file: In the folder.
        what: Is wrong with it.
        frame: Number of the frame that is wrong, if it is of one.
    """

    link: Link
    file: str
    what: str
    frame: int | None = None

    def __str__(self) -> str:
        frame = "" if self.frame is None else f"frame {self.frame}: "
        return f"{self.link}: {self.file}: {frame}{self.what}"


@dataclass(frozen=True, slots=True)
class StudyFolder:
    """A study's folder, and what it says of itself.

    Attributes:
        path: The folder.
        record: `study.json`.
        certificate: `certificate.json`; None where there is none, empty where it is damaged.
        accounts: Of all films that can be read, by name.
        unedited: Files that have the digest that they say, as they lie there.
    """

    path: Path
    record: Content
    certificate: Content | None
    accounts: Mapping[str, Content]
    unedited: frozenset[Path] = frozenset()

    @classmethod
    def read(cls, path: Path) -> StudyFolder:
        """Read a folder.

        Raises:
            InputError: If it is no study's, or its `study.json` cannot be read.
            ConfigError: If a newer version wrote it.
        """
        if not (path / RECORD).is_file():
            raise InputError(f"is no study's folder: it holds no {RECORD}", file=path)
        whole = set[Path]()
        record = _json(path / RECORD, STUDY_RECORD, whole)
        if record is None or not isinstance(record.get("films"), dict):
            raise InputError("is damaged: it names no films", file=path / RECORD)
        films = dict(_films(record))
        for own in films.values():
            if not (path / own["file"]).resolve().is_relative_to(path.resolve()):
                raise InputError("names a film outside of the folder", file=path / RECORD)
        accounts = {
            name: _json(account_file(path / own["file"]), FILM_RECORD, whole)
            for name, own in films.items()
        }
        known = {name: each for name, each in accounts.items() if each and _is_account(each)}
        there = (path / CERTIFICATE).exists()
        certificate = _json(path / CERTIFICATE, CERTIFIED, whole) or {} if there else None
        return cls(path, record, certificate, known, frozenset(whole))

    @property
    def films(self) -> dict[str, Content]:
        """What the record says of each film, by name."""
        return dict(_films(self.record))

    def film(self, name: str) -> Path:
        """Return where a film lies."""
        return self.path / str(self.films[name]["file"])

    def frame_files(self, name: str) -> dict[str, str]:
        """Return the digests of a film's frames, layers and other files, by name in the folder."""
        beside = Path(str(self.films[name]["file"])).parent.as_posix()
        files = self.accounts[name].get("files", {})
        return {f"{beside}/{own}": str(digest) for own, digest in files.items()}


def _films(record: Content) -> Iterator[tuple[str, Content]]:
    """Yield the films of a record."""
    for name, film in record["films"].items():
        if isinstance(film, dict) and isinstance(film.get("file"), str):
            yield name, film


def _json(path: Path, form: Form, whole: set[Path]) -> Content | None:
    """Return what a file of JSON holds, as this version says it; None if it is lost or damaged.

    Args:
        path: The file.
        form: Its kind.
        whole: Is told the file if its digest is that of what it holds.

    Raises:
        ConfigError: If a newer version wrote it.
    """
    try:
        content = json.loads(path.read_bytes())
    except (OSError, ValueError, RecursionError):
        return None
    if not isinstance(content, dict):
        return None
    if content.get(DIGEST) == digest_in(content):
        whole.add(path)
    return form.current(content, path)


def _is_account(account: Content) -> bool:
    """Return whether an account has what links ask it for."""
    kinds = {"frames": list, "delivered": dict, "files": dict, "inputs": dict, "scene": dict}
    return all(isinstance(account.get(key), kind) for key, kind in kinds.items())


# Inputs ------------------------------------------------------------------------------------


def seal_faults(study: StudyFolder) -> list[Fault]:
    """Return files that are not what the folder says of them, and inputs that changed."""
    faults = [*_seals(study), *_named_inputs(study)]
    if study.certificate is not None:
        faults += _certified(study, study.certificate)
    return faults


def _seals(study: StudyFolder) -> Iterator[Fault]:
    """Yield files that were edited: their digests are no longer those of what they hold."""
    edited = "was edited: it does not have the digest that it says"
    if study.path / RECORD not in study.unedited:
        yield Fault("inputs", RECORD, edited)
    for name, film in study.films.items():
        file = account_file(Path(str(film["file"]))).as_posix()
        account = study.accounts.get(name)
        if account is None:
            yield Fault("inputs", file, "the film's account is missing or damaged")
            continue
        if study.path / file not in study.unedited:
            yield Fault("inputs", file, edited)
        elif account[DIGEST] != film.get("account"):
            yield Fault("inputs", file, f"is not the account that {RECORD} was written with")


def _named_inputs(study: StudyFolder) -> Iterator[Fault]:
    """Yield input files of films of which the folder holds one of the name, with other content."""
    own: dict[str, set[str]] = {}
    for file, digest in input_files(study.path).items():
        own.setdefault(Path(file).name, set()).add(digest)
    used = {(str(n), str(d)) for each in study.accounts.values() for n, d in each["inputs"].items()}
    for name, digest in sorted(used):
        there = own.get(Path(name).name)
        if there is not None and digest not in there:
            yield Fault("inputs", f"{INPUTS}/{name}", "is not the file that films were made from")


def input_files(folder: Path) -> dict[str, str]:
    """Return the digests of a study's inputs, by name in its folder."""
    files = sorted(path for path in (folder / INPUTS).rglob("*") if path.is_file())
    return {path.relative_to(folder).as_posix(): file_hash(path) for path in files}


def scene_faults(study: StudyFolder, plan: StudyPlan) -> Iterator[Fault]:
    """Yield pairs that differ where they should not, by what their accounts tell.

    Args:
        study: The folder; what its certificate calls failed is not named again.
        plan: What its inputs show.
    """
    failed = {_names(each) for each in certified_pairs(study) if not each.get("passed")}
    for pair in plan.pairs:
        one, other = study.accounts.get(pair.one), study.accounts.get(pair.other)
        if one is None or other is None or (pair.factor, pair.one, pair.other) in failed:
            continue
        file = account_file(Path(str(study.films[pair.other]["file"]))).as_posix()
        try:
            subject = subject_of_pair(plan.file, pair, rider=rider_in(one))
            faults = account_faults(one, other, subject.acts, pair.changed)
        except (AttributeError, LookupError, TypeError, ValueError) as error:
            faults, subject = [f"the accounts cannot be compared ({error})"], Subject(Acts())
        for what in (*(f"levels also set {each}" for each in subject.confounds), *faults):
            yield Fault("inputs", file, f"beside {pair.one}: {what}")


def certified_pairs(study: StudyFolder) -> list[Content]:
    """Return what a certificate says of pairs."""
    pairs = (study.certificate or {}).get("pairs")
    return [each for each in pairs if isinstance(each, dict)] if isinstance(pairs, list) else []


def record_faults(study: StudyFolder, plan: StudyPlan) -> Iterator[Fault]:
    """Yield what the record says of films and pairs that neither inputs nor accounts say.

    Who swaps the levels' names, or leaves pairs out, changes what the study shows.
    """
    for stimulus in plan.stimuli:
        film = study.films.get(stimulus.name, {})
        levels = [dict(zip(plan.factors, own, strict=True)) for own in stimulus.profiles]
        account, about = study.accounts.get(stimulus.name), [film.get("profiles"), film.get("code")]
        if film and about != [levels, stimulus.code]:
            yield Fault("inputs", RECORD, f"says of {stimulus.name} other levels than {INPUTS} say")
        if film and account and not _as_told(film, account):
            what = f"says of {stimulus.name} another length, rate or size than its account"
            yield Fault("inputs", RECORD, what)
    wanted = {(pair.factor, pair.one, pair.other) for pair in plan.pairs}
    pairs = study.record.get("pairs")
    recorded = {_names(each) for each in pairs if isinstance(each, dict)} if pairs else set()
    places = ((RECORD, recorded), (CERTIFICATE, {_names(each) for each in certified_pairs(study)}))
    for file, listed in places:
        if listed != wanted and (file == RECORD or study.certificate is not None):
            yield Fault(
                "inputs", file, f"names {len(listed)} pairs, and {INPUTS} make {len(wanted)}"
            )


def _as_told(film: Content, account: Content) -> bool:
    """Return whether a record says of a film what its account says; a damaged one says nothing."""
    more = _mapping(account.get("overlays"))
    try:
        count = len(account["frames"]) + sum(
            int(more.get(f"frames_{n}", 0)) for n in ("before", "after")
        )
        lasts = round(float(count / Fraction(str(account["frame_rate"]))), 5)
        wanted = [count, str(account["frame_rate"]), list(account["size"]), lasts]
        stated = [film.get("frames"), str(film.get("rate")), list(film.get("size", ()))]
        stated.append(round(float(film.get("duration", 0.0)), 5))
    except (ArithmeticError, LookupError, TypeError, ValueError):
        return False
    return stated == wanted


def _names(pair: Content) -> tuple[str, str, str]:
    """Return what tells a pair from others."""
    return str(pair.get("factor")), str(pair.get("one")), str(pair.get("other"))


def rider_in(account: Content) -> str:
    """Return the id of the vehicle that a film's camera rides in, or nothing."""
    return str(account["scene"]["cameras"][account["camera"]].get("vehicle") or "")


def _certified(study: StudyFolder, certificate: Content) -> Iterator[Fault]:
    """Yield what a certificate says that is not so."""
    if study.path / CERTIFICATE not in study.unedited:
        yield Fault("inputs", CERTIFICATE, "was edited: it does not have the digest that it says")
        return
    digests = _mapping(certificate.get("digests"))
    if digests.get(RECORD) != study.record.get(DIGEST):
        yield Fault("inputs", RECORD, f"is not the one that {CERTIFICATE} was written for")
    yield from _signed(study, digests)
    links: tuple[tuple[Link, str], ...] = (
        *(("inputs", "inputs"), ("films", "cards"), ("folder", "others")),
    )
    for link, key in links:
        for file, digest in _mapping(digests.get(key)).items():
            if file_hash(study.path / file) != digest:
                yield Fault(link, file, f"is not the file that {CERTIFICATE} was written for")


def _signed(study: StudyFolder, digests: Content) -> Iterator[Fault]:
    """Yield accounts and films that were signed anew: the certificate tells other digests."""
    what = f"is not the one that {CERTIFICATE} was written for"
    accounts, films = _mapping(digests.get("accounts")), _mapping(digests.get("films"))
    for name, film in study.films.items():
        file = str(film["file"])
        # An account that is not the record's is named already.
        if film.get("account") != accounts.get(name):
            yield Fault("inputs", account_file(Path(file)).as_posix(), what)
        if film.get("sha256") != films.get(file):
            yield Fault("films", file, what)


def _mapping(value: Any) -> Content:
    """Return a value if it is a mapping, and else an empty one."""
    return value if isinstance(value, dict) else {}


def stray_faults(study: StudyFolder) -> Iterator[Fault]:
    """Yield what lies beside the films and is none of the study's: people might take it for one."""
    known = {*read_digests(study.path / CHECKSUMS)}
    names = {study.film(name).stem for name in study.films}
    for path in sorted((study.path / MATERIALS).glob("*")):
        name = path.relative_to(study.path).as_posix()
        own = path.is_dir() and not path.is_symlink() and path.stem in names
        left = path.name.startswith(".") or path.name.lower() in _LEFT_BY_SYSTEMS
        if not (own or left or name in known):
            yield Fault("folder", name, "is no file of this study; remove it")


def listed_faults(study: StudyFolder, judged: Sequence[Fault]) -> list[Fault]:
    """Return files of the folder that changed or are gone, by `checksums.sha256`.

    Args:
        study: The folder.
        judged: What other links found; what they named is not named again.
    """
    known = read_digests(study.path / CHECKSUMS)
    if not known:
        return [Fault("folder", CHECKSUMS, "is missing or damaged")]
    named = {fault.file for fault in judged}
    faults = []
    for name, digest in known.items():
        inside = (study.path / name).resolve().is_relative_to(study.path.resolve())
        own = file_hash(study.path / name) if inside and name not in named else digest
        if own != digest:
            what = "is not the file that was written" if own else "is not there"
            faults.append(Fault("folder", name, what))
    return faults


# Frames and films --------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Tested:
    """How much of a folder was there to be tested.

    Attributes:
        frames: Stored frames and layers that were there, of how many.
        pictures: Pictures of films that were decoded.
        developed: How many of these were held against frames that were developed again.
    """

    frames: tuple[int, int] = (0, 0)
    pictures: int = 0
    developed: int = 0


def frame_faults(study: StudyFolder) -> tuple[list[Fault], tuple[int, int]]:
    """Return stored frames and layers that changed; and how many are there, of how many."""
    faults, there, known = [], 0, 0
    for number, name in enumerate(study.accounts, start=1):
        files = study.frame_files(name)
        known += len(files)
        for file, digest in files.items():
            own = file_hash(study.path / file)
            there += bool(own)
            if not own and os.path.lexists(study.path / file):
                faults.append(Fault("frames", file, "is no file that can be read"))
            if own and own != digest:
                frame = int(Path(file).stem) if Path(file).stem.isdecimal() else None
                what = _stranger(study, file, own)
                faults.append(Fault("frames", file, what, frame))
        announce(Doing.MEASURE, number, len(study.accounts))
    return faults, (there, known)


def _stranger(study: StudyFolder, file: str, digest: str) -> str:
    """Return what a frame is that is not the one that was rendered."""
    for name in study.accounts:
        for other, known in study.frame_files(name).items():
            if known == digest:
                return f"is {other}, not the frame that was rendered"
    return f"is not the file that was written with {Path(file).parts[1].split('.')[0]}"


def all_film_faults(
    study: StudyFolder, broken: Sequence[Fault], *, develop: bool
) -> tuple[list[Fault], Tested]:
    """Return what is wrong with films, picture by picture; and how much was tested.

    Args:
        study: The folder.
        broken: Frames that changed; they are not developed again.
        develop: Whether frames that are there are developed again.
    """
    faults: list[Fault] = []
    pictures = developed = 0
    bad = {study.path / fault.file for fault in broken}
    for number, (name, account) in enumerate(study.accounts.items(), start=1):
        film = study.film(name)
        digest = study.films[name].get("sha256")
        tested = film_faults(film, account, sha256=str(digest), spare=bad, develop=develop)
        faults += [_of_film(study, each) for each in tested.faults]
        pictures += tested.pictures
        developed += tested.developed
        announce(Doing.MEASURE, number, len(study.accounts))
    return faults, Tested(pictures=pictures, developed=developed)


def _of_film(study: StudyFolder, fault: FilmFault) -> Fault:
    """Return a film's fault as one of the folder; one that lies in another's place is named."""
    file, what = fault.film.relative_to(study.path).as_posix(), fault.what
    if what == NOT_WRITTEN:
        own = file_hash(fault.film)
        rather = (str(each["file"]) for each in study.films.values() if each.get("sha256") == own)
        what = f"is {name}, not the film that was written" if (name := next(rather, "")) else what
    return Fault("films", file, what, fault.frame)
