"""Damaged frames and damaged states of farms end well, or in one clear sentence."""

from __future__ import annotations

import copy
import json
import math
import random
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import view_at
from searching import tries

from sumo3dviz_pt.cli import main
from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.farm.plan import PLAN, EngineChoice, FarmFilm, FarmPlan, FarmTask, write_plan
from sumo3dviz_pt.farm.state import TRIES, End, Outcome, finish, take
from sumo3dviz_pt.image import exr
from sumo3dviz_pt.model.layers import Layers
from sumo3dviz_pt.model.traced import TracedFrame
from sumo3dviz_pt.pipeline.films.traced import write_traced
from sumo3dviz_pt.render.passes.finish import Finishing

ODD: tuple[Any, ...] = (
    None, True, -1, 0, 7, 10**30, 1.5, math.inf, math.nan,
    "", "a", "9" * 5000, [], [[]], {}, {"a": 1},
)  # fmt: skip


def places(value: Any) -> Iterator[tuple[Any, Any]]:
    """Go through all containers of a JSON value, each with a key of it."""
    items = value.items() if isinstance(value, dict) else enumerate(value)
    for key, inner in list(items):
        yield value, key
        if isinstance(inner, dict | list):
            yield from places(inner)


def damaged_json(chance: random.Random, content: Any) -> bytes:
    """A value that lacks something, holds something odd, or is cut."""
    content = copy.deepcopy(content)
    how = chance.choice(("odd", "odd", "odd", "lost", "cut", "whole", "bytes"))
    inner, key = chance.choice(list(places(content)))
    if how == "odd":
        inner[key] = chance.choice(ODD)
    elif how == "lost":
        del inner[key]
    elif how == "whole":
        content = chance.choice(ODD)
    text = json.dumps(content).encode()
    if how == "cut":
        return text[: chance.randrange(len(text))]
    return damaged_bytes(chance, text) if how == "bytes" else text


def damaged_bytes(chance: random.Random, content: bytes) -> bytes:
    """A file that is cut, empty, or has other bytes here and there or in a row."""
    some, how = bytearray(content), chance.choice(("cut", "empty", "flip", "head", "row"))
    if how == "cut":
        return bytes(some[: chance.randrange(len(some))])
    if how == "empty":
        return b""
    if how == "row":
        begin = chance.randrange(len(some))
        return content[:begin] + bytes(chance.randrange(1, 200)) + content[begin + 200 :]
    for _ in range(chance.choice((1, 1, 3, 30))):
        place = chance.randrange(min(len(some), 700) if how == "head" else len(some))
        some[place] = chance.randrange(256)
    return bytes(some)


def one_sentence(said: str, *names: str) -> bool:
    """Whether a command said one thing that names a file, notes apart."""
    lines = [line for line in said.splitlines() if line.strip() and ": note: " not in line]
    return len(lines) == 1 and any(name in lines[0] for name in names) and len(lines[0]) < 600


# Frames ------------------------------------------------------------------------------------


READERS = (exr.read_exr, exr.read_layers, exr.read_attributes, exr.read_channels)


@pytest.fixture
def frame(tmp_path: Path) -> Path:
    """A frame of four layers."""
    dice = np.random.default_rng(0)
    layers = {"radiance": dice.random((18, 32, 3)), "albedo": dice.random((18, 32, 3))}
    layers |= {"depth": dice.random((18, 32)), "ids": np.zeros((18, 32), np.float16)}
    path = tmp_path / "000000.exr"
    exr.write_exr(path, layers, attributes={exr.PROVENANCE: "{}"})
    return path


def test_damaged_frames_are_refused_in_one_sentence(frame: Path, capfd) -> None:
    """Whatever the library prints of them is not passed on, on no stream."""
    good = frame.read_bytes()
    for seed in range(tries(60)):
        frame.write_bytes(damaged_bytes(random.Random(seed), good))
        for read in READERS:
            try:
                read(frame)
            except InputError as error:
                assert one_sentence(str(error), frame.name), (seed, str(error))
    said = capfd.readouterr()
    assert said.out == said.err == ""


def test_a_header_that_promises_too_much_is_refused_before_memory_is_taken(frame: Path) -> None:
    """Sixteen million columns of a file of some kilobytes."""
    content = frame.read_bytes()
    window = content.index(b"dataWindow\0box2i\0") + 17 + 4
    wide = (2**24).to_bytes(4, "little")
    frame.write_bytes(content[: window + 8] + wide + content[window + 12 :])
    for read in READERS:
        with pytest.raises(InputError, match="promises too much"):
            read(frame)


@pytest.mark.parametrize("channels", [("R", "G"), ("Y",), ("depth.Z",), ("A",)])
def test_frames_without_colours_are_refused(tmp_path: Path, channels: tuple[str, ...]) -> None:
    path = tmp_path / "000000.exr"
    exr.write_channels(path, {name: np.zeros((4, 6), np.float32) for name in channels}, {})
    for read in (exr.read_exr, exr.read_layers):
        with pytest.raises(InputError, match="holds no R, G and B channels"):
            read(path)


# Farms -------------------------------------------------------------------------------------


@pytest.fixture
def farm(tmp_path: Path) -> FarmPlan:
    """A farm of two chunks and a film, with a try that failed and one that is at work."""
    tasks = (
        FarmTask(("render", "s.yaml", "--frames", "0:4"), 0, (0, 4), (), 40.0),
        FarmTask(("render", "s.yaml", "--frames", "4:8"), 0, (4, 8), (), 40.0),
        FarmTask(("render", "s.yaml"), 0, None, (0, 1), 20.0),
    )
    films = (FarmFilm("a.mp4", 8),)
    plan = FarmPlan(tmp_path / "a.farm", tasks, films, EngineChoice(), "..", lease=60.0)
    write_plan(plan)
    for number in (1, 2):
        own = take(plan.folder, 0, number)
        assert own is not None
        if number == 1:
            finish(plan.folder, own, End(Outcome.FAILED, 2, 2, "an accident"))
    return plan


@pytest.mark.slow
def test_damaged_states_of_farms_are_told_in_one_sentence(farm: FarmPlan, capsys) -> None:
    files = [farm.folder / PLAN, *sorted((farm.folder / TRIES).iterdir())]
    assert len(files) == 4
    output = str(farm.folder.with_suffix(".mp4"))
    for seed in range(tries(150)):
        chance = random.Random(seed)
        file = chance.choice(files)
        good = file.read_bytes()
        file.write_bytes(damaged_json(chance, json.loads(good)))
        for command in ("status", "stop"):
            code = main(["farm", command, output])
            said = capsys.readouterr()
            assert code in (0, 1, 2), (seed, code)
            assert code != 2 or one_sentence(said.err, file.name), (seed, said.err)
        (farm.folder / "stop").unlink(missing_ok=True)
        file.write_bytes(good)


# Stored films ------------------------------------------------------------------------------


def traced_film(folder: Path) -> None:
    """Three frames as they are traced, and the film's account."""
    dice = np.random.default_rng(1)
    account = {"key": "k", "scene": {"output": {}}, "preset": {"accumulate": 1}, "exposure": 0.0}
    account |= {"shot": {"frames": 3, "fps": 10}, "tone": "neutral", "glare": 0.0, "seed": 1}
    how = Finishing("none", True, 0.0, None, np.ones((8, 3), np.float32))
    view = view_at((0, 0, 2))
    folder.mkdir()
    for number in range(3):
        layers = {"radiance": dice.random((18, 32, 3)), "albedo": dice.random((18, 32, 3))}
        layers |= {"normal": np.tile([0.0, 0.0, 1.0], (18, 32, 1)), "ids": np.zeros((18, 32))}
        layers |= {name: np.full((18, 32), 9.0) for name in ("depth", "first_depth")}
        layers |= {"hit": np.ones((18, 32))}
        single = Layers({name: one.astype(np.float32) for name, one in layers.items()})
        traced = TracedFrame(single, view, 1.0, 4, ())
        own = {**account, "time": number / 10}
        write_traced(folder / f"{number:06d}.exr", traced, how, account=own, half=True)
    (folder / "film.json").write_text(json.dumps(account), encoding="utf-8")


def damaged_frame(chance: random.Random, file: Path) -> None:
    """Damage a frame's bytes, what it says of itself, its channels, or its size."""
    if chance.random() < 0.3:
        file.write_bytes(damaged_bytes(chance, file.read_bytes()))
        return
    channels, strings = exr.read_channels(file)
    how = chance.choice(("text", "text", "text", "channel", "size"))
    if how == "text":
        key = chance.choice(sorted(strings))
        said = json.loads(strings[key])
        strings[key] = damaged_json(chance, said).decode("utf-8", "replace").replace("\0", "")
    elif how == "channel":
        del channels[chance.choice(sorted(channels))]
    else:
        channels = {name: one[:12] for name, one in channels.items()}
    exr.write_channels(file, channels, strings)


def test_damaged_films_are_told_in_one_sentence(tmp_path: Path, capsys) -> None:
    folder, picture = tmp_path / "a.frames", tmp_path / "{frame}.png"
    traced_film(folder)
    good = {path: path.read_bytes() for path in folder.iterdir()}
    for seed in range(tries(60)):
        chance = random.Random(seed)
        file = chance.choice(sorted(good))
        if file.suffix == ".json":
            file.write_bytes(damaged_json(chance, json.loads(good[file])))
        else:
            damaged_frame(chance, file)
        code = main(["develop", str(folder), "-o", str(picture), "--overwrite"])
        said = capsys.readouterr().err
        assert code in (0, 2), (seed, code, said)
        assert code == 0 or one_sentence(said, file.name, folder.name, "tone"), (seed, said)
        file.write_bytes(good[file])
