"""What the doctor finds, on a machine that renders and on others."""

from __future__ import annotations

import _ctypes
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from sumo3dviz_pt.cli import main
from sumo3dviz_pt.installation import doctor
from sumo3dviz_pt.installation.dependencies import VARIABLE
from sumo3dviz_pt.installation.packages import ATOMIC, LLVM
from sumo3dviz_pt.render.backend import VARIANTS

ROOT = Path(__file__).resolve().parents[3]
LOST = "ImportError('libatomic.so.1: cannot open shared object file: No such file or directory')"


@pytest.mark.slow
def test_names_versions_files_and_places(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["doctor", "--frame"]) == 0
    said = capsys.readouterr().out
    about = dict(line.split(maxsplit=1) for line in said.splitlines())
    assert {"Python", "mitsuba", "drjit", "numpy", "processor", "memory", "ffmpeg"} <= set(about)
    assert about["renderer"] in VARIANTS.values()
    assert re.match(r"\d+\.\d+\.\d+ \(.+\)$", about["libLLVM"])
    assert "CUDA" in about["CUDA,"] or "NVIDIA driver" in about["CUDA,"]
    assert f"bodies kept in  {os.environ['SUMO3DVIZ_PT_CACHE']}" in said
    assert "kernels kept in" in said
    assert re.search(r"^frame .* of 640x360 in preview takes [\d.]+ s \([\d.]+ CPU-", said, re.M)


def without(tmp_path: Path, module: str, error: str = LOST) -> dict[str, str]:
    """Variables of a program that cannot load a package."""
    (tmp_path / module).mkdir()
    (tmp_path / module / "__init__.py").write_text(f"raise {error}\n", encoding="utf-8")
    return os.environ | {"PYTHONPATH": os.pathsep.join([str(tmp_path), str(ROOT)])}


def run(*arguments: str, env: dict[str, str]) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "sumo3dviz_pt.cli", *arguments],
        capture_output=True,
        text=True,
        check=False,
        env=env,
        stdin=subprocess.DEVNULL,
    )


def _slow(*values):
    """One case of several that are alike: CI tries all of them."""
    return pytest.param(*values, marks=pytest.mark.slow)


@pytest.mark.parametrize(
    "module",
    ["mitsuba", *(_slow(name) for name in ("OpenEXR", "numpy", "platformdirs", "imageio_ffmpeg"))],
)
def test_works_whatever_cannot_be_loaded(tmp_path: Path, module: str) -> None:
    done = run("doctor", env=without(tmp_path, module))
    assert done.returncode == 1 and not done.stderr
    assert "renderer        does not work" in done.stdout
    assert (
        "libatomic.so.1 is missing; install it with: sumo3dviz-pt doctor --install" in done.stdout
    )


COMMANDS = (
    ("still", "{}", "--time", "5", "-o", "a.png"), _slow(("render", "{}", "-o", "a.mp4")),
    _slow(("converge", "{}", "--time", "5", "-o", "out")), _slow(("check", "{}", "--stress")),
    _slow(("assets", "sheet", "vehicles")), _slow(("view", "{}")), _slow(("demo",)),
)  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("command", COMMANDS, ids=lambda command: " ".join(command[:2]))
def test_commands_that_render_say_at_once_what_is_missing(
    tmp_path: Path, command: tuple[str, ...]
) -> None:
    """The scene's simulation is not even there: nothing of it is read before."""
    scene = tmp_path / "scene.yaml"
    scene.write_text(
        "scenario: {network: a.net.xml, trajectories: [b.xml]}\n"
        "cameras: {a: {mode: eulerian, position: [0, 0, 5], heading: 0}}\n"
        "shots: [{camera: a, from: 0, to: 1}]\n",
        encoding="utf-8",
    )
    arguments = [text.format(scene) for text in command]
    done = run(*arguments, env=without(tmp_path, "drjit"))
    assert done.returncode == 1, done.stderr
    assert done.stderr == (
        "sumo3dviz-pt: drjit cannot be loaded: libatomic.so.1 is missing;"
        " install it with: sumo3dviz-pt doctor --install\n"
    )


@pytest.mark.parametrize(
    ("module", "command"),
    [_slow("OpenEXR", ("develop", "{}", "-o", "a.png")), _slow("numpy", ("init", "{}")),
     ("yaml", ("check", "{}"))],
)  # fmt: skip
def test_other_commands_say_it_in_one_sentence_too(
    tmp_path: Path, module: str, command: tuple[str, ...]
) -> None:
    scene = ROOT / "examples" / "crossing" / "scene.yaml"
    arguments = [text.format(scene) for text in command]
    done = run(*arguments, env=without(tmp_path, module))
    (said,) = done.stderr.splitlines()
    assert done.returncode == 1 and said.startswith("sumo3dviz-pt: ") and "cannot be loaded" in said


def test_a_missing_package_is_said_before_any_work() -> None:
    code = (
        "import sys; sys.modules['shapely'] = None\n"
        "from sumo3dviz_pt.cli import main; sys.exit(main(['check', 'no such scene']))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert done.stderr.startswith("sumo3dviz-pt: not installed: shapely; install with: ")


@pytest.mark.slow
def test_a_trial_that_ends_the_process_is_survived(tmp_path: Path) -> None:
    done = run("doctor", env=without(tmp_path, "mapbox_earcut", "SystemExit(7)"))
    assert done.returncode == 1 and "a trial ended with exit code 7: " in done.stdout


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="signals")
def test_a_signal_is_named(tmp_path: Path) -> None:
    dies = "__import__('os').kill(__import__('os').getpid(), 6)"
    done = run("doctor", env=without(tmp_path, "mapbox_earcut", dies))
    assert "a trial ended with SIGABRT: " in done.stdout and done.returncode == 1


def test_what_is_lacking_is_named_for_the_package_manager(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.delenv(VARIABLE, raising=False)
    llvm = doctor.dependencies.Library("", "", "there is none")
    trial = doctor.LoadingTrial(problems=("a",), missing=("libatomic.so.1", "libunknown.so.3"))
    assert list(doctor._lacks(trial, llvm)) == [ATOMIC, LLVM]


@pytest.mark.slow
def test_a_choice_of_the_users_is_not_mended_by_installing(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv(VARIABLE, _ctypes.__file__)
    assert main(["doctor", "--install"]) == 0
    said = capsys.readouterr().out
    assert "scalar_rgb" in said and "unset it" in said and "missing" not in said


@pytest.mark.slow
def test_nothing_is_installed_where_nothing_is_lacking(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    assert main(["doctor", "--install", "--yes"]) == 0
    assert capsys.readouterr().out.startswith("Python")


@pytest.mark.skipif(os.name == "nt", reason="permissions")
def test_caches_that_cannot_be_written_are_told(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    file = tmp_path / "file"
    file.touch()
    assert doctor._writable(tmp_path / "later" / "deeper") == str(tmp_path / "later" / "deeper")
    assert "which cannot be written (" in doctor._writable(file / "below")
    monkeypatch.setenv("DRJIT_CACHE_DIR", str(file / "kernels"))
    assert doctor._kernels_folder() == file / "kernels"
