"""Conditions files for PsychoPy and Pavlovia: a row for each trial.

References:
    PsychoPy manual, "Loops": names of columns become variables: unique, letters, digits and _,
    no digit first. Paths are relative to the experiment's own file.
"""

from __future__ import annotations

from itertools import groupby
from pathlib import Path

from sumo3dviz_pt.experiments.tools.content import StudyContent
from sumo3dviz_pt.experiments.tools.rows import playlist_rows, wide_rows, write_table


def write_psychopy(folder: Path, content: StudyContent) -> list[Path]:
    """Write a conditions file of all trials, and one for each playlist, in its order.

    The experiment's file (.psyexp) is to lie in the study's folder; loops take the playlists with
    the loop type `sequential`.
    """
    here = folder / "psychopy"
    files = [write_table(here / "conditions.csv", wide_rows(content))]
    for name, rows in groupby(playlist_rows(content), key=lambda row: row["playlist"]):
        files.append(write_table(here / f"playlist_{name}.csv", rows))
    return files
