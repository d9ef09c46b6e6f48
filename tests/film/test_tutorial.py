"""The tutorial notebook holds what its script says, and every cell of it runs."""

import importlib

import pytest
from needed import package

nbformat = package("nbformat", "the extra dev is not installed")
package("nbclient", "the extra dev is not installed")
package("ipykernel", "the extra dev is not installed")


@pytest.fixture(scope="module")
def script():
    return importlib.import_module("make_tutorial")


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
