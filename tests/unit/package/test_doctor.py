"""What the doctor finds on a machine that renders."""

from __future__ import annotations

import pytest

from sumo3dviz_pt.cli import main
from sumo3dviz_pt.doctor import examine
from sumo3dviz_pt.render.backend import VARIANTS, llvm_advice


def test_names_versions_variant_and_ffmpeg() -> None:
    healthy, lines = examine()
    assert healthy
    about = dict(line.split(maxsplit=1) for line in lines)
    assert {"Python", "mitsuba", "drjit", "numpy", "renderer", "libLLVM", "ffmpeg"} <= set(about)
    assert about["renderer"] in VARIANTS.values()


def test_command_ends_well_and_prints_it(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["doctor"]) == 0
    assert "renderer" in capsys.readouterr().out


def test_advice_is_one_command() -> None:
    assert llvm_advice().startswith("install it with: ")
    assert "\n" not in llvm_advice()
