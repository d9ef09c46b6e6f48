"""The study file: factors, their levels as patches of a scene file, and what comes out.

As for the scene file, every default, range and meaning is said once, here: the check of study
files, their JSON schema and the manual's page are made from these models.
"""

from __future__ import annotations

import keyword
import re
from typing import Annotated, Any, Literal, get_args

from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from sumo3dviz_pt.files.forms import Form
from sumo3dviz_pt.job.renamed import with_present_names
from sumo3dviz_pt.job.sessions import (
    PAGE_COLUMNS,
    DuringSettings,
    EndpointSettings,
    Language,
    NamedFile,
    ReportSettings,
    SessionSettings,
)
from sumo3dviz_pt.job.settings import ShotSettings
from sumo3dviz_pt.job.values import (
    MOST_ENTRIES,
    ONE_OR_MORE,
    Finite,
    Positive,
    Seed,
    Settings,
    Whole,
)

MOST_FACTORS = 40
MOST_LEVELS = 100

OWN_COLUMNS = frozenset(
    {
        *("stimulus", "film", "duration", "video", "stim_file", "stim_id", "answer", "rt"),
        *("playlist", "block", "position", "trial", "task", "alternative", "none", "response"),
    }
    | PAGE_COLUMNS
)
"""Columns of the tables that are written; no factor may be called like one."""

_FACTOR = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,39}")
_LONGEST_LEVEL = 60
_ADDRESS = re.compile(r"https?://[^\s\"'<>]+")
_PLACE = re.compile(r"[^\s\"'<>]+")
_DATE = re.compile(r"\d{4}(-(0[1-9]|1[0-2])(-(0[1-9]|[12]\d|3[01]))?)?")


# Names -------------------------------------------------------------------------------------


def _factor(name: str) -> str:
    """Refuse a factor's name that some tool could not take as a variable."""
    if not _FACTOR.fullmatch(name) or keyword.iskeyword(name):
        raise ValueError(
            f"a factor's name becomes a variable: a letter, then letters, digits or _, at most 40"
            f" and no word of Python, not {name!r}"
        )
    if re.search(r"_\d+$", name):
        raise ValueError(
            f"a factor's name cannot end in _ and digits, which count alternatives, as {name!r}"
        )
    if name.lower() in OWN_COLUMNS:
        raise ValueError(f"no factor can be called {name!r}, a column of the tables is")
    return name


def _level(name: str) -> str:
    """Refuse a level's name that no table or file name could show."""
    if not name.strip() or name != name.strip() or len(name) > _LONGEST_LEVEL:
        raise ValueError(
            f"a level's name has 1 to {_LONGEST_LEVEL} characters and no blanks at its ends,"
            f" not {name!r}"
        )
    if not name.isprintable() or not re.search(r"\w", name):
        raise ValueError(f"a level's name holds letters or digits and no tabs, not {name!r}")
    return name


def _word(value: Any) -> Any:
    """Let numbers, true and false stand for the text that a key would be."""
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value:g}" if isinstance(value, int | float) else value


def _address(text: str) -> str:
    """Refuse what is no address of a folder online."""
    if not _ADDRESS.fullmatch(text):
        raise ValueError(f"an address begins with https:// and holds no blanks, not {text!r}")
    return text


def _place(text: str) -> str:
    """Refuse what is neither an address nor a folder."""
    if not text.endswith("/") or not _PLACE.fullmatch(text):
        raise ValueError(f"a place to load from ends in / and holds no blanks, not {text!r}")
    return text


def _date(text: str) -> str:
    """Refuse what is no date."""
    if text and not _DATE.fullmatch(text):
        raise ValueError(f"a date is written like 2026-11-27, 2026-11 or 2026, not {text!r}")
    return text


FactorName = Annotated[str, AfterValidator(_factor)]
LevelName = Annotated[str, BeforeValidator(_word), AfterValidator(_level)]
LevelNames = Annotated[tuple[LevelName, ...], Field(max_length=MOST_LEVELS), ONE_OR_MORE]
Cell = Annotated[str, BeforeValidator(_word)]
Columns = Annotated[tuple[str, ...], Field(min_length=1, max_length=MOST_LEVELS), ONE_OR_MORE]
Patterns = Annotated[tuple[str, ...], Field(max_length=MOST_LEVELS), ONE_OR_MORE]
Patch = dict[str, Any]
"""Keys of the scene file, dotted or nested, with their values."""

_Patch = Annotated[Patch, AfterValidator(with_present_names)]


# Factors and designs -----------------------------------------------------------------------


class ActSettings(Settings):
    """Where a factor acts; two films of a pair may differ there and nowhere else."""

    things: Patterns = Field(
        (), description="names of what may have another shape or be missing, such as tree:*"
    )
    looks: Patterns = Field(
        (), description="names of what may have another colour, such as vehicle:car.7"
    )
    light: bool = Field(False, description="sky, sun and lamps, and with them exposure and tone")
    picture: bool = Field(False, description="exposure, tone curve, glare and response")
    camera: bool = Field(False, description="where it is seen from, and the lens")
    motion: bool = Field(False, description="what traffic and signals do, and when")
    overlays: bool = Field(False, description="what is drawn over the film")
    anything: bool = Field(False, description="all of it: only numbers of frames are compared")


class FactorSettings(Settings):
    """What varies, and between what."""

    about: str = Field("", description="what it is, for tables and pages")
    acts_on: ActSettings | None = Field(
        None, description="where it acts; default what the keys that its levels set act on"
    )
    better: Literal["first", "last"] | None = Field(
        None,
        description="which level everybody would choose, if they stand in order; then choices"
        " that nobody would make are noted",
    )
    levels: dict[LevelName, _Patch] = Field(
        min_length=2,
        max_length=MOST_LEVELS,
        description="values of the scene file by level; levels that are all {} are only told",
    )


class TableSettings(Settings):
    """A design that another tool made, row by row."""

    table: NamedFile = Field(description=".csv, .tsv, .txt or .xlsx")
    form: Literal["long", "wide", "cbctools", "idefix", "spdesign", "ngene", "sawtooth"] = Field(
        "long",
        description="who wrote it; long has a row for each alternative, wide one for each task",
    )
    columns: dict[FactorName, Columns] = Field(
        default_factory=dict,
        max_length=MOST_FACTORS,
        description="column by factor, default its own name; in wide tables {alt} stands for the"
        " alternative; several columns are dummy or effects codes",
    )
    codes: dict[FactorName, dict[Cell, LevelName]] = Field(
        default_factory=dict,
        max_length=MOST_FACTORS,
        description="level by what the cells hold, where that is not the level's name",
    )
    coding: dict[FactorName, Literal["dummy", "effects"]] = Field(
        default_factory=dict,
        max_length=MOST_FACTORS,
        description="what several columns hold, where neither rows nor names of columns tell",
    )
    alternatives: tuple[str, ...] = Field(
        (), max_length=MOST_LEVELS, description="of a wide table, what {alt} stands for"
    )
    task: str | None = Field(None, description="column of the choice task; default the form's")
    alternative: str | None = Field(
        None, description="column of the alternative; default the form's"
    )
    block: str | None = Field(
        None, description="column of the block, version or respondent; default the form's"
    )
    none: dict[str, Cell] = Field(
        default_factory=dict,
        max_length=MOST_LEVELS,
        description="column and value of rows that offer to choose nothing",
    )
    sheet: str | None = Field(None, description="of an .xlsx; default the first")
    separator: Literal["comma", "semicolon", "tab", "auto"] = Field(
        "auto", description="between columns of text; auto asks the first line"
    )


class ChoiceSettings(Settings):
    """Choice tasks that tell effects apart as well as can be (least D-error)."""

    tasks: Whole = Field(ge=1, le=1000, description="how many")
    alternatives: Whole = Field(2, ge=2, le=10, description="films in each")
    none: bool = Field(False, description="whether nothing may be chosen, too")
    priors: dict[FactorName, dict[LevelName, Finite]] = Field(
        default_factory=dict,
        max_length=MOST_FACTORS,
        description="utility that is assumed of levels, 0 where nothing is said; no film of a task"
        " is better than another in all factors",
    )


Design = Literal["full", "fraction", "fraction_3", "latin", "choices"] | TableSettings


# What comes out ----------------------------------------------------------------------------


Tool = Literal["jspsych", "psychopy", "psychds", "bids", "limesurvey", "qualtrics", "otree"]
TOOLS: tuple[Tool, ...] = get_args(Tool)


class QuestionSettings(Settings):
    """What people are asked after a clip."""

    text: str | None = Field(None, description="the question; default the language's")
    choice: str | None = Field(
        None, description="the question where a task has several clips; default the language's"
    )
    answers: tuple[str, ...] = Field(
        ("1", "2", "3", "4", "5", "6", "7"),
        min_length=2,
        max_length=MOST_LEVELS,
        description="in order",
    )
    low: str | None = Field(None, description="what the first answer means")
    high: str | None = Field(None, description="what the last answer means")
    none: str | None = Field(None, description="the answer that chooses nothing")
    language: Language = Field(
        "en", description="of all texts; en and de are there, session.texts may add others"
    )
    during: DuringSettings | None = Field(
        None, description="what people press while a film plays, on the page of jsPsych"
    )


class PlaylistSettings(Settings):
    """Who sees what in which order."""

    order: Literal["latin", "random", "as_written"] = Field(
        "latin",
        description="latin: every trial at every position, and after every other, equally often",
    )
    count: Whole | None = Field(
        None, ge=1, le=MOST_ENTRIES, description="how many; default what the order needs"
    )
    parts: Whole = Field(
        1, ge=1, le=1000, description="sessions or groups that share out the trials of a design"
    )
    repeat: Whole = Field(1, ge=1, le=100, description="how often each trial is shown")
    places: Literal["as_written", "balanced"] = Field(
        "as_written",
        description="of films within a choice task; balanced: every film at every place equally"
        " often, in as many playlists more",
    )


class ScreenSettings(Settings):
    """How films get their right size on the page: as wide as the angle that their lens had."""

    distance: Positive = Field(0.6, le=100, description="of the eyes from the screen [m]")
    pixels_per_cm: Positive | None = Field(
        None, le=10_000, description="CSS pixels; default people lay a bank card on the screen"
    )
    instruction: str | None = Field(
        None, min_length=1, description="what people read then; default the language's"
    )


class CalibrationSettings(Settings):
    """A clip for a photometer: grey steps, a checker, a frame counter."""

    white: Positive = Field(
        200.0, le=100_000, description="assumed luminance of the screen's white [cd/m2]"
    )
    seconds: Positive = Field(1.0, le=60, description="how long each grey fills the screen [s]")


class ToolSettings(Settings):
    """For which tools files are written, and where films will lie."""

    write: tuple[Tool, ...] = Field(TOOLS, max_length=len(TOOLS), description="tools")
    url: Annotated[str, AfterValidator(_address)] | None = Field(
        None,
        description="of the folder online; LimeSurvey and Qualtrics show films from there",
    )
    jspsych: Annotated[str, AfterValidator(_place)] = Field(
        "https://unpkg.com/",
        description="where the page loads jsPsych from: a URL or a folder beside it, ending in /",
    )
    offline: bool = Field(
        False,
        description="whether jsPsych is copied beside the page, from the folder `jspsych`, then"
        " relative to the study file",
    )
    endpoint: EndpointSettings | None = Field(
        None, description="where answers are sent; default they are saved as a file"
    )
    cards: bool = Field(
        False, description="choice tasks as one film, all alternatives side by side"
    )
    screen: ScreenSettings | None = Field(
        None, description="how films get their right size on the page; default the window's"
    )


class CertificateSettings(Settings):
    """Proof that films of a pair differ where their factor acts, and nowhere else."""

    write: bool = Field(True, description="whether there is one; it needs layers beside the films")
    frames: Whole = Field(
        5,
        ge=1,
        le=MOST_ENTRIES,
        description="how many frames are compared pixel by pixel, evenly over the film; accounts"
        " of all frames are compared",
    )


class AboutSettings(Settings):
    """What is said about the study in its data set and citation."""

    title: str = Field("Stimuli of sumo3dviz_pt", min_length=1, description="of the data set")
    description: str = Field(
        "Path-traced films of a traffic simulation that differ by design.",
        min_length=1,
        description="what it holds",
    )
    authors: tuple[str, ...] = Field((), max_length=1000, description="given name, family name")
    date: Annotated[str, AfterValidator(_date)] = Field(
        "", description="of the study, such as 2026-11-27; films and certificates ask no clock"
    )
    licence: str = Field("", description="of the films, such as CC-BY-4.0")
    keywords: tuple[str, ...] = Field((), max_length=100, description="for catalogues")


STUDY_FILE = Form("study file")
"""Its version, and what makes it of older ones."""


class StudySettings(Settings):
    """A whole study file."""

    scene: NamedFile = Field(description="the scene file that all stimuli are patches of")
    factors: dict[FactorName, FactorSettings] = Field(
        min_length=1, max_length=MOST_FACTORS, description="what varies, by name"
    )
    design: Design = Field(
        "full",
        description="full: all combinations; fraction: an orthogonal array; fraction_3: one of"
        " strength 3; latin: a Latin square; choices: choice tasks",
    )
    choices: ChoiceSettings | None = Field(
        None, description="which choice tasks; goes with `design: choices`"
    )
    exposure: Literal["shared", "own"] = Field(
        "shared",
        description="of cameras with `exposure: auto`: shared is metered on the first film and"
        " locked for all; own is metered for each film",
    )
    exclude: tuple[dict[FactorName, LevelNames], ...] = Field(
        (),
        max_length=MOST_ENTRIES,
        description="combinations that cannot be: a level, or a list of them, by factor",
    )
    seed: Seed = Field(0, description="of the order of profiles and of playlists")
    clip: ShotSettings | None = Field(
        None, description="camera and times of all stimuli; default the scene's only shot"
    )
    common: _Patch = Field(
        default_factory=dict,
        description="values of the scene file for all stimuli, such as quality and output",
    )
    overrides: _Patch = Field(
        default_factory=dict,
        description="values of the scene file that win over levels, as --set does",
    )
    film: Literal[".mp4", ".webm", ".mov"] = Field(".mp4", description="ending of the films")
    names: Literal["levels", "codes"] = Field(
        "levels", description="what films are called; codes tell participants nothing"
    )
    question: QuestionSettings = QuestionSettings()
    session: SessionSettings = SessionSettings()
    playlists: PlaylistSettings = PlaylistSettings()
    tools: ToolSettings = ToolSettings()
    certificate: CertificateSettings = CertificateSettings()
    report: ReportSettings = ReportSettings()
    calibration: CalibrationSettings | None = Field(
        CalibrationSettings(), description="a clip for a photometer; null leaves it out"
    )
    about: AboutSettings = AboutSettings()
    schema_version: Whole = Field(
        STUDY_FILE.version,
        ge=1,
        le=STUDY_FILE.version,
        description="version of the file's form; a newer one than this package reads is refused",
    )

    @model_validator(mode="after")
    def _distinct(self) -> StudySettings:
        """Refuse factors that only differ in capitals: some tools do not tell them apart."""
        lowered: dict[str, str] = {}
        for name in self.factors:
            if other := lowered.get(name.lower()):
                raise ValueError(f"the factors {other!r} and {name!r} differ in capitals only")
            lowered[name.lower()] = name
        return self

    @model_validator(mode="after")
    def _choices(self) -> StudySettings:
        """Refuse choice tasks that no design asks for, and the other way round."""
        if (self.design == "choices") != (self.choices is not None):
            raise ValueError("design: choices goes with choices: {tasks: 12}, and these with it")
        for name, priors in self.choices.priors.items() if self.choices else ():
            if name not in self.factors:
                raise ValueError(f"choices.priors: no factor is called {name!r}")
            for level in priors:
                if level not in self.factors[name].levels:
                    raise ValueError(f"choices.priors.{name}: there is no level {level!r}")
        return self
