"""What the files of all tools are made from: films, trials, playlists and words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from string import ascii_uppercase
from typing import Any

from sumo3dviz_pt.experiments.playlists import Playlist
from sumo3dviz_pt.experiments.trials import Profile, Ranks, Trial


@dataclass(frozen=True, slots=True)
class Clip:
    """A finished film.

    Attributes:
        name: Without an ending.
        code: Short, of letters and digits; it tells nothing.
        file: Relative to the study's folder, with forward slashes.
        duration: Of the film [s].
        size: Width, height [px].
        rate: Frames per second, such as 25 or 30000/1001.
        digest: SHA-256 of the file.
        fov: Horizontal opening angle of its lens [deg]; None where it is not known.
    """

    name: str
    code: str
    file: str
    duration: float
    size: tuple[int, int]
    rate: str
    digest: str
    fov: float | None = None


@dataclass(frozen=True, slots=True)
class Screen:
    """How films get their right size on a screen.

    Attributes:
        distance: Of the eyes from the screen [m].
        pixels_per_cm: CSS pixels of the screen; None asks people to lay a bank card on it.
        instruction: What people read then.
    """

    distance: float
    pixels_per_cm: float | None
    instruction: str


@dataclass(frozen=True, slots=True)
class Form:
    """Questions on a page of their own.

    Attributes:
        name: Columns of the data are called after it.
        items: Each with `text`, and `answers`, `low` and `high` where it has its own.
        answers: Of all items; none leaves room for free text.
        low, high: What the first and the last answer mean; may be empty.
        intro: Above the items; may be empty.
    """

    name: str
    items: Sequence[Mapping[str, Any]]
    answers: Sequence[str] = ()
    low: str = ""
    high: str = ""
    intro: str = ""


@dataclass(frozen=True, slots=True)
class During:
    """What people press while a film plays.

    Attributes:
        keys: As browsers call them, in small letters; the space bar is `space`.
        button: Its words; None has a button on touch screens only.
        text: Above the film.
        only: Whether no question follows.
    """

    keys: Sequence[str]
    button: str | None = None
    text: str | None = None
    only: bool = False


@dataclass(frozen=True, slots=True)
class Session:
    """What surrounds the films on the page of jsPsych.

    Attributes:
        texts: Words of the page by key.
        consent: What people agree to first; None asks nothing.
        before, after: Forms around the films.
        practice: How many trials come first as well.
        attention: How many checks stand between the trials.
        during: What is pressed while films play.
        endpoint: Where answers are sent: kind, url, experiment; None saves a file.
        offline: Folder with jsPsych that is copied beside the page; None leaves it where it is.
    """

    texts: Mapping[str, str]
    consent: str | None = None
    before: Sequence[Form] = ()
    after: Sequence[Form] = ()
    practice: int = 0
    attention: int = 0
    during: During | None = None
    endpoint: Mapping[str, str | None] | None = None
    offline: Path | None = None


@dataclass(frozen=True, slots=True)
class Words:
    """What people are asked, and what is said about the study.

    Attributes:
        question: After a single clip.
        choice: After a task of several clips.
        answers: In order.
        low, high: What the first and the last answer mean.
        none: The answer that chooses nothing.
        language: Of all these, such as `en`.
        title, description: Of the data set.
        authors: Given name, family name.
        licence: Of the films; may be empty.
        keywords: For catalogues.
    """

    question: str
    choice: str
    answers: Sequence[str]
    low: str
    high: str
    none: str
    language: str
    title: str
    description: str
    authors: Sequence[str] = ()
    licence: str = ""
    keywords: Sequence[str] = ()


@dataclass(frozen=True, slots=True)
class StudyContent:
    """A study whose films are there.

    Attributes:
        factors: What each factor is, in the order of profiles; may be empty words.
        levels: Of each factor.
        clips: The film of each profile.
        trials: Of all blocks, in the design's order.
        playlists: Who sees what in which order.
        words: For people.
        url: Of the folder online, ending in /; None if it is not known.
        jspsych: Where jsPsych is loaded from, ending in /.
        notes: What a reader of the data should know.
        told: Factors that films do not show, so that words have to.
        screen: How films get their right size on the page; None fits them to the window.
        cards: Films of all alternatives side by side, by the trial's name; else they are shown one
            after the other.
        session: What surrounds films on the page of jsPsych; None is nothing, in English.
        ranks: How good levels are, in the order of factors; empty where nothing is known.
    """

    factors: Mapping[str, str]
    levels: Mapping[str, Sequence[str]]
    clips: Mapping[Profile, Clip]
    trials: Sequence[Trial]
    playlists: Sequence[Playlist]
    words: Words
    url: str | None = None
    jspsych: str = "https://unpkg.com/"
    notes: Sequence[str] = ()
    told: Sequence[str] = ()
    screen: Screen | None = None
    cards: Mapping[str, str] = field(default_factory=dict)
    session: Session | None = None
    ranks: Ranks = ()

    @property
    def films(self) -> tuple[Clip, ...]:
        """All films, each once."""
        return tuple({clip.name: clip for clip in self.clips.values()}.values())

    @property
    def most_alternatives(self) -> int:
        """The most alternatives that a trial has, those that choose nothing among them."""
        return max(len(trial.alternatives) for trial in self.trials)

    def named(self, profile: Profile) -> dict[str, str]:
        """Return a profile's levels by the names of their factors."""
        return dict(zip(self.factors, profile, strict=True))

    def told_words(self, profile: Profile) -> str:
        """Return what people read beside a film; nothing if it shows all."""
        levels = self.named(profile)
        return ", ".join(f"{self.factors[name] or name}: {levels[name]}" for name in self.told)


def trial_name(trial: Trial) -> str:
    """Return a name of a trial that no other has."""
    return f"b{trial.block}t{trial.task}"


def letter(place: int) -> str:
    """Return what people call an alternative, from A on; from 27 on a number."""
    return ascii_uppercase[place] if place < len(ascii_uppercase) else str(place + 1)
