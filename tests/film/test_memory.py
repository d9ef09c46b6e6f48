"""A film's memory depends on its window of frames, not on how many there are."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from builders import write_scenario

SHORT, LONG = 20, 60
FPS = 10

PEAK = """
import sys
from pathlib import Path
from sumo3dviz_pt.cli import main
code = main(sys.argv[1:])
status = Path("/proc/self/status").read_text(encoding="utf-8")
print(next(line.split()[1] for line in status.splitlines() if line.startswith("VmHWM")))
sys.exit(code)
"""
"""Renders, then tells the most memory that this program itself ever held [kB].

`getrusage` would count what the program held that started this one.
"""


def peak(scene: Path, frames: int, target: Path) -> float:
    """Most memory of a process that renders a film and keeps none of its frames [MB]."""
    words = ["render", scene, "--camera", "post", "--from", 2, "--to", 2 + frames / FPS]
    words += ["--fps", FPS, "--size", "192x108", "--quality", "draft", "--discard-frames"]
    run = subprocess.run(
        [sys.executable, "-c", PEAK, *map(str, words), "-o", str(target)],
        check=True,
        capture_output=True,
        text=True,
    )
    return int(run.stdout.splitlines()[-1]) / 1024


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="only Linux tells a peak so")
def test_memory_is_constant_in_a_films_length(tmp_path: Path) -> None:
    """40 frames more, of two megabytes each as they are traced, would be a sixth more."""
    scene = write_scenario(tmp_path, speed=1.0)
    # Whatever is built for the first film lies in the cache for the second.
    short = peak(scene, SHORT, tmp_path / "short.mp4")
    long = peak(scene, LONG, tmp_path / "long.mp4")
    assert long <= 1.06 * short
    assert not list(tmp_path.glob("*.frames/*.exr"))
