"""An app for oTree: its page, its table of playlists, the code that ties them together, and bots.

References:
    D. L. Chen, M. Schonger, C. Wickens (2016): oTree, Journal of Behavioral and Experimental
    Finance 9, 88-97; doi:10.1016/j.jbef.2015.12.001
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from pathlib import Path, PurePosixPath

from sumo3dviz_pt.experiments.tools.content import StudyContent, letter
from sumo3dviz_pt.experiments.tools.online import survey_script
from sumo3dviz_pt.experiments.tools.rows import Record, playlist_rows, write_table
from sumo3dviz_pt.files.whole import write_whole

_PAGES = Path(__file__).with_name("page")
_STATIC = "films"


def write_otree(folder: Path, content: StudyContent) -> list[Path]:
    """Write the app `otree/films`; without an address, films are the project's static files."""
    here = folder / "otree" / "films"
    here.mkdir(parents=True, exist_ok=True)
    columns = _columns(content)
    rows = (_placed(content, row, columns) for row in playlist_rows(content))
    table = write_table(here / "playlists.csv", rows)
    texts = {
        "__init__.py": (_PAGES / "otree_app.txt").read_text(encoding="utf-8"),
        "tests.py": (_PAGES / "otree_bots.txt").read_text(encoding="utf-8"),
        "Trial.html": _page(content),
        "study.json": json.dumps(_study(content), indent=1, ensure_ascii=False) + "\n",
    }
    for name, text in texts.items():
        write_whole(here / name, text)
    return [table, *(here / name for name in texts)]


def _page(content: StudyContent) -> str:
    """Return the page of a trial; oTree would take double braces for its own."""
    script = re.sub(r"(?<=[{}])(?=[{}])", " ", survey_script(content, None))
    page = (_PAGES / "otree_trial.html").read_text(encoding="utf-8")
    return page.replace("SCRIPT", script)


def _columns(content: StudyContent) -> list[str]:
    """Return the columns that hold films."""
    count = content.most_alternatives
    return ["film"] if count == 1 else [f"film_{place}" for place in range(1, count + 1)]


def _placed(content: StudyContent, row: Record, columns: Sequence[str]) -> Record:
    """Return a row in which films stand by where oTree finds them."""
    found = dict(row)
    for column in columns:
        file = str(found[column])
        static = f"{_STATIC}/{PurePosixPath(file).name}"
        found[column] = "" if not file else f"{content.url}{file}" if content.url else static
    return found


def _study(content: StudyContent) -> Mapping[str, object]:
    """Return the words of the page, and how the table is to be read."""
    words = content.words
    return {
        "question": words.question,
        "choice": words.choice,
        "answers": list(words.answers),
        "low": words.low,
        "high": words.high,
        "none": words.none,
        "letters": [letter(place) for place in range(content.most_alternatives)],
        "film_columns": _columns(content),
        "told": {name: content.factors[name] or name for name in content.told},
        "online": content.url is not None,
    }
