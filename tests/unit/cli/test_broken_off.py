"""Commands that are broken off from outside: Ctrl-C while modules load, readers that go."""

import os
import subprocess
import sys

import pytest
from builders import complaints, write_scenario

from sumo3dviz_pt.cli.options import PROGRAM

CLI = [sys.executable, "-m", "sumo3dviz_pt.cli"]

INTERRUPTED = """
import sys, sumo3dviz_pt.cli

class Finder:
    def find_spec(self, name, path=None, target=None):
        if name == {name!r}:
            raise KeyboardInterrupt

sys.meta_path.insert(0, Finder())
sys.exit(sumo3dviz_pt.cli.main({arguments!r}))
"""


@pytest.mark.parametrize(
    ("name", "arguments"),
    [
        ("sumo3dviz_pt.cli.program", ["--version"]),
        ("sumo3dviz_pt.cli.check", ["--version"]),
        ("sumo3dviz_pt.installation.doctor", ["doctor"]),
    ],
)
def test_ctrl_c_while_modules_are_imported(name, arguments):
    code = INTERRUPTED.format(name=name, arguments=arguments)
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 130
    assert done.stderr == f"{PROGRAM}: interrupted\n"


@pytest.mark.parametrize(
    "arguments",
    [
        ["assets", "list"],
        ["--help"],
        pytest.param(["check", "{scene}"], marks=pytest.mark.slow),
    ],
)
def test_a_reader_that_has_gone(arguments, tmp_path):
    """`check SCENE | head -1` ended with a traceback."""
    scene = str(write_scenario(tmp_path, vehicles=1))
    reading, writing = os.pipe()
    os.close(reading)
    done = subprocess.run(
        [*CLI, *(word.replace("{scene}", scene) for word in arguments)],
        stdout=writing,
        stderr=subprocess.PIPE,
        text=True,
        check=False,
    )
    os.close(writing)
    # argparse says its help without asking whether somebody listens.
    assert done.returncode == 141 or (arguments == ["--help"] and done.returncode == 0)
    assert not complaints(done.stderr)
