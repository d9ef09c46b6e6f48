"""Files that published versions made are read: scene files, films, studies, plans, recordings.

`tests/make_corpus.py` made them, and nobody makes them again.
"""

from __future__ import annotations

import json
import logging
import shutil
from pathlib import Path
from typing import Any

import pytest
from make_corpus import CORPUS, named

from sumo3dviz_pt.cli import main
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.farm.plan import PLAN_FILE, read_plan
from sumo3dviz_pt.files.forms import SCHEMA_VERSION, UPDATE, Form
from sumo3dviz_pt.job.settings import SCENE_FILE
from sumo3dviz_pt.job.study import STUDY_FILE
from sumo3dviz_pt.pipeline.accounts import account_of
from sumo3dviz_pt.pipeline.films.film import prepared
from sumo3dviz_pt.pipeline.films.frames import account_in, film_of, read_account, stored_film
from sumo3dviz_pt.pipeline.films.orders import FilmOrder
from sumo3dviz_pt.pipeline.production import Request
from sumo3dviz_pt.pipeline.provenance import FILM_RECORD, differences
from sumo3dviz_pt.pipeline.scene_file import load_job
from sumo3dviz_pt.studies.certificate.links import CERTIFIED, StudyFolder, seal_faults
from sumo3dviz_pt.studies.file import load_study
from sumo3dviz_pt.studies.plan import plan_study
from sumo3dviz_pt.studies.records import STUDY_RECORD, noted_films, read_film_account

VERSIONS = sorted(path.name for path in CORPUS.iterdir())
SCENES = [path for version in VERSIONS for path in sorted((CORPUS / version).glob("scenes/*.yaml"))]
MOST = 300_000
"""Bytes of a version's corpus."""


@pytest.fixture(params=VERSIONS)
def corpus(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    """A copy of what a version made."""
    return shutil.copytree(CORPUS / request.param, tmp_path / "corpus")


def test_the_corpus_is_small_and_has_every_kind() -> None:
    for version in VERSIONS:
        files = [path for path in (CORPUS / version).rglob("*") if path.is_file()]
        assert sum(path.stat().st_size for path in files) < MOST
        parts = {path.relative_to(CORPUS / version).parts[0] for path in files}
        assert parts == {"farm", "film", "recording", "scenes", "study", "study_file", "town"}


def told_otherwise(old: Any, new: Any, path: str = "") -> list[str]:
    """Keys of which settings say something else than they did; new keys are none."""
    if isinstance(old, dict) and isinstance(new, dict):
        pairs = [(f"{path}.{key}", value, new.get(key, "gone")) for key, value in old.items()]
        return [found for key, one, other in pairs for found in told_otherwise(one, other, key)]
    return [] if old == new else [f"{path}: {old} -> {new}"]


@pytest.mark.parametrize("path", SCENES, ids=lambda path: f"{path.parts[-3]}-{path.stem}")
def test_scene_files_mean_what_they_meant(path: Path) -> None:
    job = load_job(path)
    now = named(job.model_dump(by_alias=True, mode="json"))
    assert told_otherwise(json.loads(path.with_suffix(".json").read_bytes()), now) == []


def test_a_film_s_record_frames_and_folder_are_read(corpus: Path) -> None:
    film = corpus / "film" / "film.mp4"
    frames = film.with_suffix(".frames")
    account = account_in(film)
    assert account["frame_rate"] == "10" and len(account["frames"]) == 2
    assert differences(account, account_in(film)) == []
    stored = stored_film(frames)
    assert len(stored.files) == 2 and str(stored.fps) == "10"
    assert film_of(frames)["key"] == read_account(stored.files[0])["key"]
    shutil.copytree(frames, corpus / "other.frames")
    assert main(["compare", str(frames), str(corpus / "other.frames")]) == 0


def test_frames_are_developed_again(corpus: Path) -> None:
    frames = corpus / "film" / "film.frames"
    assert main(["develop", str(frames), "-o", str(corpus / "again.mp4")]) == 0


def test_a_film_differs_from_today_s_in_nothing_but_code_and_versions(corpus: Path) -> None:
    """Keys may have come since; a version that a scene file states is no difference."""
    folder = corpus / "film"
    old, words = account_in(folder / "film.mp4"), ("our own ", "version of ", "input scene_temp")
    text = (folder / "scene.yaml").read_text(encoding="utf-8")
    for version in ("", f"{SCHEMA_VERSION}: {SCENE_FILE.version}\n"):
        (folder / "scene.yaml").write_text(version + text, encoding="utf-8")
        order = FilmOrder(folder / "film.mp4")
        made = account_of(prepared(load_job(folder / "scene.yaml"), Request(), order))
        kept = ("scene", "inputs", "versions", "package", "camera", "exposure", "preset")
        found = differences({k: old[k] for k in kept}, {k: made[k] for k in kept})
        odd = [each for each in found if not each.startswith(words)]
        assert all(each.endswith("only the second has it") for each in odd), odd
        assert SCHEMA_VERSION not in made["scene"]


def test_a_study_is_planned_as_it_was(corpus: Path) -> None:
    for file in (corpus / "study_file" / "study.yaml", corpus / "study" / "inputs" / "study.yaml"):
        plan = plan_study(load_study(file))
        record = json.loads((corpus / "study" / "study.json").read_bytes())
        assert {each.name for each in plan.stimuli} == set(record["films"])
        assert [pair.factor for pair in plan.pairs] == [p["factor"] for p in record["pairs"]]


def test_a_study_s_folder_is_proven_without_its_frames(
    corpus: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = corpus / "study"
    assert set(noted_films(folder)) == {"red", "blue"}
    assert seal_faults(StudyFolder.read(folder)) == []
    assert main(["study", "verify", str(folder), "--json", "-q"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["faults"] == [] and found["pictures"]["decoded"] == 4
    assert found["digest"] == json.loads((folder / "certificate.json").read_bytes())["digest"]
    assert main(["study", "pack", str(folder), "-o", str(corpus / "study.zip")]) == 0


def test_a_farm_s_plan_is_read(corpus: Path) -> None:
    plan = read_plan(corpus / "farm")
    assert [task.frames for task in plan.tasks] == [(0, 2), None]
    assert plan.films[0].frames == 2


def test_a_recording_is_read(corpus: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """It holds files of SUMO alone, whose form is SUMO's."""
    configuration = corpus / "recording" / "recording" / "own.sumocfg"
    assert main(["init", str(configuration), "-o", str(corpus / "scene.yaml")]) == 0
    logs = load_job(corpus / "scene.yaml").scenario
    assert [path.name for path in logs.logs] == ["fcd.xml.gz"]
    assert [path.name for path in logs.signals] == ["signals.xml.gz"]
    assert "camera driver rides with v0" in capsys.readouterr().out


# Newer versions, and older ones ----------------------------------------------------------------

KINDS: dict[str, tuple[Form, str, Any]] = {
    "scene": (SCENE_FILE, "film/scene.yaml", load_job),
    "scene behind a study": (SCENE_FILE, "study_file/scene.yaml", None),
    "study": (STUDY_FILE, "study_file/study.yaml", load_study),
    "film": (FILM_RECORD, "film/film.json", account_in),
    "note of frames": (FILM_RECORD, "film/film.frames/film.json", None),
    "film of a study": (FILM_RECORD, "study/materials/red.json", read_film_account),
    "record": (STUDY_RECORD, "study/study.json", None),
    "certificate": (CERTIFIED, "study/certificate.json", None),
    "plan": (PLAN_FILE, "farm/plan.json", None),
}
READERS = {
    "scene behind a study": lambda path: load_study(path.with_name("study.yaml")),
    "note of frames": lambda path: film_of(path.parent),
    "record": lambda path: (StudyFolder.read(path.parent), noted_films(path.parent)),
    "certificate": lambda path: StudyFolder.read(path.parent),
    "plan": lambda path: read_plan(path.parent),
}


def stamped(path: Path, version: int) -> None:
    """Let a file say a version."""
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".json":
        path.write_text(json.dumps({**json.loads(text), SCHEMA_VERSION: version}), encoding="utf-8")
    else:
        path.write_text(f"{SCHEMA_VERSION}: {version}\n{text}", encoding="utf-8")


@pytest.mark.parametrize("kind", KINDS)
def test_a_newer_file_is_refused_with_the_command_that_helps(corpus: Path, kind: str) -> None:
    form, name, reader = KINDS[kind]
    read = reader or READERS[kind]
    path = corpus / name
    read(path)
    stamped(path, form.version + 1)
    with pytest.raises(ConfigError) as caught:
        read(path)
    said = str(caught.value)
    assert path.name in said and f"a {form.name} of version {form.version + 1}" in said
    assert said.endswith(UPDATE) and "\n" not in said


def test_films_of_a_newer_version_are_not_rendered_over(
    corpus: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """They look like another film's; --resume would replace them."""
    folder = corpus / "film"
    stamped(folder / "film.frames" / "film.json", FILM_RECORD.version + 1)
    before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    words = ["render", str(folder / "scene.yaml"), "-o", str(folder / "film.mp4")]
    assert main([*words, "--resume", "--frames", "0:1"]) == 2
    assert "update the package" in capsys.readouterr().err
    assert {path: path.read_bytes() for path in before} == before


def test_records_that_tell_the_rate_by_fps_alone_are_read_with_a_note(
    corpus: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """So did the first versions of this code; a ratio such as 30000/1001 came later."""
    film = corpus / "film" / "film.mp4"
    for path in (film.with_suffix(".json"), film.with_suffix(".frames") / "film.json"):
        account = json.loads(path.read_bytes())
        for part in (account, account["shot"]):
            part.pop("frame_rate", None)
        path.write_text(json.dumps(account), encoding="utf-8")
    with caplog.at_level(logging.WARNING):
        assert read_film_account(film)["frame_rate"] == "10.0"
    (note,) = {record.message.partition(": ")[2] for record in caplog.records}
    assert note == "an older version wrote it: its frame rate is told by fps alone"
    assert float(stored_film(film.with_suffix(".frames")).fps or 0) == 10.0
