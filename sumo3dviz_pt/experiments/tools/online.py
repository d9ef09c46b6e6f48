"""Surveys that show films from an address: LimeSurvey and Qualtrics.

References:
    LimeSurvey manual, "Tab Separated Value survey structure": classes S, SL, G, Q and A; a row's
    parents are the rows above it; UTF-8 with a byte-order mark
    Qualtrics, "Import and export surveys": advanced format of text files; "Loop & Merge"
"""

from __future__ import annotations

import html
from collections.abc import Iterator
from pathlib import Path

from sumo3dviz_pt.experiments.tools.content import StudyContent, letter, trial_name
from sumo3dviz_pt.experiments.tools.rows import Record, table_text, wide_row, write_table
from sumo3dviz_pt.experiments.trials import Profile, Trial
from sumo3dviz_pt.files.whole import write_whole

_COLUMNS = (
    *("id", "related_id", "class", "type/scale", "name", "relevance", "text", "help", "language"),
    *("validation", "mandatory", "encrypted", "other", "default", "same_default", "same_script"),
)
"""LimeSurvey's columns, in the order in which it exports them; empty cells are its defaults."""

_LIST, _EQUATION = "L", "*"
"""LimeSurvey's types of questions: a list of radio buttons, and a value that is computed."""


def film_address(content: StudyContent, profile: Profile) -> str:
    """Return where a film lies online."""
    assert content.url is not None
    return f"{content.url}{content.clips[profile].file}"


def _player(address: str, title: str, told: str) -> str:
    """Return a film in HTML; it plays by itself, without sound and controls."""
    shown = f'<p style="font-size: 1.5em">{html.escape(title)}</p>' if title else ""
    below = f"<p>{html.escape(told)}</p>" if told else ""
    source = html.escape(address, quote=True)
    return (
        f'{shown}<video src="{source}" autoplay="autoplay" muted="muted" playsinline="playsinline"'
        f' preload="auto" style="max-width: 100%"></video>{below}'
    )


def _shown(content: StudyContent, trial: Trial) -> str:
    """Return the films of a trial and its question in HTML, in one line."""
    several = len(trial.alternatives) > 1
    players = [
        _player(
            film_address(content, profile),
            letter(place) if several else "",
            content.told_words(profile),
        )
        for place, profile in enumerate(trial.alternatives)
        if profile is not None
    ]
    words = content.words
    asked = words.choice if several else words.question
    ends = "" if several else f" ({words.low} ... {words.high})"
    return f"{''.join(players)}<p>{html.escape(asked + ends)}</p>"


def _answers(content: StudyContent, trial: Trial) -> list[str]:
    """Return the answers of a trial."""
    if len(trial.alternatives) == 1:
        return list(content.words.answers)
    return [
        content.words.none if profile is None else letter(place)
        for place, profile in enumerate(trial.alternatives)
    ]


# LimeSurvey --------------------------------------------------------------------------------


def write_limesurvey(folder: Path, content: StudyContent) -> list[Path]:
    """Write `limesurvey.txt`, a whole survey to import; with several blocks, chance chooses one."""
    path = folder / "limesurvey.txt"
    rows: list[Record] = [dict.fromkeys(_COLUMNS, "") | row for row in _survey(content)]
    write_whole(path, "\ufeff" + table_text(rows, separator="\t"))
    return [path]


def _survey(content: StudyContent) -> Iterator[dict[str, str]]:
    """Yield the rows of a survey: settings, then a group with one question for each trial."""
    language = content.words.language.partition("-")[0]
    yield {"class": "S", "name": "language", "text": language}
    yield {"class": "S", "name": "format", "text": "G"}  # a group is a page
    yield {
        "class": "SL",
        "name": "surveyls_title",
        "text": content.words.title.replace("{", "{ "),
        "language": language,
    }
    blocks = list(dict.fromkeys(trial.block for trial in content.trials))
    number = 0
    if len(blocks) > 1:
        number += 1
        yield _group(number, "Block", language)
        drawn = f"{{if(is_empty(block), rand(1, {len(blocks)}), block)}}"
        yield _question(_EQUATION, "block", drawn, language) | {"mandatory": "N"}
    for place, trial in enumerate(content.trials, start=1):
        number += 1
        yield _group(number, f"Trial {place}", language) | _only_for(blocks, trial.block)
        yield _question(_LIST, f"q{place}", _verbatim(_shown(content, trial)), language)
        for code, answer in enumerate(_answers(content, trial), start=1):
            yield {
                "class": "A",
                "type/scale": "0",
                "name": f"A{code}",
                "text": _verbatim(html.escape(answer, quote=False)),
                "language": language,
            }


def _verbatim(text: str) -> str:
    """Return HTML in which braces are braces; LimeSurvey would compute what stands in them."""
    return text.replace("{", "&#123;").replace("}", "&#125;")


def _group(number: int, name: str, language: str) -> dict[str, str]:
    """Return the row of a group."""
    return {"class": "G", "type/scale": str(number), "name": name, "language": language}


def _question(kind: str, name: str, text: str, language: str) -> dict[str, str]:
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


def _only_for(blocks: list[str], block: str) -> dict[str, str]:
    """Return the condition under which a block's groups are shown."""
    return {"relevance": f"block == {blocks.index(block) + 1}"} if len(blocks) > 1 else {}


# Qualtrics ---------------------------------------------------------------------------------


def write_qualtrics(folder: Path, content: StudyContent) -> list[Path]:
    """Write `qualtrics.txt`, a survey to import, and the fields of a Loop & Merge block."""
    text = folder / "qualtrics.txt"
    write_whole(text, "\n".join(["[[AdvancedFormat]]", "", *_blocks(content)]) + "\n")
    rows = [
        {"trial": trial_name(trial), **_addresses(content, trial), **wide_row(content, trial)}
        for trial in content.trials
    ]
    return [text, write_table(folder / "qualtrics_loop.csv", rows)]


def _blocks(content: StudyContent) -> Iterator[str]:
    """Yield the lines of all questions: a block for each of the design's, a page for each trial."""
    block = None
    for place, trial in enumerate(content.trials, start=1):
        if trial.block == block:
            yield from ("[[PageBreak]]", "")
        else:
            block = trial.block
            yield from (f"[[Block:Block {block}]]", "")
        yield from (
            "[[Question:MC:SingleAnswer:Horizontal]]",
            f"[[ID:q{place}]]",
            _shown(content, trial),
            "",
            "[[Choices]]",
            *_answers(content, trial),
            "",
        )


def _addresses(content: StudyContent, trial: Trial) -> dict[str, str]:
    """Return where the films of a trial lie, by column."""
    several = len(trial.alternatives) > 1
    return {
        f"url_{place}" if several else "url": (
            "" if profile is None else film_address(content, profile)
        )
        for place, profile in enumerate(trial.alternatives, start=1)
    }
