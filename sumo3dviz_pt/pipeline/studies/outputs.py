"""Writes what goes with the finished films of a study: tables, tools' files, digests."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType

from sumo3dviz_pt.experiments.tools.build import ONLINE, write_tools
from sumo3dviz_pt.experiments.tools.content import Clip, Screen, StudyContent
from sumo3dviz_pt.experiments.tools.papers import (
    CHECKSUMS,
    digest_of,
    read_digests,
    write_checksums,
    write_citation,
    write_inputs,
)
from sumo3dviz_pt.experiments.tools.sheets import write_sheet
from sumo3dviz_pt.job.study import StudySettings
from sumo3dviz_pt.pipeline.accounts.provenance import versions
from sumo3dviz_pt.pipeline.films.frames import account_file
from sumo3dviz_pt.pipeline.overlays.files import extra_files
from sumo3dviz_pt.pipeline.sound import sound_folder
from sumo3dviz_pt.pipeline.studies.calibration import write_calibration
from sumo3dviz_pt.pipeline.studies.cards import write_cards
from sumo3dviz_pt.pipeline.studies.inputs import FOLDER
from sumo3dviz_pt.pipeline.studies.patches import told_only
from sumo3dviz_pt.pipeline.studies.plan import StudyPlan
from sumo3dviz_pt.pipeline.studies.records import (
    MATERIALS,
    FilmRecord,
    film_path,
)
from sumo3dviz_pt.pipeline.studies.sessions import session_of, texts_of, words_of
from sumo3dviz_pt.pipeline.studies.stimuli import Stimulus
from sumo3dviz_pt.pipeline.studies.thumbnails import FOLDER as THUMBNAILS
from sumo3dviz_pt.pipeline.studies.thumbnails import write_thumbnails

log = logging.getLogger(__name__)


def cards_of(folder: Path, plan: StudyPlan, films: Mapping[str, FilmRecord]) -> Mapping[str, str]:
    """Write the choice cards of a study, if it wants any; return their files by trial.

    Args:
        folder: The study's.
        plan: What its films show.
        films: All of them, finished.
    """
    wanted = plan.file.settings.tools.cards
    return write_cards(folder, content_of(plan, films)) if wanted else {}


def write_outputs(
    folder: Path,
    plan: StudyPlan,
    films: Mapping[str, FilmRecord],
    *,
    cards: Mapping[str, str] = MappingProxyType({}),
    also: Sequence[Path] = (),
    seal: Callable[[Sequence[Path]], None] | None = None,
) -> list[Path]:
    """Write all files that go with films; files of an earlier run that are no more are removed.

    Args:
        folder: The study's.
        plan: What its films show.
        films: All of them, finished.
        cards: Its choice cards, as `cards_of` wrote them.
        also: Further files that count among its outputs.
        seal: Is called with all files before their digests are written, and may change some.

    Returns:
        All files of the study.
    """
    before = read_digests(folder / CHECKSUMS)
    content = replace(content_of(plan, films), cards=cards)
    files = [*also, *_film_files(folder, plan)]
    files += [folder / card for card in content.cards.values()]
    files += write_thumbnails(folder, content.films)
    pictures = {clip.name: f"{THUMBNAILS}/{clip.name}.png" for clip in content.films}
    files.append(write_sheet(folder, content, pictures))
    files += write_tools(folder, content, plan.file.settings.tools.write)
    files += write_calibration(folder, plan.file.settings.calibration, plan.stimuli[0].job.output)
    files.append(write_citation(folder, content.words, version=versions()["sumo3dviz_pt"]))
    files.append(
        write_inputs(folder, [path for path in also if path.is_relative_to(folder / FOLDER)])
    )
    if content.url is None and ONLINE & set(plan.file.settings.tools.write):
        log.info("files of LimeSurvey and Qualtrics need tools.url, where the films lie online")
    if seal is not None:
        seal(files)
    files.append(write_checksums(folder, files))
    _remove_stale(folder, before, files)
    return files


def content_of(plan: StudyPlan, films: Mapping[str, FilmRecord]) -> StudyContent:
    """Return what the files of tools are made from.

    Args:
        plan: The study's.
        films: All of them, finished.
    """
    settings = plan.file.settings
    url = settings.tools.url
    clips = {
        stimulus.name: _clip(plan, films[stimulus.name], stimulus) for stimulus in plan.stimuli
    }
    shown = sorted(plan.profiles, key=plan.place)
    return StudyContent(
        factors={name: factor.about for name, factor in settings.factors.items()},
        levels=plan.file.levels,
        clips={profile: clips[plan.films[profile].name] for profile in shown},
        trials=plan.trials,
        playlists=plan.playlists,
        words=words_of(settings),
        url=None if url is None else f"{url.rstrip('/')}/",
        jspsych=settings.tools.jspsych,
        notes=plan.notes,
        screen=_screen(settings),
        session=session_of(settings, plan.file.path.parent),
        ranks=plan.file.ranks,
        told=tuple(name for name in settings.factors if told_only(plan.file, name)),
    )


def _clip(plan: StudyPlan, film: FilmRecord, stimulus: Stimulus) -> Clip:
    """Return a film as tools know it."""
    name = stimulus.name
    file = f"{MATERIALS}/{name}{plan.file.settings.film}"
    return Clip(
        name,
        stimulus.code,
        file,
        film.duration,
        film.size,
        film.rate,
        film.sha256,
        film.fov,
    )


def _screen(settings: StudySettings) -> Screen | None:
    """Return how films get their right size."""
    wanted = settings.tools.screen
    if wanted is None:
        return None
    said = wanted.instruction or texts_of(settings).page["screen"]
    return Screen(wanted.distance, wanted.pixels_per_cm, said)


def _film_files(folder: Path, plan: StudyPlan) -> list[Path]:
    """Return the films and all that lies beside them, but for their frames."""
    found: list[Path] = []
    for stimulus in plan.stimuli:
        path = film_path(folder, plan, stimulus)
        found += [path, account_file(path), *extra_files(path, stimulus.job.overlays)]
        if stimulus.job.output.sound is not None:
            found += sorted(sound_folder(path).iterdir())
    return found


def _remove_stale(folder: Path, before: Mapping[str, str], files: Sequence[Path]) -> None:
    """Remove what an earlier run wrote, this one did not and nobody changed; films stay."""
    now = {file.relative_to(folder).as_posix() for file in files}
    for name, digest in before.items():
        path = folder / name
        inside = path.resolve().is_relative_to(folder.resolve())
        if name in now or not inside or not path.is_file():
            continue
        if name.startswith(f"{MATERIALS}/"):
            if path.suffix != ".json":
                log.warning("%s: the study shows this film no longer; it is kept", path)
        elif digest_of(path) == digest:
            path.unlink()
