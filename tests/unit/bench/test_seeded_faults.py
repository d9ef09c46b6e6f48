"""Faults that are seeded to try the tests can still be seeded, and their tests are there."""

import pytest
from bench.seeded_faults import FAULTS, ROOT


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_finds_its_line_and_its_tests(name):
    fault = FAULTS[name]
    text = (ROOT / "sumo3dviz_pt" / fault.file).read_text(encoding="utf-8")
    assert text.count(fault.old) == 1
    for test in fault.tests:
        path, _, function = test.partition("::")
        assert (ROOT / path).exists()
        assert f"def {function}" in (ROOT / path).read_text("utf-8") if function else True
