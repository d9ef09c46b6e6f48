"""The certificate's page and words."""

import numpy as np

from sumo3dviz_pt.cli.study import say
from sumo3dviz_pt.image.png import write_png
from sumo3dviz_pt.pipeline.certificate.build import Certificate
from sumo3dviz_pt.pipeline.certificate.page import write_page
from sumo3dviz_pt.pipeline.certificate.verdicts import PairVerdict

CLEAN = PairVerdict("light", ("day", "<night>"), "a", "b", "sky, sun and lamps", ())
SPOILT = PairVerdict(
    "ahead", ("white", "red"), "a", "c", "the colour of x", ("another colour: vehicle:<b>",),
    frames=(0, 2), differing=0.25, wrong=0.01, light=0.001, codes=0.3, picture="certificate/p.png",
)  # fmt: skip


def test_faults_are_sentences_and_names_are_escaped(tmp_path):
    (tmp_path / "certificate").mkdir()
    write_png(tmp_path / "certificate" / "p.png", np.zeros((4, 12, 3), np.uint8))
    page = write_page(tmp_path / "certificate.html", [CLEAN, SPOILT]).read_text("utf-8")
    assert "One pair differs where nothing should, of 2." in page
    assert "<li>Another colour: vehicle:&lt;b&gt;.</li>" in page and "&lt;night&gt;" in page
    assert "<night>" not in page and page.count("data:image/png;base64,") == 1
    assert "25.0%" in page and "1.00%" in page


def test_words_of_the_command():
    both = Certificate((CLEAN, SPOILT), ())
    assert str(both) == "certificate: 1 of 2 pairs differ in their factor alone"
    assert not both.passed and both.failed == (SPOILT,)
    assert str(SPOILT) == "ahead white and red: a and c"
    nothing = Certificate((), ())
    assert nothing.passed and "no two films" in str(nothing)


def test_a_design_without_pairs_has_a_page_that_says_so(tmp_path):
    page = write_page(tmp_path / "certificate.html", []).read_text("utf-8")
    assert "there are no pairs" in page and "<table" not in page


def test_the_command_names_failed_pairs_and_ends_with_1(capsys):
    assert say(Certificate((CLEAN,), ())) == 0
    assert say(Certificate((CLEAN, SPOILT), ())) == 1
    said = capsys.readouterr().out
    assert "failed: ahead white and red: a and c: another colour: vehicle:<b>\n" in said
    assert "certificate: 1 of 2 pairs differ in their factor alone; see certificate.html" in said
