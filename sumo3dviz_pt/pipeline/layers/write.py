"""Writes the layers of frames, and at the end of a film what is said of all of them."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sumo3dviz_pt.files.whole import write_whole
from sumo3dviz_pt.image.layers.boxes import (
    Box2d,
    Box3d,
    coco_categories,
    kitti_calibration,
    kitti_line,
)
from sumo3dviz_pt.model.network import UNPLACED, Location
from sumo3dviz_pt.model.scene import View
from sumo3dviz_pt.pipeline.layers import places
from sumo3dviz_pt.pipeline.layers.traced import FrameFacts

if TYPE_CHECKING:
    from sumo3dviz_pt.pipeline.production import Production
    from sumo3dviz_pt.render.session import Session

FORM = 2
"""Number of the form of these files."""

FORMS = frozenset({1, FORM})
"""Numbers of the forms that can be read; in the first, layers were channels of one part."""


@dataclass(frozen=True, slots=True, eq=False)
class LayerWriter:
    """Writes the layers of a film's frames.

    Attributes:
        folder: Where to.
        production: The film's.
    """

    folder: Path
    production: Production

    @classmethod
    def beside(cls, frames: Path, production: Production) -> LayerWriter:
        """Return the writer for a film whose frames lie in a folder."""
        return cls(places.beside(frames), production)

    def write(self, session: Session, number: int) -> None:
        """Write the layers of the frame that was rendered last.

        Args:
            session: That rendered it, of a shot whose faces all belong to things.
            number: Its number.

        Raises:
            OSError: If a file cannot be written.
        """
        wanted = frozenset(self.production.job.output.layers)
        frame = session.frame
        assert frame is not None, "render a frame first"
        seen = FrameFacts(self.production.shot, session, frame, wanted)
        for name in places.FOLDERS:
            (self.folder / name).mkdir(parents=True, exist_ok=True)
        self._write_pictures(seen, number)
        if "flow" in wanted and number + 1 < len(self.production.times):
            self._write_flow(seen, number)
        if "boxes3d" in wanted:
            _write_kitti(self.folder, seen, number)
        # What says that all is there comes last.
        location = self.production.shot.fleet.location
        said = _said(seen, number, key=self.production.key, location=location)
        said["layers"] = sorted(wanted)
        write_whole(places.said_file(self.folder, number), json.dumps(said))

    def _write_pictures(self, seen: FrameFacts, number: int) -> None:
        """Write what is stored as channels, classes and mattes."""
        from sumo3dviz_pt.image.exr import write_channels, write_parts
        from sumo3dviz_pt.image.layers.cryptomatte import header, mattes
        from sumo3dviz_pt.image.layers.numbers import write_numbers

        parts = _parts(seen)
        if parts:
            write_parts(places.channels_file(self.folder, number), parts)
        if "semantic" in seen.wanted:
            write_numbers(places.classes_file(self.folder, number), seen.classes)
        if "ids" in seen.wanted:
            owners, names = seen.coverage()
            path = places.mattes_file(self.folder, number)
            write_channels(path, mattes(owners, names), header(names[1:]))

    def _write_flow(self, seen: FrameFacts, number: int) -> None:
        """Write the flow to the next frame."""
        from sumo3dviz_pt.image.layers.flow import write_flow

        after = self.production.shot.frame_at(float(self.production.times[number + 1]))
        write_flow(places.flow_file(self.folder, number), *seen.flow(after))

    def finish(self) -> None:
        """Write what is said of the whole film, from what is said of its frames."""
        count = len(self.production.times)
        said = [json.loads(places.said_file(self.folder, k).read_bytes()) for k in range(count)]
        wanted = self.production.job.output.layers
        cameras = [{"frame": one["frame"], "time": one["time"], **one["camera"]} for one in said]
        write_whole(self.folder / "cameras.json", json.dumps(cameras, indent=1))
        rows = {(number, *thing) for one in said for number, thing in one["things"].items()}
        ordered = sorted(rows, key=lambda row: row[1:])
        _write_csv(self.folder / "instances.csv", ("number", "name", "label", "label_id"), ordered)
        if "boxes2d" in wanted:
            write_whole(self.folder / "coco.json", json.dumps(_coco(said)))
        if "lamps" in wanted:
            lit = [(one["frame"], one["time"], lamp) for one in said for lamp in one["lamps"]]
            _write_csv(self.folder / "lamps.csv", ("frame", "time", "lamp"), lit)


def is_written(folder: Path, number: int, *, key: str, layers: Iterable[str]) -> bool:
    """Return whether some layers of a frame are there, of a film with that key."""
    try:
        said = json.loads(places.said_file(folder, number).read_bytes())
    except (OSError, ValueError):
        return False
    if not isinstance(said, dict) or said.get("key") != key:
        return False
    return {*layers} <= {*map(str, said.get("layers", ()))}


def _parts(seen: FrameFacts) -> dict[str, dict[str, Any]]:
    """Return the channels of depth, normals, albedo and instance numbers, as asked for."""
    found = seen.facts.found
    parts: dict[str, dict[str, Any]] = {}
    if "depth" in seen.wanted:
        parts["depth"] = {"Z": np.asarray(found["depth"], np.float32)}
    for layer, letters in (("normals", "XYZ"), ("albedo", "RGB")):
        if layer in seen.wanted:
            half = found[layer].astype(np.float16)
            parts[layer] = {letter: half[..., k] for k, letter in enumerate(letters)}
    if "instance" in seen.wanted:
        parts["instance"] = {"id": seen.numbers}
    return parts


def _said(seen: FrameFacts, number: int, *, key: str, location: Location) -> dict[str, Any]:
    """Return all that is said of a frame in words and numbers, in SUMO's coordinates."""
    wanted, frame = seen.wanted, seen.frame
    said: dict[str, Any] = {
        "form": FORM,
        "key": key,
        "frame": number,
        "time": frame.time,
        "camera": camera_of(frame.view, seen.size, location),
        "things": {},
    }
    if {"instance", "ids", "semantic", "boxes2d", "boxes3d"} & wanted:
        said["things"] = {t.number: (t.name, t.label, t.label_id) for t in seen.things}
    if "boxes2d" in wanted:
        said["boxes2d"] = [asdict(box) for box in seen.boxes_2d]
    if "boxes3d" in wanted:
        said["boxes3d"] = [_box_3d(box, location) for box in seen.boxes_3d]
    if "lamps" in wanted:
        said["lamps"] = seen.lit
    return said


def camera_of(view: View, size: tuple[int, int], location: Location = UNPLACED) -> dict[str, Any]:
    """Return a camera as numbers, in SUMO's coordinates.

    Args:
        view: Of the camera.
        size: Width, height of the picture [px].
        location: From where ours are counted.
    """
    width, height = size
    return {
        "size": [width, height],
        "focal": 1.0 / view.lens.pixel_width(width),
        "centre": [(width - 1) / 2, (height - 1) / 2],
        "world_from_camera": location.outside_pose(view.world_from_camera.matrix).tolist(),
        **({} if view.lens.is_pinhole else {"lens": view.lens.as_dict()}),
    }


def _box_3d(box: Box3d, location: Location) -> dict[str, Any]:
    """Return a box around a body as plain values, in SUMO's coordinates."""
    matrix = location.outside_pose(box.world_from_box.matrix).tolist()
    return {"name": box.name, "part": box.part, "size": box.size, "world_from_box": matrix}


def _write_kitti(folder: Path, seen: FrameFacts, number: int) -> None:
    """Write the boxes of what is seen, and the camera, as KITTI has them."""
    labels = {thing.name: thing.label for thing in seen.things}
    around = {box.name: box for box in seen.boxes_2d}
    lines = [
        kitti_line(box, around[box.name], labels[box.name], seen.frame.view, seen.size)
        for box in seen.boxes_3d
    ]
    file, calibration = places.kitti_files(folder, number)
    write_whole(file, "".join(f"{line}\n" for line in lines))
    camera = camera_of(seen.frame.view, seen.size)
    write_whole(calibration, kitti_calibration(camera["focal"], camera["centre"]))


def _coco(said: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return the boxes of all frames as one COCO data set."""
    images: list[Any] = []
    annotations: list[Any] = []
    for one in said:
        width, height = one["camera"]["size"]
        number = one["frame"]
        name = f"{number:06d}.exr"
        images.append({"id": number, "width": width, "height": height, "file_name": name})
        kinds = {name: label_id for name, _, label_id in one["things"].values()}
        for entry in one["boxes2d"]:
            box = Box2d(**entry)
            annotations.append(_annotation(box, kinds[box.name], number, len(annotations) + 1))
    return {"images": images, "annotations": annotations, "categories": coco_categories()}


def _annotation(box: Box2d, category: int, image: int, number: int) -> dict[str, Any]:
    """Return a box as COCO's annotation."""
    return {
        "id": number,
        "image_id": image,
        "category_id": category,
        "bbox": [box.left, box.top, box.right - box.left, box.bottom - box.top],
        "area": box.pixels,
        "iscrowd": 0,
        "name": box.name,
    }


def _write_csv(path: Path, header: Sequence[str], rows: Iterable[Sequence[Any]]) -> None:
    """Write a table."""
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(header)
    table.writerows(rows)
    write_whole(path, text.getvalue())
