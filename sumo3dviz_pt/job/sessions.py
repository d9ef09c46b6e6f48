"""Settings of what goes with a study: its page, and the stimulus report.

The page surrounds the films with forms, keys and texts, and says where answers go. The report says
what is measured of films, and for whom.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated, Literal

from pydantic import AfterValidator, Field, model_validator

from sumo3dviz_pt.job.values import (
    MOST_ENTRIES,
    ONE_OR_MORE,
    File,
    Finite,
    Metres,
    Positive,
    Settings,
    Whole,
)

CAMERA = "camera"
"""Name of the observer that every film has: its camera."""

_Place = tuple[Metres, Metres]
_Patterns = Annotated[tuple[str, ...], Field(max_length=MOST_ENTRIES), ONE_OR_MORE]
_Rates = Annotated[tuple[Positive, ...], Field(max_length=20)]


class ObserverSettings(Settings):
    """Somebody for whom vehicles arrive: who stands at a place, or a road user."""

    position: _Place | None = Field(
        None, description="x, y of who stands [m], such as a kerb; or give road_user"
    )
    road_user: str | None = Field(None, description="id of a road user, such as a cyclist")
    eye: Finite = Field(1.6, ge=0, le=100, description="height of the eye above the road [m]")
    across: _Place | None = Field(
        None,
        description="x, y where the way across ends that begins at `position` [m]; default"
        " straight over the nearest lane and 12 m beyond its middle. Of a road user it is the line"
        " through its front, at right angles to its heading",
    )

    @model_validator(mode="after")
    def _one(self) -> ObserverSettings:
        """Ask for a place or a road user."""
        if (self.position is None) == (self.road_user is None):
            raise ValueError("give either position or road_user")
        if self.across is not None and self.position in (None, self.across):
            raise ValueError("across is another place than position, and needs it")
        return self


class ReportSettings(Settings):
    """What films show, in numbers: light, motion, clutter, traffic, flashes."""

    write: bool = Field(
        True, description="whether there is one; it needs the layer `instance` beside the films"
    )
    white: Positive = Field(
        100.0,
        le=100_000,
        description="luminance of the display's white [cd/m2], for what is shown; its curve is"
        " taken as sRGB",
    )
    things: _Patterns = Field(
        ("vehicle:*", "person:*"),
        description="names of things whose visible share is told, such as sign:*: of the"
        " picture's pixels, those that show it",
    )
    observers: dict[str, ObserverSettings] = Field(
        default_factory=dict,
        max_length=100,
        description="for whom gaps, arrivals and angles of vehicles are told, by name, beside the"
        f" film's `{CAMERA}`",
    )
    within: Positive = Field(
        100.0, le=300, description="of which road users observers are told: so near [m]"
    )
    connections: _Rates = Field(
        (5.0, 25.0, 100.0), description="for which the time is told that a film takes [Mbit/s]"
    )

    @model_validator(mode="after")
    def _no_camera(self) -> ReportSettings:
        """Keep the name of the observer that is always there."""
        if CAMERA in self.observers:
            raise ValueError(f"no observer can be called {CAMERA!r}: the film's camera is")
        return self


MOST_FORMS = 100

PAGE_COLUMNS = frozenset(
    {
        *("participant", "visit", "visit_row", "study_digest", "page_time", "page_loads"),
        *("row_kind", "page_form", "page_part", "attempt", "repeated", "dominated"),
        *("chosen", "attention_wanted", "attention_passed", "rt_start", "rt_end", "rt_shown"),
        *("px_per_cm", "pixel_ratio", "browser", "window_width", "window_height"),
        *("page_hidden", "page_hidden_ms", "page_blurred", "page_blurred_ms", "film_place"),
        *("film_ms", "film_loading_ms", "film_skipped", "films_skipped", "film_retries"),
        *("film_problems", "film_certified", "film_clock", "film_width", "film_fitted"),
        *("film_paused", "film_paused_ms", "film_stalled", "film_stalled_ms", "film_hidden_ms"),
        *("film_frames_dropped", "film_frames_repeated", "presses", "press_keys"),
        *("press_film_times", "press_frames", "press_rt_start", "press_held_ms"),
    }
)
"""Columns of the data that the page records, beside factors and forms."""

_LANGUAGE = re.compile(r"[a-z]{2,3}(-[A-Za-z]+)?")
_KEYS = frozenset({"space", "enter", "arrowleft", "arrowright", "arrowup", "arrowdown"})
_FORM = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,39}")


def _printable(path: Path) -> Path:
    """Refuse a file's name that no message could show."""
    if not str(path).isprintable() or not path.name.strip():
        raise ValueError(f"this should be a file's name, not {str(path.name)!r}")
    return path


def _language(text: str) -> str:
    """Refuse what is no language's code."""
    if not _LANGUAGE.fullmatch(text):
        raise ValueError(f"a language is written like en or pt-BR, not {text!r}")
    return text


def _key(name: str) -> str:
    """Refuse what is no key of a keyboard."""
    name = name.lower()
    if name not in _KEYS and (len(name) != 1 or not name.isprintable() or name.isspace()):
        raise ValueError(f"a key is a character, or one of {', '.join(sorted(_KEYS))}")
    return name


def _form(name: str) -> str:
    """Refuse a form's name that no column could have."""
    if not _FORM.fullmatch(name):
        raise ValueError(
            f"a form's name becomes columns: a letter, then letters, digits or _, not {name!r}"
        )
    return name


NamedFile = Annotated[File, AfterValidator(_printable)]
Language = Annotated[str, AfterValidator(_language)]
FormName = Annotated[str, AfterValidator(_form)]
FormNames = Annotated[tuple[FormName, ...], ONE_OR_MORE]
Keys = Annotated[tuple[Annotated[str, AfterValidator(_key)], ...], ONE_OR_MORE]


class DuringSettings(Settings):
    """What people press while a film plays; the film's time of each press is recorded."""

    keys: Keys = Field(
        (), max_length=MOST_FORMS, description="characters, space, enter or arrowleft and so on"
    )
    button: str | None = Field(
        None,
        description="words of a button below the film; default none, but on touch screens one that"
        " stands for the keys",
    )
    text: str | None = Field(None, description="what people read before each film")
    only: bool = Field(False, description="whether no question follows a single clip")

    @model_validator(mode="after")
    def _something(self) -> DuringSettings:
        """Refuse nothing to press."""
        if not self.keys and self.button is None:
            raise ValueError("say what people press: keys, or a button")
        return self


class SessionSettings(Settings):
    """What surrounds the films on the page of jsPsych."""

    consent: str | None = Field(
        None, min_length=1, description="what people agree to first; default nothing"
    )
    before: FormNames = Field(
        (), max_length=MOST_FORMS, description="forms before the films, by name"
    )
    practice: Whole = Field(
        0, ge=0, le=100, description="how many trials, the last of the playlist, come first as well"
    )
    attention: Whole = Field(
        0, ge=0, le=100, description="how many checks of attention stand between the trials"
    )
    after: FormNames = Field(
        (),
        max_length=MOST_FORMS,
        description="forms after the films: presence, sickness, symptoms, comments, or own ones",
    )
    texts: NamedFile | None = Field(
        None, description="a YAML file with texts in other languages, and with own forms"
    )


class EndpointSettings(Settings):
    """Where the page of jsPsych sends each answer as soon as it is given."""

    kind: Literal["post", "jatos", "datapipe", "pavlovia"] = Field(
        "post", description="post: a row as JSON in each request; or one of these services"
    )
    url: str | None = Field(
        None,
        pattern=r"^[^\s\"'<>]+$",
        description="of a server's own script, needed for post; default the service's",
    )
    experiment: str | None = Field(
        None, pattern=r"^[\w-]+$", description="its number at DataPipe or Pavlovia"
    )

    @model_validator(mode="after")
    def _complete(self) -> EndpointSettings:
        """Refuse an endpoint that lacks what its kind needs."""
        if self.kind == "post" and self.url is None:
            raise ValueError("say where answers are posted: url")
        if self.kind in ("datapipe", "pavlovia") and self.experiment is None:
            raise ValueError(f"say the number of the experiment at {self.kind}: experiment")
        return self


# Files of texts ----------------------------------------------------------------------------


class ItemSettings(Settings):
    """One question of a form."""

    text: str = Field(min_length=1, description="the question")
    answers: tuple[str, ...] = Field((), description="in order; default the form's")
    low: str | None = Field(None, description="what the first answer means; default the form's")
    high: str | None = Field(None, description="what the last answer means; default the form's")


class FormSettings(Settings):
    """Questions on a page of their own."""

    source: str = Field("", description="who made it, and whose translation it is")
    intro: str = Field("", description="what stands above the questions")
    answers: tuple[str, ...] = Field(
        (), description="of all questions, in order; without any, there is room for free text"
    )
    low: str = Field("", description="what the first answer means")
    high: str = Field("", description="what the last answer means")
    items: tuple[ItemSettings, ...] = Field(min_length=1, max_length=100, description="questions")


class LanguageSettings(Settings):
    """What people read in one language."""

    page: dict[str, str] = Field(default_factory=dict, description="words of the page by key")
    question: dict[str, str] = Field(default_factory=dict, description="what is asked after films")
    forms: dict[FormName, FormSettings] = Field(
        default_factory=dict, max_length=MOST_FORMS, description="forms by name"
    )
