"""The certificate's page and words."""

from dataclasses import asdict

import numpy as np

from sumo3dviz_pt.cli.study import say
from sumo3dviz_pt.image.png import write_png
from sumo3dviz_pt.studies.certificate.certificate import Certificate
from sumo3dviz_pt.studies.certificate.comparison import PairVerdict
from sumo3dviz_pt.studies.certificate.links import CLAIMS, Fault
from sumo3dviz_pt.studies.certificate.page import write_page

CLEAN = PairVerdict("light", ("day", "<night>"), "a", "b", "sky, sun and lamps", ())
SPOILT = PairVerdict(
    "ahead", ("white", "red"), "a", "c", "the colour of x", ("another colour: vehicle:<b>",),
    frames=(0, 2), differing=0.25, wrong=0.01, light=0.001, codes=0.3, picture="certificate/p.png",
)  # fmt: skip


def page_of(folder, *verdicts, broken=()):
    """The page of some pairs."""
    faults = {link: ["it is wrong"] if link in broken else [] for link in CLAIMS}
    content = {
        "title": "Gaps & <lights>",
        "description": "What is <seen>.",
        "authors": ["Ada Example"],
        "date": "2026-11-27",
        "licence": "CC-BY-4.0",
        "versions": {"sumo3dviz_pt": "1.0", "mitsuba": "3.7"},
        "links": {
            link: {"claim": "failed" if wrong else "proven", "what": CLAIMS[link], "faults": wrong}
            for link, wrong in faults.items()
        },
        "factors": {
            "light": {"about": "time of day", "levels": ["day", "<night>"]},
            "ahead": {"about": "colour of the car ahead", "levels": ["white", "red"]},
            "price": {"about": "what it costs", "levels": ["low", "high"]},
        },
        "limits": {
            **{"light": 0.02, "codes": 2.0, "beyond": 0.01},
            "codec": {"shade": 1, "block": 5, "pixel": 12, "colour": 8, "tone": 1},
        },
        "codec": {
            "pictures": 12,
            **{
                key: {"median": 0.4, "most": 1.25}
                for key in ("shade", "block", "pixel", "colour", "tone")
            },
        },
        "digests": {"films": {"materials/a.mp4": "f" * 64}},
        "pairs": [{"claim": each.claim, **asdict(each)} for each in verdicts],
        "digest": "d" * 64,
    }  # fmt: skip
    return write_page(folder / "certificate.html", content, verdicts).read_text("utf-8")


def test_faults_are_sentences_and_names_are_escaped(tmp_path):
    (tmp_path / "certificate").mkdir()
    write_png(tmp_path / "certificate" / "p.png", np.zeros((4, 12, 3), np.uint8))
    page = page_of(tmp_path, CLEAN, SPOILT, broken=("pictures",))
    assert "Not proven: pictures failed; 1 of 2 pairs fail." in page
    assert "<li>Another colour: vehicle:&lt;b&gt;.</li>" in page and "&lt;night&gt;" in page
    assert "<night>" not in page and page.count("data:image/png;base64,") == 1
    assert "25.0%" in page and "1.00%" in page


def test_the_sheets_say_who_what_by_which_limits_and_how_to_verify_it(tmp_path):
    page = page_of(tmp_path, CLEAN)
    for said in (
        *("Gaps &amp; &lt;lights&gt;", "Ada Example", "2026-11-27", "sumo3dviz_pt 1.0"),
        *("Proven: 1 of 1 pairs differ in their factor alone.", "time of day", "what it costs"),
        *("all of it: no pair of films shows it", *CLAIMS.values()),
        *("<td class=\"n\">0.40</td><td class=\"n\">1.25</td>", "materials/a.mp4", "f" * 64),
        f"study verify FOLDER --published {'d' * 64}",
    ):  # fmt: skip
        assert said in page, said


LOG = PairVerdict(
    "gap", ("short", "long"), "a", "b", "the camera; what traffic and signals do", (),
    moving="its levels change the whole traffic log, <so> 5 road users move otherwise",
)  # fmt: skip


def test_a_factor_that_may_change_all_traffic_is_not_read_as_a_gap(tmp_path):
    page = page_of(tmp_path, LOG, LOG, CLEAN)
    head = page[: page.index("<h2>")]
    assert "gap (a and b, and 1 more): its levels change the whole traffic log, &lt;so" in head
    assert "alone; in 2 of them everything that moves may differ.</p>" in head
    assert page.count("traffic log") == 3 and "light (" not in page
    said = str(Certificate((LOG, CLEAN), ()))
    assert said.endswith("in their factor alone; in 1 of them everything that moves may differ")


def test_words_of_the_command():
    both = Certificate((CLEAN, SPOILT), ())
    assert str(both) == "certificate: 1 of 2 pairs differ in their factor alone"
    assert not both.passed and both.failed == (SPOILT,)
    assert str(SPOILT) == "ahead white and red: a and c"
    nothing = Certificate((), ())
    assert nothing.passed and "no two films" in str(nothing)


def test_a_design_without_pairs_has_a_page_that_says_so(tmp_path):
    page = page_of(tmp_path)
    assert "Not judged: there are no pairs" in page


def test_the_command_names_failed_pairs_and_ends_with_1(capsys):
    assert say(Certificate((CLEAN,), ())) == 0
    assert say(Certificate((CLEAN, SPOILT), ())) == 1
    assert say(Certificate((CLEAN,), (), (Fault("films", "a.mp4", "is gone", 3),))) == 1
    said = capsys.readouterr().out
    assert "failed: ahead white and red: a and c: another colour: vehicle:<b>\n" in said
    assert "certificate: 1 of 2 pairs differ in their factor alone; see certificate.html" in said
    assert "failed: films: a.mp4: frame 3: is gone\n" in said
