"""Verifies a study's folder: follows every link of its proof, and renders some frames anew.

A frame is a function of its scene. So whoever has the scene can draw frames by lot, render them and
compare them with what is stored, bit by bit; digests in accounts stand for frames that are gone.
"""

from __future__ import annotations

import hashlib
import json
import tempfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from sumo3dviz_pt.errors import ConfigError, InputError
from sumo3dviz_pt.model.progress import Doing, announce
from sumo3dviz_pt.pipeline.films.encoding import DIGEST
from sumo3dviz_pt.pipeline.films.film import render_film
from sumo3dviz_pt.pipeline.films.frames import frame_file, frames_folder
from sumo3dviz_pt.pipeline.films.orders import FilmOrder
from sumo3dviz_pt.pipeline.production import Request
from sumo3dviz_pt.pipeline.provenance import (
    code_of,
    file_hash,
    package_hashes,
    versions,
)
from sumo3dviz_pt.studies.certificate.certificate import (
    PAGE,
    WORDED_BY,
    judged_again,
    limits_of,
    page_of,
)
from sumo3dviz_pt.studies.certificate.comparison import PairVerdict
from sumo3dviz_pt.studies.certificate.delivered import helping, replayed_faults, whole_frames
from sumo3dviz_pt.studies.certificate.links import (
    CERTIFICATE,
    Fault,
    StudyFolder,
    Tested,
    all_film_faults,
    certified_pairs,
    frame_faults,
    listed_faults,
    record_faults,
    scene_faults,
    seal_faults,
    stray_faults,
)
from sumo3dviz_pt.studies.file import load_study
from sumo3dviz_pt.studies.folder import FOLDER as INPUTS
from sumo3dviz_pt.studies.folder import STUDY
from sumo3dviz_pt.studies.plan import StudyPlan, plan_study
from sumo3dviz_pt.studies.tools.datasets import CHECKSUMS

_SAME_NUMBER = 0.01
"""How far a pair's numbers may be from those of its certificate: processors differ in last bits."""


@dataclass(frozen=True, slots=True)
class Verified:
    """What was found in a study's folder.

    Attributes:
        study: The folder.
        faults: What is wrong.
        tested: How much was there to be tested.
        notes: What was not tested or not judged, and what was rendered anew; sentences.
    """

    study: StudyFolder
    faults: tuple[Fault, ...]
    tested: Tested
    notes: tuple[str, ...]

    @property
    def digest(self) -> str:
        """Of the certificate; of the record where there is none."""
        return str((self.study.certificate or self.study.record).get(DIGEST, ""))

    def __str__(self) -> str:
        tested = self.tested
        there, known = tested.frames
        films = len(self.study.accounts)
        own = "certificate" if self.study.certificate else "no certificate; study.json"
        if self.faults:
            count = len(self.faults)
            return (
                f"not proven: {count} {'thing is' if count == 1 else 'things are'} wrong; see above"
            )
        return (
            f"proven: {films} films with {tested.pictures} pictures, {there} of {known} frames and"
            f" layers, {tested.developed} pictures developed again; {own} {self.digest}"
        )

    def as_plain(self) -> dict[str, Any]:
        """Return it as JSON holds it."""
        return {
            "verified": not self.faults,
            "digest": self.digest,
            "faults": [
                {"link": each.link, "file": each.file, "frame": each.frame, "what": each.what}
                for each in self.faults
            ],
            "frames": {"there": self.tested.frames[0], "of": self.tested.frames[1]},
            "pictures": {"decoded": self.tested.pictures, "developed": self.tested.developed},
            "notes": list(self.notes),
        }


@dataclass(frozen=True, slots=True)
class VerifyOrder:
    """How a folder is verified.

    Attributes:
        folder: The study's.
        replay: How many frames are rendered anew.
        seed: Draws others of them.
        published: What the certificate's digest should be, where that was published; or empty.
        quick: Whether films are held against the prints of their frames only.
    """

    folder: Path
    replay: int = 0
    seed: int = 0
    published: str = ""
    quick: bool = False


def verify_study(order: VerifyOrder) -> Verified:
    """Follow all links of a study's proof.

    Raises:
        InputError: If the folder is no study's, or what a replay needs is missing.
        ConfigError: If the study file that a replay needs is wrong.
    """
    study = StudyFolder.read(order.folder)
    plan, why = _plan(study)
    if order.replay and plan is None:
        raise _lacking(study, why)
    again = _replayed(study, plan, order) if plan is not None and order.replay else _NOTHING
    faults = [*_published(study, order), *seal_faults(study)]
    faults += [] if plan is None else [*scene_faults(study, plan), *record_faults(study, plan)]
    frames, there = frame_faults(study)
    films, tested = all_film_faults(study, frames, develop=not order.quick)
    tested = replace(tested, frames=there)
    faults += [*frames, *films, *_pictures(study)]
    if plan is not None and study.certificate is not None and not order.quick:
        faults += _pairs(study, plan)
    faults += [*stray_faults(study), *_page(study)]
    faults += [*listed_faults(study, faults), *again.faults]
    notes = [] if plan else [f"not tested: accounts of pairs were not compared again ({why})"]
    return Verified(study, tuple(faults), tested, (*notes, *_untested(study, tested), *again.notes))


def _lacking(study: StudyFolder, why: object) -> InputError:
    """Return what is said of a folder that lacks what a replay needs."""
    return InputError(f"a replay needs the study's inputs ({why})", file=study.path)


def _plan(study: StudyFolder) -> tuple[StudyPlan | None, str]:
    """Return what the folder's inputs show; or nothing, and why."""
    source = study.path / INPUTS / STUDY
    if not source.is_file():
        return None, f"there is no {INPUTS}/{STUDY}"
    try:
        plan = plan_study(load_study(source))
    except (ConfigError, InputError) as error:
        return None, str(error)
    lost = sorted(study.films.keys() - {each.name for each in plan.stimuli})
    return (None, f"{INPUTS}/{STUDY} makes no film {lost[0]}") if lost else (plan, "")


def _published(study: StudyFolder, order: VerifyOrder) -> Iterator[Fault]:
    """Yield that a certificate is not the one whose digest was published."""
    if order.published and (study.certificate or {}).get(DIGEST) != order.published.lower():
        yield Fault("inputs", CERTIFICATE, "is not the one whose digest was published")


def _page(study: StudyFolder) -> Iterator[Fault]:
    """Yield that the page says something else than the certificate; other versions write others."""
    path = study.path / PAGE
    if study.certificate is None or not _is_own(study):
        return
    try:
        wanted = page_of(study.path, study.certificate)
        limits = json.loads(json.dumps(limits_of(study)))
    except (KeyError, TypeError, ValueError, OSError, AttributeError):
        yield Fault("folder", CERTIFICATE, "does not hold what its page shows")
        return
    if study.certificate.get("limits") != limits:
        yield Fault("folder", CERTIFICATE, "tells other limits than those that were used")
    if not path.is_file() or path.read_bytes() != wanted.encode():
        yield Fault("folder", PAGE, f"does not say what {CERTIFICATE} says")


def _is_own(study: StudyFolder) -> bool:
    """Return whether this code worded a certificate, so that its words can be compared."""
    return (study.certificate or {}).get(WORDED_BY) == code_of("studies")


def _pairs(study: StudyFolder, plan: StudyPlan) -> Iterator[Fault]:
    """Yield pairs of which the frames say something else than the certificate."""
    certified = {(p.get("factor"), p.get("one"), p.get("other")): p for p in certified_pairs(study)}
    for number, pair in enumerate(plan.pairs, start=1):
        old = certified.get((pair.factor, pair.one, pair.other))
        if old is None or not {pair.one, pair.other} <= study.accounts.keys():
            continue
        try:
            again = judged_again(study, plan, pair)
        except (AttributeError, LookupError, TypeError, ValueError, InputError) as error:
            what = f"{pair.one} and {pair.other}: cannot be compared again ({error})"
            yield Fault("pictures", CERTIFICATE, what)
            continue
        announce(Doing.MEASURE, number, len(plan.pairs))
        for what in () if again is None else _otherwise(again, old, worded=_is_own(study)):
            yield Fault("pictures", CERTIFICATE, f"{pair.one} and {pair.other}: {what}")


def _otherwise(again: PairVerdict, old: Mapping[str, Any], *, worded: bool) -> Iterator[str]:
    """Yield what a certificate does not say of a pair, or says otherwise.

    Args:
        again: What its frames say.
        old: What the certificate says.
        worded: Whether the same code wrote it, so that its words are those of this version.
    """
    yield from (each for each in again.faults[again.told :] if each not in old.get("faults", []))
    words: dict[str, Any] = {"claim": again.claim}
    if worded:
        words |= {"acts": again.acts, "not_tested": [*again.not_tested], "moving": again.moving}
    yield from (
        f"says otherwise than its frames: {key}" for key in words if old.get(key) != words[key]
    )
    numbers = {"wrong": again.wrong, "light": again.light, "codes": again.codes}
    for key, value in numbers.items():
        was = old.get(key)
        known = float("nan") if was is None else float(was)
        if not (np.isnan(known) and np.isnan(value)) and not abs(known - value) <= _SAME_NUMBER:
            yield f"says otherwise than its frames: {key}"


def _pictures(study: StudyFolder) -> Iterator[Fault]:
    """Yield what a certificate says itself that is wrong."""
    for pair in certified_pairs(study):
        for what in pair.get("faults", []):
            films = f"{pair.get('one')} and {pair.get('other')}"
            yield Fault("pictures", CERTIFICATE, f"{films}: {what}")


def _untested(study: StudyFolder, tested: Tested) -> Iterator[str]:
    """Yield what was not tested or judged, in sentences."""
    if study.certificate is None:
        yield "not tested: pictures of pairs, because there is no certificate"
    elif not _is_own(study):
        yield (
            f"not compared: the words of {PAGE} and {CERTIFICATE} with those of this version,"
            f" because other code chose them; only digests hold them: {CHECKSUMS} the page's,"
            " --published the certificate's"
        )
    for pair in certified_pairs(study):
        films = f"{pair.get('factor')}: {pair.get('one')} and {pair.get('other')}"
        if pair.get("claim") == "not judged":
            yield f"not judged: {films}"
        if pair.get("moving"):
            yield f"not tested: {films}: {pair['moving']}"
    there, known = tested.frames
    if there < known:
        yield f"not tested: {known - there} of {known} frames and layers, which are not there"
    if tested.developed < tested.pictures:
        yield (
            f"not developed: {tested.pictures - tested.developed} of {tested.pictures} pictures,"
            " which were held against the prints of their frames"
        )


# Replay ------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _Replay:
    """What was found of frames that were rendered anew."""

    faults: tuple[Fault, ...] = ()
    notes: tuple[str, ...] = ()


_NOTHING = _Replay()


def _replayed(study: StudyFolder, plan: StudyPlan, order: VerifyOrder) -> _Replay:
    """Render some frames anew, and compare them with those that are stored.

    Raises:
        InputError: If an input is missing or wrong.
    """
    drawn = _drawn(study, order)
    faults: list[Fault] = []
    notes: dict[str, None] = {}
    with tempfile.TemporaryDirectory() as folder:
        for name, number in drawn:
            notes |= dict.fromkeys(_unlike(study, plan, name))
            try:
                fresh = _rendered(study, plan, name, number, Path(folder))
            except (ConfigError, InputError) as error:
                raise _lacking(study, error) from error
            faults += _replay_faults(study, name, number, fresh)
    notes["rendered anew: " + ", ".join(f"{name} {number}" for name, number in drawn)] = None
    if faults:
        notes["frames are equal to the bit on one kind of processor; others agree to noise"] = None
    return _Replay(tuple(faults), tuple(notes))


def _drawn(study: StudyFolder, order: VerifyOrder) -> list[tuple[str, int]]:
    """Return frames that are drawn by lot: by digests, so that nobody chooses them."""
    salt = f"{(study.certificate or study.record).get(DIGEST)}:{order.seed}"
    frames = [(name, n) for name, own in study.accounts.items() for n in range(len(own["frames"]))]

    def lot(frame: tuple[str, int]) -> str:
        return hashlib.sha256(f"{salt}:{frame[0]}:{frame[1]}".encode()).hexdigest()

    return sorted(sorted(frames, key=lot)[: order.replay])


def _unlike(study: StudyFolder, plan: StudyPlan, name: str) -> Iterator[str]:
    """Yield why a frame that is rendered here need not be the same to the bit."""
    account = study.accounts[name]
    own = {**versions(), **{f"own {key}": value for key, value in package_hashes().items()}}
    theirs = {
        **account.get("versions", {}),
        **{f"own {key}": value for key, value in account.get("package", {}).items()},
    }
    others = [key for key in sorted(own.keys() | theirs.keys()) if own.get(key) != theirs.get(key)]
    if others:
        yield (
            f"other versions made the films ({', '.join(others)}), so frames need not be equal to"
            " the bit"
        )
    made = next((each for each in plan.stimuli if each.name == name), None)
    if made is not None and not others and made.digest != study.films[name].get("digest"):
        yield f"the study file does not make {name} as it was made: a value or a file is another"


def _rendered(study: StudyFolder, plan: StudyPlan, name: str, number: int, folder: Path) -> Path:
    """Render a frame anew, with those that help it where they are gone; return its file."""
    account, film = study.accounts[name], study.film(name)
    there = frame_file(frames_folder(film), number) in whole_frames(film, account)
    wanted = range(number, number + 1) if there else helping(account, number)
    (stimulus,) = plan.only(name).stimuli
    path = folder / f"{name}-{number}" / film.name
    path.parent.mkdir()
    request = Request(
        variant=str(account["variant"]),
        command=str(account["command"]),
        metered=account.get("metering", {}).get("metered"),
    )
    order = FilmOrder(path, frames=(wanted.start, wanted.stop))
    render_film(stimulus.job, request, order)
    return frame_file(frames_folder(path), number)


def _replay_faults(study: StudyFolder, name: str, number: int, fresh: Path) -> Iterator[Fault]:
    """Yield that a frame that was rendered anew is not the stored one, or not what a film shows."""
    film, account = study.film(name), study.accounts[name]
    stored = frame_file(frames_folder(film), number)
    file = stored.relative_to(study.path).as_posix()
    if file_hash(fresh) != study.frame_files(name).get(file):
        what = _apart(stored, fresh) if stored.is_file() else "rendered anew, it is another frame"
        if what:
            yield Fault("replay", file, what, number)
            return
    if all(frame_file(fresh.parent, each).is_file() for each in helping(account, number)):
        for each in replayed_faults(film, account, fresh):
            where = each.film.relative_to(study.path).as_posix()
            yield Fault("replay", where, each.what, each.frame)


def _apart(stored: Path, fresh: Path) -> str:
    """Return by how much two frames differ, in words; nothing if all of their pixels are equal."""
    from sumo3dviz_pt.image.exr import read_layers

    one, other = read_layers(stored)[0], read_layers(fresh)[0]
    if one.keys() != other.keys() or any(one[k].shape != other[k].shape for k in one):
        return "rendered anew, it has other layers"
    unlike = np.zeros(next(iter(one.values())).shape[:2], dtype=bool)
    for name, layer in one.items():
        apart = ~((layer == other[name]) | (np.isnan(layer) & np.isnan(other[name])))
        unlike |= apart.reshape(*unlike.shape, -1).any(axis=-1)
    if not unlike.any():
        return ""
    count = int(unlike.sum())
    light, again = (each["radiance"][unlike].astype(np.float64) for each in (one, other))
    by = float(np.median(np.abs(light - again).max(axis=-1) / np.maximum(light.max(axis=-1), 1e-9)))
    return f"rendered anew, {count} of {unlike.size} pixels are others, a typical one by {by:.2g}"
