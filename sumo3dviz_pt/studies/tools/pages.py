"""Pages that show films: one with jsPsych that records answers, and a sheet of all films.

The sheet shows all films of a study with their levels. The page with jsPsych runs from the study's
folder by any web server (`python -m http.server`). It is one file, put together from those in the
folder `page`. jsPsych itself is not part of it: the page loads it from the address in the study
file, or from a folder beside it that `npm install` filled, or from one to which it was copied.

References:
    J. R. de Leeuw et al. (2023): jsPsych, Journal of Open Source Software 8(85), 5351;
    doi:10.21105/joss.05351
    https://www.jspsych.org/v8/developers/plugin-development/
    https://wicg.github.io/video-rvfc/ (requestVideoFrameCallback: which frame is seen when)
"""

from __future__ import annotations

import hashlib
import html
import json
import re
import shutil
from collections.abc import Mapping
from dataclasses import asdict, replace
from fractions import Fraction
from functools import cache
from pathlib import Path
from typing import Any

import yaml

from sumo3dviz_pt.files.atomic import write_atomically
from sumo3dviz_pt.studies.designs.trials import Trial, dominated
from sumo3dviz_pt.studies.tools.content import (
    Clip,
    Screen,
    StudyContent,
    StudySession,
    letter,
    trial_name,
    writes,
)

VERSION = "8.3.0"
"""Of jsPsych: what pages load from an address."""

SCRIPT, STYLE = "jspsych/dist/index.browser.min.js", "jspsych/css/jspsych.css"
"""What the page needs of it, in npm's folder."""

_DIGESTS: Mapping[str, str] = {
    SCRIPT: "PPMNzYQfqrWFhrOxhpwxXmKK+LDH//fBCLsvA/JIRHOfiuOcZ2j8wJhqo87V4R4B",
    STYLE: "+gGUkbtw2BJWSroKW2jzIEXGe7KxdycJ0Bo+CqzpIOSBHOYEHHRWETaV+v2mpdWX",
}
"""SHA-384 of both: a browser runs nothing else that an address may send."""

_PAGE = Path(__file__).with_name("page")
_SCRIPTS = ("keep.js", "film.js", "session.js")
COPY = "scripts/"
"""Folder beside the page to which jsPsych is copied."""


@cache
def own_texts() -> Mapping[str, Any]:
    """Return what people read, by language: `page`, `question` and `forms`."""
    texts: Mapping[str, Any] = yaml.safe_load((_PAGE / "texts.yaml").read_text(encoding="utf-8"))
    return texts


@writes("jspsych")
def write_jspsych(folder: Path, content: StudyContent) -> list[Path]:
    """Write `index.html` into the study's folder, and jsPsych beside it where it is to be there."""
    files = [folder / "index.html"]
    write_atomically(files[0], page(content))
    session = _session(content)
    if session.offline is not None:
        for name in (SCRIPT, STYLE):
            files.append(folder / COPY / name)
            files[-1].parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(session.offline / name, files[-1])
    return files


def page(content: StudyContent) -> str:
    """Return the page."""
    base = content.jspsych if _session(content).offline is None else COPY
    # "</" ends a script and "<!--<script" keeps it from ending; JSON may write "<" as an escape.
    study = json.dumps(_study(content, base), ensure_ascii=False).replace("<", "\\u003c")
    parts = {
        "language": html.escape(content.words.language),
        "title": html.escape(content.words.title),
        "head": _head(content, base),
        "style": _source("page.css"),
        "script": "\n".join(map(_source, _SCRIPTS)),
        "study": study,
    }
    text = _source("index.html")
    return re.sub(r"\{(" + "|".join(parts) + r")\}", lambda mark: parts[mark[1]], text)


def _source(name: str) -> str:
    """Return a file of which the page is put together."""
    return (_PAGE / name).read_text(encoding="utf-8")


def _session(content: StudyContent) -> StudySession:
    """Return what surrounds the films."""
    return content.session or StudySession(own_texts()["en"]["page"])


def _head(content: StudyContent, base: str) -> str:
    """Return the lines that load jsPsych, and what an endpoint needs."""
    script, style = (
        f'"{_place(base, name)}"{_checked(base, _DIGESTS[name])}' for name in (SCRIPT, STYLE)
    )
    lines = [f"<script src={script}></script>", f'<link rel="stylesheet" href={style}>']
    endpoint = _session(content).endpoint
    if endpoint and endpoint["kind"] == "jatos":
        lines.append('<script src="jatos.js"></script>')
    return "\n".join(lines)


def _place(base: str, name: str) -> str:
    """Return where a file of jsPsych lies; from an address, in the version that was tried."""
    if _is_online(base):
        name = name.replace("jspsych/", f"jspsych@{VERSION}/", 1)
    return html.escape(f"{base}{name}", quote=True)


def _checked(base: str, digest: str) -> str:
    """Return attributes by which a browser refuses a file from an address if it is another one."""
    return f' integrity="sha384-{digest}" crossorigin="anonymous"' if _is_online(base) else ""


def _is_online(base: str) -> bool:
    """Return whether jsPsych comes from an address and not from a folder."""
    return base.startswith(("http://", "https://"))


def _missing(base: str) -> str:
    """Return what people read where jsPsych cannot be loaded."""
    if _is_online(base):
        why = f"from {base}: is there a connection, and is that address open to it?"
    else:
        why = f"from the folder {base} beside this page: was it installed there?"
    return f"Nothing is shown, because jsPsych could not be loaded {why}"


def _study(content: StudyContent, base: str) -> Mapping[str, object]:
    """Return what the page shows; its digest tells studies apart in a browser's memory."""
    words, session = content.words, _session(content)
    fields = {
        "title": words.title,
        "texts": session.texts,
        "missing": _missing(base),
        "question": {
            "text": words.question,
            "choice": words.choice,
            "answers": list(words.answers),
            "low": words.low,
            "high": words.high,
            "none": words.none,
        },
        "letters": [letter(place) for place in range(content.most_alternatives)],
        "films": {clip.name: _film(clip) for clip in content.films} | _cards(content),
        "screen": _screen(content.screen),
        "during": None if session.during is None else asdict(session.during),
        "endpoint": session.endpoint,
        "session": {
            "consent": session.consent,
            "before": [asdict(form) for form in session.before],
            "after": [asdict(form) for form in session.after],
            "practice": session.practice,
            "attention": session.attention,
        },
        "trials": {trial_name(trial): _trial(content, trial) for trial in content.trials},
        "playlists": {
            playlist.name: [trial_name(trial) for trial in playlist.trials]
            for playlist in content.playlists
        },
    }
    digest = hashlib.sha256(json.dumps(fields, sort_keys=True).encode()).hexdigest()
    return {"digest": digest[:16], **fields}


def _film(clip: Clip) -> Mapping[str, object]:
    """Return what the page knows of a film."""
    return {
        "file": clip.file,
        "fov": clip.fov,
        "size": clip.size,
        "duration": clip.duration,
        "frames": max(1, round(clip.duration * Fraction(clip.rate))),
        "digest": clip.digest,
        **({"heard": True} if clip.heard else {}),
    }


def _cards(content: StudyContent) -> dict[str, Mapping[str, object]]:
    """Return the films that show all alternatives of a task, as long as the longest of them."""
    cards: dict[str, Mapping[str, object]] = {}
    for trial in content.trials:
        card = content.cards.get(trial_name(trial))
        if card is not None:
            clips = [content.clips[each] for each in trial.alternatives if each is not None]
            longest = max(clips, key=lambda clip: clip.duration)
            silent = _film(replace(longest, heard=False))
            cards[card] = {**silent, "file": card, "size": None, "fov": None, "digest": ""}
    return cards


def _screen(screen: Screen | None) -> Mapping[str, object] | None:
    """Return how films get their right size.

    References:
        ISO/IEC 7810:2019, ID-1: a bank card is 85.60 mm wide and 53.98 mm high
    """
    if screen is None:
        return None
    return {
        "distance": screen.distance,
        "pixels_per_cm": screen.pixels_per_cm,
        "instruction": screen.instruction,
        "card": [8.56, 5.398],
    }


def _trial(content: StudyContent, trial: Trial) -> Mapping[str, object]:
    """Return the films of a trial, and what is recorded with its answer."""
    clips = [None if profile is None else content.clips[profile] for profile in trial.alternatives]
    data: dict[str, str] = {"block": trial.block, "task": trial.task}
    for place, (profile, clip) in enumerate(zip(trial.alternatives, clips, strict=True), start=1):
        if profile is None or clip is None:
            continue
        end = f"_{place}" if len(clips) > 1 else ""
        data[f"film{end}"] = clip.name
        data |= {f"{key}{end}": level for key, level in content.named(profile).items()}
    if len(clips) > 1 and content.ranks:
        data["dominated"] = ";".join(map(str, dominated(trial, content.ranks)))
    return {
        "films": [None if clip is None else clip.name for clip in clips],
        "card": content.cards.get(trial_name(trial)),
        "told": ["" if p is None else content.told_words(p) for p in trial.alternatives],
        "data": data,
    }


_STYLE = (
    "body { background: #777; color: #fff; font-family: sans-serif }"
    " figure { display: inline-block; margin: .5em; vertical-align: top; max-width: 320px }"
    " video { width: 320px } figcaption { font-size: .9em }"
)


def write_sheet(folder: Path, content: StudyContent, thumbnails: Mapping[str, str]) -> Path:
    """Write `contact_sheet.html`: every film as a player, under its picture and levels.

    Args:
        folder: The study's.
        content: Its films.
        thumbnails: Pictures by the films' names, relative to the folder.
    """
    title = html.escape(content.words.title)
    lines = [
        "<!doctype html>",
        f'<html lang="en"><head><meta charset="utf-8"><title>{title}</title>',
        f"<style>{_STYLE}</style></head><body><h1>{title}</h1>",
    ]
    for clip in content.films:
        profiles = [profile for profile, film in content.clips.items() if film == clip]
        words = "<br>".join(
            html.escape(", ".join(f"{key} {level}" for key, level in content.named(p).items()))
            for p in profiles
        )
        source, poster = (
            html.escape(path, quote=True) for path in (clip.file, thumbnails[clip.name])
        )
        lines.append(
            f'<figure><video src="{source}" poster="{poster}" controls muted loop preload="none">'
            f"</video><figcaption><b>{html.escape(clip.name)}</b><br>{words}</figcaption></figure>"
        )
    path = folder / "contact_sheet.html"
    write_atomically(path, "\n".join([*lines, "</body></html>", ""]))
    return path
