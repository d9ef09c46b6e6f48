"""What can go wrong with a study's films, seeded one by one, and what is said of it.

Films of `examples/crossing` differ in one factor at a time, by day and by night. A violation is
seeded into the second film of a clean pair: into what its account says, into what its level sets,
or into what its stored frames show while the account keeps silent.
"""

from __future__ import annotations

import copy
import re
import shutil
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from manipulations import FILMS, FOLDERS, OUTSIDER, FilmChange, FolderChange, judge_film

from sumo3dviz_pt.catalog import data_root
from sumo3dviz_pt.studies.certificate.accounts import account_faults
from sumo3dviz_pt.studies.certificate.acts import Acts
from sumo3dviz_pt.studies.certificate.comparison import compare, pixel_verdict
from sumo3dviz_pt.studies.certificate.evidence import Evidence, read_evidence
from sumo3dviz_pt.studies.file import load_study
from sumo3dviz_pt.studies.foresight import rider_of, subject_of_pair
from sumo3dviz_pt.studies.plan import StudyPlan, plan_study
from sumo3dviz_pt.studies.records import film_path, read_film_account
from sumo3dviz_pt.studies.stimuli import StimulusPair

RIDDEN, AHEAD = "traffic_W_E.54", "traffic_W_E.52"

STUDY = f"""scene: scene.yaml
clip: {{camera: driver, from: 453, to: 453.08}}
common:
  quality: draft
  output: {{size: [SIZE], tone: agx, glare: 0.02}}
  cameras.driver.vehicle: {RIDDEN}
  weather.wind: {{speed: 4 m/s, from: 270}}
factors:
  light: {{levels: {{day: {{template: city_day}}, night: {{template: city_night}}}}}}
  trees: {{levels: {{trees: {{}}, bare: {{objects: {{trees: null}}, ground: {{planting: none}}}}}}}}
  water: {{levels: {{dry: {{}}, rain: {{weather: {{preset: rain}}}}}}}}
  air: {{levels: {{clear: {{}}, fog: {{weather: {{fog: {{visibility: 150 m, height: 60 m}}}}}}}}}}
  ahead:
    levels:
      white: {{vehicles: {{by_id: {{{AHEAD}: {{colour: "#f4f4f2"}}}}}}}}
      red: {{vehicles: {{by_id: {{{AHEAD}: {{colour: "#b01010"}}}}}}}}
  gap: {{levels: {{far: {{}}, near: {{traffic: {{rides: {{{AHEAD}: {{delay: 0.4 s}}}}}}}}}}}}
  road: {{levels: {{grey: {{}}, brown: {{roads: {{colour: "#6a3030"}}}}}}}}
design: {{table: one_at_a_time.csv}}
certificate: {{frames: 2}}
"""
"""All films of one wind, so that leaves move alike."""

SEEN = "e_joining.46"

OTHER_STUDY = f"""scene: scene.yaml
clip: {{camera: overview, from: 482, to: 482.08}}
common:
  quality: draft
  output: {{size: [SIZE], tone: agx, glare: 0.02}}
  weather.wind: {{speed: 4 m/s, from: 270}}
factors:
  light: {{levels: {{day: {{template: highway_day}}, night: {{template: city_night}}}}}}
  trees: {{levels: {{trees: {{}}, bare: {{objects: {{trees: null}}, ground: {{planting: none}}}}}}}}
  ahead:
    levels:
      white: {{vehicles: {{by_id: {{{SEEN}: {{colour: "#f4f4f2"}}}}}}}}
      red: {{vehicles: {{by_id: {{{SEEN}: {{colour: "#b01010"}}}}}}}}
  gap: {{levels: {{far: {{}}, near: {{traffic: {{rides: {{{SEEN}: {{delay: 0.4 s}}}}}}}}}}}}
  road: {{levels: {{grey: {{}}, brown: {{roads: {{colour: "#6a3030"}}}}}}}}
design: {{table: one_at_a_time.csv}}
certificate: {{frames: 2}}
"""
"""Another scene, an urban motorway from above: no limit was set by it."""

OTHERS = {"trees": "bare", "ahead": "red", "gap": "near", "road": "brown"}
"""Its factors, and the level that the second film of a pair has."""

FACTORS = {"trees": "bare", "water": "rain", "air": "fog", "ahead": "red", "gap": "near",
           "road": "brown"}  # fmt: skip
"""Factors, and the level that the second film of a pair has."""

_BASE = {"trees": "trees", "water": "dry", "air": "clear", "ahead": "white", "gap": "far",
         "road": "grey"}  # fmt: skip


def write_study(
    folder: Path, *, size: str = "96, 54", by_night: Iterable[str] = tuple(FACTORS)
) -> Path:
    """Copy the example and write the study of its clean pairs beside it; return the study file.

    Args:
        folder: Where to.
        size: Of the films.
        by_night: Factors that have a pair by night, too.
    """
    return _write(folder, "crossing", STUDY.replace("SIZE", size), FACTORS, by_night)


def write_other_study(folder: Path, *, size: str = "96, 54") -> Path:
    """Do the same for another scene."""
    return _write(folder, "ronda", OTHER_STUDY.replace("SIZE", size), OTHERS, OTHERS)


def _write(
    folder: Path, example: str, study: str, factors: dict[str, str], by_night: Iterable[str]
) -> Path:
    """Copy an example, and write a study beside it whose films differ in one factor each."""
    shutil.copytree(data_root("examples") / example, folder)
    scene = (folder / "scene.yaml").read_text("utf-8")
    (folder / "scene.yaml").write_text(re.sub(r"(?m)^template:.*\n", "", scene), encoding="utf-8")
    base = [_BASE[factor] for factor in factors]
    levels = {
        factor: [*base[:n], level, *base[n + 1 :]]
        for n, (factor, level) in enumerate(factors.items())
    }
    lit = (("day", factors), ("night", by_night))
    rows = [("light", *factors)]
    rows += [
        (light, *row) for light, own in lit for row in (base, *(levels[factor] for factor in own))
    ]
    text = "\n".join(",".join(row) for row in rows)
    (folder / "one_at_a_time.csv").write_text(text + "\n", encoding="utf-8")
    (folder / "study.yaml").write_text(study, encoding="utf-8")
    return folder / "study.yaml"


# Judging ------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Judged:
    """What the certificate says of a pair into which something was seeded.

    Attributes:
        faults: All of them.
        light: Share of the blocks that are lit otherwise, and of those out of reach; NaN where the
            factor acts on all light.
        wrong: Pixels that differ in shape or colour and should not.
    """

    faults: tuple[str, ...]
    light: tuple[float, float]
    wrong: int


@dataclass(frozen=True)
class Films:
    """Films of the study, rendered.

    Attributes:
        plan: The study's.
        folder: Of all that came out.
    """

    plan: StudyPlan
    folder: Path

    def pair(self, factor: str, light: str) -> StimulusPair:
        """Return a clean pair."""
        lit = {each.name: each.profiles[0][0] for each in self.plan.stimuli}
        return next(
            pair for pair in self.plan.pairs if pair.factors == (factor,) and lit[pair.one] == light
        )

    def paths(self, pair: StimulusPair) -> tuple[Path, Path]:
        """Return where the two films of a pair lie."""
        films = {each.name: each for each in self.plan.stimuli}
        one, other = (
            film_path(self.folder, self.plan, films[name]) for name in (pair.one, pair.other)
        )
        return one, other

    def evidence(self, factor: str, light: str) -> tuple[Acts, list[tuple[Evidence, Evidence]]]:
        """Return where a clean pair's factor acts, and its two frames."""
        pair, films = self.pair(factor, light), {each.name: each for each in self.plan.stimuli}
        acts = subject_of_pair(self.plan.file, pair, rider=rider_of(films[pair.one])).acts
        both = [(path, read_film_account(path)) for path in self.paths(pair)]
        frames = [
            [read_evidence(path, n, account, unexposed=acts.picture) for path, account in both]
            for n in (0, 1)
        ]
        return acts, [(one, other) for one, other in frames]

    def judge_film(self, violation: Violation, folder: Path) -> tuple[str, ...]:
        """Return what is said of the second film of a pair when something was done to it."""
        assert violation.film is not None
        one, other = self.paths(self.pair(violation.factor, violation.light))
        return judge_film(violation.film, other, one, folder)

    def judge(self, factor: str, light: str, seeded: Violation | None = None) -> Judged:
        """Return what is said of a pair, clean or with something seeded into its second film."""
        pair, films = self.pair(factor, light), {each.name: each for each in self.plan.stimuli}
        paths = [film_path(self.folder, self.plan, films[name]) for name in (pair.one, pair.other)]
        accounts: list[Any] = [read_film_account(path) for path in paths]
        if seeded and seeded.account:
            accounts = copy.deepcopy(accounts)
            seeded.account(accounts[1])
            (seeded.first or (lambda account: None))(accounts[0])
        acts = subject_of_pair(self.plan.file, pair, rider=rider_of(films[pair.one])).acts
        said = account_faults(accounts[0], accounts[1], acts, pair.changed)
        found = []
        for number in (0, 1):
            one, other = (
                read_evidence(path, number, account, unexposed=acts.picture)
                for path, account in zip(paths, accounts, strict=True)
            )
            shown = seeded.shown(other) if seeded and seeded.shown else other
            found.append(compare(number, one, shown, acts))
        verdict = pixel_verdict(found, acts)
        blocks = [each.blocks for each in found if each.blocks is not None]
        judged = max(sum(int(each.judged.sum()) for each in blocks), 1)
        light_ = [sum(int(what.sum()) for what in some) / judged for some in (
            [each.lit for each in blocks], [each.beyond for each in blocks])]  # fmt: skip
        return Judged(
            (*said, *verdict.faults),
            (light_[0], light_[1]) if blocks else (np.nan, np.nan),
            sum(int(each.wrong.sum()) for each in found),
        )


@dataclass(frozen=True)
class Violation:
    """Something that is wrong with the second film of a pair.

    Attributes:
        said: What the certificate says of it, a pattern.
        account: What is changed in the film's account, if it tells it.
        shown: What is changed in its stored frames, if they show it.
        level: What its level sets beside the factor, if that is it.
        factor: Of the pair.
        light: Of the pair, day or night.
        first: What is changed in the first film's account, so that both tell of something.
        film: What is done to the second film itself.
        folder: What is done to the folder of a small study.
    """

    said: str
    account: Callable[[Any], None] | None = None
    shown: Callable[[Evidence], Evidence] | None = None
    level: str = ""
    factor: str = "ahead"
    light: str = "day"
    first: Callable[[Any], None] | None = None
    film: FilmChange | None = None
    folder: FolderChange | None = None

    @property
    def where(self) -> str:
        """Where it is seeded, in a word."""
        words = {
            "level": self.level,
            "account": self.account,
            "film": self.film,
            "folder": self.folder,
        }
        return next((word for word, own in words.items() if own), "pixels")

    def is_said(self, faults: tuple[str, ...]) -> bool:
        """Return whether a fault tells it."""
        return any(re.search(self.said, fault) for fault in faults)


def confounded(folder: Path, level: str) -> tuple[str, ...]:
    """Return what is said of a level that sets something beside its factor, before rendering."""
    one = f'{{vehicles: {{by_id: {{{AHEAD}: {{colour: "#f4f4f2"}}}}}}}}'
    other = one.replace("#f4f4f2", "#b01010")
    text = (
        f"scene: scene.yaml\nclip: {{camera: driver, from: 453, to: 453.08}}\n"
        f"common: {{cameras.driver.vehicle: {RIDDEN}}}\n"
        f"factors: {{ahead: {{levels: {{white: {one}, red: {other[:-1]}, {level}}}}}}}}}\n"
    )
    path = folder / "beside.yaml"
    path.write_text(text, encoding="utf-8")
    plan = plan_study(load_study(path))
    (pair,) = plan.pairs
    found = subject_of_pair(plan.file, pair, rider=RIDDEN)
    return tuple(f"levels also set {each}" for each in found.confounds)


# What accounts tell -------------------------------------------------------------------------


def _frame(key: str, change: Callable[[Any], Any], number: int = 1) -> Callable[[Any], None]:
    """Change a value of a frame."""

    def edit(account: Any) -> None:
        account["frames"][number][key] = change(account["frames"][number][key])

    return edit


def _set(**values: Any) -> Callable[[Any], None]:
    """Set values of an account."""
    return lambda account: account.update(values)


def _user(**values: Any) -> Callable[[Any], None]:
    """Change what is said of the first vehicle that is not the one ahead."""

    def edit(account: Any) -> None:
        users = account["road_users"]
        key = next(k for k in sorted(users) if k.startswith("vehicle:") and AHEAD not in k)
        users[key] = {**users[key], **values}

    return edit


def _turned(camera: Any) -> Any:
    """A camera that looks .05 degrees farther to the left."""
    angle = np.radians(0.05)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    x, y, z = camera["forward"]
    return {**camera, "forward": [*(turn @ [x, y]).tolist(), z]}


def _moved(camera: Any) -> Any:
    """A camera that stands 1 cm higher."""
    x, y, z = camera["position"]
    return {**camera, "position": [x, y, z + 0.01]}


def _late(account: Any) -> None:
    """A signal that changes a frame late."""
    account["signal_changes"] = [{**c, "frame": c["frame"] + 1} for c in account["signal_changes"]]


ACCOUNTS = {
    "one frame more": Violation("have 2 and 3 frames",
        lambda account: account["frames"].append(account["frames"][-1])),
    "a frame .04 s late": Violation(r"frame 1 shows 453\.04 s .* and 453\.08 s",
        _frame("time", lambda time: time + 0.04)),
    "another frame rate": Violation("frames per second", _set(frame_rate="30")),
    "the camera 1 cm higher": Violation(r"in frame 1 by 1 cm and", _frame("camera", _moved)),
    "the camera turned by .05 degrees": Violation(r"by 0 cm and 0\.05 deg",
        _frame("camera", _turned)),
    "a lens of 61 degrees": Violation("lenses of 60 and 61 deg",
        _frame("camera", lambda camera: {**camera, "fov": 61.0})),
    "another shutter": Violation("shutter is an instant",
        lambda account: account.update(shutter={"open": 0.02})),
    "exposure + .1 EV": Violation(r"exposure \[EV\] is",
        lambda account: account.update(exposure=account["exposure"] + 0.1)),
    "another tone curve": Violation("tone curve is agx .* and filmic", _set(tone="filmic")),
    "another glare": Violation("glare is", _set(glare=0.05)),
    "another response": Violation("camera's response is", _set(response="dashcam")),
    "another seed": Violation("no level changes this: .*seed: 7 -> 8",
        lambda account: account["scene"].update(seed=8)),
    "more samples": Violation("no level changes this: quality preset: spp",
        lambda account: account["preset"].update(spp=2)),
    "another version of the renderer": Violation("no level changes this: version of",
        lambda account: account["versions"].update(mitsuba="0")),
    "another trajectory file": Violation("no level changes this: input .*fcd.* other content",
        lambda account: account["inputs"].update(
            {next(k for k in account["inputs"] if "fcd" in k): "0"})),
    "a cyclist missing": Violation("only one film shows",
        _frame("drawn", lambda drawn: drawn[1:])),
    "a road user's other body": Violation("another body: vehicle:", _user(body="coupe")),
    "another road user's colour": Violation("another colour: vehicle:", _user(colour=[0, 1, 0])),
    "a road user elsewhere": Violation("road users are elsewhere: vehicle:", _user(motion="0")),
    "lamps of a road user lit": Violation("lamps are lit otherwise: vehicle:",
        _user(lamps=[{"frame": 0, "lit": ["brake"]}])),
    "a signal a frame late": Violation("traffic light C goes to .* in the first film only", _late),
    "another house": Violation("roads, houses, plants", _set(world="0")),
    "another sky": Violation("sky, sun or air are others", _set(light="0")),
    "the sun elsewhere": Violation("no level changes this: sky.sun",
        lambda account: account["scene"]["sky"].update(
            sun={"azimuth": 200.0, "elevation": 20.0})),
    "a mesh replaced under its name": Violation("traffic_W_E.obj: other content",
        lambda account: account["inputs"].update({"models/traffic_W_E.obj": "1"}),
        first=lambda account: account["inputs"].update({"models/traffic_W_E.obj": "0"})),
    "another picture before the film": Violation("overlays are others",
        _set(overlays={"frames_before": 25, "frames_after": 0})),
    "another weather in a frame": Violation("the weather is another in 1 frame",
        _frame("weather", lambda weather: {**weather, "wetness": 0.9})),
}  # fmt: skip
"""Seeded into what an account says."""

LEVELS = {
    "the level sets the seed": "seed: 8",
    "the level sets the exposure": "output.exposure: -0.5",
    "the level raises the eye by .5 m": "cameras.driver.eye_height: 1.84",
    "the level leaves a cyclist out": "traffic: {leave_out: [ride_10N.8]}",
    "the level sets the quality": "quality: reference",
    "the level ends the film later": "shots.0.to: 453.12",
    "the level moves the sun": "sky.sun: {azimuth: 200, elevation: 20}",
    OUTSIDER + "the level draws a text over the film": "overlays: {text: [{text: How near?}]}",
    OUTSIDER + "the level puts a picture before the film": "overlays: {before: [{text: Ready}]}",
    OUTSIDER + "the level sets the codec": "output.codec: h264_10",
}
"""Seeded into what a level sets beside its factor."""


# What pixels tell ---------------------------------------------------------------------------


def _layer(other: Evidence, name: str, where: Any, value: Any) -> Evidence:
    """Return a frame with other values in a layer."""
    changed = np.array(other.layers[name])
    changed[where] = value(changed[where]) if callable(value) else value
    return replace(other, layers={**other.layers, name: changed})


def _box(other: Evidence, share: float, left: float, top: float) -> tuple[slice, slice]:
    """Return a rectangle of a share of the picture."""
    height, width = other.things.shape
    rows, columns = (round(side * share**0.5) for side in (height, width))
    row, column = round(top * height), round(left * width)
    return slice(row, row + rows), slice(column, column + columns)


def _relit(factor: float, share: float, left: float = 0.62, top: float = 0.3) -> Any:
    """Light a rectangle otherwise."""

    def edit(other: Evidence) -> Evidence:
        radiance = np.array(other.radiance)
        radiance[_box(other, share, left, top)] *= factor
        return replace(other, radiance=radiance)

    return edit


def _sky_turned(other: Evidence) -> Evidence:
    """Turn the sky by 1 degree: a lens of 60 degrees has some pixels for it."""
    width = other.things.shape[1]
    shift = max(1, round(width / 60))
    radiance = np.array(other.radiance)
    sky = other.things == 0
    radiance[sky] = np.roll(radiance, shift, axis=1)[sky]
    return replace(other, radiance=radiance)


def _noise(other: Evidence) -> Evidence:
    """Draw the noise of all pixels anew, as another seed does."""
    rng = np.random.default_rng(8)
    drawn = rng.gamma(1.0, 1.0, (*other.things.shape, 1)).astype(np.float32)
    return replace(other, radiance=np.array(other.radiance) * drawn)


def _painted(other: Evidence) -> Evidence:
    """Paint a person before the picture."""
    where = _box(other, 0.01, 0.3, 0.5)
    things = np.array(other.things)
    things[where] = 77
    names = {**other.names, 77: "person:painted"}
    return _layer(replace(other, things=things, names=names), "depth", where, 6.0)


def _gone(label: str) -> Any:
    """Take things of a class away: what is behind them is seen, here the sky."""

    def edit(other: Evidence) -> Evidence:
        own = [number for number, name in other.names.items() if other.labels.get(name) == label]
        where = np.isin(other.things, own)
        assert where.any(), label
        gone = replace(other, things=np.where(where, 0, other.things))
        return _layer(gone, "depth", where, 0.0)

    return edit


def _of(label: str, name: str, value: Any) -> Any:
    """Change a layer where things of a class are seen."""

    def edit(other: Evidence) -> Evidence:
        own = [number for number, own in other.names.items() if other.labels.get(own) == label]
        where = np.isin(other.things, own)
        assert where.any(), label
        return _layer(other, name, where, value)

    return edit


def _stripes(other: Evidence) -> Evidence:
    """Move all by a pixel."""
    layers = {name: np.roll(layer, 1, axis=1) for name, layer in other.layers.items()}
    things, radiance = (
        np.roll(np.array(each), 1, axis=1) for each in (other.things, other.radiance)
    )
    return replace(other, things=things, layers=layers, radiance=radiance)


def _chequers(other: Evidence) -> Evidence:
    """Darken and brighten the pixels of a rectangle by turns: medians stay what they are."""
    radiance = np.array(other.radiance)
    part = radiance[_box(other, 0.02, 0.62, 0.45)]
    rows, columns = np.indices(part.shape[:2])
    part *= np.where((rows + columns) % 2, 1.6, 0.5)[..., None]
    return replace(other, radiance=radiance)


def _grey(other: Evidence) -> Evidence:
    """Take half of the colour out of all light; each pixel keeps its luminance."""
    radiance = np.array(other.radiance)
    level = (radiance @ np.float32([0.2126, 0.7152, 0.0722]))[..., None]
    return replace(other, radiance=(0.5 * radiance + 0.5 * level).astype(np.float32))


def _overdrawn(other: Evidence) -> Evidence:
    """Draw a bar over the film's picture."""
    drawn = np.array(other.picture)
    bar = drawn[_box(other, 0.01, 0.6, 0.45)]
    bar[:] = 255 - 255 * (bar > 127)
    return replace(other, overlaid=drawn)


_SHAPE = "shape or colour differs where the factor does not act"
_LIGHT = "light differs where the factor does not act"

PIXELS = {
    "2 % of the picture lit 2.5 times": Violation(_LIGHT, shown=_relit(2.5, 0.02)),
    "2 % lit 1.3 times, by night": Violation(
        f"({_LIGHT}|changed by hand)", shown=_relit(1.3, 0.02), light="night"),
    "7 % lit 2.5 times": Violation(_LIGHT, shown=_relit(2.5, 0.07)),
    "7 % lit 2.5 times, trees gone": Violation(_LIGHT, shown=_relit(2.5, 0.07, 0.2, 0.6),
                                               factor="trees"),
    "2 % lit 1.5 times, trees gone": Violation("changed by hand", shown=_relit(1.5, 0.02, 0.2, 0.6),
                                               factor="trees"),
    "2 % lit 1.5 times, another gap, by night": Violation(
        "changed by hand", shown=_relit(1.5, 0.02, 0.3, 0.6), factor="gap", light="night"),
    "chequers in 2 % of the light": Violation("changed by hand", shown=_chequers),
    "half of the colour gone from all light": Violation("changed by hand", shown=_grey),
    "a bar drawn over the film": Violation("drawn over the film", shown=_overdrawn),
    "the sky turned by 1 degree": Violation("the sky is another", shown=_sky_turned),
    "another seed": Violation("a typical pixel .* differs in light by", shown=_noise),
    "all of it 1.07 times as bright": Violation("a typical pixel .* differs in light by",
                                                shown=_relit(1.07, 1.0, 0.0, 0.0)),
    "a person painted in": Violation(f"{_SHAPE}.*person:painted", shown=_painted),
    "all shifted by a pixel": Violation(_SHAPE, shown=_stripes),
    "houses gone": Violation(_SHAPE, shown=_gone("building"), factor="trees"),
    "a road 2 cm lower, where its colour is the factor": Violation(
        _SHAPE, shown=_of("road", "depth", lambda d: d + 0.4), factor="road"),
    "water that leans by 50 degrees": Violation(
        _SHAPE, shown=_of("road", "normals", (0.77, 0.0, 0.64)), factor="water"),
    "walls turned, in rain": Violation(
        _SHAPE, shown=_of("building", "normals", (0.0, 0.6, 0.8)), factor="water"),
    "trees gone, in fog": Violation(_SHAPE, shown=_gone("vegetation"), factor="air"),
    "a pavement of another grey": Violation(
        _SHAPE, shown=_of("sidewalk", "albedo", lambda a: a + 0.02)),
}  # fmt: skip
"""Seeded into what stored frames show, while the account keeps silent."""


def all_violations() -> dict[str, Violation]:
    """Return all violations, by what they are and where they are seeded."""
    levels = {
        name: Violation(rf"levels also set {re.escape(level.partition(':')[0])}\b", level=level)
        for name, level in LEVELS.items()
    }
    pixels = {f"{name}, and the account silent": each for name, each in PIXELS.items()}
    films = {name: Violation(each.said, film=each) for name, each in FILMS.items()}
    folders = {
        f"{OUTSIDER}{name}": Violation(each.said, folder=each) for name, each in FOLDERS.items()
    }
    return {**ACCOUNTS, **levels, **pixels, **films, **folders}
