"""Writes the layers of frames, and at the end of a film what is said of all of them.

A frame's layers are found by the session that has just rendered it.
"""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sumo3dviz_pt.files.atomic import write_atomically
from sumo3dviz_pt.image.layers import (
    SURFACES,
    Box2d,
    Box3d,
    box_3d,
    boxes_2d,
    coco_categories,
    flow_of,
    header,
    kitti_calibration,
    kitti_line,
    mattes,
    read_flow,
    read_numbers,
    write_flow,
    write_numbers,
)
from sumo3dviz_pt.model.geometry import Bools, Floats, Image, Ints, Transform
from sumo3dviz_pt.model.layers import SKY, Thing
from sumo3dviz_pt.model.network import UNPLACED, Location
from sumo3dviz_pt.model.numbers import LAYER_KINDS
from sumo3dviz_pt.model.scene import FrameState, Mover, Prototype, View

if TYPE_CHECKING:
    from sumo3dviz_pt.pipeline.production import Production
    from sumo3dviz_pt.render.session import PixelFacts, Session
    from sumo3dviz_pt.shot.build import Shot


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


def own_file(folder: Path, number: int, layer: str) -> Path:
    """Return the file of a frame that one layer has for itself."""
    return folder / OWN_FILES[layer].place.format(number)


def files_of(folder: Path, number: int) -> tuple[Path, ...]:
    """Return all files that a frame's layers may have."""
    own = [own_file(folder, number, layer) for layer in OWN_FILES]
    camera = _calibration(own_file(folder, number, "boxes3d"))
    return said_file(folder, number), channels_file(folder, number), *own, camera


def _calibration(boxes: Path) -> Path:
    """Return the file of a frame's camera as KITTI has it, beside that of its boxes."""
    return boxes.with_name(f"calib.{boxes.name}")


_SIDE = 4
"""Rays a pixel, along each of its sides, that tell coverage."""


def rays_for(wanted: Collection[str]) -> set[str]:
    """Return what rays through pixels' centres are asked for some layers."""
    return {ray for layer in wanted for ray in LAYER_KINDS[layer].rays}


@dataclass(frozen=True, eq=False)
class LayerFacts:
    """What a frame shows, by which its layers are made.

    Attributes:
        shot: What is shown.
        session: That has just rendered the frame.
        frame: What it shows.
        wanted: Layers that are asked for.
    """

    shot: Shot
    session: Session
    frame: FrameState
    wanted: frozenset[str]

    @cached_property
    def size(self) -> tuple[int, int]:
        """Width, height [px]."""
        return self.session.settings.size

    @cached_property
    def facts(self) -> PixelFacts:
        """What pixels' centres show."""
        return self.session.facts(rays_for(self.wanted))

    @cached_property
    def things(self) -> tuple[Thing, ...]:
        """All things that some pixel shows, in the order of `owner`; the first is the sky."""
        from sumo3dviz_pt.shot.picking import thing_of

        ego = self.frame.view.rides_in
        return tuple(thing_of(name, self.shot.fleet, ego=ego) for name in self._owner[1])

    @property
    def owner(self) -> Ints:
        """Which of the things each pixel shows, (h, w)."""
        return self._owner[0]

    @cached_property
    def _owner(self) -> tuple[Ints, tuple[str, ...]]:
        """Which thing each pixel shows, (h, w), and the names of those that are seen."""
        names: dict[str, int] = {SKY: 0}
        return self._renumbered(self.facts, names), tuple(names)

    def _renumbered(self, facts: PixelFacts, names: dict[str, int]) -> Ints:
        """Return which thing each pixel shows, (h, w); things that are new join the names."""
        assert facts.owner is not None, "ask for owners"
        places = np.zeros(len(facts.names), np.int64)
        for number in np.flatnonzero(np.bincount(facts.owner.ravel())).tolist():
            if number:
                name = self.thing_of(facts.names[number])
                places[number] = names.setdefault(name, len(names))
        return places[facts.owner]

    def thing_of(self, part: str) -> str:
        """Return the name of the thing that a part of what moves, or what stands, belongs to."""
        return self._movers[part].id if part in self._movers else part

    @cached_property
    def _movers(self) -> Mapping[str, Mover]:
        """Everything that moves, by its name."""
        frame = self.frame
        return {mover.name: mover for mover in (*frame.everyone, *frame.fixtures)}

    @property
    def numbers(self) -> Any:
        """Instance number of each pixel, (h, w)."""
        return np.array([thing.number for thing in self.things], np.uint32)[self.owner]

    @property
    def classes(self) -> Any:
        """Id of each pixel's class, (h, w)."""
        return np.array([thing.label_id for thing in self.things], np.uint8)[self.owner]

    def flow(self, after: FrameState) -> tuple[Image, Bools]:
        """Return the flow to another frame, (h, w, 2) [px], and where it is known."""
        from sumo3dviz_pt.render.session import carried, points_of

        facts, view = self.facts, self.frame.view
        points = points_of(facts, self.frame, self.size)
        moved, known = carried(facts, self.session.loaded, (self.frame, after), points)
        sky = facts.layers["depth"] <= 0.0
        flow, ahead = flow_of(moved, view.directions(self.size), sky, view=after.view)
        flow[~known] = 0.0
        return flow, known & ahead

    def coverage(self) -> tuple[list[Ints], tuple[str, ...]]:
        """Return which thing several places of every pixel show, (h, w) each, and their names."""
        names: dict[str, int] = {"": 0}
        counts = []
        for row, column in np.ndindex(_SIDE, _SIDE):
            at = ((column + 0.5) / _SIDE, (row + 0.5) / _SIDE)
            rays = {"depth", "face", "instance"}
            facts = self.session.facts(rays, at=at, owners=self.facts.owners)
            counts.append(self._renumbered(facts, names))
        return counts, tuple(names)

    @cached_property
    def boxes_2d(self) -> tuple[Box2d, ...]:
        """Boxes around the pixels of all things that have an outline of their own."""
        boxes = boxes_2d(self.owner, [thing.name for thing in self.things])
        kinds = {thing.name: thing for thing in self.things}
        return tuple(box for box in boxes if _is_boxed(kinds[box.name]))

    @cached_property
    def boxes_3d(self) -> tuple[Box3d, ...]:
        """Boxes around all road users that some pixel shows, without the one ridden in."""
        seen = {thing.name for thing in self.things}
        return tuple(
            box_3d(mover.id, mover.part, _bounds(self._prototype(mover)), mover.world_from_body)
            for mover in self.frame.everyone
            if mover.id in seen
            and mover.id != self.frame.view.rides_in
            and (not mover.part or mover.part.removeprefix("unit").isdecimal())
        )

    def _prototype(self, mover: Mover) -> Prototype:
        """Return the body of a mover."""
        return self.shot.data.prototypes[mover.prototype]

    @cached_property
    def lit(self) -> tuple[str, ...]:
        """Names of all lamps that are lit, of those that can change and are in the scene."""
        data, names = self.shot.data, set()
        for some in data.lamps:
            if some.radiance is None:
                shines = np.asarray(self.frame.lamps[some.id]).max(axis=1) > 0.0
                lamps = zip(some.lamps, shines.tolist(), strict=True)
                names |= {f"{some.id}:{lamp}" for lamp, lit in lamps if lit}
        for mover in self.frame.everyone:
            roles = {lamp.role for lamp in self._prototype(mover).lamps}
            names |= {f"{mover.id}/{role}" for role in mover.lit & roles}
        return tuple(sorted(names))


def _is_boxed(thing: Thing) -> bool:
    """Return whether a thing has a box: a road user, or what has a name and an outline."""
    return ":" in thing.name and thing.label not in SURFACES


def _bounds(body: Prototype) -> Floats:
    """Return the lowest and highest corner of a body, in all of its poses, (2, 3) [m]."""
    if body.poses is not None:
        points = body.poses.vertices.reshape(-1, 3)
    else:
        points = np.concatenate([part.mesh.vertices for part in body.parts])
    return np.stack([points.min(axis=0), points.max(axis=0)])


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
        return cls(beside(frames), production)

    def write(self, session: Session, number: int) -> None:
        """Write the layers of the frame that was rendered last.

        Args:
            session: That rendered it, of a shot whose faces all belong to things.
            number: Its number.

        Raises:
            OSError: If a file cannot be written.
        """
        from sumo3dviz_pt.image.exr import write_parts

        wanted = frozenset(self.production.job.output.layers)
        frame = session.frame
        assert frame is not None, "render a frame first"
        seen = LayerFacts(self.production.shot, session, frame, wanted)
        for file in files_of(self.folder, number):
            file.parent.mkdir(parents=True, exist_ok=True)
        parts = _parts(seen)
        if parts:
            write_parts(channels_file(self.folder, number), parts)
        for layer, own in OWN_FILES.items():
            if layer in wanted:
                own.write(own_file(self.folder, number, layer), seen, self.production, number)
        # What says that all is there comes last.
        location = self.production.shot.fleet.location
        facts = _said(seen, number, key=self.production.key, location=location)
        facts["layers"] = sorted(wanted)
        write_atomically(said_file(self.folder, number), json.dumps(facts))

    def finish(self) -> None:
        """Write what is said of the whole film, from what is said of its frames."""
        count = len(self.production.times)
        facts = [json.loads(said_file(self.folder, k).read_bytes()) for k in range(count)]
        wanted = self.production.job.output.layers
        cameras = [{"frame": one["frame"], "time": one["time"], **one["camera"]} for one in facts]
        write_atomically(self.folder / "cameras.json", json.dumps(cameras, indent=1))
        rows = {(number, *thing) for one in facts for number, thing in one["things"].items()}
        ordered = sorted(rows, key=lambda row: row[1:])
        _write_csv(self.folder / "instances.csv", ("number", "name", "label", "label_id"), ordered)
        for layer, row in SAID.items():
            if layer in wanted and row.finish is not None:
                row.finish(self.folder, facts)


def is_written(folder: Path, number: int, *, key: str, layers: Iterable[str]) -> bool:
    """Return whether some layers of a frame are there, of a film with that key."""
    try:
        content = json.loads(said_file(folder, number).read_bytes())
    except (OSError, ValueError):
        return False
    if not isinstance(content, dict) or content.get("key") != key:
        return False
    return {*layers} <= {*map(str, content.get("layers", ()))}


def _parts(seen: LayerFacts) -> dict[str, dict[str, Any]]:
    """Return the channels of all layers that lie in the frame's EXR, as asked for."""
    parts: dict[str, dict[str, Any]] = {}
    for layer, kind in LAYER_KINDS.items():
        if kind.channels and layer in seen.wanted:
            values = seen.numbers if layer == "instance" else seen.facts.layers[layer]
            stored = np.atleast_3d(values.astype(kind.dtype))
            parts[layer] = {letter: stored[..., k] for k, letter in enumerate(kind.channels)}
    return parts


def _said(seen: LayerFacts, number: int, *, key: str, location: Location) -> dict[str, Any]:
    """Return all that is said of a frame in words and numbers, in SUMO's coordinates."""
    wanted, frame = seen.wanted, seen.frame
    content: dict[str, Any] = {
        "form": FORM,
        "key": key,
        "frame": number,
        "time": frame.time,
        "camera": camera_of(frame.view, seen.size, location),
        "things": {},
    }
    if any(LAYER_KINDS[layer].names for layer in wanted):
        content["things"] = {t.number: (t.name, t.label, t.label_id) for t in seen.things}
    return content | {name: row.say(seen, location) for name, row in SAID.items() if name in wanted}


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


def _write_classes(path: Path, seen: LayerFacts, production: Production, number: int) -> None:
    """Write the class of each pixel."""
    write_numbers(path, seen.classes)


def _write_mattes(path: Path, seen: LayerFacts, production: Production, number: int) -> None:
    """Write a Cryptomatte."""
    from sumo3dviz_pt.image.exr import write_channels

    owners, names = seen.coverage()
    write_channels(path, mattes(owners, names), header(names[1:]))


def _write_flow(path: Path, seen: LayerFacts, production: Production, number: int) -> None:
    """Write the flow to the next frame, if there is one."""
    if number + 1 < len(production.times):
        write_flow(path, *seen.flow(production.shot.frame_at(float(production.times[number + 1]))))


def _read_flow(path: Path) -> dict[str, Any]:
    """Return flow, and where it is known."""
    flow, known = read_flow(path)
    return {"flow": flow, "flow_valid": known}


def _write_kitti(path: Path, seen: LayerFacts, production: Production, number: int) -> None:
    """Write the boxes of what is seen, and the camera, as KITTI has them."""
    labels = {thing.name: thing.label for thing in seen.things}
    around = {box.name: box for box in seen.boxes_2d}
    lines = [
        kitti_line(box, around[box.name], labels[box.name], seen.frame.view, seen.size)
        for box in seen.boxes_3d
    ]
    write_atomically(path, "".join(f"{line}\n" for line in lines))
    camera = camera_of(seen.frame.view, seen.size)
    write_atomically(_calibration(path), kitti_calibration(camera["focal"], camera["centre"]))


@dataclass(frozen=True, slots=True)
class OwnFile:
    """The file of a frame that a layer has for itself.

    Attributes:
        place: In the film's folder, with a place for the frame's number.
        write: Writes it.
        read: Returns the pictures in it, by name; None if it is for other programs alone.
    """

    place: str
    write: Callable[[Path, LayerFacts, Production, int], None]
    read: Callable[[Path], Mapping[str, Any]] | None = None


OWN_FILES: Mapping[str, OwnFile] = {
    "ids": OwnFile("ids/{:06d}.exr", _write_mattes),
    "semantic": OwnFile(
        "semantic/{:06d}.png", _write_classes, lambda path: {"semantic": read_numbers(path)}
    ),
    "flow": OwnFile("flow/{:06d}.png", _write_flow, _read_flow),
    "boxes3d": OwnFile("kitti/{:06d}.txt", _write_kitti),
}
"""Files of layers that are no channels of the frame's EXR."""


def _write_coco(folder: Path, frames: Sequence[Mapping[str, Any]]) -> None:
    """Write the boxes of all frames as one COCO data set."""
    write_atomically(folder / "coco.json", json.dumps(_coco(frames)))


def _write_lamps(folder: Path, frames: Sequence[Mapping[str, Any]]) -> None:
    """Write which lamps are lit in which frame."""
    lit = [(one["frame"], one["time"], lamp) for one in frames for lamp in one["lamps"]]
    _write_csv(folder / "lamps.csv", ("frame", "time", "lamp"), lit)


@dataclass(frozen=True, slots=True)
class Said:
    """What a layer says of a frame in words and numbers.

    Attributes:
        say: Returns it for a frame, in SUMO's coordinates.
        read: Makes it again of what was stored.
        finish: Writes a file of what was said of all frames into the film's folder, if anything.
    """

    say: Callable[[LayerFacts, Location], Any]
    read: Callable[[Any], Any]
    finish: Callable[[Path, Sequence[Mapping[str, Any]]], None] | None = None


SAID: Mapping[str, Said] = {
    "boxes2d": Said(
        lambda seen, location: [asdict(box) for box in seen.boxes_2d],
        lambda boxes: tuple(Box2d(**one) for one in boxes),
        _write_coco,
    ),
    "boxes3d": Said(
        lambda seen, location: [_box_3d(box, location) for box in seen.boxes_3d],
        lambda boxes: tuple(_read_box_3d(one) for one in boxes),
    ),
    "lamps": Said(lambda seen, location: seen.lit, frozenset, _write_lamps),
}
"""Layers that are no pictures."""


def _read_box_3d(box: Mapping[str, Any]) -> Box3d:
    """Return a box around a body."""
    length, width, height = box["size"]
    placed = Transform(np.array(box["world_from_box"]))
    return Box3d(box["name"], box["part"], (length, width, height), placed)


def _coco(frames: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return the boxes of all frames as one COCO data set."""
    images: list[Any] = []
    annotations: list[Any] = []
    for one in frames:
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
    write_atomically(path, text.getvalue())
