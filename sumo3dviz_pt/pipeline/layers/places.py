"""Where the layers of a film lie."""

from __future__ import annotations

from pathlib import Path

FOLDERS = ("frames", "ids", "semantic", "flow", "kitti")
"""Folders of files of single frames."""

WHOLE = ("cameras.json", "instances.csv", "coco.json", "lamps.csv")
"""Files of a whole film."""


def beside(frames: Path) -> Path:
    """Return where the layers of a film go whose frames lie in a folder."""
    return frames.with_suffix(".layers")


def said_file(folder: Path, number: int) -> Path:
    """Return the file that says what a frame's layers show; it is written last."""
    return folder / "frames" / f"{number:06d}.json"


def channels_file(folder: Path, number: int) -> Path:
    """Return the file of a frame's depth, normals, albedo and instance numbers."""
    return folder / "frames" / f"{number:06d}.exr"


def mattes_file(folder: Path, number: int) -> Path:
    """Return the file of a frame's Cryptomatte."""
    return folder / "ids" / f"{number:06d}.exr"


def classes_file(folder: Path, number: int) -> Path:
    """Return the file of a frame's classes."""
    return folder / "semantic" / f"{number:06d}.png"


def flow_file(folder: Path, number: int) -> Path:
    """Return the file of the flow from a frame to the next."""
    return folder / "flow" / f"{number:06d}.png"


def kitti_files(folder: Path, number: int) -> tuple[Path, Path]:
    """Return the files of a frame's boxes and of its camera, as KITTI has them."""
    kitti = folder / "kitti"
    return kitti / f"{number:06d}.txt", kitti / f"calib.{number:06d}.txt"


def files_of(folder: Path, number: int) -> tuple[Path, ...]:
    """Return all files that a frame's layers may have."""
    own = (said_file, channels_file, mattes_file, classes_file, flow_file)
    return *(place(folder, number) for place in own), *kitti_files(folder, number)
