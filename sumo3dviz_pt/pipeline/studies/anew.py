"""Says why films that lie in a study's folder would be made anew."""

from __future__ import annotations

from pathlib import Path

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.pipeline.accounts.differences import differences
from sumo3dviz_pt.pipeline.accounts.provenance import (
    inputs_of,
    package_hashes,
    versions,
    with_files,
)
from sumo3dviz_pt.pipeline.reading import scenario_files
from sumo3dviz_pt.pipeline.studies.plan import StudyPlan
from sumo3dviz_pt.pipeline.studies.records import (
    film_path,
    finished_films,
    lacking_layers,
    noted_films,
    read_film_account,
)
from sumo3dviz_pt.pipeline.studies.stimuli import Stimulus

_MOST = 3
"""More reasons are counted."""

_COMPARED = ("scene", "inputs", "versions", "package")


def why_anew(folder: Path, plan: StudyPlan, *, variant: str) -> dict[str, str]:
    """Return why films that are there do not count, by their names.

    Args:
        folder: The study's; it need not exist.
        plan: What is wanted.
        variant: The renderer's.
    """
    done = finished_films(folder, plan, variant=variant)
    known, lacking = noted_films(folder), lacking_layers(folder, plan, variant=variant)
    found = {}
    for stimulus in plan.stimuli:
        path, record = film_path(folder, plan, stimulus), known.get(stimulus.name)
        if stimulus.name in done or not (path.is_file() or record):
            continue
        if not path.is_file():
            found[stimulus.name] = f"{path} is gone"
        elif record is None:
            found[stimulus.name] = "no record says what it was made from"
        elif record.variant != variant:
            found[stimulus.name] = f"it was made with the variant {record.variant}"
        elif record.digest != stimulus.digest:
            found[stimulus.name] = _changes(path, stimulus)
        elif stimulus.name in lacking:
            found[stimulus.name] = f"it lacks the layers {', '.join(lacking[stimulus.name])}"
        else:
            found[stimulus.name] = "the film or its account was changed since"
    return found


def _changes(path: Path, stimulus: Stimulus) -> str:
    """Return what a film was made from otherwise than it would be now."""
    try:
        account = read_film_account(path)
    except InputError as error:
        return str(error)
    job = stimulus.job
    inputs = inputs_of(job, scenario_files(job), camera=stimulus.shot.camera)
    now = {
        "scene": with_files(job.model_dump(by_alias=True), inputs.name),
        "inputs": dict(inputs.hashes),
        "versions": versions(),
        "package": package_hashes(),
    }
    changes = differences({key: account.get(key) for key in _COMPARED}, now)
    more = f" and {len(changes) - _MOST} more" if len(changes) > _MOST else ""
    return ", ".join(changes[:_MOST]) + more or "it is made from something else now"
