"""Packs what a GPU machine without a network needs, to measure it there with `measure.sh`.

Run from the repository's root on Linux, x86-64, with the Python version of that machine:

    python tools/gpu/pack.py gpu.tar.xz --python 3.12

There, with the archive's parts:

    cat gpu.tar.xz.* | tar xJ && cd sumo3dviz_pt_gpu
    PYTHONPATH=packages:. bash tools/gpu/measure.sh out

The archive holds the code as last committed, the examples, and packages for Linux on x86-64 without
what no frame needs: SUMO, matplotlib and the encoder's program stay behind. It is cut into parts,
as such machines take little at once. The machine itself must have NVIDIA's driver and libLLVM, on
which the pictures to compare with are traced.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
import tarfile
import tempfile
import tomllib
from pathlib import Path

NAME = "sumo3dviz_pt_gpu"
CODE = ("sumo3dviz_pt", "assets", "scene_templates", "examples", "pyproject.toml", "tools/gpu")
TESTS = ("tests/film/test_gpu.py", "tests/bench/frame_parts.py")
MORE = ("pytest", "flip-evaluator")
"""What the tests need beyond the product's own packages."""

UNUSED = (
    *("**/tests", "**/test", "**/*.pyi", "**/include", "**/__pycache__", "bin", "share"),
    *("colour/htmlcov", "imageio_ffmpeg/binaries/ffmpeg*", "matplotlib*", "fontTools*"),
    *("mitsuba/data/[!s]*", "mitsuba/*_spectral*", "mitsuba/*_mono*", "mitsuba/*_double*"),
    *("mitsuba/*_polarized*", "kiwisolver*", "contourpy*", "pylab.py"),
)
PLUGINS = (
    *("aov", "area", "bitmap", "box", "conductor", "constant", "d65", "depth", "diffuse", "disk"),
    *("envmap", "hdrfilm", "independent", "instance", "merge", "mesh_attribute", "multijitter"),
    *("normalmap", "path", "perspective", "principled", "principledthin", "rectangle", "regular"),
    *("rgb", "shapegroup", "spot", "srgb", "sunsky", "twosided", "uniform"),
)
"""Mitsuba's that our scenes consist of; the others are half as large as all packages."""


def main() -> None:
    """Pack code and packages."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("out", type=Path, help="the archive to write, a .tar.xz")
    parser.add_argument("--most", type=float, default=60.0, help="the largest part [MB]")
    parser.add_argument("--python", default="3.12", help="the other machine's version")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        root = Path(temporary) / NAME
        root.mkdir()
        copy_code(root)
        fetch_packages(root / "packages", options.python)
        packed = Path(temporary) / "packed"
        with tarfile.open(packed, "w:xz", preset=3) as archive:
            archive.add(root, NAME)
        content = packed.read_bytes()
    most = round(options.most * 1e6)
    for old in options.out.parent.glob(f"{options.out.name}.[0-9]*"):
        old.unlink()  # of an archive with more parts
    for number, start in enumerate(range(0, len(content), most)):
        part = options.out.with_name(f"{options.out.name}.{number:04d}")
        part.write_bytes(content[start : start + most])
        print(f"wrote {part} ({part.stat().st_size / 1e6:.1f} MB)")


def copy_code(root: Path) -> None:
    """Lay what is committed of the code into a folder."""
    packed = subprocess.run(
        ["git", "archive", "HEAD", *CODE, *TESTS], check=True, capture_output=True
    )
    subprocess.run(["tar", "x", "-C", str(root)], input=packed.stdout, check=True)


def fetch_packages(folder: Path, python: str) -> None:
    """Install the packages for a version of Python, without what no frame needs."""
    project = tomllib.loads(Path("pyproject.toml").read_text(encoding="utf-8"))["project"]
    install = [
        sys.executable,
        "-m",
        "pip",
        "install",
        "-q",
        "--no-compile",
        "-c",
        "constraints.txt",
    ]
    only = ["--only-binary=:all:", "--implementation", "cp", "--python-version", python]
    wanted = [*project["dependencies"], *MORE]
    subprocess.run([*install, *only, "--target", str(folder), *wanted], check=True)
    unused = [found for pattern in UNUSED for found in folder.glob(pattern)]
    plugins = (folder / "mitsuba/plugins").glob("*")
    for found in (*unused, *(each for each in plugins if each.stem not in PLUGINS)):
        if found.is_dir():
            shutil.rmtree(found)
        else:
            found.unlink(missing_ok=True)


if __name__ == "__main__":
    main()
