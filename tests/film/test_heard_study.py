"""A study whose films are heard is made, verified, and shown aloud."""

from __future__ import annotations

import json

import pytest
from builders import write_scenario

from sumo3dviz_pt.cli import main

pytestmark = pytest.mark.slow

STUDY = """scene: scene.yaml
clip: {camera: post, from: 2, to: 2.4}
common: {quality: draft, output.size: [32, 18], output.fps: 10, output.sound: {play: stereo}}
factors:
  light:
    about: the sky
    levels:
      clear: {sky: {preset: sky_blue}}
      grey: {sky: {preset: sky_overcast}}
report: {write: false}
tools: {url: "https://example.org/s"}
"""


def test_films_of_a_study_sound_alike_where_only_light_differs(tmp_path, capsys):
    write_scenario(tmp_path, vehicles=2)
    (tmp_path / "study.yaml").write_text(STUDY, encoding="utf-8")
    out = tmp_path / "out"
    assert main(["study", str(tmp_path / "study.yaml"), "-o", str(out)]) == 0
    waves = [path.read_bytes() for path in sorted((out / "materials").glob("*.wav"))]
    assert len(waves) == 2 and waves[0] == waves[1]
    assert '"heard": true' in (out / "survey.js").read_text("utf-8")
    accounts = [json.loads(each.read_bytes()) for each in sorted(out.glob("materials/*.json"))]
    assert len([each for each in accounts if "sound" in each]) == 2
    assert main(["study", "verify", str(out)]) == 0, capsys.readouterr()
