"""Makes what surrounds a study's films on its page: texts of a language, forms, what is pressed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from sumo3dviz_pt.catalog import did_you_mean
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.experiments.tools.content import During, Form, Session, Words
from sumo3dviz_pt.experiments.tools.jspsych import SCRIPT, STYLE, VERSION, own_texts
from sumo3dviz_pt.files.whole import read_plain
from sumo3dviz_pt.job.errors import Source, explained
from sumo3dviz_pt.job.sessions import EndpointSettings, FormSettings, LanguageSettings
from sumo3dviz_pt.job.study import OWN_COLUMNS, StudySettings
from sumo3dviz_pt.job.yaml12 import MOST_TEXT, parse_yaml

_SERVICES: Mapping[str, str | None] = {
    "post": None,
    "jatos": None,
    "datapipe": "https://pipe.jspsych.org/api/data/",
    "pavlovia": "https://pavlovia.org/",
}
"""Where the kinds of endpoints listen, unless the study file says it."""


_ASKED = ("text", "choice", "low", "high", "none")
"""Words of a question that a language has, where the study file has none of its own."""


def words_of(settings: StudySettings) -> Words:
    """Return what people are asked, in the language of the study."""
    asked, about = settings.question, settings.about
    usual = texts_of(settings).question
    own = {key: usual[key] if (said := getattr(asked, key)) is None else said for key in _ASKED}
    return Words(
        question=own["text"],
        choice=own["choice"],
        answers=asked.answers,
        low=own["low"],
        high=own["high"],
        none=own["none"],
        language=asked.language,
        title=about.title,
        description=about.description,
        authors=about.authors,
        licence=about.licence,
        keywords=about.keywords,
    )


def session_of(settings: StudySettings, folder: Path) -> Session:
    """Return what surrounds the films.

    Args:
        settings: The study's.
        folder: Where the study file lies.

    Raises:
        ConfigError: If there are no such texts or forms, or jsPsych is not where it is copied from.
    """
    texts, asked = texts_of(settings), settings.session
    pressed = settings.question.during
    return Session(
        texts=texts.page,
        consent=asked.consent,
        before=_forms(texts, settings, "before"),
        after=_forms(texts, settings, "after"),
        practice=asked.practice,
        attention=asked.attention,
        during=None if pressed is None else During(**pressed.model_dump()),
        endpoint=_endpoint(settings.tools.endpoint),
        offline=_offline(settings, folder),
    )


def texts_of(settings: StudySettings) -> LanguageSettings:
    """Return all texts of the study's language: ours, with those of its own file over them.

    Raises:
        ConfigError: If there is no such language, or some of its texts are missing.
    """
    language, file = settings.question.language, settings.session.texts
    ours = own_texts()
    found = LanguageSettings.model_validate(ours.get(language, {}))
    if file is not None:
        found = _over(found, _read(file, language))
    elif language not in ours:
        raise ConfigError(
            f"there are no texts in {language!r}, only in {' and '.join(ours)}; write them into a"
            " file and name it as session.texts",
            key="question.language",
        )
    for part in ("page", "question"):
        missing = [key for key in ours["en"][part] if key not in getattr(found, part)]
        if missing:
            raise ConfigError(
                f"{file} lacks texts in {language!r}: {part}: {', '.join(missing)}",
                key="session.texts",
            )
    return found


def _over(below: LanguageSettings, above: LanguageSettings) -> LanguageSettings:
    """Return texts of which those above win."""
    return LanguageSettings(
        page={**below.page, **above.page},
        question={**below.question, **above.question},
        forms={**below.forms, **above.forms},
    )


def _read(file: Path, language: str) -> LanguageSettings:
    """Return what a file says in a language; nothing if it does not know that."""
    try:
        text = read_plain(file, most=4 * MOST_TEXT).decode("utf-8")
    except FileNotFoundError as error:
        raise ConfigError(f"there is no file {file}", key="session.texts") from error
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(f"{file} is no text in UTF-8: {error}", key="session.texts") from error
    content, places = parse_yaml(text, file=file)
    if not isinstance(content, dict) or not all(
        isinstance(each, dict) for each in content.values()
    ):
        raise ConfigError("texts are mappings by language, such as fr: {page: {...}}", file=file)
    inner = {path[1:]: place for path, place in places.items() if path[:1] == (language,)}
    try:
        return LanguageSettings.model_validate(content.get(language, {}))
    except ValidationError as error:
        raise explained(error, LanguageSettings, Source(file, inner)) from error


def _forms(texts: LanguageSettings, settings: StudySettings, part: str) -> tuple[Form, ...]:
    """Return the forms before or after the films."""
    names: Sequence[str] = getattr(settings.session, part)
    for name in names:
        if name not in texts.forms:
            hint = did_you_mean(name, texts.forms)
            raise ConfigError(
                f"no form is called {name!r}{hint}; there are {', '.join(texts.forms)}",
                key=f"session.{part}",
            )
        if name.lower() in OWN_COLUMNS or name in settings.factors:
            raise ConfigError(
                f"no form can be called {name!r}, as its columns are; call it something else",
                key=f"session.{part}",
            )
    return tuple(_form(name, texts.forms[name]) for name in names)


def _form(name: str, form: FormSettings) -> Form:
    """Return a form; items say what differs from it."""
    items: list[dict[str, Any]] = [item.model_dump(exclude_defaults=True) for item in form.items]
    return Form(name, items, form.answers, form.low, form.high, form.intro)


def _endpoint(asked: EndpointSettings | None) -> Mapping[str, str | None] | None:
    """Return where answers are sent."""
    if asked is None:
        return None
    url = asked.url if asked.url is not None else _SERVICES[asked.kind]
    return {"kind": asked.kind, "url": url, "experiment": asked.experiment}


def _offline(settings: StudySettings, folder: Path) -> Path | None:
    """Return the folder from which jsPsych is copied beside the page."""
    if not settings.tools.offline or "jspsych" not in settings.tools.write:
        return None
    place = folder / settings.tools.jspsych
    if "://" not in settings.tools.jspsych and all((place / n).is_file() for n in (SCRIPT, STYLE)):
        return place
    raise ConfigError(
        f"jsPsych is not in {settings.tools.jspsych}, from where it would be copied; run"
        f" `npm install jspsych@{VERSION}` beside the study file, and write"
        " tools: {offline: true, jspsych: node_modules/}",
        key="tools.offline",
    )
