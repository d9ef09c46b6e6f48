"""Stored frames that are not finished: what was traced, and how to finish it.

Such a frame is a function of itself alone; what falls and flies before its camera is stored with it
as text. What its neighbours know is added when the film is developed, so it does not matter in
which order, by how many runs or where frames were traced.
"""

from __future__ import annotations

import base64
import json
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sumo3dviz_pt.model.falling import Cabin, Falling, Glows, Puffs, SkyLight, Throws, Windscreen
from sumo3dviz_pt.model.geometry import Image
from sumo3dviz_pt.model.layers import Layers
from sumo3dviz_pt.model.scene import FrameState, Haze, View
from sumo3dviz_pt.model.traced import TracedFrame
from sumo3dviz_pt.pipeline.films.frames import intact, parsed

if TYPE_CHECKING:
    from sumo3dviz_pt.render.averaging.average import Averager as Averager
    from sumo3dviz_pt.render.passes.finish import Finishing
    from sumo3dviz_pt.render.session import Samples, Session


_PARTS = {
    "glows": Glows,
    "throws": Throws,
    "puffs": Puffs,
    "cabin": Cabin,
    "windscreen": Windscreen,
}


def as_plain(value: Any) -> Any:
    """Return a value of `model/falling.py` as plain ones; arrays keep all of their bits."""
    if isinstance(value, np.ndarray):
        raw = np.ascontiguousarray(value, dtype=np.float64).tobytes()
        return {"shape": list(value.shape), "raw": base64.b64encode(zlib.compress(raw, 9)).decode()}
    if isinstance(value, Falling | SkyLight | Glows | Throws | Puffs | Cabin | Windscreen):
        return {field.name: as_plain(getattr(value, field.name)) for field in fields(value)}
    return value


def falling_of(content: dict[str, Any]) -> Falling:
    """Return what plain values say that falls and flies.

    Raises:
        KeyError: If something is missing.
        ValueError: If something is damaged.
    """
    values: dict[str, Any] = {}
    for name, value in content.items():
        made = _PARTS.get(name)
        values[name] = (
            _of_plain(value)
            if made is None or value is None
            else made(**{key: _of_plain(part) for key, part in value.items()})
        )
    return Falling(**values)


def light_of(content: dict[str, Any]) -> SkyLight:
    """Return the light of the sky from plain values."""
    return SkyLight(**{name: _of_plain(value) for name, value in content.items()})


def _of_plain(value: Any) -> Any:
    """Return an array, a tuple or a number from plain values."""
    if isinstance(value, dict):
        raw = zlib.decompress(base64.b64decode(value["raw"]))
        return np.frombuffer(raw, dtype=np.float64).reshape(value["shape"])
    return tuple(value) if isinstance(value, list) else value


def text_of(falling: Falling, light: SkyLight | None) -> str:
    """Return what falls, and in what light, as text."""
    return json.dumps({"falling": as_plain(falling), "light": as_plain(light)})


def read_text(text: str) -> tuple[Falling, SkyLight]:
    """Return what falls, and in what light, from its text.

    Raises:
        ValueError: If it is damaged.
    """
    try:
        content = json.loads(text)
        return falling_of(content["falling"]), light_of(content["light"])
    except (KeyError, TypeError, zlib.error) as error:
        raise ValueError(f"does not say what falls in it ({error})") from error


TRACED, FINISHING = "sumo3dviz_pt_traced", "sumo3dviz_pt_finishing"
"""Names of the attributes that say what a frame shows, and how it is finished."""

_WIDEST = 100  # frames before and after one that help it

FALLING = "sumo3dviz_pt_falling"
"""Name of the attribute that says what falls and flies before it; only where something does."""


def traced_by(session: Session, samples: Samples, frame: FrameState) -> TracedFrame:
    """Return a frame as it was traced.

    Args:
        session: That traced it.
        samples: What was traced, with the layers `ids` and `first_depth`.
        frame: What it shows.
    """
    white, spp = session.settings.white, session.settings.quality.spp
    return TracedFrame(samples.apart, frame.view, white, spp, samples.movers)


def write_traced(
    path: Path,
    traced: TracedFrame,
    how: Finishing,
    *,
    account: Mapping[str, Any],
    half: bool,
) -> None:
    """Store a frame as it was traced.

    Args:
        path: Where to.
        traced: The frame.
        how: It is finished later.
        account: What it was made from.
        half: Whether colours are stored in half precision.

    Raises:
        OSError: If the file cannot be written.
    """
    from sumo3dviz_pt.image.exr import PROVENANCE, write_exr
    from sumo3dviz_pt.image.traced import packed

    layers, text = packed(traced)
    attributes = {
        PROVENANCE: json.dumps(account, sort_keys=True),
        TRACED: text,
        FINISHING: _finishing_text(how),
    }
    if how.falling is not None:
        attributes[FALLING] = text_of(how.falling, how.light)
    write_exr(path, layers, half=half, attributes=attributes)


def _finishing_text(how: Finishing) -> str:
    """Return how frames are finished, as text."""
    horizon = zlib.compress(how.horizon.astype(np.float16).tobytes(), 9)
    return json.dumps(
        {
            "denoiser": how.denoiser,
            "guided": how.guided,
            "raw_share": how.raw_share,
            "haze": None if how.haze is None else list(how.haze.extinction),
            **({"falls": how.haze.falls} if how.haze is not None and how.haze.falls else {}),
            "horizon": base64.b64encode(horizon).decode(),
            **({"grainy_sky": True} if how.grainy_sky else {}),
        }
    )


def _finishing_of(text: str) -> Finishing:
    """Return how frames are finished, from its text."""
    from sumo3dviz_pt.render.passes.finish import Finishing

    content = json.loads(text)
    red_green_blue, falls = content["haze"], float(content.get("falls", 0.0))
    horizon = zlib.decompress(base64.b64decode(content["horizon"]))
    return Finishing(
        str(content["denoiser"]),
        bool(content["guided"]),
        float(content["raw_share"]),
        None if red_green_blue is None else Haze(tuple(red_green_blue), falls),
        np.frombuffer(horizon, dtype=np.float16).astype(np.float32).reshape(-1, 3),
        bool(content.get("grainy_sky", False)),
    )


@dataclass(frozen=True, slots=True, eq=False)
class StoredFrame:
    """A frame as it lies on disk.

    Attributes:
        layers: All of its layers.
        strings: Its attributes.
        account: What it was made from.
    """

    layers: Mapping[str, Image]
    strings: Mapping[str, str]
    account: Mapping[str, Any]

    @classmethod
    def read(cls, path: Path) -> StoredFrame:
        """Read a frame.

        Raises:
            InputError: If it is missing or damaged.
        """
        from sumo3dviz_pt.image.exr import PROVENANCE, read_layers

        layers, strings = read_layers(path)
        return cls(layers, strings, parsed(strings.get(PROVENANCE, "{}").encode(), path))

    @property
    def window(self) -> int:
        """How many frames before and after help it; 0 where it is finished already."""
        if not self.traced:
            return 0
        window = int(self.account.get("preset", {}).get("accumulate", 0))
        if not 0 <= window <= _WIDEST:
            raise ValueError(f"{window} frames before and after help it")
        return window

    @property
    def traced(self) -> bool:
        """Whether it is stored as it was traced."""
        return TRACED in self.strings


@dataclass(frozen=True, slots=True, eq=False)
class HelpedFrame:
    """A frame with its neighbours' help.

    Attributes:
        layers: As they are now.
        view: Of the camera.
        how: It is finished; None where it was stored finished.
        account: What it was made from.
    """

    layers: Layers
    view: View | None = None
    how: Finishing | None = None
    account: Mapping[str, Any] = field(default_factory=dict)

    def finished(self) -> Image:
        """Return its radiance, (h, w, 3); threads may do so for several frames at once."""
        if self.how is None or self.view is None:
            return self.layers["radiance"]
        from sumo3dviz_pt.render.passes.finish import finished

        return finished(self.layers, self.view, self.how)


@dataclass(slots=True)
class Shelf:
    """Reads a film's frames and helps each; those that the next one needs, too, are kept.

    Memory depends on the window, not on the film's length.
    """

    _frames: dict[Path, tuple[StoredFrame, TracedFrame]] = field(default_factory=dict)
    _averager: Averager | None = None

    def helped(self, path: Path) -> HelpedFrame:
        """Return a frame with the help of its neighbours.

        Its neighbours are the frames of the same film that lie beside it.

        Raises:
            InputError: If it, or a neighbour, is missing or damaged.
        """
        with intact(path):
            if path not in self._frames:
                stored = StoredFrame.read(path)
                if not stored.traced:
                    return HelpedFrame(Layers(stored.layers), account=stored.account)
                self._frames[path] = (stored, _traced_frame(stored))
            stored, centre = self._frames[path]
            around = _beside(path, stored.window)
            self._frames = {p: one for p, one in self._frames.items() if p == path or p in around}
            others = [self._neighbour(other, stored) for other in around]
            how = _finishing_of(stored.strings[FINISHING])
            if FALLING in stored.strings:
                how = _with_falling(how, stored.strings[FALLING])
            if self._averager is None:
                self._averager = new_averager()
            known = [one for one in others if one]
            frame = helped(centre, known, how, averager=self._averager)
            return replace(frame, account=stored.account)

    def _neighbour(self, path: Path, centre: StoredFrame) -> TracedFrame | None:
        """Return a frame beside another one; None if it is of another film."""
        with intact(path):
            if path not in self._frames:
                stored = StoredFrame.read(path)
                if not stored.traced or stored.account.get("key") != centre.account.get("key"):
                    return None
                self._frames[path] = (stored, _traced_frame(stored))
            stored, traced = self._frames[path]
            if stored.layers["radiance"].shape != centre.layers["radiance"].shape:
                raise ValueError("it has another size than its neighbours")
            return traced


def _with_falling(how: Finishing, text: str) -> Finishing:
    """Return how a frame is finished before which something falls."""
    falling, light = read_text(text)
    return replace(how, falling=falling, light=light)


def new_averager() -> Averager:
    """Return what averages the frames of a film.

    Raises:
        RenderError: If nothing here can.
    """
    from sumo3dviz_pt.render.averaging.average import Averager

    return Averager()


def helped(
    centre: TracedFrame, others: Sequence[TracedFrame], how: Finishing, *, averager: Averager
) -> HelpedFrame:
    """Return a frame with its neighbours' help, which is finished as is told."""
    return HelpedFrame(averager.accumulated(centre, others).layers, centre.view, how)


def _traced_frame(stored: StoredFrame) -> TracedFrame:
    """Return a stored frame ready to help others."""
    from sumo3dviz_pt.image.traced import unpacked

    return unpacked(stored.layers, stored.strings[TRACED])


def _beside(path: Path, window: int) -> list[Path]:
    """Return the frames that lie beside one, in order, as far as they exist."""
    if not path.stem.isdecimal():
        return []
    number, digits = int(path.stem), len(path.stem)
    numbers = [n for n in range(number - window, number + window + 1) if n >= 0 and n != number]
    files = [path.with_name(f"{n:0{digits}d}{path.suffix}") for n in numbers]
    return [file for file in files if file.is_file()]
