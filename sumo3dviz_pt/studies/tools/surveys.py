"""Files of survey tools (LimeSurvey, Qualtrics, oTree, PsychoPy), and the writers of all tools.

Surveys of LimeSurvey and Qualtrics show films from an address. Each person sees one playlist. A
survey has a question for each place in it, whose text holds the number of that place; a script from
the study's address, `survey.js`, shows the films there, one after the other, and opens the answers
when they have ended.

An app for oTree is its page, its table of playlists, the code that ties them together, and bots.
PsychoPy and Pavlovia get conditions files with a row for each trial. `write_tools` writes the files
of all tools that are asked for.

References:
    LimeSurvey manual, "Tab Separated Value survey structure": classes S, SL, G, Q and A; a row's
    parents are the rows above it; UTF-8 with a byte-order mark
    Qualtrics, "Import and export surveys": advanced format of text files; [[ED:name]] is embedded
    data, which the address of a survey may set
    D. L. Chen, M. Schonger, C. Wickens (2016): oTree, Journal of Behavioral and Experimental
    Finance 9, 88-97; doi:10.1016/j.jbef.2015.12.001
    PsychoPy manual, "Loops": names of columns become variables: unique, letters, digits and _,
    no digit first. Paths are relative to the experiment's own file.
"""

from __future__ import annotations

import hashlib
import html
import json
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import groupby
from pathlib import Path, PurePosixPath

from sumo3dviz_pt.files.atomic import write_atomically
from sumo3dviz_pt.studies.designs.trials import Trial
from sumo3dviz_pt.studies.tools.content import (
    WRITERS,
    Record,
    StudyContent,
    StudySession,
    letter,
    playlist_rows,
    wide_rows,
    write_table,
    writes,
)
from sumo3dviz_pt.studies.tools.datasets import write_data
from sumo3dviz_pt.studies.tools.pages import own_texts

_COLUMNS = (
    *("id", "related_id", "class", "type/scale", "name", "relevance", "text", "help", "language"),
    *("validation", "mandatory", "encrypted", "other", "default", "same_default", "same_script"),
)
"""LimeSurvey's columns, in the order in which it exports them; empty cells are its defaults."""

_LIST, _EQUATION = "L", "*"
"""LimeSurvey's types of questions: a list of radio buttons, and a value that is computed."""

SCRIPT = "survey.js"


def write_survey_script(folder: Path, content: StudyContent) -> Path:
    """Write `survey.js`, which shows the films of a playlist within a survey."""
    playlists = {
        playlist.name: [_films(content, trial) for trial in playlist.trials]
        for playlist in content.playlists
    }
    write_atomically(folder / SCRIPT, survey_script(content, playlists))
    return folder / SCRIPT


def survey_script(content: StudyContent, playlists: Mapping[str, object] | None) -> str:
    """Return the script that plays the films of a trial before it is answered.

    Args:
        content: The study.
        playlists: Films of each trial by playlist; None leaves them to links on the page.
    """
    texts = (content.session or StudySession(own_texts()["en"]["page"])).texts
    study = {
        "digest": hashlib.sha256(json.dumps(playlists).encode()).hexdigest()[:16],
        "words": {key: texts[key] for key in ("problem", "retry", "skip", "play")},
        "playlists": playlists,
        **({"heard": True} if any(clip.heard for clip in content.films) else {}),
    }
    known = json.dumps(study, ensure_ascii=False).replace("<", "\\u003c")
    source = Path(__file__).with_name("page") / SCRIPT
    return f"const STUDY = {known};\n{source.read_text(encoding='utf-8')}"


def _films(content: StudyContent, trial: Trial) -> list[Mapping[str, str]]:
    """Return the films of a trial: address, letter, and what people read beside it."""
    several = len(trial.alternatives) > 1
    return [
        {
            "address": "" if profile is None else f"{content.url}{content.clips[profile].file}",
            "letter": letter(place) if several else "",
            "told": content.words.none if profile is None else content.told_words(profile),
        }
        for place, profile in enumerate(trial.alternatives)
    ]


def question(content: StudyContent, position: int, playlist: str) -> str:
    """Return the question at a place of the playlist in HTML, in one line.

    Args:
        content: The study.
        position: Place in the playlist, from 1.
        playlist: The survey's own word for the variable that holds its name.
    """
    words = content.words
    several = content.most_alternatives > 1
    label = words.choice if several else f"{words.question} ({words.low} ... {words.high})"
    source = html.escape(f"{content.url}{SCRIPT}", quote=True)
    return (
        f'<div class="films" data-playlist="{playlist}" data-position="{position}">'
        "The films need a script that this survey does not let through.</div>"
        f'<p>{html.escape(label)}</p><script src="{source}"></script>'
    )


def _answers(content: StudyContent) -> list[str]:
    """Return the answers of all questions; where tasks differ, those that letters name."""
    if content.most_alternatives == 1:
        return list(content.words.answers)
    labels = {
        tuple(
            content.words.none if profile is None else letter(place)
            for place, profile in enumerate(trial.alternatives)
        )
        for trial in content.trials
    }
    if len(labels) == 1:
        return list(labels.pop())
    return [letter(place) for place in range(content.most_alternatives)]


def _longest(content: StudyContent) -> int:
    """Return the most trials that a playlist has."""
    return max(len(playlist.trials) for playlist in content.playlists)


# LimeSurvey --------------------------------------------------------------------------------


@writes("limesurvey", online=True)
def write_limesurvey(folder: Path, content: StudyContent) -> list[Path]:
    """Write `limesurvey.txt`, a whole survey to import, and the script that it loads."""
    rows: list[Record] = [dict.fromkeys(_COLUMNS, "") | row for row in _survey(content)]
    path = write_table(folder / "limesurvey.txt", rows, separator="\t", mark="\ufeff")
    return [path, write_survey_script(folder, content)]


def _survey(content: StudyContent) -> Iterator[dict[str, str]]:
    """Yield the rows of a survey: settings, the playlist, then a group for each place in it."""
    language = content.words.language.partition("-")[0]
    yield {"class": "S", "name": "language", "text": language}
    yield {"class": "S", "name": "format", "text": "G"}  # a group is a page
    yield {
        "class": "SL",
        "name": "surveyls_title",
        "text": content.words.title.replace("{", "{ "),
        "language": language,
    }
    yield _group(1, "Playlist", language)
    drawn = f"{{if(is_empty(playlist), rand(1, {len(content.playlists)}), playlist)}}"
    yield _row(_EQUATION, "playlist", drawn, language) | {"mandatory": "N"}
    for position in range(1, _longest(content) + 1):
        group = _group(position + 1, f"Trial {position}", language)
        yield group | _only_for(content, position)
        text = _verbatim(question(content, position, "PLAYLIST")).replace("PLAYLIST", "{playlist}")
        yield _row(_LIST, f"q{position}", text, language)
        for code, answer in enumerate(_answers(content), start=1):
            yield {
                "class": "A",
                "type/scale": "0",
                "name": f"A{code}",
                "text": _verbatim(html.escape(answer, quote=False)),
                "language": language,
            }


def _verbatim(text: str) -> str:
    """Return HTML in which braces are braces; LimeSurvey would compute what stands in them.

    What a spreadsheet would compute begins with a character by its number, so that no apostrophe
    comes before an answer that people read.
    """
    text = text.replace("{", "&#123;").replace("}", "&#125;")
    return f"&#{ord(text[0])};{text[1:]}" if text[:1] in ("=", "+", "-", "@") else text


def _group(number: int, name: str, language: str) -> dict[str, str]:
    """Return the row of a group."""
    return {"class": "G", "type/scale": str(number), "name": name, "language": language}


def _row(kind: str, name: str, text: str, language: str) -> dict[str, str]:
    """Return the row of a question."""
    return {
        "class": "Q",
        "type/scale": kind,
        "name": name,
        "relevance": "1",
        "text": text,
        "language": language,
        "mandatory": "Y",
        "other": "N",
    }


def _only_for(content: StudyContent, position: int) -> dict[str, str]:
    """Return the condition under which a place is shown: playlists may differ in length."""
    long = [len(playlist.trials) >= position for playlist in content.playlists]
    if all(long):
        return {}
    runs = groupby(enumerate(long, start=1), key=lambda each: each[1])
    spans = [[number for number, _ in run] for is_long, run in runs if is_long]
    words = [f"(playlist >= {span[0]} and playlist <= {span[-1]})" for span in spans]
    return {"relevance": " or ".join(words)}


# Qualtrics ---------------------------------------------------------------------------------


@writes("qualtrics", online=True)
def write_qualtrics(folder: Path, content: StudyContent) -> list[Path]:
    """Write `qualtrics.txt`, a survey to import, and the script that it loads."""
    text = folder / "qualtrics.txt"
    write_atomically(text, "\n".join(_lines(content)) + "\n")
    return [text, write_survey_script(folder, content)]


def _lines(content: StudyContent) -> Iterator[str]:
    """Yield the lines of a survey: what the address may set, then a page for each place."""
    yield from ("[[AdvancedFormat]]", "", "[[ED:participant]]", "[[ED:playlist]]", "")
    yield from ("[[Block:Films]]", "")
    for position in range(1, _longest(content) + 1):
        if position > 1:
            yield from ("[[PageBreak]]", "")
        yield from (
            "[[Question:MC:SingleAnswer:Horizontal]]",
            f"[[ID:q{position}]]",
            question(content, position, "${e://Field/playlist}"),
            "",
            "[[Choices]]",
            *(html.escape(answer, quote=False) for answer in _answers(content)),
            "",
        )


_PAGES = Path(__file__).with_name("page")
_STATIC = "films"


@writes("otree")
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
        write_atomically(here / name, text)
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
    placed = dict(row)
    for column in columns:
        file = str(placed[column])
        static = f"{_STATIC}/{PurePosixPath(file).name}"
        placed[column] = "" if not file else f"{content.url}{file}" if content.url else static
    return placed


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


@writes("psychopy")
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


def write_tools(folder: Path, content: StudyContent, tools: Iterable[str]) -> list[Path]:
    """Write the tables of a study and the files of some tools; return all files.

    Args:
        folder: The study's, with its films.
        content: What the files are made from.
        tools: Names from `WRITERS`; those that need an address are left out where none is known.
    """
    files = write_data(folder, content)
    for tool in tools:
        writer = WRITERS[tool]
        if content.url is not None or not writer.online:
            files += writer.write(folder, content)
    return list(dict.fromkeys(files))
