"""What can be emulated of Windows and macOS: consoles, ends of lines, names, processes, open files.

Laws over the code find what would only fail there.
"""

from __future__ import annotations

import ast
import errno
import gzip
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from builders import write_scenario
from needed import lacking

from sumo3dviz_pt.cli import main
from sumo3dviz_pt.files import atomic
from sumo3dviz_pt.pipeline.films.orders import FilmOrder, shots_of
from sumo3dviz_pt.pipeline.production import Request
from sumo3dviz_pt.pipeline.scene_file import load_job

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = ROOT / "sumo3dviz_pt"
MODULES = sorted(PACKAGE.rglob("*.py"))

# Consoles ----------------------------------------------------------------------------------------

WORDS = {"v0": "車Ω", "post": "Камера"}
"""Names in scripts that the code page of a western Windows lacks."""

COMMANDS = {
    "check": ["check", "{scene}"],
    "check as JSON": ["check", "{scene}", "--json"],
    "forecast": ["render", "{scene}", "--dry-run", "-o", "影_{shot}.mp4"],
    "init": ["init", "{folder}", "-o", "нов.yaml"],
    "still": ["still", "{scene}", "--time", "4", "--size", "32x18", "-o", "静.png"],
    "film": ["render", "{scene}", "--from", "4", "--to", "4.1", "--size", "32x18", "-o", "影.mp4"],
    "missing": ["render", "нет.yaml", "-o", "a.mp4"],
    "unknown": ["still", "{scene}", "--camera", "каме", "--time", "4", "-o", "a.png"],
    "vehicles": ["vehicles", "{scene}"],
}


@pytest.fixture(scope="module")
def foreign(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A scene whose place, ids and cameras stand in other scripts."""
    folder = tmp_path_factory.mktemp("s") / "場景 Ω"
    folder.mkdir()
    write_scenario(folder, signals=True, trees=True, persons=1, vehicles=3)
    for path in folder.iterdir():
        text = path.read_text(encoding="utf-8")
        for plain, word in WORDS.items():
            text = text.replace(plain, word)
        path.write_text(text, encoding="utf-8")
    return folder / "scene.yaml"


@pytest.mark.parametrize(
    ("name", "encoding"), [*((name, "cp1252") for name in COMMANDS), ("check", "ascii")]
)
def test_consoles_without_the_letters_get_all_that_is_said(
    foreign: Path, tmp_path: Path, name: str, encoding: str
) -> None:
    """Windows writes into files and pipes by its code page; what that lacks stands as an escape."""
    known = {"scene": foreign, "folder": foreign.parent, "shot": "{shot}"}
    words = [word.format(**known) for word in COMMANDS[name]]
    console = {"PYTHONIOENCODING": encoding, "PYTHONUTF8": "0", "LC_ALL": "C.UTF-8"}
    done = subprocess.run(
        [sys.executable, "-m", "sumo3dviz_pt.cli", *words],
        cwd=tmp_path,
        env={**os.environ, **console, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        check=False,
    )
    said = (done.stdout + done.stderr).decode(encoding)
    assert "Traceback" not in said, said
    assert done.returncode == (2 if name in ("missing", "unknown") else 0), said
    if name == "check":
        assert r"\u041a\u0430\u043c\u0435\u0440\u0430" in said, "the camera's name"


def test_words_that_python_could_not_read_are_refused_in_a_sentence(
    capsys: pytest.CaptureFixture[str],
) -> None:
    """As where neither the locale nor Python's own mode is UTF-8."""
    assert main(["check", os.fsdecode(b"\xe5\xa0.yaml")]) == 2
    said = capsys.readouterr().err
    assert "PYTHONUTF8=1" in said and said.count("\n") == 1


# Ends of lines -----------------------------------------------------------------------------------


def test_ends_of_lines_of_windows_change_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Editors and git write them into scene files, XML and the logs in it, packed or not."""
    said = []
    for name in ("unix", "windows"):
        folder = tmp_path / name
        folder.mkdir()
        write_scenario(folder, signals=True, trees=True, persons=1, vehicles=3)
        for path in folder.iterdir() if name == "windows" else ():
            text = path.read_bytes()
            assert b"\r" not in text
            path.write_bytes(text.replace(b"\n", b"\r\n"))
        log = folder / "fcd.xml"
        (folder / "fcd.xml.gz").write_bytes(gzip.compress(log.read_bytes()))
        log.unlink()
        scene = folder / "scene.yaml"
        scene.write_bytes(scene.read_bytes().replace(b"fcd.xml", b"fcd.xml.gz"))
        assert main(["check", str(scene), "--json"]) == 0
        assert main(["init", str(folder), "-o", str(tmp_path / f"{name}.yaml")]) == 0
        said.append(capsys.readouterr().out.replace(str(tmp_path), "").replace(name, "."))
    assert said[0] == said[1]
    made = [(tmp_path / f"{name}.yaml").read_text(encoding="utf-8") for name in ("unix", "windows")]
    assert made[0].replace("unix/", "/") == made[1].replace("windows/", "/")


# Open files --------------------------------------------------------------------------------------


def refused_by_windows() -> PermissionError:
    """As Windows refuses to replace a file that another program has open."""
    error = PermissionError(errno.EACCES, "The process cannot access the file")
    error.winerror = 32  # type: ignore[attr-defined]
    return error


def test_a_file_that_is_in_use_for_a_moment_is_replaced_then(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    left, replace = [refused_by_windows(), refused_by_windows()], Path.replace

    def refusing(self: Path, target: Path) -> Path:
        if left:
            raise left.pop()
        return replace(self, target)

    monkeypatch.setattr(Path, "replace", refusing)
    atomic.write_atomically(tmp_path / "a.json", "new")
    assert (tmp_path / "a.json").read_text(encoding="utf-8") == "new" and not left


def test_a_file_that_stays_in_use_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refusing(self: Path, target: Path) -> Path:
        raise refused_by_windows()

    monkeypatch.setattr(Path, "replace", refusing)
    monkeypatch.setattr(atomic, "_WAIT", 0.0)
    with pytest.raises(PermissionError, match=r"another program has it open; close that"):
        atomic.write_atomically(tmp_path / "a.json", "new")
    assert list(tmp_path.iterdir()) == []


def test_what_may_not_be_written_is_refused_at_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    tries: list[Path] = []

    def refusing(self: Path, target: Path) -> Path:
        tries.append(target)
        raise PermissionError(errno.EACCES, "Permission denied")

    monkeypatch.setattr(Path, "replace", refusing)
    with pytest.raises(PermissionError, match="Permission denied"):
        atomic.write_atomically(tmp_path / "a.json", "new")
    assert len(tries) == 1


# Laws over the code ------------------------------------------------------------------------------


def calls_in(path: Path) -> Iterator[tuple[ast.Call, str]]:
    """All calls of a module, and what is called."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Call):
            yield node, ast.unparse(node.func)


def place(path: Path, node: ast.AST) -> str:
    return f"{path.relative_to(ROOT).as_posix()}:{getattr(node, 'lineno', 0)}"


def test_files_get_their_names_by_one_function() -> None:
    """It waits for files that are in use: `atomic.put_in_place`; folders are new names."""
    found = [
        place(path, call)
        for path in MODULES
        for call, name in calls_in(path)
        if re.fullmatch(r"os\.(rename|replace|renames)|shutil\.move", name)
        or (name.endswith((".replace", ".rename")) and len(call.args) == 1 and not call.keywords)
    ]
    known = {"files/atomic.py", "exports/page.py", "exports/order.py", "studies/folder.py"}
    odd = [
        each for each in found if each.partition(":")[0].removeprefix("sumo3dviz_pt/") not in known
    ]
    assert not odd, "use put_in_place"


def test_text_of_other_programs_is_read_in_a_stated_encoding() -> None:
    """Else it is read in the code page, and a letter that is not in it is an accident."""
    found = [
        place(path, call)
        for path in MODULES
        for call, _ in calls_in(path)
        if any(key.arg in ("text", "universal_newlines") for key in call.keywords)
        and any(key.arg in ("capture_output", "stdout") for key in call.keywords)
        and not any(key.arg == "encoding" for key in call.keywords)
    ]
    assert not found


def test_text_files_are_opened_in_a_stated_encoding() -> None:
    """The system's own is a code page on Windows."""
    command = ["check", "--isolated", "--preview", "--select", "PLW1514", str(PACKAGE)]
    ruff = shutil.which("ruff", path=str(Path(sys.executable).parent))
    if ruff is None:
        lacking("ruff is not installed")
    done = subprocess.run([ruff, *command], capture_output=True, check=False)
    assert done.returncode == 0, done.stdout.decode()


ONLY_POSIX = re.compile(
    r"(os\.(fork|forkpty|getuid|geteuid|getgid|setsid|setuid|killpg|getpgid|uname|mkfifo|nice|chown"
    r"|getloadavg|sysconf|sched_getaffinity|sched_setaffinity|wait|waitpid|O_NOFOLLOW|openpty)"
    r"|signal\.(SIGKILL|SIGHUP|SIGQUIT|SIGUSR1|SIGUSR2|SIGSTOP|SIGCONT|SIGCHLD|SIGALRM|alarm|pause"
    r"|setitimer|pthread_kill))$"
)
POSIX_MODULES = {"fcntl", "grp", "posix", "pty", "pwd", "resource", "syslog", "termios", "tty"}
CHECKED = re.compile(r"sys\.platform|os\.name|hasattr\(|except \(?(ImportError|AttributeError)")


def around(tree: ast.Module) -> dict[ast.AST, ast.AST]:
    """What every node lies in."""
    return {child: node for node in ast.walk(tree) for child in ast.iter_child_nodes(node)}


def is_checked(node: ast.AST, outer: dict[ast.AST, ast.AST]) -> bool:
    """Whether a branch, a `try` or the function around it asks for the system first."""
    while node in outer:
        node = outer[node]
        if isinstance(node, ast.If | ast.IfExp | ast.Try | ast.FunctionDef | ast.BoolOp) and (
            CHECKED.search(ast.unparse(node))
        ):
            return True
    return False


@pytest.mark.parametrize(
    ("code", "odd"),
    [
        ("import fcntl", True),
        ("try:\n    import resource\nexcept ImportError:\n    resource = None", False),
        ("def f():\n    return os.getuid()", True),
        ("def f():\n    return os.getuid() if hasattr(os, 'getuid') else 0", False),
    ],
)
def test_the_next_law_sees_what_it_should(code: str, odd: bool) -> None:
    assert bool(unchecked(ast.parse(code))) == odd


def unchecked(tree: ast.Module) -> list[ast.AST]:
    """What only POSIX has, and nobody asks for before."""
    outer, found = around(tree), []
    for node in ast.walk(tree):
        names = {alias.name for alias in node.names} if isinstance(node, ast.Import) else set()
        posix = isinstance(node, ast.Attribute) and ONLY_POSIX.match(ast.unparse(node))
        if (names & POSIX_MODULES or posix) and not is_checked(node, outer):
            found.append(node)
    return found


def test_what_only_posix_has_is_asked_for_first() -> None:
    found = [
        place(path, node)
        for path in MODULES
        for node in unchecked(ast.parse(path.read_text(encoding="utf-8")))
    ]
    assert not found


def test_nobody_forks_and_nobody_needs_links() -> None:
    """Windows and macOS spawn: what a pool is given would have to be told anew. Links need rights
    there; the one that is made has a copy behind it."""
    odd = re.compile(r"multiprocessing|ProcessPoolExecutor|\.symlink_to|\.hardlink_to|os\.symlink")
    found = [path.name for path in MODULES if odd.search(path.read_text(encoding="utf-8"))]
    assert not found
    linking = [path.name for path in MODULES if "os.link(" in path.read_text(encoding="utf-8")]
    assert linking == ["datasets.py"]


def test_temporary_files_are_not_opened_twice() -> None:
    """Windows opens a NamedTemporaryFile once only."""
    assert not [
        path for path in MODULES if "NamedTemporaryFile" in path.read_text(encoding="utf-8")
    ]


# Names -------------------------------------------------------------------------------------------


def test_films_of_scenes_that_differ_in_capitals_alone_are_told_apart(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A.mp4 and a.mp4 are one file on Windows and macOS: the second would replace the first."""
    scene = write_scenario(tmp_path)
    scenes = [tmp_path / name for name in ("A.yaml", "a.yaml")]
    for each in scenes:
        each.write_text(scene.read_text(encoding="utf-8"), encoding="utf-8")
    words = ["render", *map(str, scenes), "--dry-run", "-o", str(tmp_path / "{scene}.mp4")]
    assert main(words) == 2
    assert "two scene files have one name" in capsys.readouterr().err


def test_shots_of_cameras_that_differ_in_capitals_alone_have_films_of_their_own(
    tmp_path: Path,
) -> None:
    scene = write_scenario(tmp_path)
    text = scene.read_text(encoding="utf-8")
    text = text.replace("  driver:", "  Post: {mode: lagrangian, vehicle: v1}\n  driver:")
    text = text.replace("shots:\n", "shots:\n  - {camera: Post, from: 4, to: 5}\n")
    scene.write_text(text, encoding="utf-8")
    films = shots_of(load_job(scene), Request(), FilmOrder(tmp_path / "{shot}.mp4"))
    assert len({path.name.lower() for _, path in films}) == 2


def test_names_of_unfinished_files_are_hardly_longer(tmp_path: Path) -> None:
    """Windows opens paths of 260 characters, of which names that we choose should not take many."""
    with atomic.atomic_path(tmp_path / "film.json") as part:
        part.write_bytes(b"")
        assert len(part.name) - len("film.json") <= 40
    with atomic.atomic_path(tmp_path / ("x" * 250)) as part:
        part.write_bytes(b"whole")
    assert (tmp_path / ("x" * 250)).read_bytes() == b"whole"
