"""The demo suits what the machine can do."""

from __future__ import annotations

import pytest

from sumo3dviz_pt.cli import build_parser
from sumo3dviz_pt.cli.render import _COMPILED, _SCALAR, _extent


def test_with_compiled_kernels_it_is_as_the_manual_says(capsys: pytest.CaptureFixture[str]) -> None:
    extent = _extent(build_parser().parse_args(["demo"]), compiled=True)
    assert extent == _COMPILED and extent.seconds >= 2 and not capsys.readouterr().out


def test_without_it_is_smaller_and_shorter_and_says_so(capsys: pytest.CaptureFixture[str]) -> None:
    extent = _extent(build_parser().parse_args(["demo"]), compiled=False)
    assert extent == _SCALAR
    assert extent.size < _COMPILED.size and extent.seconds < _COMPILED.seconds
    said = capsys.readouterr().out
    assert said.startswith("without compiled kernels the demo is smaller and shorter: ")
    assert "{}x{}".format(*extent.size) in said and said.endswith("2 s at 640x360, preview\n")


@pytest.mark.parametrize("compiled", [True, False])
def test_what_is_asked_for_is_done(compiled: bool) -> None:
    options = build_parser().parse_args(["demo", "--size", "64x36", "--quality", "standard"])
    extent = _extent(options, compiled=compiled)
    assert (extent.size, extent.quality) == ((64, 36), "standard")
