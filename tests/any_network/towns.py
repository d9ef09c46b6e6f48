"""A simulated network with its proposed scene file, as a user gets them."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

from any_network.laws import Drawn
from any_network.recipes import RECIPES
from any_network.simulation import simulate
from sumo3dviz_pt.job.settings import Job, RoadSettings
from sumo3dviz_pt.model.traffic import Scenario
from sumo3dviz_pt.pipeline.scene_file import load_job
from sumo3dviz_pt.proposals.proposal import propose
from sumo3dviz_pt.sumo import find_scenario, read_scenario
from sumo3dviz_pt.world.roads.layout import layout_roads

WHOLE = os.environ.get("ANY_NETWORK") == "all"
"""Whether all networks are built, and more of them rendered; it takes a quarter of an hour."""

PICTURED = range(0, len(RECIPES), 3 if WHOLE else 10)
"""Networks that are built with houses and plants, and rendered."""

BUILT = frozenset(range(len(RECIPES)) if WHOLE else range(1, len(RECIPES), 3)) - {*PICTURED}
"""Networks that are built plainly; the others are laid out."""


@dataclass(frozen=True, slots=True, eq=False)
class Town:
    """A network, its logs and what `init` proposes for them.

    Attributes:
        number: Of its recipe; -1 for none.
        folder: Where its files lie.
        scenario: As read.
        drawn: Its roads, laid out.
    """

    number: int
    folder: Path
    scenario: Scenario
    drawn: Drawn

    def job(self, template: str) -> Job:
        """Return the scene file that `init` writes with a template."""
        scene = self.folder / f"{template}.yaml"
        text, _ = propose(self.folder, output=scene, template=template)
        scene.write_text(text, encoding="utf-8")
        return load_job(scene)


def made_town(number: int, folder: Path) -> Town:
    """Simulate the network of a number in a folder."""
    return town_in(simulate(number, folder / f"{number:02d}"), number=number)


def town_in(folder: Path, *, number: int = -1) -> Town:
    """Read a folder that holds a network and its logs."""
    scenario = read_scenario(find_scenario(folder))
    layout = layout_roads(scenario.network, RoadSettings())
    return Town(number, folder, scenario, Drawn(scenario.network, layout))


def name_of(number: int) -> str:
    """Return number and title, as a test's name."""
    return f"{number:02d} {RECIPES[number].title}".replace(",", "").replace(" ", "_")
