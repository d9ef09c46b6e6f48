"""A page with jsPsych 8 that shows a study's films and records answers.

The page runs from the study's folder by any web server (`python -m http.server`). jsPsych itself
is not part of it: the page loads it from the address in the study file, or from a folder beside
it that `npm install` filled.

References:
    J. R. de Leeuw et al. (2023): jsPsych, Journal of Open Source Software 8(85), 5351;
    doi:10.21105/joss.05351
    https://www.jspsych.org/v8/plugins/video-button-response/ and .../preload/
"""

from __future__ import annotations

import html
import json
import re
from collections.abc import Mapping
from pathlib import Path

from sumo3dviz_pt.experiments.tools.content import Screen, StudyContent, letter, trial_name
from sumo3dviz_pt.experiments.trials import Trial
from sumo3dviz_pt.files.whole import write_whole

PACKAGES: Mapping[str, str] = {
    "jspsych": "8.3.0",
    "@jspsych/plugin-preload": "2.1.0",
    "@jspsych/plugin-html-button-response": "2.1.0",
    "@jspsych/plugin-video-button-response": "2.1.1",
}
"""What the page loads, by npm's names, and in which versions."""

_SCRIPTS: Mapping[str, str] = {
    "jspsych": "PPMNzYQfqrWFhrOxhpwxXmKK+LDH//fBCLsvA/JIRHOfiuOcZ2j8wJhqo87V4R4B",
    "@jspsych/plugin-preload": "BiUYHx4tdTYToceth936qf4Wkf+Ho2VZti/5bB5/nDiPRuTaZ37hrxkLsANkHGdp",
    "@jspsych/plugin-html-button-response": (
        "tPGtXEC8xEbInWvarnxvJ3fyzeXwRDS0QjGUts+TGQ9I8OCxiqsv9lxTS3mEN6um"
    ),
    "@jspsych/plugin-video-button-response": (
        "EzTLpOPKkUdmj0L6ueQzRV1TLRFgve84vNAlFZZxx8oc2p6GVHL6Mt8lH229p+yi"
    ),
}
"""Digests (SHA-384) of `_SCRIPT` of these packages: a browser runs nothing else that an address
may send."""

_STYLES = "+gGUkbtw2BJWSroKW2jzIEXGe7KxdycJ0Bo+CqzpIOSBHOYEHHRWETaV+v2mpdWX"
"""The same of jsPsych's `_STYLE`."""

_SCRIPT = "dist/index.browser.min.js"
_STYLE = "css/jspsych.css"
_PAGE = Path(__file__).with_name("page") / "index.html"


def write_jspsych(folder: Path, content: StudyContent) -> list[Path]:
    """Write `index.html` into the study's folder."""
    path = folder / "index.html"
    write_whole(path, page(content))
    return [path]


def page(content: StudyContent) -> str:
    """Return the page."""
    # "</" ends a script and "<!--<script" keeps it from ending; JSON may write "<" as an escape.
    study = json.dumps(_study(content), ensure_ascii=False).replace("<", "\\u003c")
    parts = {
        "language": html.escape(content.words.language),
        "title": html.escape(content.words.title),
        "head": _head(content.jspsych),
        "study": study,
    }
    text = _PAGE.read_text(encoding="utf-8")
    return re.sub(r"\{(" + "|".join(parts) + r")\}", lambda mark: parts[mark[1]], text)


def _head(base: str) -> str:
    """Return the lines that load jsPsych from an address, or from npm's folder."""
    places = {
        name: html.escape(f"{base}{name}{f'@{version}' if _is_online(base) else ''}", quote=True)
        for name, version in PACKAGES.items()
    }
    lines = [
        f'<script src="{place}/{_SCRIPT}"{_checked(base, _SCRIPTS[name])}></script>'
        for name, place in places.items()
    ]
    style = f'href="{places["jspsych"]}/{_STYLE}"{_checked(base, _STYLES)}'
    return "\n".join([*lines, f'<link rel="stylesheet" {style}>'])


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


def _study(content: StudyContent) -> Mapping[str, object]:
    """Return what the page shows."""
    words = content.words
    return {
        "words": {
            "title": words.title,
            "question": words.question,
            "choice": words.choice,
            "answers": list(words.answers),
            "low": words.low,
            "high": words.high,
            "none": words.none,
            "start": "Start",
            "loading": "Loading the films ...",
            "failed": "The films could not be loaded. Is the page open through a web server?",
            "missing": _missing(content.jspsych),
            "end": "Thank you.",
        },
        "letters": [letter(place) for place in range(content.most_alternatives)],
        "films": {clip.name: {"file": clip.file, "fov": clip.fov} for clip in content.films},
        "screen": _screen(content.screen),
        "trials": {trial_name(trial): _trial(content, trial) for trial in content.trials},
        "playlists": {
            playlist.name: [trial_name(trial) for trial in playlist.trials]
            for playlist in content.playlists
        },
    }


def _screen(screen: Screen | None) -> Mapping[str, object] | None:
    """Return how wide films are shown: 2 D tan(fov / 2) on a screen at the distance D.

    So the picture fills the angle that its lens had; a bank card gives the screen's pixels.

    References:
        Q. Li et al. (2020): Controlling for participants' viewing distance in large-scale,
        psychophysical online experiments using a virtual chinrest; doi:10.1038/s41598-019-57204-1
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
    return {
        "films": [None if clip is None else clip.name for clip in clips],
        "card": content.cards.get(trial_name(trial)),
        "told": ["" if p is None else content.told_words(p) for p in trial.alternatives],
        "data": data,
    }
