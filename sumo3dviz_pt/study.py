"""Studies in Python: the same films and files as the command `study` makes."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sumo3dviz_pt.pipeline.films.shown import Films

if TYPE_CHECKING:
    from sumo3dviz_pt.pipeline.certificate.build import Certificate
    from sumo3dviz_pt.pipeline.studies.plan import StudyPlan


class Study:
    """Films that differ by design; printed, it says which, what differs and what they cost.

    Args:
        path: The study file.
        overrides: Values of the scene file by dotted key, for all films.

    Attributes:
        plan: What it shows: profiles, trials, films, pairs of films, playlists.
        certificate: What was found on the pairs of films, once they are rendered; None before,
            and where the study file asks for none.

    Raises:
        ConfigError: If the study file, a level or the design is wrong.
        InputError: If a design table is wrong, or the simulation's files are not there.
    """

    def __init__(self, path: str | Path, overrides: Mapping[str, Any] | None = None) -> None:
        from sumo3dviz_pt.pipeline.scene_file import override_values
        from sumo3dviz_pt.pipeline.studies.file import load_study
        from sumo3dviz_pt.pipeline.studies.plan import plan_study

        self.certificate: Certificate | None = None
        self.plan: StudyPlan = plan_study(load_study(Path(path)), override_values(overrides))

    def __str__(self) -> str:
        from sumo3dviz_pt.pipeline.studies.words import plan_in_words

        return plan_in_words(self.plan, self.plan.stimuli)

    def __repr__(self) -> str:
        plan = self.plan
        return (
            f"<Study {plan.file.path}: {len(plan.stimuli)} films, {len(plan.trials)} trials,"
            f" {len(plan.playlists)} playlists>"
        )

    def render(self, folder: str | Path, *, progress: bool | None = None, **choices: Any) -> Films:
        """Render the films, and write the files of all tools beside them.

        Args:
            folder: Of all that comes out.
            progress: Whether a bar or lines say how far it is; default on terminals and in
                notebooks.
            choices: `resume`, `overwrite`, `discard_frames` and `variant` as on the command line.

        Returns:
            All films, those that were there already among them: a list of paths that notebooks
            show as films.

        Raises:
            ConfigError: If a choice is wrong, or films exist and neither `resume` nor `overwrite`
                is true.
            RenderError: If a frame fails; finished films and frames are kept.
        """
        from sumo3dviz_pt.job.asked import made
        from sumo3dviz_pt.pipeline.progress.build import can_redraw, followed
        from sumo3dviz_pt.pipeline.progress.expectations import film_steps
        from sumo3dviz_pt.pipeline.studies.records import film_path
        from sumo3dviz_pt.pipeline.studies.run import (
            StudyOrder,
            check_study,
            film_tasks,
            finish_study,
            render_task,
        )

        order = made(StudyOrder, {**choices, "folder": folder})
        check_study(self.plan, order)
        shown = can_redraw(sys.stderr) if progress is None else progress
        for task in film_tasks(self.plan, order):
            steps = film_steps(task.stimulus.job, task.request, task.order)
            with followed(task.order.path.name, steps) if shown else nullcontext():
                render_task(self.plan, order, task)
        self.certificate = finish_study(self.plan, order).certificate
        return Films(film_path(order.folder, self.plan, each) for each in self.plan.stimuli)
