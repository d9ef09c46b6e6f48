"""Writes what an installation takes on disk, by package.

    python -m venv plain && plain/bin/pip install WHEEL
    python tools/release/sizes.py plain -o docs/_bench

Sizes are those of the files that each package's RECORD lists, compiled Python among them; pip and
setuptools belong to the environment and are left out. libLLVM is not pip's.
"""

from __future__ import annotations

import argparse
import platform
from importlib import metadata
from pathlib import Path

MIB = 2**20
_OURS_TO_LEAVE = {"pip", "setuptools", "wheel"}
_LARGE = 4.0  # MiB; what is smaller is added up
_WHY = {
    "colour-science": "how different colours look; {htmlcov:.0f} MiB are reports of its tests",
    "drjit": "compiles the kernels",
    "imageio-ffmpeg": "ffmpeg, one file of {ffmpeg:.0f} MiB",
    "mitsuba": "the renderer; {variants:.0f} MiB are variants that we never load",
    "mitsuba-oidn": "the denoiser and its weights",
    "numpy": "arrays",
    "openexr": "radiance in files",
    "pillow": "pictures, letters",
    "pydantic": "settings",
    "pydantic_core": "settings",
    "scipy": "nearest points, filters, splines; {tests:.0f} MiB are its own tests",
    "shapely": "areas of land, roads and houses",
    "sumo3dviz_pt": "this package: {data:.0f} MiB of bodies, surfaces and skies",
    "trimesh": "reads users' meshes",
    "tzfpy": "time zones of places",
}
"""What the large ones are for."""


def main() -> None:
    """Write sizes.md."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("environment", type=Path)
    parser.add_argument("-o", "--output", type=Path, required=True)
    chosen = parser.parse_args()
    (packages,) = chosen.environment.glob("lib/python3*/site-packages")
    sizes = sizes_in(packages)
    (chosen.output / "sizes.md").write_text(table(sizes, parts_in(packages)), "utf-8")
    print(f"{sum(sizes.values()):.0f} MiB in {len(sizes)} packages")


def sizes_in(packages: Path) -> dict[str, float]:
    """Return the size of each package [MiB], the largest first."""
    sizes = {}
    for found in metadata.distributions(path=[str(packages)]):
        paths = [Path(str(path.locate())) for path in found.files or []]
        total = sum(path.stat().st_size for path in paths if path.is_file())
        if found.name not in _OURS_TO_LEAVE:
            sizes[f"{found.name} {found.version}"] = total / MIB
    return dict(sorted(sizes.items(), key=lambda item: -item[1]))


def parts_in(packages: Path) -> dict[str, float]:
    """Return the sizes of parts that the table speaks of [MiB]."""
    variants = [
        path
        for kind in ("llvm", "cuda", "scalar")
        for path in packages.glob(f"mitsuba/{kind}_*.so")
        if not path.name.startswith(("llvm_ad_rgb.", "cuda_ad_rgb.", "scalar_rgb."))
    ]
    globs = {
        "htmlcov": packages.glob("colour/htmlcov/**/*"),
        "ffmpeg": packages.glob("imageio_ffmpeg/binaries/ffmpeg*"),
        "tests": packages.glob("scipy/**/tests/**/*"),
        "data": packages.glob("sumo3dviz_pt/_data/**/*"),
        "variants": iter(variants),
    }
    return {
        name: sum(path.stat().st_size for path in paths if path.is_file()) / MIB
        for name, paths in globs.items()
    }


def table(sizes: dict[str, float], parts: dict[str, float]) -> str:
    """Return the table, as Markdown."""
    lines = ["| package | MiB | what for |", "|---|--:|---|"]
    large = {name: size for name, size in sizes.items() if size >= _LARGE}
    for name, size in large.items():
        why = _WHY.get(name.split()[0].lower(), "").format(**parts)
        lines.append(f"| {name} | {size:.1f} | {why} |")
    rest = sum(sizes.values()) - sum(large.values())
    lines.append(f"| {len(sizes) - len(large)} smaller ones | {rest:.1f} | |")
    lines.append(f"| **all that pip installs** | **{sum(sizes.values()):.0f}** | |")
    where = f"{platform.system()} {platform.machine()}"
    command = "python tools/release/sizes.py ENVIRONMENT -o docs/_bench"
    return "\n".join([*lines, "", f"Measured on {where} by `{command}`.", ""])


if __name__ == "__main__":
    main()
