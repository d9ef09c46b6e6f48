"""A folder `stimuli` for BIDS, by a draft (BEP044) that may still change.

References:
    BIDS 1.10: `stim_file` in events.tsv is relative to /stimuli
    BEP044, draft of 2026: https://github.com/bids-standard/bids-specification/pull/2022
"""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Mapping
from pathlib import Path

from sumo3dviz_pt.experiments.tools.content import Clip, StudyContent
from sumo3dviz_pt.experiments.tools.rows import MEANINGS, Record, write_table
from sumo3dviz_pt.files.whole import write_whole

_DRAFT = "BEP044 (draft of 2026); released BIDS only knows stim_file in events.tsv"
_ABSENT = "n/a"


def write_bids(folder: Path, content: StudyContent) -> list[Path]:
    """Write `bids/stimuli`: films under the names of the draft, stimuli.tsv and stimuli.json.

    Films are hard links where the file system has them, and copies elsewhere.
    """
    here = folder / "bids" / "stimuli"
    here.mkdir(parents=True, exist_ok=True)
    films = [_linked(folder / clip.file, here / _film(clip)) for clip in content.films]
    rows = [_row(content, clip) for clip in content.films]
    table = write_table(here / "stimuli.tsv", rows, separator="\t")
    write_whole(here / "stimuli.json", json.dumps(_columns(content), indent=1) + "\n")
    return [*films, table, here / "stimuli.json"]


def _film(clip: Clip) -> str:
    """Return a film's name: labels have letters and digits only."""
    return f"stim-{clip.code}_video{Path(clip.file).suffix}"


def _row(content: StudyContent, clip: Clip) -> Record:
    """Return what is said about a film; levels are those of all profiles that it stands for."""
    profiles = [profile for profile, film in content.clips.items() if film == clip]
    levels = {
        factor: "|".join(dict.fromkeys(profile[place] for profile in profiles))
        for place, factor in enumerate(content.factors)
    }
    address = f"{content.url}{clip.file}" if content.url else _ABSENT
    return {
        "stim_id": f"stim-{clip.code}",
        "type": "video",
        "URL": address,
        "license": content.words.licence or _ABSENT,
        "copyright": ", ".join(content.words.authors) or _ABSENT,
        "description": clip.name,
        "present": "true",
        "stim_file": _film(clip),
        "duration": clip.duration,
        **levels,
    }


def _columns(content: StudyContent) -> Mapping[str, object]:
    """Return what the columns mean."""
    factors = {
        factor: {
            "Description": about or "factor of the design",
            "Levels": {level: level for level in content.levels[factor]},
        }
        for factor, about in content.factors.items()
    }
    return {
        "stim_id": {"Description": f"identifier of the film for events.tsv; {_DRAFT}"},
        "stim_file": {"Description": "file, relative to this folder, as stim_file in events.tsv"},
        "duration": {"Description": MEANINGS["duration"], "Units": "s"},
        **factors,
    }


def _linked(film: Path, place: Path) -> Path:
    """Put a film at another place."""
    place.unlink(missing_ok=True)
    try:
        os.link(film, place)
    except OSError:
        shutil.copyfile(film, place)
    return place
