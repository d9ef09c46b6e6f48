"""The tutorial notebook holds what its script says, and every cell of it runs."""

import importlib.util
from pathlib import Path

import pytest

nbformat = pytest.importorskip("nbformat", reason="the extra dev is not installed; CI has it")
pytest.importorskip("nbclient", reason="the extra dev is not installed; CI has it")
pytest.importorskip("ipykernel", reason="the extra dev is not installed; CI has it")

DOCS = Path(__file__).resolve().parents[2] / "docs"


@pytest.fixture(scope="module")
def script():
    spec = importlib.util.spec_from_file_location("make_tutorial", DOCS / "make_tutorial.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_notebook_holds_the_scripts_cells_and_what_they_gave(script):
    stored = nbformat.read(script.NOTEBOOK, as_version=4)
    assert [cell.source for cell in stored.cells] == [
        cell.source for cell in script.notebook().cells
    ]
    assert all(cell.outputs for cell in stored.cells[:-1] if cell.cell_type == "code")


@pytest.mark.slow
def test_every_cell_runs(script):
    made = script.run(script.notebook())
    outputs = [out for cell in made.cells if cell.cell_type == "code" for out in cell.outputs]
    shown = [kind for out in outputs for kind in out.get("data", {})]
    assert shown.count("image/png") == 2
    assert any("<video" in out.get("data", {}).get("text/html", "") for out in outputs)
