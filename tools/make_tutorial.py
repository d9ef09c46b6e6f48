"""Writes and runs the tutorial notebook: python tools/make_tutorial.py

Its cells are below, as text that can be reviewed; `tutorial.ipynb` holds them with what they
gave. A test runs the notebook.
"""

from __future__ import annotations

import json
import os
import sys
import tempfile
from pathlib import Path

import nbformat
from nbclient import NotebookClient

ROOT = Path(__file__).resolve().parents[1]
NOTEBOOK = ROOT / "docs" / "tutorial.ipynb"

CELLS = (
    """# From a SUMO log to pictures

This notebook films the bundled motorway. With `sv.load("scene.yaml")` it films your own
simulation: `sumo3dviz-pt init city.sumocfg -o scene.yaml` writes that file. Everything here is
small and coarse, so that it takes a minute; `quality="standard"` and `size=(1280, 720)` are for
real films.""",
    "> import sumo3dviz_pt as sv\n>\n"
    '> small = {"output.size": [320, 180], "quality": "draft"}\n'
    '> scene = sv.load(sv.example("ronda"), small)\n> scene',
    """## Who is on the road

Vehicles and persons of the log, here the five that drive farthest of those near a camera at
460 s.""",
    '> scene.find_vehicles(at=460, near="overview", radius=200, sort="length")[:5]',
    "> scene.cameras",
    """## A still

A cell shows a still by itself. It knows what it was made from; `radiance` is linear light,
`develop()` the 8-bit picture, and `save` writes a .png or an .exr.""",
    '> still = scene.still(time=482, camera="overview")\n> still',
    '> print(still.radiance.shape, still.develop().dtype, still.provenance["seed"])',
    """## The same place in another light

What wins over the file can be given as a dictionary. Each scene keeps its renderer open, so
close the one that is done.""",
    '> scene.close()\n> evening_light = {**small, "template": "highway_golden_hour"}\n'
    '> evening = sv.load(sv.example("ronda"), evening_light)\n'
    '> evening.still(time=482, camera="overview")',
    """## Frames as arrays

`frames` renders one frame after the other and stores none: here the mean brightness of half a
second.""",
    '> for frame in evening.frames(camera="overview", start=482, end=482.5, fps=8):\n'
    '>     print(f"{frame.time:.3f} s: {frame.develop().mean():.1f} of 255")\n> evening.close()',
    """## A film

The last line of a cell shows the film. Beside it lies `drive.json`, which tells what every frame
shows, and a folder of EXR frames.""",
    '> scene.render("drive.mp4", camera="driver", start=460, end=460.5, fps=8, progress=True)',
    """## Walk through it

`scene.view()` opens the viewer in a frame below its cell (extra `viewer`). On JupyterHub it finds
its way by itself, elsewhere `proxy="/proxy/{port}/"` names the address of jupyter-server-proxy.""",
    "> scene.close()",
)
"""Lines that begin with > are code."""


def notebook() -> nbformat.NotebookNode:
    """The cells, not yet run."""
    made = nbformat.v4.new_notebook()
    made.metadata["kernelspec"] = {
        "name": "python3",
        "display_name": "Python 3",
        "language": "python",
    }
    for number, text in enumerate(CELLS):
        is_code = text.startswith(">")
        lines = [line[2:] if is_code else line for line in text.splitlines()]
        kind = nbformat.v4.new_code_cell if is_code else nbformat.v4.new_markdown_cell
        cell = kind("\n".join(lines))
        cell["id"] = f"cell-{number}"
        made.cells.append(cell)
    return made


def run(made: nbformat.NotebookNode) -> nbformat.NotebookNode:
    """Run a notebook in an empty folder.

    Raises:
        CellExecutionError: If a cell fails.
    """
    with tempfile.TemporaryDirectory() as folder:
        # The kernel finds the package where this program has found it.
        os.environ["PYTHONPATH"] = os.pathsep.join(path for path in sys.path if path)
        client = NotebookClient(made, timeout=900, resources={"metadata": {"path": folder}})
        client.execute()
    for cell in made.cells:
        cell.metadata.pop("execution", None)
    return nbformat.from_dict(json.loads(json.dumps(made).replace(f"{ROOT}/", "")))


def main() -> None:
    """Write it."""
    nbformat.write(run(notebook()), NOTEBOOK)


if __name__ == "__main__":
    main()
