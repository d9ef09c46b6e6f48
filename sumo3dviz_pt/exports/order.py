"""What is exported, when, and where to: asked, checked, done."""

from __future__ import annotations

import shutil
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from sumo3dviz_pt.errors import ConfigError
from sumo3dviz_pt.exports.scene import MOST_TIMES, ExportedScene, exported
from sumo3dviz_pt.files.atomic import atomic_path, check_place, put_in_place
from sumo3dviz_pt.job.settings import Job
from sumo3dviz_pt.model.progress import Doing, announce
from sumo3dviz_pt.pipeline.still import check_free, check_writable

FPS = 10.0
"""Times per second of a stretch; between them tools move things evenly."""

PAGE = "page"
_USD = (".usd", ".usda", ".usdc", ".usdz")
KINDS = (".glb", *_USD)


@dataclass(frozen=True, slots=True)
class ExportOrder:
    """What is exported.

    Attributes:
        path: A file that ends in one of `KINDS`, or a folder for a page.
        start: First time [s].
        end: Last time [s]; the first one again for a scene that stands still.
        fps: Times per second of a stretch.
        overwrite: Whether what exists there may go.
    """

    path: Path
    start: float
    end: float
    fps: float = FPS
    overwrite: bool = False

    @property
    def kind(self) -> str:
        """The file's ending, or `page`."""
        return self.path.suffix.lower() or PAGE

    @property
    def count(self) -> int:
        """How many times that are."""
        return round((self.end - self.start) * self.fps) + 1

    def check(self) -> None:
        """Refuse what cannot be done, before any work.

        Raises:
            ConfigError: If times, place or kind are wrong.
            InstallationError: If what writes that kind is not installed.
        """
        if self.kind not in (*KINDS, PAGE):
            raise ConfigError(
                f"{self.path} must end in {', '.join(KINDS)}, or be a folder for a page",
                key="output",
            )
        if not self.end >= self.start:
            raise ConfigError(f"it ends at {self.end:g} s, before {self.start:g} s", key="--to")
        if not 0.1 <= self.fps <= 240.0:
            raise ConfigError(f"takes 0.1 to 240 times per second, not {self.fps:g}", key="--fps")
        if self.count > MOST_TIMES:
            raise ConfigError(
                f"{self.count:,} times are more than {MOST_TIMES:,};"
                " make fps or the stretch smaller",
                key="--to",
            )
        if self.kind == PAGE:
            self._check_folder()
            return
        self._check_file()

    def _check_file(self) -> None:
        """Refuse a file that cannot be written, or beside which others' pictures lie."""
        check_writable(self.path)
        if not self.overwrite:
            check_free(self.path, *self.pictures)
        for folder in self.pictures:
            if folder.exists() and not _is_of_pictures(folder):
                message = f"{folder} is no folder of pictures of ours; give another name"
                raise ConfigError(message, key="output")
        if self.kind in _USD:
            from sumo3dviz_pt.exports.usd import needed

            needed()

    def _check_folder(self) -> None:
        """Refuse a folder that cannot be made, or that holds anything but a page of ours."""
        from sumo3dviz_pt.exports.page import is_page, three_js

        if not self.path.absolute().parent.is_dir():
            raise ConfigError(
                f"there is no folder {self.path.parent}; create it first", key="output"
            )
        check_place(self.path)
        if self.path.exists() and not (self.path.is_dir() and is_page(self.path)):
            if not self.path.is_dir() or any(self.path.iterdir()):
                message = f"{self.path} exists, and is no page of ours; give another name"
                raise ConfigError(message, key="output")
        elif not self.overwrite:
            check_free(self.path)
        three_js()

    @property
    def pictures(self) -> tuple[Path, ...]:
        """The folder that lies beside a USD file that packs no pictures."""
        loose = self.kind in _USD and self.kind != ".usdz"
        return (self.path.with_name(f"{self.path.stem}_pictures"),) if loose else ()


def _is_of_pictures(folder: Path) -> bool:
    """Whether a folder holds nothing but what a USD file of ours may have beside it."""
    from sumo3dviz_pt.exports.usd import PICTURE

    return folder.is_dir() and all(
        file.is_file() and PICTURE.fullmatch(file.name) for file in folder.iterdir()
    )


def export(job: Job, order: ExportOrder, *, title: str = "") -> ExportedScene:
    """Export a scene.

    Args:
        job: The scene file.
        order: What, when, where to.
        title: Of a page.

    Returns:
        What was written.

    Raises:
        ConfigError: As in `ExportOrder.check`, or if the log has nothing then.
        InputError: If a file is wrong.
        InstallationError: If what writes that kind is not installed.
    """
    order.check()
    scene = exported(job, order.start + np.arange(order.count) / order.fps)
    announce(Doing.WRITE)
    if order.kind == PAGE:
        from sumo3dviz_pt.exports.page import write_page

        write_page(scene, order.path, title=title or order.path.name)
    elif order.kind == ".glb":
        from sumo3dviz_pt.exports.gltf import gltf

        with atomic_path(order.path) as part:
            part.write_bytes(gltf(scene))
    else:
        _write_usd(scene, order)
        if scene.walks:
            glides = "who walks keeps one pose in USD, and glides; .glb has all of them"
            scene = replace(scene, notes=(*scene.notes, glides))
    return scene


def _write_usd(scene: ExportedScene, order: ExportOrder) -> None:
    """Write a USD file and its pictures, whole or not at all."""
    import tempfile

    from sumo3dviz_pt.exports.usd import write_usd

    with tempfile.TemporaryDirectory(dir=order.path.absolute().parent, prefix=".usd-") as folder:
        made = Path(folder) / order.path.name
        write_usd(scene, made)
        for pictures in order.pictures:
            if pictures.exists():
                shutil.rmtree(pictures)
            drawn = made.with_name(pictures.name)
            if drawn.exists():
                drawn.rename(pictures)
        put_in_place(made, order.path)
