"""Choice cards: each film at its place, letters above, the shorter one holds its last picture."""

from __future__ import annotations

import re
from types import SimpleNamespace

import numpy as np
import pytest

from sumo3dviz_pt.studies.designs.trials import Trial
from sumo3dviz_pt.studies.outputs import card_names, card_size, write_card, write_cards
from sumo3dviz_pt.studies.tools.content import Clip, trial_name
from sumo3dviz_pt.video import encode
from sumo3dviz_pt.video.ffmpeg import film_pictures

SIZE = (64, 36)


def clip(folder, name, shades):
    frames = [np.full((*SIZE[::-1], 3), shade, np.uint8) for shade in shades]
    encode(frames, folder / name, size=SIZE, fps=10)
    return Clip(name, name, name, len(shades) / 10, SIZE, "10", "")


def test_films_stand_side_by_side_and_the_shorter_one_holds(tmp_path):
    one, other = clip(tmp_path, "a.mp4", [200] * 4), clip(tmp_path, "b.mp4", [40, 90])
    write_card(tmp_path, [one, None, other], tmp_path / "card.mp4")
    size, cell = card_size(SIZE, 2)
    frames = [*film_pictures(tmp_path / "card.mp4", size=size)]
    assert len(frames) == 4
    width, middle = size[0], size[1] - cell[1] // 2 - 2
    left = [int(frame[middle, width // 4, 0]) for frame in frames]
    right = [int(frame[middle, 3 * width // 4, 0]) for frame in frames]
    assert left == pytest.approx([200] * 4, abs=3)
    assert right == pytest.approx([40, 90, 90, 90], abs=3)
    # Letters above each film, grey between.
    strip = frames[0][: size[1] - cell[1] - 6].astype(int)
    assert (strip[:, : width // 2] > 180).any() and (strip[:, width // 2 :] > 180).any()
    assert frames[0][middle, width // 2, 0] == pytest.approx(119, abs=3)


@pytest.mark.parametrize("count", [2, 3, 4])
def test_sizes_are_even_and_films_keep_their_form(count):
    size, cell = card_size((1280, 720), count)
    assert not any(side % 2 for side in (*size, *cell))
    assert cell[0] / cell[1] == pytest.approx(16 / 9, rel=0.01)
    assert size[0] <= 2 * 1280 + 8


HOSTILE = (
    "1",
    "A",
    "a",
    "1/2",
    "../../../x",
    "con",
    "x:y",
    "what?",
    "Ω",
    "Ж",
    "long" * 60,
    "x.",
    " ",
)
"""Names of blocks and tasks, as tables of other tools may have them."""


def test_cards_of_any_tasks_have_names_that_every_system_knows():
    trials = [Trial(block, task, ()) for block in HOSTILE for task in HOSTILE]
    names = card_names(trials)
    assert list(names) == [trial_name(trial) for trial in trials]
    assert len({name.lower() for name in names.values()}) == len(trials)
    assert all(re.fullmatch(r"[A-Za-z0-9_-][A-Za-z0-9._-]{0,90}", name) for name in names.values())
    assert not any(name.endswith(".") for name in names.values())
    assert names["b1t1"] == "b1t1", "usual names stay"


def test_no_card_lies_outside_of_its_folder(tmp_path):
    content = SimpleNamespace(
        trials=(Trial("../../../out/b", "1", ("p", "q")),),
        clips={"p": clip(tmp_path, "a.mp4", [200]), "q": clip(tmp_path, "b.mp4", [40])},
    )
    (file,) = write_cards(tmp_path, content).values()
    assert (tmp_path / file).parent == tmp_path / "materials" / "cards"
    assert (tmp_path / file).is_file()
