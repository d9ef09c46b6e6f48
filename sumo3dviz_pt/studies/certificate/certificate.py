"""Makes the certificate of a study: every pair is compared, verdicts become a page and a file."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.image.png import write_png
from sumo3dviz_pt.model.progress import Doing, announce
from sumo3dviz_pt.pipeline.films import layers
from sumo3dviz_pt.pipeline.films.encoding import DIGEST, sealed
from sumo3dviz_pt.pipeline.films.frames import frame_file, frames_folder, write_json
from sumo3dviz_pt.pipeline.provenance import code_of, file_hash, versions
from sumo3dviz_pt.studies.certificate.accounts import (
    account_faults,
    moving_otherwise,
    named_differences,
)
from sumo3dviz_pt.studies.certificate.acts import Acts
from sumo3dviz_pt.studies.certificate.comparison import (
    TYPICAL_CODES,
    TYPICAL_LIGHT,
    Comparison,
    PairVerdict,
    ThingDifference,
    compare,
    pixel_verdict,
    untested,
)
from sumo3dviz_pt.studies.certificate.delivered import codec_most
from sumo3dviz_pt.studies.certificate.evidence import (
    MOST_BEYOND,
    Evidence,
    check_same_size,
    compared_frames,
    read_evidence,
    spread,
)
from sumo3dviz_pt.studies.certificate.links import (
    CERTIFICATE,
    CERTIFIED,
    CLAIMS,
    Fault,
    StudyFolder,
    all_film_faults,
    frame_faults,
    input_files,
    rider_in,
    seal_faults,
)
from sumo3dviz_pt.studies.certificate.page import page_text, write_page
from sumo3dviz_pt.studies.foresight import subject_of_pair
from sumo3dviz_pt.studies.plan import StudyPlan
from sumo3dviz_pt.studies.records import RECORD, film_path, read_film_account
from sumo3dviz_pt.studies.stimuli import StimulusPair

PAGE, FOLDER = "certificate.html", "certificate"

WORDED_BY = "worded_by"
"""Key of the code that chose a certificate's words: another one may choose others."""

_APART = ("shade", "block", "pixel", "worst", "colour", "stain", "tone")
"""What the numbers of `Apart` are called."""

_WIDEST = 480
"""Width of each picture on the page, at most [px]."""

_GREY, _RED, _BLUE, _AMBER = (0.35, (255, 60, 40), (40, 150, 255), (230, 170, 20))
"""How dark the picture is under the mask, and colours of what is wrong, of what is not, and of what
is lit otherwise."""

Pixels = NDArray[np.uint8]


@dataclass(frozen=True, slots=True)
class Certificate:
    """What was found on all pairs of a study.

    Attributes:
        pairs: A verdict on each.
        files: All that was written.
        faults: What is wrong with the folder itself: files, frames, films.
    """

    pairs: tuple[PairVerdict, ...]
    files: tuple[Path, ...]
    faults: tuple[Fault, ...] = ()

    @property
    def failed(self) -> tuple[PairVerdict, ...]:
        """The pairs that differ where they should not."""
        return tuple(pair for pair in self.pairs if not pair.passed)

    @property
    def passed(self) -> bool:
        """Whether all pairs are clean, and all else is what it says."""
        return not (self.failed or self.faults)

    def __str__(self) -> str:
        if not self.pairs:
            return "certificate: there are no two films to compare"
        claims = Counter(pair.claim for pair in self.pairs)
        more = f", {claims['not judged']} not judged" if claims["not judged"] else ""
        moving = sum(bool(pair.moving) for pair in self.pairs)
        more += f"; in {moving} of them everything that moves may differ" if moving else ""
        return (
            f"certificate: {claims['proven']} of {len(self.pairs)} pairs differ in their factor"
            f" alone{more}"
        )


def certify(folder: Path, plan: StudyPlan, *, cards: Sequence[str] = ()) -> Certificate:
    """Compare all pairs of a study's films, and write `certificate.html` and `certificate.json`.

    Args:
        folder: The study's, with all films.
        plan: What they show.
        cards: Files of choice cards, which are made of these films.

    Raises:
        InputError: If a film's account is missing or damaged.
    """
    verdicts = []
    for number, pair in enumerate(plan.pairs, start=1):
        verdicts.append(_verdict(folder, plan, pair))
        announce(Doing.MEASURE, number, len(plan.pairs))
    pictures = [folder / each.picture for each in verdicts if each.picture]
    study = replace(StudyFolder.read(folder), certificate=None)
    faults = _folder_faults(study)
    content = _content(study, plan, verdicts, faults)
    content["digests"]["cards"] = {name: file_hash(folder / name) for name in sorted(cards)}
    content = sealed(content)
    write_json(folder / CERTIFICATE, content, indent=1)
    page = write_page(folder / PAGE, content, verdicts)
    return Certificate(tuple(verdicts), (folder / CERTIFICATE, page, *pictures), faults)


def seal_folder(folder: Path, certificate: Certificate, files: Sequence[Path]) -> None:
    """Put the digests of all that goes with films into the certificate, so that its own covers it.

    Pages and playlists say which film people see, and reports what was measured on it.

    Args:
        folder: The study's.
        certificate: Of it, written.
        files: All of the study's files.
    """
    content = json.loads((folder / CERTIFICATE).read_bytes())
    digests = content["digests"]
    known = {CERTIFICATE, PAGE, RECORD, *digests["films"], *digests["inputs"], *digests["cards"]}
    names = {file.relative_to(folder).as_posix() for file in files} - known
    digests["others"] = {name: file_hash(folder / name) for name in sorted(names)}
    content = sealed(content)
    write_json(folder / CERTIFICATE, content, indent=1)
    write_page(folder / PAGE, content, certificate.pairs)


def verdicts_in(content: Mapping[str, Any]) -> list[PairVerdict]:
    """Return the verdicts that `certificate.json` holds.

    Raises:
        KeyError, TypeError, ValueError: If it holds none, or no sense.
    """
    return [_read_verdict(each) for each in content["pairs"]]


def _read_verdict(values: Mapping[str, Any]) -> PairVerdict:
    """Return a verdict; unknown numbers are NaN."""
    nan = float("nan")
    known: dict[str, Any] = {}
    for field in fields(PairVerdict):
        value = values[field.name]
        value = (
            tuple(nan if each is None else each for each in value)
            if isinstance(value, list)
            else value
        )
        known[field.name] = nan if value is None else value
    known["things"] = tuple(ThingDifference(**each) for each in values["things"])
    return PairVerdict(**known)


def page_of(folder: Path, content: Mapping[str, Any]) -> str:
    """Return the page of a certificate, as this version writes it."""
    return page_text(folder, content, verdicts_in(content))


def _folder_faults(study: StudyFolder) -> tuple[Fault, ...]:
    """Return what is wrong with a folder's files, frames and films."""
    frames, _ = frame_faults(study)
    # Films were measured against their frames when they were made.
    films, _ = all_film_faults(study, frames, develop=False)
    return (*seal_faults(study), *frames, *films)


def judged_again(study: StudyFolder, plan: StudyPlan, pair: StimulusPair) -> PairVerdict | None:
    """Return what there is to say of a pair by what lies in a folder; None if something is gone."""
    count = min(len(study.accounts[name]["frames"]) for name in (pair.one, pair.other))
    numbers = compared_frames(count, plan.file.settings.certificate.frames)
    films = [study.film(name) for name in (pair.one, pair.other)]
    folders = [frames_folder(film) for film in films]
    there = all(
        frame_file(folder, n).is_file() and layers.files_of(layers.beside(folder), n)
        for folder in folders
        for n in numbers
    )
    return _verdict(study.path, plan, pair, draw=False) if there else None


def limits_of(study: StudyFolder) -> dict[str, Any]:
    """Return the limits of numbers in a certificate."""
    return {
        **{"light": TYPICAL_LIGHT, "codes": TYPICAL_CODES, "beyond": MOST_BEYOND},
        "codec": dict(zip(_APART, codec_most(_size(study)), strict=True)),
    }


def _verdict(
    folder: Path, plan: StudyPlan, pair: StimulusPair, *, draw: bool = True
) -> PairVerdict:
    """Return what there is to say of a pair, and write its picture if that is wanted."""
    stimuli = {each.name: each for each in plan.stimuli}
    films = [film_path(folder, plan, stimuli[name]) for name in (pair.one, pair.other)]
    accounts = [read_film_account(film) for film in films]
    subject = subject_of_pair(plan.file, pair, rider=rider_in(accounts[0]))
    acts, confounds = subject.acts, tuple(subject.confounds)
    faults = account_faults(accounts[0], accounts[1], acts, pair.changed)
    verdict = PairVerdict(
        pair.factor,
        pair.levels,
        pair.one,
        pair.other,
        str(acts),
        (*(f"levels also set {each}" for each in confounds), *faults),
        tuple(named_differences(accounts[0], accounts[1], acts)),
        confounds=confounds,
        not_tested=untested(acts),
        told=len(confounds) + len(faults),
        moving=moving_otherwise(accounts[0], accounts[1], acts, pair.changed),
    )
    count = min(len(account["frames"]) for account in accounts)
    wanted = compared_frames(count, plan.file.settings.certificate.frames)
    try:
        judged, shown = _compared(verdict, films, accounts, acts=acts, numbers=wanted)
    except InputError as error:
        why = str(error).replace(f"{folder}/", "")
        return replace(verdict, faults=(*verdict.faults, f"not compared: {why}"))
    if not draw:
        return judged
    name = f"{FOLDER}/{verdict.one}--{verdict.other}.png"
    (folder / FOLDER).mkdir(exist_ok=True)
    write_png(folder / name, _picture(*shown, light=not acts.light), level=6)
    return replace(judged, picture=name)


def _compared(
    verdict: PairVerdict,
    films: Sequence[Path],
    accounts: Sequence[Mapping[str, Any]],
    *,
    acts: Acts,
    numbers: Sequence[int],
) -> tuple[PairVerdict, tuple[Comparison, Evidence, Evidence]]:
    """Return a verdict with what pixels say, and the frame that is most worth showing."""
    shown: tuple[Comparison, Evidence, Evidence] | None = None
    comparisons = []
    unlike = _unlike_views(accounts, numbers, acts)
    for number in numbers:
        one, other = (
            read_evidence(film, number, account, unexposed=acts.picture)
            for film, account in zip(films, accounts, strict=True)
        )
        check_same_size(one, other, films[1])
        comparison = compare(number, one, other, acts)
        comparisons.append(comparison)
        if shown is None or _weight(comparison) > _weight(shown[0]):
            shown = (comparison, one, other)
    assert shown is not None
    judged = pixel_verdict(comparisons, acts)
    whole = replace(
        verdict,
        faults=(*verdict.faults, *(() if unlike else judged.faults)),
        named=(*verdict.named, *judged.named),
        not_judged=(*verdict.not_judged, *unlike),
        frames=tuple(numbers),
        differing=judged.differing,
        wrong=0.0 if unlike else judged.wrong,
        light=judged.light,
        codes=judged.codes,
        lit=judged.lit,
        things=judged.things,
    )
    return whole, shown


def _unlike_views(
    accounts: Sequence[Mapping[str, Any]], numbers: Sequence[int], acts: Acts
) -> tuple[str, ...]:
    """Return why pixels are shown and not judged; nothing if they are."""
    if acts.anything:
        return ("the factor may change anything, so pixels are shown and not judged",)
    one, other = ([account["frames"][n]["camera"] for n in numbers] for account in accounts)
    if acts.camera and one != other:
        return ("it is seen from elsewhere, so pixels are shown and not judged",)
    return ()


def _weight(diff: Comparison) -> tuple[int, int]:
    """Return by how much a frame is worth showing: what is wrong, then what differs."""
    return int(diff.wrong.sum()), int((diff.shape | diff.paint | diff.light).sum())


def _picture(diff: Comparison, one: Evidence, other: Evidence, *, light: bool) -> Pixels:
    """Return two pictures and the mask of their difference side by side, (h, 3 w, 3).

    In the mask, blue is what differs, amber blocks that are lit otherwise, red what differs in
    shape or colour and should not.

    Args:
        diff: What differs.
        one: Of the first film.
        other: Of the second.
        light: Whether other light alone counts as a difference.
    """
    step = -(-one.picture.shape[1] // _WIDEST)
    first, second = (_blocks(each.picture, step).mean(axis=(1, 3)) for each in (one, other))
    mask = np.repeat(_GREY * first.mean(axis=-1, keepdims=True), 3, axis=-1)
    differs = diff.shape | diff.paint | (diff.light & light)
    lit = np.zeros_like(differs)
    if diff.blocks is not None:
        lit = spread(diff.blocks.lit, side=diff.blocks.side, shape=differs.shape)
    for where, colour in ((differs, _BLUE), (lit & differs, _AMBER), (diff.wrong, _RED)):
        # A block shows what any of its pixels does, so that nothing small gets lost.
        mask[_blocks(where, step).any(axis=(1, 3))] = colour
    return np.concatenate([first, second, mask], axis=1).round().astype(np.uint8)


def _blocks(picture: NDArray[Any], step: int) -> NDArray[Any]:
    """Return a picture in square blocks, (rows, step, columns, step, ...); a rest is cut off."""
    rows, columns = (side // step for side in picture.shape[:2])
    cut = picture[: rows * step, : columns * step]
    return cut.reshape(rows, step, columns, step, *picture.shape[2:])


def _content(
    study: StudyFolder, plan: StudyPlan, verdicts: Sequence[PairVerdict], faults: Sequence[Fault]
) -> dict[str, Any]:
    """Return what `certificate.json` holds; there is no clock in it."""
    about, factors = plan.file.settings.about, plan.file.settings.factors
    return {
        **CERTIFIED.stamp,
        "title": about.title,
        "description": about.description,
        "authors": list(about.authors),
        "date": about.date,
        "licence": about.licence,
        "versions": versions(),
        WORDED_BY: code_of("studies"),
        "passed": not faults and all(each.passed for each in verdicts),
        "links": _links(verdicts, faults),
        "factors": {
            name: {"about": factor.about, "levels": list(factor.levels)}
            for name, factor in factors.items()
        },
        "limits": limits_of(study),
        "codec": _codec(study),
        "digests": {
            RECORD: study.record[DIGEST],
            "accounts": {name: film["account"] for name, film in study.films.items()},
            "films": {film["file"]: film["sha256"] for film in study.films.values()},
            "inputs": input_files(study.path),
        },
        "pairs": [_plain(each) for each in verdicts],
    }


def _links(verdicts: Sequence[PairVerdict], faults: Sequence[Fault]) -> dict[str, Any]:
    """Return what is claimed of each link of the proof."""
    wrong = {link: [str(each) for each in faults if each.link == link] for link in CLAIMS}
    for pair in verdicts:
        wrong["inputs"] += [f"{pair}: {what}" for what in pair.faults[: pair.told]]
        wrong["pictures"] += [f"{pair}: {what}" for what in pair.faults[pair.told :]]
    claims = {link: "failed" if wrong[link] else "proven" for link in CLAIMS}
    judged = verdicts and all(each.claim != "not judged" for each in verdicts)
    if not (judged or wrong["pictures"]):
        claims["pictures"] = "not judged"
    return {
        link: {"claim": claims[link], "what": what, "faults": wrong[link]}
        for link, what in CLAIMS.items()
    }


def _size(study: StudyFolder) -> tuple[int, int]:
    """Return the size of the smallest film [px], in which single pixels count most."""
    return min((tuple(own["size"]) for own in study.accounts.values()), default=(1, 1))


def _codec(study: StudyFolder) -> dict[str, Any]:
    """Return how far codecs brought pictures from their frames: of all, the median and the most."""
    errors = [
        picture["codec_error"]
        for account in study.accounts.values()
        for film in account["delivered"].values()
        for picture in film["pictures"]
    ]
    values = np.array(errors, dtype=np.float64).reshape(-1, len(_APART))
    content: dict[str, Any] = {"pictures": len(values)}
    for name, column in zip(_APART, values.T, strict=True) if errors else ():
        content[name] = {"median": round(float(np.median(column)), 2), "most": float(column.max())}
    return content


def _plain(verdict: PairVerdict) -> dict[str, Any]:
    """Return a verdict as JSON holds it; unknown numbers are null."""
    values = {"claim": verdict.claim, "passed": verdict.passed, **asdict(verdict)}
    values["lit"] = [None if np.isnan(value) else value for value in verdict.lit]
    return {key: None if value != value else value for key, value in values.items()}
