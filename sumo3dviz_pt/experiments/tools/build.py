"""Writes the files of all tools that are asked for."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from types import MappingProxyType

from sumo3dviz_pt.experiments.tools.bids import write_bids
from sumo3dviz_pt.experiments.tools.content import StudyContent
from sumo3dviz_pt.experiments.tools.jspsych import write_jspsych
from sumo3dviz_pt.experiments.tools.online import write_limesurvey, write_qualtrics
from sumo3dviz_pt.experiments.tools.otree import write_otree
from sumo3dviz_pt.experiments.tools.psychds import write_data, write_psychds
from sumo3dviz_pt.experiments.tools.psychopy import write_psychopy

Writer = Callable[[Path, StudyContent], list[Path]]

WRITERS: Mapping[str, Writer] = MappingProxyType(
    {
        "jspsych": write_jspsych,
        "psychopy": write_psychopy,
        "psychds": write_psychds,
        "bids": write_bids,
        "limesurvey": write_limesurvey,
        "qualtrics": write_qualtrics,
        "otree": write_otree,
    }
)
"""Writers by the tools' names in study files."""

ONLINE = frozenset({"limesurvey", "qualtrics"})
"""Tools that can only show films from an address."""


def write_tools(folder: Path, content: StudyContent, tools: Iterable[str]) -> list[Path]:
    """Write the tables of a study and the files of some tools; return all files.

    Args:
        folder: The study's, with its films.
        content: What the files are made from.
        tools: Names from `WRITERS`; those that need an address are left out where none is known.
    """
    files = write_data(folder, content)
    for tool in tools:
        if content.url is not None or tool not in ONLINE:
            files += WRITERS[tool](folder, content)
    return list(dict.fromkeys(files))
