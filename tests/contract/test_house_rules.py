"""The style guide's rules that a program can check."""

from __future__ import annotations

import ast
import re
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator
from functools import cache
from pathlib import Path

import pytest
from needed import lacking

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = ROOT / "sumo3dviz_pt"
MODULES = sorted(PACKAGE.rglob("*.py"))
LONGEST_MODULE = 600  # lines
BANNED_CALLS = {"os.fork", "os.forkpty", "os.system", "sys.exit", "exit", "quit", "eval", "exec"}
POSIX_ONLY = {"fcntl", "resource", "pwd", "grp", "termios", "pty"}
MAY_EXIT_AND_PRINT = "cli/"
MACHINE_PATH = re.compile(
    r"(?<![\w.])/(?:home|root|Users|work|mnt|data)/\w|[A-Z]:\\\\?(?:Users|work)"
)
REGISTRY = re.compile(r"https?://[^\s/]*(?:pypi|artifact|nexus|mirror|registry)", re.I)
LATE = {"mitsuba", "drjit", "trimesh", "colour", "imageio_ffmpeg", "matplotlib", "aiohttp"}
LATE |= {"pyarrow", "pyproj", "openpyxl", "PIL", "distributed"}


def name_of(path: Path) -> str:
    return path.relative_to(PACKAGE).as_posix()


@cache
def tree_of(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


@cache
def nodes_of(path: Path) -> tuple[ast.AST, ...]:
    return tuple(ast.walk(tree_of(path)))


@cache
def tracked() -> tuple[str, ...]:
    """Files that the repository holds."""
    if shutil.which("git") is None or not (ROOT / ".git").exists():
        pytest.skip("no git repository here")
    done = subprocess.run(
        ["git", "-C", str(ROOT), "ls-files", "-z"], capture_output=True, text=True, check=False
    )
    if done.returncode:
        pytest.skip(f"git does not list files: {done.stderr.strip()}")
    return tuple(name for name in done.stdout.split("\0") if name and (ROOT / name).is_file())


def dotted(node: ast.expr) -> str:
    """A called name such as `os.fork`."""
    if isinstance(node, ast.Attribute):
        return f"{dotted(node.value)}.{node.attr}"
    return node.id if isinstance(node, ast.Name) else "?"


def guarded(tree: ast.Module) -> set[int]:
    """Lines inside a try or an if, where an import may fail or be left out."""
    blocks = [node for node in ast.walk(tree) if isinstance(node, ast.Try | ast.If)]
    return {line for node in blocks for line in range(node.lineno, (node.end_lineno or 0) + 1)}


def imports(nodes: Iterable[ast.AST]) -> list[tuple[str, int]]:
    """Imported top-level packages and their lines."""
    found = []
    for node in nodes:
        if isinstance(node, ast.Import):
            found += [(alias.name.split(".")[0], node.lineno) for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            found.append((node.module.split(".")[0], node.lineno))
    return found


def faults_of(path: Path) -> Iterator[str]:
    """Return what in a module is against the house rules."""
    tree, lines = tree_of(path), path.read_text(encoding="utf-8").count("\n")
    if lines > LONGEST_MODULE:
        yield f"{lines} lines; split it"
    if (path.name != "__init__.py" or tree.body) and not ast.get_docstring(tree):
        yield "no module docstring"
    banned = set() if name_of(path).startswith(MAY_EXIT_AND_PRINT) else {*BANNED_CALLS, "print"}
    for node in nodes_of(path):
        if isinstance(node, ast.Call) and dotted(node.func) in banned:
            yield f"{dotted(node.func)} in line {node.lineno}"
        if isinstance(node, ast.ExceptHandler) and node.type is None:
            yield f"bare except in line {node.lineno}"
    for package, line in imports(nodes_of(path)):
        if package in POSIX_ONLY and line not in guarded(tree):
            yield f"{package} is not everywhere, line {line}"


NO_CODE_OUT_OF_DATA = {"pickle", "cPickle", "cloudpickle", "dill", "joblib", "marshal", "shelve"}


def code_out_of_data(path: Path) -> Iterator[str]:
    """Return where a module lets data become code."""
    for package, line in imports(nodes_of(path)):
        if package in NO_CODE_OUT_OF_DATA:
            yield f"{package} in line {line}"
    for node in nodes_of(path):
        if isinstance(node, ast.Call):
            called, words = dotted(node.func), [ast.unparse(word) for word in node.keywords]
            wrong = {
                "np.load": "allow_pickle=False" not in words,
                "numpy.load": True,
                "yaml.load": not any("SafeLoader" in word for word in words),
                **dict.fromkeys(("yaml.unsafe_load", "yaml.full_load", "yaml.load_all"), True),
                **dict.fromkeys(("builtins.eval", "builtins.exec", "__import__"), True),
            }
            if wrong.get(called) or "allow_pickle=True" in words:
                yield f"{called} in line {node.lineno}"


@pytest.mark.parametrize("faults", [faults_of, code_out_of_data])
def test_modules_keep_the_house_rules(faults: Callable[[Path], Iterator[str]]) -> None:
    """Among them: caches, frames, states and users' files hold values only (law 11)."""
    found = [f"{name_of(path)}: {fault}" for path in MODULES for fault in faults(path)]
    assert MODULES and not found


def test_scripts_of_others_are_checked() -> None:
    """What our pages load from an address has an integrity hash; only jsPsych comes from one."""
    loads = re.compile(r"<(?:script|link)\b[^>]*(?:src|href)\s*=\s*[\"'](?:https?:)?//[^>]*>")
    for path in PACKAGE.rglob("*"):
        if path.suffix in {".html", ".js", ".css", ".py"}:
            text = path.read_text(encoding="utf-8")
            assert all("integrity=" in one for one in loads.findall(text)), path
            assert not re.search(r"@import\s+(?:url\()?[\"']?(?:https?:)?//", text), path
            assert not re.search(r"import\(?\s*[\"']https?://", text), path


def test_nothing_heavy_is_imported_at_the_top_of_a_module() -> None:
    for path in MODULES:
        if not path.is_relative_to(PACKAGE / "render"):
            assert not {name for name, _ in imports(tree_of(path).body)} & LATE, name_of(path)


MAY_KNOW_THE_OPENING = {
    "model/lens.py",
    "model/projections.py",  # lays rays out
    "pipeline/accounts.py",  # says it in accounts
    "render/convert.py",  # says it to Mitsuba
    "report/stress/cases.py",
    "viewer/keyframes.py",  # shows it to people, in degrees
}


def readers(*attributes: str) -> set[str]:
    """Modules that read attributes of these names."""
    return {
        name_of(path)
        for path in MODULES
        for node in nodes_of(path)
        if isinstance(node, ast.Attribute) and node.attr in attributes
    }


def test_nobody_but_the_lens_knows_what_it_is_made_of() -> None:
    assert readers("opening") <= MAY_KNOW_THE_OPENING
    assert readers("half_width") == {"model/lens.py", "model/projections.py"}


def test_nobody_but_the_shutter_knows_when_it_opens_and_closes() -> None:
    assert readers("opens", "closes") == {"model/camera.py"}


def test_frame_states_are_made_where_shutters_are_asked() -> None:
    makers = {
        name_of(path)
        for path in MODULES
        for node in nodes_of(path)
        if isinstance(node, ast.Call) and dotted(node.func).endswith("FrameState")
    }
    assert makers <= {"shot/build.py", "inspection/catalogue.py"}  # on sheets nothing moves


MAY_COUNT_CHANNELS = {
    "image/exr.py",  # refuses what is no picture, and leaves the alpha of a user's file out
}
NAMES_LAYERS = ("render/passes/", "render/session.py", "pipeline/", "image/", "viewer/")


def counts_channels(node: ast.AST) -> bool:
    """Whether code compares the last size of an array with a number, or cuts channels by number."""
    if isinstance(node, ast.Compare):
        sides = [node.left, *node.comparators]
        numbers = [s for s in sides if isinstance(s, ast.Constant) and isinstance(s.value, int)]
        return bool(numbers) and any(
            isinstance(s, ast.Subscript)
            and dotted(s.value).endswith(".shape")
            and ast.unparse(s.slice) in {"-1", "2"}
            for s in sides
        )
    if isinstance(node, ast.Subscript) and isinstance(node.slice, ast.Tuple):
        *front, last = node.slice.elts
        cuts = (last.lower, last.upper) if isinstance(last, ast.Slice) else ()
        whole = [ast.unparse(part) for part in front] in (["..."], [":", ":"])
        return whole and any(isinstance(cut, ast.Constant | ast.UnaryOp) for cut in cuts)
    return False


@pytest.mark.parametrize(
    ("code", "found"),
    [
        ("image.shape[-1] == 6", True),
        ("4 < image.shape[2]", True),
        ("image[..., 4:7]", True),
        ("image[:, :, -3:]", True),
        ("image[..., None]", False),
        ("image.shape[-1] == other.shape[-1]", False),
        ("rows[:, :3]", False),
        ("places[:, None, :2]", False),
    ],
)
def test_counted_channels_are_found(code: str, found: bool) -> None:
    assert any(map(counts_channels, ast.walk(ast.parse(code)))) == found


def test_layers_are_told_apart_by_name() -> None:
    counting = {
        name_of(path)
        for path in MODULES
        if name_of(path).startswith(NAMES_LAYERS) and any(map(counts_channels, nodes_of(path)))
    }
    assert counting <= MAY_COUNT_CHANNELS


def test_stages_do_not_import_each_other() -> None:
    linter = Path(sys.executable).with_name("lint-imports")
    found = shutil.which("lint-imports", path=str(linter.parent))
    if found is None:
        lacking("import-linter is not installed")
    done = subprocess.run(
        [found, "--no-cache"], cwd=ROOT, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr


def test_names_suit_every_file_system() -> None:
    bad = re.compile(r'[<>:"\\|?*\x00-\x1f]|[ .](?:/|$)')
    reserved = re.compile(r"(?:^|/)(?:con|prn|aux|nul|com\d|lpt\d)(?:\.|/|$)", re.I)
    names = tracked()
    assert not [name for name in names if bad.search(name) or reserved.search(name)]
    assert len({name.lower() for name in names}) == len(names)
    assert max(map(len, names)) < 120


def test_tracked_files_tell_nothing_about_a_machine() -> None:
    problems = []
    for name in tracked():
        path = ROOT / name
        content = path.read_bytes()
        if b"\0" in content or path.suffix == ".gz" or path == Path(__file__).resolve():
            continue
        text = content.decode("utf-8")
        problems += [
            f"{name}: {found.group()}"
            for pattern in (MACHINE_PATH, REGISTRY)
            for found in pattern.finditer(text)
        ]
    assert not problems


def test_no_file_is_huge() -> None:
    sizes = {name: (ROOT / name).stat().st_size for name in tracked()}
    assert not {name: size for name, size in sizes.items() if size > 6_000_000}
    assert sum(sizes.values()) < 80_000_000
