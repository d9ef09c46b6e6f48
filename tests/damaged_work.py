"""Seeded damage to what lies beside a scene: studies and tables, other logs, frames, states.

As in `damage`, a case is a kind and a number. What is done with it is a command line.
"""

from __future__ import annotations

import gzip
import io
import json
import os
import re
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from damage import (
    NETWORK,
    NUMBERS,
    SCENE,
    SIGNALS,
    WORDS,
    YAML_BITS,
    Chance,
    damaged_bytes,
    damaged_yaml,
    log_text,
    write_town,
)

STUDY = """scene: scene.yaml
clip: {camera: post, from: 4, to: 4.3}
common: {quality: draft}
factors:
  light:
    about: time of day
    levels: {day: {}, dusk: {sky: {sun: {elevation: 3, azimuth: 260}}}}
  paint:
    levels:
      red: {vehicles: {by_id: {c0: {colour: "#c00000"}}}}
      blue: {vehicles: {by_id: {c0: {colour: "#0000c0"}}}}
design: full
seed: 4
exclude: [{light: dusk, paint: [blue]}]
playlists: {order: latin, count: 6, parts: 1, repeat: 1}
question: {text: How safe?, low: not, high: very, answers: ["1", "2", "3"], language: en}
tools: {url: "https://example.org/x", write: [jspsych, psychopy], cards: false}
about: {title: A test, description: something, licence: CC0, authors: [a b], keywords: [a]}
"""
ROWS = [("task", "alternative", "light", "paint")] + [
    (str(task), str(place), light, paint)
    for task in range(1, 4)
    for place, light, paint in ((1, "day", "red"), (2, "dusk", "blue"))
]

Case = Callable[[Path, Chance], list[str]]
"""Damages something beside a scene file; returns the command that reads it."""


def _check(scene: Path) -> list[str]:
    return ["check", str(scene)]


def _planned(scene: Path) -> list[str]:
    return ["study", str(scene.with_name("study.yaml")), "-o", str(scene.parent / "o"), "--dry-run"]


def _study(scene: Path, rng: Chance) -> list[str]:
    """A damaged study file."""
    scene.with_name("study.yaml").write_bytes(damaged_yaml(STUDY, rng))
    return _planned(scene)


def _cell(rows: list[list[str]], rng: Chance) -> None:
    """Another value for a cell, or a row more or less."""
    row = int(rng.integers(len(rows)))
    column = int(rng.integers(len(rows[row])))
    odd = (*NUMBERS, *WORDS, "dusk", '"', ",", ";", "\n")
    ways: tuple[Callable[[], object], ...] = (
        lambda: rows[row].__setitem__(column, odd[int(rng.integers(len(odd)))]),
        lambda: rows[row].pop(column),
        lambda: rows.insert(row, list(rows[row])),
        lambda: rows[row].append("day"),
    )
    ways[int(rng.choice(4, p=[0.7, 0.1, 0.1, 0.1]))]()


def _sheet(rows: list[list[str]]) -> bytes:
    import openpyxl
    from openpyxl.utils.exceptions import IllegalCharacterError

    book, file = openpyxl.Workbook(), io.BytesIO()
    for row in rows:
        try:
            book.active.append(row)
        except IllegalCharacterError:
            book.active.append(["?"])
    book.save(file)
    return file.getvalue()


def _table(scene: Path, rng: Chance) -> list[str]:
    """A damaged design table."""
    rows = [list(row) for row in ROWS]
    kind, torn = ("csv", "tsv", "xlsx", "xlsx")[int(rng.integers(4))], rng.random() < 0.5
    if not torn:
        for _ in range(int(rng.integers(1, 3))):
            _cell(rows, rng)
    sign = "\t" if kind == "tsv" else ","
    text = "\n".join(sign.join(row) for row in rows) + "\n"
    data = _sheet(rows) if kind == "xlsx" else text.encode("utf-8", "surrogatepass")
    scene.with_name(f"d.{kind}").write_bytes(damaged_bytes(data, rng) if torn else data)
    text = STUDY.replace("design: full", f"design: {{table: d.{kind}}}")
    scene.with_name("study.yaml").write_text(re.sub("exclude.*\n", "", text), encoding="utf-8")
    return _planned(scene)


def _rows_of_log() -> dict[str, list[object]]:
    """The log as columns."""
    found: dict[str, list[object]] = {}
    for time, step in re.findall(r'<timestep time="([^"]+)">(.*?)</timestep>', log_text(), re.S):
        for vehicle in re.findall(r"<vehicle (.*?)/>", step):
            row = {"timestep_time": float(time)}
            row |= {f"vehicle_{key}": value for key, value in re.findall(r'(\w+)="(.*?)"', vehicle)}
            row = {key: row.get(key, "") for key in _COLUMNS}
            for key, value in row.items():
                number = key.rsplit("_", 1)[1] in ("x", "y", "angle", "speed", "pos")
                found.setdefault(key, []).append(float(value) if number else value)
    return found


_KEYS = ("id", "type", "x", "y", "angle", "speed", "pos", "lane")
_COLUMNS = ("timestep_time", *(f"vehicle_{key}" for key in _KEYS))


def _csv_log(scene: Path, rng: Chance) -> list[str]:
    """A damaged log of comma-separated values, perhaps packed."""
    columns = _rows_of_log()
    rows = [list(columns), *(list(map(str, row)) for row in zip(*columns.values(), strict=True))]
    packed, torn = rng.random() < 0.3, rng.random() < 0.4
    if not torn:
        _cell(rows, rng)
    text = "\n".join(";".join(row) for row in rows) + "\n"
    data = text.encode("utf-8", "surrogatepass")
    data = damaged_bytes(data, rng) if torn else data
    return (
        _other_log(scene, "fcd.csv.gz", gzip.compress(data, mtime=0))
        if packed
        else _other_log(scene, "fcd.csv", data)
    )


def _other_log(scene: Path, name: str, data: bytes) -> list[str]:
    scene.with_name(name).write_bytes(data)
    _change(scene, "[fcd.xml]", f"[{name}]")
    return _check(scene)


def _change(scene: Path, old: str, new: str) -> None:
    text = scene.read_text(encoding="utf-8")
    assert old in text
    scene.write_text(text.replace(old, new), encoding="utf-8")


def _parquet_log(scene: Path, rng: Chance) -> list[str]:
    """A damaged log in Parquet, or one with an odd column."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    columns, file = _rows_of_log(), io.BytesIO()
    torn = rng.random() < 0.6
    if not torn:
        name = list(columns)[int(rng.integers(len(columns)))]
        count = len(columns[name])
        odd: tuple[list[object], ...] = (
            [None] * count, [float("nan")] * count, [b"x"] * count, [[1]] * count,
            [True] * count, ["\x1b"] * count, [1e300] * count, [2**62] * count,
        )  # fmt: skip
        columns[name] = odd[int(rng.integers(len(odd)))]
    pq.write_table(pa.table(columns), file)
    data = file.getvalue()
    return _other_log(scene, "fcd.parquet", damaged_bytes(data, rng) if torn else data)


def _packed(scene: Path, rng: Chance) -> list[str]:
    """A damaged packed network, log or signal log."""
    texts = {"net.net.xml": NETWORK, "fcd.xml": log_text(), "tls.xml": SIGNALS}
    name = list(texts)[int(rng.integers(3))]
    data = gzip.compress(texts[name].encode(), mtime=0)
    scene.with_name(f"{name}.gz").write_bytes(damaged_bytes(data, rng))
    _change(scene, name, f"{name}.gz")
    return _check(scene)


# What a run leaves -------------------------------------------------------------------------

ACCOUNT: Mapping[str, object] = {
    "key": "k", "command": "sumo3dviz-pt render", "exposure": 0.0, "tone": "srgb", "glare": 0.0,
    "camera": "post", "scene": {"seed": 3, "output": {"tone": "srgb"}},
    "shot": {"from": 4.0, "fps": 12.5, "frames": 2}, "world": "w", "plan": "p",
    "versions": {"sumo3dviz_pt": "1"}, "files": {"a.net.xml": "00"},
}  # fmt: skip


def _damaged_json(content: object, rng: Chance) -> bytes:
    """JSON with another value anywhere, or torn."""
    text = json.dumps(content)
    if rng.random() < 0.3:
        return damaged_bytes(text.encode(), rng)
    values = list(
        re.finditer(r'(?<=: )("[^"]*"|-?[\d.]+|null|true|false)|(?<=[\[,] )[\w."]+', text)
    )
    match = values[int(rng.integers(len(values)))]
    odd = (
        *("null", "[]", "{}", "-1", "1e400", "NaN", "true", '""', '"x"', "[[1]]", '{"a": 1}'),
        *("99999999999999999999", '"\\ud800"', '"a\\nb"', '"../../x"', '"' + "x" * 3000 + '"'),
    )
    return (text[: match.start()] + odd[int(rng.integers(len(odd)))] + text[match.end() :]).encode()


def _frames(scene: Path, rng: Chance) -> list[str]:
    """A damaged frame among those of a film, or a damaged note of them."""
    from sumo3dviz_pt.image.exr import PROVENANCE, write_exr

    folder = scene.parent / "f"
    folder.mkdir()
    note = rng.random() < 0.4
    for number in range(2):
        known = {**ACCOUNT, "frame": number, "time": 4.0 + number / 12.5}
        text = json.dumps(known)
        if note and number and rng.random() < 0.5:
            text = _damaged_json(known, rng).decode("utf-8", "replace")
        write_exr(
            folder / f"{number:06d}.exr",
            {"radiance": np.full((18, 32, 3), 0.2, np.float32)},
            attributes={PROVENANCE: text},
        )
    (folder / "film.json").write_bytes(_damaged_json(ACCOUNT, rng) if note else b"{}")
    if not note:
        path = folder / "000001.exr"
        path.write_bytes(damaged_bytes(path.read_bytes(), rng))
    out = str(scene.parent / "o")
    ways = (
        ["develop", str(folder / "000001.exr"), "-o", f"{out}.png"],
        ["develop", str(folder), "-o", f"{out}_{{frame}}.png"],
        ["report", str(folder), "-o", out],
        ["compare", str(folder), str(folder / "000001.exr")],
    )
    return ways[int(rng.integers(len(ways)))]


def _accounts(scene: Path, rng: Chance) -> list[str]:
    """A damaged account of a film, compared with a whole one."""
    from sumo3dviz_pt.image.png import write_png

    one, other = scene.with_name("a.json"), scene.with_name("b.json")
    one.write_text(json.dumps(ACCOUNT), encoding="utf-8")
    other.write_bytes(_damaged_json(ACCOUNT, rng))
    if rng.random() < 0.3:
        other = scene.with_name("b.png")
        text = {"sumo3dviz_pt": _damaged_json(ACCOUNT, rng).decode("utf-8", "replace")}
        write_png(other, np.zeros((4, 4, 3), np.uint8), text=text)
        other.write_bytes(damaged_bytes(other.read_bytes(), rng))
    return ["compare", str(one), str(other)]


def _farm(scene: Path, rng: Chance) -> list[str]:
    """A damaged plan of a farm, or a damaged try of a task."""
    from sumo3dviz_pt.farm.plan import PLAN, EngineChoice, FarmFilm, FarmPlan, FarmTask, write_plan
    from sumo3dviz_pt.farm.state import End, Outcome, finish, take

    tasks = (
        FarmTask(("render", "--frames", "0:4"), 0, (0, 4), (), 40.0),
        FarmTask(("render", "--frames", "4:8"), 0, (4, 8), (), 40.0),
        FarmTask(("render",), 0, None, (0, 1), 20.0),
    )
    folder = scene.parent / "a.farm"
    plan = FarmPlan(folder, tasks, (FarmFilm("a.mp4", 8),), EngineChoice(), "..", lease=60.0)
    write_plan(plan)
    own = take(folder, 0, 1)
    assert own is not None
    finish(folder, own, End(next(iter(Outcome))))
    take(folder, 1, 1)
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    path = folder / PLAN if rng.random() < 0.5 else files[int(rng.integers(len(files)))]
    try:
        damaged = _damaged_json(json.loads(path.read_bytes()), rng)
    except ValueError:
        damaged = damaged_bytes(path.read_bytes(), rng)
    path.write_bytes(damaged)
    return ["farm", "status", str(folder), *(["--json"] if rng.random() < 0.5 else [])]


def _special(scene: Path, rng: Chance) -> list[str]:
    """A pipe, a device or a folder where a file should be."""
    scene.with_name("study.yaml").write_text(STUDY, encoding="utf-8")
    names = sorted(path.name for path in scene.parent.iterdir())
    path = scene.with_name(names[int(rng.integers(len(names)))])
    path.unlink()
    what = int(rng.integers(3))
    if what == 0 and hasattr(os, "mkfifo"):
        os.mkfifo(path)
    elif what == 1 and Path("/dev/zero").exists():
        path.symlink_to("/dev/zero")
    else:
        path.mkdir()
    if path.suffix in (".glb", ".ply", ".stl"):
        own = scene.with_name("own.yaml")
        if own.is_file():
            _change(own, "own.obj", path.name)
    if path.suffix in (".hdr", ".exr") and scene.is_file():
        start, end = SCENE.index("sky: {"), SCENE.index("\nground:")
        _change(scene, SCENE[start:end], f"sky: {{file: {path.name}}}")
    return _planned(scene) if path.name == "study.yaml" else _check(scene)


def _words(scene: Path, rng: Chance) -> list[str]:
    """An odd command line."""
    odd = (*NUMBERS, *WORDS, *YAML_BITS)

    def any_word() -> str:
        return odd[int(rng.integers(len(odd)))]

    key = ("output.fps", "cameras.post.lens.fov", "sky", "weather", "shots.0.to", any_word())
    ways = (
        ["check", str(scene), "--set", f"{key[int(rng.integers(len(key)))]}={any_word()}"],
        ["check", str(scene), "--size", any_word()],
        ["vehicles", str(scene), "--at", any_word()],
        ["render", str(scene), "--dry-run", "-o", f"{scene.parent}/{any_word()}.mp4"],
        ["render", str(scene), "--dry-run", "-o", f"{scene.parent}/a.mp4", "--fps", any_word()],
        ["study", f"{scene.parent}/{any_word()[:20]}", "-o", str(scene.parent / "o")],
        ["compare", any_word(), str(scene)],
        [any_word(), str(scene)],
    )
    return ways[int(rng.integers(len(ways)))]


CASES: Mapping[str, Case] = {
    "study": _study,
    "tables": _table,
    "csv": _csv_log,
    "parquet": _parquet_log,
    "packed": _packed,
    "frames": _frames,
    "accounts": _accounts,
    "farm": _farm,
    "special": _special,
    "words": _words,
}
"""What is damaged, by the name of a kind."""


def command_of(folder: Path, kind: str, seed: int) -> list[str]:
    """Write a scenario with one case's damage; returns the command that reads it."""
    return CASES[kind](write_town(folder), np.random.default_rng([seed, *kind.encode()]))
