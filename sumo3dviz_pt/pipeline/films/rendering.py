"""Renders a film's frames one by one, all at once or as the film asks for them."""

from __future__ import annotations

import json
import time
from collections import deque
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sumo3dviz_pt.model.news import Doing, announce
from sumo3dviz_pt.pipeline.films.frames import frame_file
from sumo3dviz_pt.pipeline.films.stopping import whole_frame
from sumo3dviz_pt.pipeline.films.traced import write_traced
from sumo3dviz_pt.pipeline.production import Production, opened

if TYPE_CHECKING:
    from sumo3dviz_pt.pipeline.layers.write import LayerWriter
    from sumo3dviz_pt.render.session import Session


@dataclass(frozen=True, slots=True)
class FrameDone:
    """How far a film is after a frame.

    Attributes:
        done: Frames that exist now.
        total: Frames that were asked for.
        seconds_left: Estimate of the wall time left [s].
        kept: True if the frame was there already.
        cpu: CPU-seconds by phase; empty if kept.
    """

    done: int
    total: int
    seconds_left: float
    kept: bool
    cpu: dict[str, float]


@dataclass(frozen=True, slots=True, eq=False)
class Frames:
    """A film's frames on disk, and what is needed to make those that are missing.

    Attributes:
        production: What they show.
        folder: Where they go.
        wanted: Their numbers.
        missing: The numbers of those that are to be rendered, ascending.
        shared: The account that they share.
        on_frame: Called after every frame.
    """

    production: Production
    folder: Path
    wanted: Sequence[int]
    missing: Sequence[int]
    shared: Mapping[str, Any]
    on_frame: Callable[[FrameDone], None] | None

    @property
    def files(self) -> list[Path]:
        """All of their files."""
        return [frame_file(self.folder, number) for number in self.wanted]

    @property
    def layers(self) -> LayerWriter | None:
        """What writes the film's layers; None where none are asked for."""
        if not self.production.job.output.layers:
            return None
        from sumo3dviz_pt.pipeline.layers.write import LayerWriter

        return LayerWriter.beside(self.folder, self.production)

    def _shown(self) -> Production:
        """Return what the renderer shows: where layers are asked for, all faces have names."""
        if not self.production.job.output.layers:
            return self.production
        from sumo3dviz_pt.shot.things import with_things

        return replace(self.production, shot=with_things(self.production.shot))

    def rendered(self, cpu: dict[str, float]) -> Generator[int, None, None]:
        """Render what is missing; yield each number when its frame is stored.

        Args:
            cpu: CPU-seconds by phase, to which is added.
        """
        if not self.missing:
            return
        kept = len(self.wanted) - len(self.missing)
        layers = self.layers
        with opened(self._shown()) as session:
            started = time.monotonic()
            announce(Doing.RENDER, kept, len(self.wanted))
            for count, number in enumerate(self.missing, start=1):
                with whole_frame():
                    spent = self._render(session, number, layers)
                for phase, seconds in spent.items():
                    cpu[phase] = cpu.get(phase, 0.0) + seconds
                announce(Doing.RENDER, kept + count, len(self.wanted))
                left = (time.monotonic() - started) / count * (len(self.missing) - count)
                done = FrameDone(kept + count, len(self.wanted), left, kept=False, cpu=spent)
                self._tell(done)
                yield number

    def _render(
        self, session: Session, number: int, layers: LayerWriter | None
    ) -> dict[str, float]:
        """Render and store one frame and its layers; CPU-seconds by phase."""
        spent = _render_frame(self.production, session, self.folder, number, self.shared)
        if layers is not None:
            layers.write(session, number)
            spent = dict(session.clock.seconds)
        return spent

    def passing(self, cpu: dict[str, float]) -> Generator[Path, None, None]:
        """Yield all files in order, each when those exist that help it; drop what none needs.

        Only frames that were rendered here go: what took another run's time stays until there is
        a film. So memory and disk hold a window, however long the film is.

        Args:
            cpu: As in `rendered`.
        """
        window = self.production.quality.accumulate
        pending, own = deque(self.missing), set(self.missing)
        with closing(self.rendered(cpu)) as rendering:
            for number in self.wanted:
                while pending and pending[0] <= number + window:
                    pending.popleft()
                    next(rendering)
                yield frame_file(self.folder, number)
                if number - window in own:
                    frame_file(self.folder, number - window).unlink()

    def tell_kept(self) -> None:
        """Say how many frames were there before."""
        kept = len(self.wanted) - len(self.missing)
        if kept:
            self._tell(FrameDone(kept, len(self.wanted), 0.0, kept=True, cpu={}))

    def _tell(self, news: FrameDone) -> None:
        """Say how far the film is."""
        if self.on_frame is not None:
            self.on_frame(news)


def _render_frame(
    production: Production, session: Session, folder: Path, number: int, shared: Mapping[str, Any]
) -> dict[str, float]:
    """Render and store one frame; CPU-seconds by phase."""
    from sumo3dviz_pt.image.exr import PROVENANCE, write_exr

    at = float(production.times[number])
    frame, path = production.frame_at(at), frame_file(folder, number)
    half = production.job.output.half
    samples = session.samples(frame)
    account = {
        **shared,
        "frame": number,
        "time": at,
        "capped_share": round(samples.tally.capped_share, 6),
        "nonfinite": samples.tally.nonfinite,
        "stored": "traced" if "ids" in samples.layers else "finished",
    }
    if "ids" in samples.layers:
        write_traced(path, samples, frame, session=session, account=account, half=half)
    else:
        finished = {"radiance": session.finish(samples, frame)}
        text = json.dumps(account, sort_keys=True)
        write_exr(path, finished, half=half, attributes={PROVENANCE: text})
    return dict(session.clock.seconds)
