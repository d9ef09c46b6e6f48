"""Conditions files for PsychoPy and Pavlovia: a row for each trial.

References:
    PsychoPy manual, "Loops": names of columns become variables: unique, letters, digits and _,
    no digit first. Paths are relative to the experiment's own file.
"""

from __future__ import annotations

from pathlib import Path

from sumo3dviz_pt.experiments.tools.content import StudyContent
from sumo3dviz_pt.experiments.tools.rows import playlist_rows, wide_row, write_table


def write_psychopy(folder: Path, content: StudyContent) -> list[Path]:
    """Write a conditions file of all trials, and one for each playlist, in its order.

    The experiment's file (.psyexp) is to lie in the study's folder; loops take the playlists with
    the loop type `sequential`.
    """
    here = folder / "psychopy"
    every = [wide_row(content, trial) for trial in content.trials]
    files = [write_table(here / "conditions.csv", every)]
    rows = list(playlist_rows(content))
    for playlist in content.playlists:
        own = [row for row in rows if row["playlist"] == playlist.name]
        files.append(write_table(here / f"playlist_{playlist.name}.csv", own))
    return files
