"""Compares what is built on different processors: bodies, worlds and plans.

    python tests/bench/processors.py [--only WORD ...] [--processors NAME ...] [--scenes PATH ...]

One machine stands for many: OpenBLAS, NumPy and the C library choose their kernels by the
processor, and each can be told to take another one's. `shaken` stands for those that nobody
has here: there the last bit of every root, angle and wave is a matter of chance. Every
account is built in a process of its own, with words hashed in another way; what exists must
be the same, and lie within a millimetre. Prints what differs; the exit code is 1 if anything
does. All of it takes about an hour; a folder among the scenes is one of SUMO's files.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tools"))

NEAR = 1e-3
"""Places that differ by less are the same [m]."""

_FOUND = np.show_config(mode="dicts")["SIMD Extensions"].get("found", [])
_AVX512 = [name for name in _FOUND if "512" in name or name.endswith("V4")]
_CORES = ("Haswell", "Zen", *(["SkylakeX"] if _AVX512 else []), "Prescott")
_SHAKEN = "SUMO3DVIZ_SHAKEN"

PROCESSORS: Mapping[str, Mapping[str, str]] = {
    "this": {},
    **{name: {"OPENBLAS_CORETYPE": name} for name in _CORES},
    "no AVX512": {"NPY_DISABLE_CPU_FEATURES": " ".join(_AVX512)},
    "old": {
        "OPENBLAS_CORETYPE": "Prescott",
        "NPY_DISABLE_CPU_FEATURES": " ".join(_FOUND),
        "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-FMA,-FMA4,-AVX512F",
    },
    "shaken": {_SHAKEN: "1"},
}
"""Environments that make this machine compute as others do, by name: those that it can be."""

_CHOSEN = frozenset(key for chosen in PROCESSORS.values() for key in chosen)
_ROUNDED = ("sin", "cos", "tan", "arcsin", "arccos", "arctan", "arctan2", "exp", "log", "hypot")


def differences(
    one: Mapping[str, Any], other: Mapping[str, Any], *, near: float = NEAR
) -> Iterator[str]:
    """What two accounts do not agree about, in words; places may be so near [m]."""
    for key in sorted({*one, *other}):
        if key not in one or key not in other:
            yield f"{key}: only {'the first' if key in one else 'the second'} has it"
        elif (said := _difference(np.asarray(one[key]), np.asarray(other[key]), near)) is not None:
            yield f"{key}: {said}"


def _difference(one: Any, other: Any, near: float) -> str | None:
    """What two arrays do not agree about, or None."""
    if one.shape != other.shape:
        return f"{one.shape} and {other.shape}"
    if one.dtype.kind != "f":
        wrong = np.flatnonzero((one != other).reshape(-1))
        return f"{len(wrong)} of {one.size} differ" if len(wrong) else None
    if (np.isnan(one) != np.isnan(other)).any():
        return "not the same ones are missing"
    away = np.nan_to_num(np.abs(one - other))
    return f"{away.max():.3g} apart" if away.size and away.max() > near else None


def accounts_of(
    processor: str, folder: Path, *, only: Sequence[str], scenes: Sequence[Path]
) -> None:
    """Write accounts into a folder, in a process that computes as a processor does."""
    command = [sys.executable, __file__, "--into", str(folder), "--only", *only, "--scenes"]
    inherited = {key: value for key, value in os.environ.items() if key not in _CHOSEN}
    own = {"SUMO3DVIZ_PT_CACHE": str(folder / "cache"), "PYTHONHASHSEED": "random"}
    environment = {**inherited, **own, **PROCESSORS[processor]}
    subprocess.run([*command, *map(str, scenes)], env=environment, check=True)


def compared(first: Path, second: Path) -> Iterator[str]:
    """What differs between two folders of accounts."""
    for path in sorted(first.glob("*.npz")):
        with np.load(path) as one, np.load(second / path.name) as other:
            for text in differences(one, other):
                yield f"{path.stem.replace('~', '/')}/{text}"


def _write(folder: Path, only: Sequence[str], scenes: Sequence[Path]) -> None:
    """Build accounts one by one into files."""
    if _SHAKEN in os.environ:
        _shake()
    from bench.processor_accounts import library, scene, scene_file

    made = list(library())
    for path in scenes:
        made += scene(scene_file(path, folder) if path.is_dir() else path)
    for name, build in made:
        if not only or any(word in name for word in only):
            np.savez(folder / f"{name.replace('/', '~')}.npz", **build())


def _shake() -> None:
    """Leave the last bit of NumPy's functions to chance from now on."""
    rng = np.random.default_rng(1)

    def shaken(exact: Callable[..., Any]) -> Callable[..., Any]:
        def rounded(*values: Any, **options: Any) -> Any:
            result = exact(*values, **options)
            if np.asarray(result).dtype != np.float64:
                return result
            return result * (1.0 + 2.0**-52 * rng.integers(-1, 2, np.shape(result)))

        return rounded

    for name in _ROUNDED:
        setattr(np, name, shaken(getattr(np, name)))
    exact_norm = np.linalg.norm
    rounded_norm = shaken(exact_norm)

    def norm(values: Any, **options: Any) -> Any:
        """Roots of sums along an axis are exact everywhere; only vectors go to OpenBLAS."""
        return (exact_norm if "axis" in options else rounded_norm)(values, **options)

    np.linalg.norm = norm


def main(arguments: Sequence[str]) -> int:
    """Build on all processors and compare with the first."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", nargs="*", default=[], help="parts of the names to look at")
    parser.add_argument("--processors", nargs="+", default=list(PROCESSORS), choices=PROCESSORS)
    parser.add_argument("--scenes", nargs="*", type=Path, help="scene files, or folders of SUMO's")
    parser.add_argument("--into", type=Path, help=argparse.SUPPRESS)
    chosen = parser.parse_args(arguments)
    scenes = chosen.scenes
    if scenes is None:
        examples = Path(__file__).resolve().parents[2] / "examples"
        scenes = sorted(examples.glob("*/scene.yaml"))
    if chosen.into is not None:
        _write(chosen.into, chosen.only, scenes)
        return 0
    with tempfile.TemporaryDirectory() as folder:
        return _run(Path(folder), chosen.processors, only=chosen.only, scenes=scenes)


def _run(
    folder: Path, processors: Sequence[str], *, only: Sequence[str], scenes: Sequence[Path]
) -> int:
    """Build on each processor and compare with the first; 1 if anything differs."""
    worst = False
    for name in processors:
        own = folder / name.replace(" ", "_")
        own.mkdir()
        accounts_of(name, own, only=only, scenes=scenes)
        found = list(compared(folder / processors[0].replace(" ", "_"), own))
        print(f"{name}: {len(found)} differences from {processors[0]}", flush=True)
        print("".join(f"  {text}\n" for text in found), end="", flush=True)
        worst |= bool(found)
    return int(worst)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
