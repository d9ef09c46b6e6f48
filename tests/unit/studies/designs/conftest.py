"""A small study with films, for the files of tools."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from sumo3dviz_pt.studies.designs.trials import Trial, build_playlists, profiles_of, single_trials
from sumo3dviz_pt.studies.tools.content import Clip, StudyContent, Words
from sumo3dviz_pt.studies.tools.datasets import digest_of
from sumo3dviz_pt.video import encode

WORDS = Words(
    question='Is "this" <safe> & sound?',
    choice="Which one?",
    answers=("1", "2", "3"),
    low="not at all",
    high="very",
    none="None of these",
    language="en",
    title="Gaps & lights: </script> {study}",
    description='Films, "quoted".',
    authors=("Ada Lovelace", "Lab"),
    licence="CC-BY-4.0",
    keywords=("gaps",),
)
FACTORS = {"light": "time of day", "gap": ""}
LEVELS = {"light": ("day", "night"), "gap": ("1.5", "3")}
PROFILES = tuple((light, gap) for light in LEVELS["light"] for gap in LEVELS["gap"])


def film(folder: Path, name: str, shade: int) -> Clip:
    (folder / "materials").mkdir(exist_ok=True)
    path = folder / "materials" / f"{name}.mp4"
    frames = [np.full((36, 64, 3), shade, np.uint8)] * 5
    encode(frames, path, size=(64, 36), fps=25)
    return Clip(
        name, f"s{shade:03d}", f"materials/{name}.mp4", 0.2, (64, 36), "25", digest_of(path)
    )


def content_of(folder: Path, trials: tuple[Trial, ...], **more: object) -> StudyContent:
    clips = {
        profile: film(folder, "_".join(profile), 40 + 30 * place)
        for place, profile in enumerate(profiles_of(trials))
    }
    playlists = build_playlists(trials, order="latin", count=None, parts=1, repeat=1, seed=0)
    return StudyContent(FACTORS, LEVELS, clips, trials, playlists, WORDS, **more)


@pytest.fixture
def ratings(tmp_path: Path) -> StudyContent:
    """Four films, each rated by itself."""
    return content_of(tmp_path, single_trials(PROFILES))


@pytest.fixture
def choices(tmp_path: Path) -> StudyContent:
    """Two blocks of two choices between two films or nothing."""
    day, late, night, last = PROFILES
    trials = (
        Trial("1", "1", (day, night, None)),
        Trial("1", "2", (late, last, None)),
        Trial("2", "1", (last, day, None)),
        Trial("2", "2", (night, late, None)),
    )
    return content_of(tmp_path, trials, url="https://example.org/study/")
