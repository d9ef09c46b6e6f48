"""A test that lacks something is skipped; in CI, which has everything, it fails."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

TESTS = Path(__file__).parents[1]

ASKING = """import sys; sys.path.append({tests!r})
from needed import package, skip_if
package("json")
{line}
def test_nothing(): pass
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    "line", ["package('no_package_of_this_name')", "pytestmark = skip_if(True, 'it is not here')"]
)
def test_what_is_missing_fails_only_where_everything_has_to_be_there(tmp_path, line):
    (tmp_path / "test_it.py").write_text(ASKING.format(tests=str(TESTS), line=line))
    said = []
    for complete in ("", "1"):
        env = {**os.environ, "SUMO3DVIZ_PT_TESTS_COMPLETE": complete}
        words = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "test_it.py"]
        done = subprocess.run(
            words, cwd=tmp_path, env=env, capture_output=True, text=True, check=False
        )
        said.append(done.stdout)
    assert "1 skipped" in said[0]
    assert (
        "CI needs it: no_package_of_this_name is not installed" in said[1] or "1 passed" in said[1]
    )
    assert "skipped" not in said[1]
