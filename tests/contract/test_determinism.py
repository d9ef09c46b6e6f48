"""The same inputs give the same things: no chance, clock or processor decides what there is."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from alike import assert_files_alike
from bakery.bake import completed_recipe
from bench.baked_files import baked_again
from bench.processor_accounts import library
from bench.processors import PROCESSORS, accounts_of, compared, differences

from sumo3dviz_pt.catalog import digest_of, find, names

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = ROOT / "sumo3dviz_pt"
GENERATORS = sorted(
    path for part in ("library", "world", "cast", "shot") for path in (PACKAGE / part).rglob("*.py")
)
MODULES = {"uuid", "random", "secrets"}
CLOCKS = {"time", "time_ns", "monotonic", "perf_counter", "process_time", "now", "today", "utcnow"}
SEEDED = {"default_rng", "Generator"}
UNSTABLE = {"argsort", "np.partition", "np.argpartition"}
# What is kept in the user's cache ages; what is in it does not hang on that.
MAY_SEE_A_CLOCK = {"cast/figures.py"}


def problems(tree: ast.Module, *, clock: bool = False) -> Iterator[str]:
    """What in a module can give another result each time, or on each processor."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import | ast.ImportFrom):
            names = [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            names += [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            yield from (f"imports {name}" for name in names if name.split(".")[0] in MODULES)
        if isinstance(node, ast.Attribute) and ast.unparse(node.value) == "np.random":
            yield from [f"np.random.{node.attr}"] * (node.attr not in SEEDED)
        if isinstance(node, ast.Call):
            yield from _calls(node, clock=clock)


def _calls(node: ast.Call, *, clock: bool) -> Iterator[str]:
    """The same of one call."""
    name = ast.unparse(node.func)
    owner, _, last = name.rpartition(".")
    if name == "hash":
        yield "hash() of words changes with every process"
    if last == "default_rng" and not node.args:
        yield f"{name}() without a seed"
    if not clock and last in CLOCKS and {"time", "dt", "datetime", "date"} & set(owner.split(".")):
        yield f"{name}() reads a clock"
    stable = any(
        each.arg == "kind" and ast.unparse(each.value) == "'stable'" for each in node.keywords
    )
    if {name, last} & UNSTABLE and not stable:
        yield f"{name}() leaves the order of equal values to the processor"


@pytest.mark.slow
def test_generators_know_no_chance_and_no_clock() -> None:
    found = []
    for path in GENERATORS:
        tree, name = ast.parse(path.read_text(encoding="utf-8")), path.relative_to(PACKAGE)
        clock = name.as_posix() in MAY_SEE_A_CLOCK
        found += [f"{name}: {problem}" for problem in problems(tree, clock=clock)]
    assert GENERATORS and not found


@pytest.mark.parametrize(
    "text",
    [
        "import uuid",
        "from random import random",
        "np.random.seed(3)",
        "np.random.normal()",
        "rng = np.random.default_rng()",
        "hash(name)",
        "time.time()",
        "dt.datetime.now()",
        "np.argsort(away)",
        "away.argsort()",
        "np.argpartition(away, 3)",
    ],
)
def test_the_lint_sees(text: str) -> None:
    assert list(problems(ast.parse(text)))


@pytest.mark.parametrize(
    "text",
    [
        "np.random.default_rng(seed)",
        "dt.datetime(2026, 6, 21)",
        'np.argsort(away, kind="stable")',
        'name.partition("@")',
        "def grow(rng: np.random.Generator): ...",
    ],
)
def test_the_lint_lets_pass(text: str) -> None:
    assert not list(problems(ast.parse(text)))


# Two times the same, and on two processors ------------------------------------------------------

MADE = dict(library())
CHEAP = [name for name in MADE if name.startswith(("people", "plain", "buildings", "street"))]
DEAR = [name for name in MADE if name.startswith("plants")]
DEAR += ["vehicles/hatchback/full", "vehicles/motorcycle/full"]
VEHICLES = [name for name in names("vehicles") if "units" not in find("vehicles", name).meta]
TWICE = ("bicycle_sport", "city_car", "quadcopter", "trailer_tank", "wagon_tank")
BAKED = (
    *TWICE,
    "motorcycle",
    "tram_middle",
    "van_compact",
    "truck_tractor",
    "ship_hold",
    "airliner",
)
"""Of each builder; `bench/baked_files.py` makes all vehicles again and compares."""

PLAIN = ("vehicles/ship_hold/baked", "people/boy_ten", "buildings/homes/brick", "plants/broom")
"""What every processor builds in these tests; `bench/processors.py` compares all that there is."""


@pytest.mark.parametrize(
    "name", [*CHEAP, *(pytest.param(name, marks=pytest.mark.slow) for name in DEAR)]
)
def test_what_is_built_twice_is_the_same(name: str) -> None:
    assert not list(differences(MADE[name](), MADE[name](), near=0.0))


@pytest.mark.parametrize("name", VEHICLES)
def test_no_recipe_was_changed_after_its_files_were_made(name: str) -> None:
    entry = find("vehicles", name)
    assert entry.meta["made_from"] == digest_of(completed_recipe(entry.folder))


@pytest.mark.slow
@pytest.mark.parametrize("name", BAKED)
def test_baked_files_are_what_the_recipe_says(name: str, tmp_path: Path) -> None:
    made = baked_again(name, tmp_path / "one")
    assert_files_alike(made, find("vehicles", name).folder)
    for path in baked_again(name, tmp_path / "two").iterdir() if name in TWICE else ():
        assert path.read_bytes() == (made / path.name).read_bytes()


@pytest.fixture(scope="module")
def here(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What this machine's own processor builds."""
    folder = tmp_path_factory.mktemp("this")
    accounts_of("this", folder, only=PLAIN, scenes=())
    return folder


@pytest.mark.slow
@pytest.mark.parametrize("processor", ["Prescott", "old", "Haswell", "SkylakeX", "shaken"])
def test_other_processors_build_the_same(processor: str, here: Path, tmp_path: Path) -> None:
    if processor not in PROCESSORS:
        pytest.skip("this machine's processor lacks what that one has")
    accounts_of(processor, tmp_path, only=PLAIN, scenes=())
    assert len(list(tmp_path.glob("*.npz"))) == len(PLAIN)
    assert not list(compared(here, tmp_path))


def test_the_comparison_sees() -> None:
    one = {"faces": np.array([[0, 1, 2]]), "vertices": np.zeros((3, 3)), "names": np.array(["a"])}
    assert not list(differences(one, dict(one)))
    for key, value in (
        ("faces", np.array([[0, 2, 1]])),
        ("faces", np.zeros((2, 3), dtype=int)),
        ("vertices", np.full((3, 3), 2e-3)),
        ("vertices", np.full((3, 3), np.nan)),
        ("names", np.array(["b"])),
    ):
        assert list(differences(one, {**one, key: value}))
    assert list(differences(one, {"faces": one["faces"]}))
