"""Reads study files, says what is wrong in them, and describes their keys to editors.

Editors get a JSON schema: keys, meanings and ranges. What surrounds a study's films on its page is
made here, too: texts of a language, forms, what is pressed.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from sumo3dviz_pt.catalog import did_you_mean, file_meant
from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.files.atomic import open_plain, read_plain
from sumo3dviz_pt.files.forms import SCHEMA_VERSION
from sumo3dviz_pt.job.errors import Source, explained, located
from sumo3dviz_pt.job.sessions import EndpointSettings, FormSettings, LanguageSettings
from sumo3dviz_pt.job.settings import Job
from sumo3dviz_pt.job.study import OWN_COLUMNS, STUDY_FILE, FactorSettings, StudySettings
from sumo3dviz_pt.job.yaml12 import MOST_TEXT, KeyPath, as_path, parse_yaml
from sumo3dviz_pt.pipeline.scene_file import SceneText, read_scene
from sumo3dviz_pt.studies.designs.trials import Levels, Ranks
from sumo3dviz_pt.studies.tools.content import During, Form, StudySession, Words
from sumo3dviz_pt.studies.tools.pages import SCRIPT, STYLE, VERSION, own_texts

_SERVICES: Mapping[str, str | None] = {
    "post": None,
    "jatos": None,
    "datapipe": "https://pipe.jspsych.org/api/data/",
    "pavlovia": "https://pavlovia.org/",
}
"""Where the kinds of endpoints listen, unless the study file says it."""


_PARTS = ("text", "choice", "low", "high", "none")
"""Words of a question that a language has, where the study file has none of its own."""


def words_of(settings: StudySettings) -> Words:
    """Return what people are asked, in the language of the study."""
    question, about = settings.question, settings.about
    usual = texts_of(settings).question
    own = {key: usual[key] if (text := getattr(question, key)) is None else text for key in _PARTS}
    return Words(
        question=own["text"],
        choice=own["choice"],
        answers=question.answers,
        low=own["low"],
        high=own["high"],
        none=own["none"],
        language=question.language,
        title=about.title,
        description=about.description,
        authors=about.authors,
        licence=about.licence,
        keywords=about.keywords,
    )


def session_of(settings: StudySettings, folder: Path) -> StudySession:
    """Return what surrounds the films.

    Args:
        settings: The study's.
        folder: Where the study file lies.

    Raises:
        ConfigError: If there are no such texts or forms, or jsPsych is not where it is copied from.
    """
    texts, session = texts_of(settings), settings.session
    pressed = settings.question.during
    return StudySession(
        texts=texts.page,
        consent=session.consent,
        before=_forms(texts, settings, "before"),
        after=_forms(texts, settings, "after"),
        practice=session.practice,
        attention=session.attention,
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
    texts = LanguageSettings.model_validate(ours.get(language, {}))
    if file is not None:
        texts = _over(texts, _read(file, language))
    elif language not in ours:
        raise ConfigError(
            f"there are no texts in {language!r}, only in {' and '.join(ours)}; write them into a"
            " file and name it as session.texts",
            key="question.language",
        )
    for part in ("page", "question"):
        missing = [key for key in ours["en"][part] if key not in getattr(texts, part)]
        if missing:
            raise ConfigError(
                f"{file} lacks texts in {language!r}: {part}: {', '.join(missing)}",
                key="session.texts",
            )
    return texts


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


def _endpoint(endpoint: EndpointSettings | None) -> Mapping[str, str | None] | None:
    """Return where answers are sent."""
    if endpoint is None:
        return None
    url = endpoint.url if endpoint.url is not None else _SERVICES[endpoint.kind]
    return {"kind": endpoint.kind, "url": url, "experiment": endpoint.experiment}


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


@dataclass(frozen=True, slots=True)
class StudyFile:
    """A study file that was read, and its scene file as it stands.

    Attributes:
        settings: Checked.
        source: Where they stand.
        scene: What all stimuli are patches of.
    """

    settings: StudySettings
    source: Source
    scene: SceneText

    @property
    def path(self) -> Path:
        """The study file."""
        assert self.source.file is not None
        return self.source.file

    @property
    def levels(self) -> Levels:
        """The levels of each factor, by its name."""
        return {name: tuple(each.levels) for name, each in self.settings.factors.items()}

    @property
    def ranks(self) -> Ranks:
        """How good the levels of each factor are; empty where the study says nothing of it."""
        ranked = [
            None if each.better is None else _ranked(tuple(each.levels), each.better)
            for each in self.settings.factors.values()
        ]
        return ranked if any(ranked) else ()

    @contextmanager
    def blamed(self, *path: str | int) -> Iterator[None]:
        """Give errors within the `with` statement their place in the study file.

        Args:
            path: The key at fault; default the one that an error names.
        """
        try:
            yield
        except ConfigError as error:
            if error.file is not None and not path:
                raise
            raise _placed(error, path, self.source) from error


def _ranked(levels: Sequence[str], better: str) -> dict[str, int]:
    """Return how good levels are, the best with the highest number."""
    ordered = levels if better == "last" else reversed(levels)
    return {level: rank for rank, level in enumerate(ordered)}


def load_study(path: Path) -> StudyFile:
    """Read a study file and the scene file that it names.

    Args:
        path: The YAML file.

    Raises:
        ConfigError: If one is missing, no YAML, or a setting is wrong; names file, line and key.
    """
    path = as_path(path, key="study")
    content, places = parse_yaml(_text_of(path), file=path)
    source = Source(path, places)
    if not isinstance(content, dict):
        raise ConfigError("a study file is a mapping of keys to values; this is not", file=path)
    if "scenario" in content and "factors" not in content:
        raise ConfigError(
            "is a scene file, not a study file; name it in one under the key scene", file=path
        )
    if problem := STUDY_FILE.problem(content):
        raise located(problem, (SCHEMA_VERSION,), source)
    settings = _settings(STUDY_FILE.current(content, path), source)
    _check_exclusions(settings, source)
    if not settings.scene.is_file():
        hint = file_meant(settings.scene)
        raise located(f"there is no scene file {settings.scene}{hint}", ("scene",), source)
    study = StudyFile(settings, source, read_scene(settings.scene))
    with study.blamed():
        session_of(settings, path.parent)
    return study


def _text_of(path: Path) -> str:
    """Return what a study file holds."""
    try:
        with open_plain(path) as stream:
            # A character is four bytes at most.
            return stream.read(4 * MOST_TEXT + 1).decode("utf-8")
    except FileNotFoundError as error:
        hint = file_meant(path)
        raise ConfigError(f"there is no such study file{hint}", file=path) from error
    except OSError as error:
        why = error.strerror or error
        raise ConfigError(f"the study file cannot be read: {why}", file=path) from error
    except UnicodeDecodeError as error:
        raise ConfigError(
            "the study file cannot be read: it is no text in UTF-8; save it as that", file=path
        ) from error


def _settings(content: Mapping[str, Any], source: Source) -> StudySettings:
    """Return checked settings."""
    assert source.file is not None
    try:
        return StudySettings.model_validate(content, context={"folder": source.file.parent})
    except ValidationError as error:
        raise explained(error, StudySettings, source) from error


def _check_exclusions(settings: StudySettings, source: Source) -> None:
    """Refuse exclusions of factors and levels that there are not."""
    for number, combination in enumerate(settings.exclude):
        if not combination:
            raise located("an exclusion names one factor at least", ("exclude", number), source)
        for name, some in combination.items():
            where: KeyPath = ("exclude", number, name)
            if name not in settings.factors:
                hint = did_you_mean(name, settings.factors)
                raise located(f"no factor is called {name!r}{hint}", where, source)
            for level in some:
                if level not in settings.factors[name].levels:
                    hint = did_you_mean(level, settings.factors[name].levels)
                    raise located(f"{name} has no level {level!r}{hint}", where, source)


def _placed(error: ConfigError, path: KeyPath, source: Source) -> ConfigError:
    """Return an error with its place in a study file."""
    own = ":".join(str(part) for part in (error.file, error.line, error.column) if part is not None)
    message = str(error)
    for part in (own, error.key):
        message = message.removeprefix(f"{part}: ") if part else message
    if not path:
        return located(message, _path_of(error.key or "", source), source)
    return located(f"{error.key}: {message}" if error.key else message, path, source)


def _path_of(key: str, source: Source) -> KeyPath:
    """Return the keys that a dotted key means; names in it may hold dots themselves."""
    if not key:
        return ()
    named = (path for path in source.places if ".".join(map(str, path)) == key)
    return next(named, tuple(key.split(".")))


TITLE = "Study file of sumo3dviz_pt"

Node = dict[str, Any]


def study_schema() -> Node:
    """Return the JSON schema of study files; in levels, editors offer the scene file's keys."""
    schema = StudySettings.model_json_schema()
    levels = schema["$defs"][FactorSettings.__name__]["properties"]["levels"]
    for place in (levels["additionalProperties"], schema["properties"]["common"]):
        place["properties"] = _scene_keys()
        place["additionalProperties"] = True  # dotted keys
    _loosen(schema)
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        **schema,
        "title": TITLE,
    }


def study_schema_text() -> str:
    """Return the schema as text."""
    return json.dumps(study_schema(), indent=1, ensure_ascii=False) + "\n"


def _scene_keys() -> Node:
    """Return the keys of scene files with their meanings; a patch may hold a part of a value."""
    properties = Job.model_json_schema()["properties"]
    return {key: {"description": node.get("description", key)} for key, node in properties.items()}


def _loosen(schema: Node) -> None:
    """Accept single words where the models hold lists, and numbers where they hold text."""
    table = schema["$defs"]["TableSettings"]["properties"]
    several = table["columns"]["additionalProperties"]
    table["columns"]["additionalProperties"] = {"anyOf": [{"type": "string"}, several]}
    word = {"type": ["string", "number", "boolean"]}
    table["none"]["additionalProperties"] = word
    listed = {"type": "array", "items": word}
    schema["properties"]["exclude"]["items"]["additionalProperties"] = {"anyOf": [word, listed]}
