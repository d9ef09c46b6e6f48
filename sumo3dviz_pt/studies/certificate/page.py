"""Writes the page of the certificate for people: two sheets of A4, and each pair with its pictures.

The two sheets are what is printed: what was claimed, what was found, by which limits, and how
anybody can verify it. The pairs with their pictures follow on the screen only.
"""

from __future__ import annotations

import base64
import html
import math
import statistics
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from sumo3dviz_pt.files.atomic import write_atomically
from sumo3dviz_pt.studies.certificate.comparison import PairVerdict, ThingDifference
from sumo3dviz_pt.studies.certificate.evidence import MOST_BEYOND

_MOST_THINGS = 12
"""Most objects that a pair's table lists; `certificate.json` has all."""

_MOST_FACTORS, _MOST_FILMS, _MOST_FAULTS, _MOST_WORDS = 14, 16, 6, 140
"""Most factors, films, faults, and letters of a text that the printed sheets show."""

_MOST_MOVING, _MOST_SENTENCE = 3, 400
"""Most factors that may change all traffic of which the first sheet tells, and their letters."""

_STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; color: #1a1a1a; background: #fff; margin: 2rem auto;
  max-width: 1200px; padding: 0 1rem }
h1 { font-size: 1.7rem; margin-bottom: .2rem } h2 { font-size: 1.2rem; margin: 1.6rem 0 .3rem }
table { border-collapse: collapse; margin: .6rem 0; font-size: .93rem; width: 100% }
caption { text-align: left; color: #444; padding-bottom: .3rem }
th, td { text-align: left; padding: .25rem .8rem .25rem 0; border-bottom: 1px solid #ddd;
  vertical-align: top }
td.n, th.n { text-align: right; font-variant-numeric: tabular-nums }
code { font-size: .85em; overflow-wrap: anywhere }
figure { margin: .6rem 0 } figure img { width: 100%; image-rendering: auto; display: block }
figcaption { color: #444; font-size: .9rem; margin-top: .3rem }
.proven { color: #0a5c2b; font-weight: 600 } .failed { color: #a30000; font-weight: 700 }
.not { color: #6b4a00; font-weight: 600 }
.faults { border-left: 4px solid #a30000; padding-left: 1rem; list-style: none; margin: .6rem 0 }
.scroll { overflow-x: auto } .pairs section { border-top: 2px solid #ddd; margin-top: 2rem }
@page { size: A4; margin: 13mm }
@media print { body { font-size: 9pt; line-height: 1.3; margin: 0; padding: 0; max-width: none }
  h1 { font-size: 15pt } h2 { font-size: 11pt; margin: 8pt 0 2pt }
  table { font-size: 8pt; margin: 3pt 0 } th, td { padding: 1.5pt 6pt 1.5pt 0 } p { margin: 4pt 0 }
  .pairs { display: none } .sheet + .sheet { break-before: page } }
"""

Content = Mapping[str, Any]

_NUMBER = ' class="n"'
"""Of cells that hold numbers."""


def write_page(path: Path, content: Content, verdicts: Sequence[PairVerdict]) -> Path:
    """Write `certificate.html`; pictures are within it, so that it can be sent as it is.

    Args:
        path: In the study's folder, below which the pictures of verdicts lie.
        content: Of `certificate.json`.
        verdicts: On all pairs.
    """
    write_atomically(path, page_text(path.parent, content, verdicts))
    return path


def page_text(folder: Path, content: Content, verdicts: Sequence[PairVerdict]) -> str:
    """Return what `certificate.html` holds; it is the same whoever writes it."""
    lines = [
        "<!doctype html>",
        f'<html lang="en"><head><meta charset="utf-8"><title>{_text(content["title"])}:'
        " certificate of the stimuli</title>",
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        f"<style>{_STYLE}</style></head><body><main>",
        *('<section class="sheet">', *_claims(content), "</section>"),
        *('<section class="sheet">', *_proof(content), "</section>"),
        '<section class="pairs"><h2>Pairs</h2>',
    ]
    claims = [pair["claim"] for pair in content["pairs"]]
    lines += _table(verdicts, claims)
    for number, (verdict, claim) in enumerate(zip(verdicts, claims, strict=True), start=1):
        lines += _section(folder, number, verdict, claim)
    return "\n".join([*lines, "</section></main></body></html>", ""])


# First sheet: what is claimed ---------------------------------------------------------------


def _claims(content: Content) -> Iterator[str]:
    """Yield what the study is, and what was found of its factors."""
    yield f"<h1>{_text(content['title'])}</h1>"
    about = [", ".join(content["authors"]), content["date"], content["licence"]]
    made = f"sumo3dviz_pt {content['versions']['sumo3dviz_pt']}"
    line = " &middot; ".join(_text(each) for each in [*about, f"films by {made}"] if each)
    yield f"<p>Certificate of the stimuli. {line}</p>"
    yield f"<p>{_text(content['description'])}</p>"
    yield _headline(content)
    yield from _moving(content["pairs"])
    yield "<p><b>Proven</b>: all that the claim names was tested, and nothing is wrong."
    yield "<b>Not judged</b>: looked at, and no rule tells what was seen from what is allowed."
    yield "<b>Not tested</b>: nothing was compared. Nothing is claimed beyond what is proven.</p>"
    yield from _factors(content)
    yield from _links(content["links"])


def _headline(content: Content) -> str:
    """Return what was found, in a sentence."""
    tally = Counter(each["claim"] for each in content["pairs"])
    broken = [link for link, outcome in content["links"].items() if outcome["claim"] == "failed"]
    count = sum(tally.values())
    if broken:
        failed = f"; {tally['failed']} of {count} pairs fail" if tally["failed"] else ""
        return f'<p class="failed">Not proven: {" and ".join(broken)} failed{failed}.</p>'
    if not count:
        return '<p class="not">Not judged: there are no pairs of films to compare.</p>'
    rest = f"; {tally['not judged']} not judged" if tally["not judged"] else ""
    moving = sum(bool(each["moving"]) for each in content["pairs"])
    rest += f"; in {moving} of them everything that moves may differ" if moving else ""
    sentence = f"{tally['proven']} of {count} pairs differ in their factor alone{rest}"
    return f'<p class="{"not" if rest else "proven"}">Proven: {sentence}.</p>'


def _moving(pairs: Sequence[Content]) -> Iterator[str]:
    """Yield of which factors nobody should think that they leave the rest of traffic alone."""
    own: dict[str, list[Content]] = {}
    for pair in pairs:
        if pair["moving"]:
            own.setdefault(str(pair["factor"]), []).append(pair)
    for factor, some in list(own.items())[:_MOST_MOVING]:
        first, more = some[0], len(some) - 1
        films = f"{first['one']} and {first['other']}{f', and {more} more' if more else ''}"
        sentence = f"{factor} ({films}): {first['moving']}"
        yield f'<p class="not">{_text(sentence, _MOST_SENTENCE)}.</p>'


def _factors(content: Content) -> Iterator[str]:
    """Yield a table of what varies, and what its pairs say of it."""
    yield "<h2>What varies, and what was found</h2><table><thead><tr>"
    for title, numeric in (
        *(("factor", 0), ("in words", 0), ("levels", 0), ("acts on", 0)),
        *(("proven", 1), ("failed", 1), ("not judged", 1), ("not tested", 0), ("worst pair", 0)),
    ):
        yield f'<th scope="col"{_NUMBER if numeric else ""}>{title}</th>'
    yield "</tr></thead><tbody>"
    # Few factors are told at length, many in short: they share a sheet.
    most = _MOST_WORDS if len(content["factors"]) <= _MOST_FACTORS // 2 else _MOST_WORDS // 2
    for name, factor in list(content["factors"].items())[:_MOST_FACTORS]:
        pairs = [each for each in content["pairs"] if name in str(each["factor"]).split(" and ")]
        tally = Counter(each["claim"] for each in pairs)
        untested = dict.fromkeys(what for each in pairs for what in each["not_tested"])
        about = (name, factor["about"] or "-", ", ".join(factor["levels"]))
        acts = "; ".join(dict.fromkeys(str(each["acts"]) for each in pairs))
        cells = [f"<td>{_text(each, most)}</td>" for each in (*about, acts or "-")]
        cells += [f"<td{_NUMBER}>{tally[word]}</td>" for word in ("proven", "failed", "not judged")]
        lacking = "-" if pairs else "all of it: no pair of films shows it"
        cells += [f"<td>{_text('; '.join(untested) or lacking, most)}</td>"]
        yield f"<tr>{''.join(cells)}<td>{_text(_worst_pair(pairs), most)}</td></tr>"
    more = len(content["factors"]) - _MOST_FACTORS
    yield f"</tbody></table>{f'<p>And {more} more, in certificate.json.</p>' if more > 0 else ''}"


def _worst_pair(pairs: Sequence[Content]) -> str:
    """Return what is most wrong with pairs of a factor."""
    failed = next((each for each in pairs if each["claim"] != "proven"), None)
    if failed is None:
        return "nothing is wrong" if pairs else "-"
    why = [*failed["faults"], *failed["not_judged"]]
    return f"{failed['one']} and {failed['other']}: {why[0] if why else failed['claim']}"


def _links(links: Content) -> Iterator[str]:
    """Yield a table of the links of the proof."""
    yield "<h2>The proof, link by link</h2><table><thead><tr>"
    for title in ("link", "claims that", "is"):
        yield f'<th scope="col">{title}</th>'
    yield "</tr></thead><tbody>"
    for link, outcome in links.items():
        claim = _word(outcome["claim"])
        yield f"<tr><td>{link}</td><td>{_text(outcome['what'])}</td><td>{claim}</td></tr>"
    yield "</tbody></table>"
    faults = [fault for each in links.values() for fault in each["faults"]]
    if faults:
        more = len(faults) - _MOST_FAULTS
        items = [f"<li>{_text(fault)}</li>" for fault in faults[:_MOST_FAULTS]]
        items += [f"<li>and {more} more, in certificate.json</li>"] if more > 0 else []
        yield f'<ul class="faults">{"".join(items)}</ul>'


# Second sheet: numbers, digests, how to verify ---------------------------------------------

_NUMBERS = (
    (
        *("wrong", "pixels of another shape or colour where the factor does not act", "{:.2%}"),
        0.0,
        "layers hold no noise: where two scenes are the same, so is every pixel",
    ),
    (
        *("light", "light of a typical pixel there", "{:.2%}"),
        "light",
        "shadows and reflections do not move a median; a tenth of an EV moves it by 5 %",
    ),
    (
        *("beyond", "blocks of the picture lit otherwise, out of the factor's reach", "{:.2%}"),
        "beyond",
        "what a factor throws, as shadows, reaches 5 to 25 m, by what it acts on",
    ),
    (
        *("codes", "brightness of a typical pixel there, in 255 codes", "{:.1f}"),
        "codes",
        "a step or two of the film's own picture",
    ),
)
"""Numbers of pairs: key, words, form, limit, why that limit."""

_CODEC = {
    "shade": "whole picture lighter, darker or of another colour than its frame, in 255 codes",
    "block": "the same of one of 144 blocks, the worst of each picture",
    "pixel": "root mean square of single pixels",
    "colour": "the same of their colour",
    "tone": "contrast, saturation or hue of the whole picture",
}
"""Numbers of films, in words."""

_WHY_CODEC = (
    "more than any codec here does; when it is verified, each picture may be 1.5 times as far as it"
    " was when the film was made, and .1 (whole picture, tone) or .5 more"
)


def _proof(content: Content) -> Iterator[str]:
    """Yield numbers with their limits, digests, and how to verify them."""
    yield "<h2>Numbers, their limits, and why these</h2><table><thead><tr>"
    for title, numeric in (("number", 0), ("median", 1), ("worst", 1), ("limit", 1), ("why", 0)):
        yield f'<th scope="col"{_NUMBER if numeric else ""}>{title}</th>'
    yield "</tr></thead><tbody>"
    for key, words, form, limit, why in _NUMBERS:
        values = [each[key] for each in _compared(content) if each[key] is not None]
        most = content["limits"][limit] if isinstance(limit, str) else limit
        yield _number(words, _both(form, values), form.format(most), why)
    for key, words in _CODEC.items() if content["codec"]["pictures"] else ():
        error = content["codec"][key]
        both = (f"{error['median']:.2f}", f"{error['most']:.2f}")
        yield _number(f"film: {words}", both, f"{content['limits']['codec'][key]:g}", _WHY_CODEC)
    yield "</tbody></table>"
    yield f"<p>Decoded and measured: {content['codec']['pictures']} pictures, which are all.</p>"
    yield from _digests(content)
    yield from _how(content)


def _compared(content: Content) -> Iterator[Content]:
    """Yield the pairs of which pixels were compared."""
    for pair in content["pairs"]:
        if pair["frames"]:
            yield {**pair, "beyond": pair["lit"][1]}


def _both(form: str, values: Sequence[float]) -> tuple[str, str]:
    """Return the median and the largest of some numbers."""
    if not values:
        return "not tested", "not tested"
    return form.format(statistics.median(values)), form.format(max(values))


def _number(words: str, both: tuple[str, str], limit: str, why: str) -> str:
    """Return a row of the table of numbers."""
    cells = "".join(f'<td class="n">{value}</td>' for value in (*both, limit))
    return f"<tr><td>{words}</td>{cells}<td>{why}</td></tr>"


def _digests(content: Content) -> Iterator[str]:
    """Yield what stands for the certificate and the films."""
    films = content["digests"]["films"]
    yield "<h2>Digests (SHA-256)</h2><table><tbody>"
    yield f"<tr><td>this certificate</td><td><code>{content['digest']}</code></td></tr>"
    for file, digest in list(films.items())[:_MOST_FILMS]:
        yield f"<tr><td>{_text(file)}</td><td><code>{digest}</code></td></tr>"
    more = len(films) - _MOST_FILMS
    also = f", for {more} more films" if more > 0 else ""
    yield (
        f"</tbody></table><p>The certificate's digest stands for all of them{also}, and for every"
        " account, frame and input file: publish it, with the preregistration or in the paper, and"
        " nothing can be changed unseen. Whoever can change the folder can also write new digests;"
        " only a published one shows that.</p>"
    )


def _how(content: Content) -> Iterator[str]:
    """Yield how anybody can verify a study."""
    digest = content["digest"]
    yield "<h2>How to verify it</h2><p>On any machine, without rendering:</p>"
    yield f"<p><code>sumo3dviz-pt study verify FOLDER --published {digest}</code></p>"
    yield "<p>With three frames that are drawn by lot, rendered anew and compared bit by bit:</p>"
    yield "<p><code>sumo3dviz-pt study verify FOLDER --replay 3</code></p>"
    parts = ("sumo3dviz_pt", "mitsuba", "drjit", "mitsuba-oidn", "numpy")
    named = [f"{name} {content['versions'][name]}" for name in parts if name in content["versions"]]
    yield f"<p>Made with {_text(', '.join(named))}. It ends with exit code 0 if nothing is wrong,"
    yield "and else names link, file and frame. What each link proves, and what it cannot: the"
    yield "manual's page <i>The certificate</i>.</p>"


def _word(claim: str) -> str:
    """Return a claim, in a word that is not told by colour alone."""
    kind = claim if claim in ("proven", "failed") else "not"
    return f'<span class="{kind}">{claim}</span>'


def _text(value: object, most: int = _MOST_WORDS) -> str:
    """Return a text as HTML, cut where it has more letters than the sheets have room for."""
    text = str(value)
    return html.escape(text if len(text) <= most else f"{text[: most - 3]}...")


# Pairs, on the screen ----------------------------------------------------------------------

_COLUMNS = (
    *(("pair", False), ("factor", False), ("films", False), ("verdict", False)),
    *(("differs", True), ("wrongly", True), ("light", True), ("codes", True)),
)


def _table(verdicts: Sequence[PairVerdict], claims: Sequence[str]) -> Iterator[str]:
    """Yield a table of all pairs."""
    yield '<div class="scroll"><table><caption>Differs: pixels that differ in any way. Wrongly: in'
    yield " shape or colour, where the factor does not act. Light, codes: by how much a typical"
    yield " pixel differs there; - where the factor acts on all of them</caption><thead><tr>"
    for title, numeric in _COLUMNS:
        yield f'<th scope="col"{_NUMBER if numeric else ""}>{title}</th>'
    yield "</tr></thead><tbody>"
    for number, (verdict, claim) in enumerate(zip(verdicts, claims, strict=True), start=1):
        yield _row(number, verdict, claim)
    yield "</tbody></table></div>"


def _row(number: int, verdict: PairVerdict, claim: str) -> str:
    """Return a row of the table of all pairs."""
    levels = f"{verdict.factor}: {verdict.levels[0]} / {verdict.levels[1]}"
    cells = [
        f'<td><a href="#pair{number}">{number}</a></td>',
        f"<td>{html.escape(levels)}</td>",
        f"<td>{html.escape(verdict.one)}<br>{html.escape(verdict.other)}</td>",
        f"<td>{_word(claim)}</td>",
    ]
    values = _values(verdict)
    cells += [f'<td class="n">{value}</td>' for value in values]
    return f"<tr>{''.join(cells)}</tr>"


def _values(verdict: PairVerdict) -> tuple[str, str, str, str]:
    """Return a pair's numbers as the table shows them; a dash where no pixel was compared."""
    if not verdict.frames:
        return ("-",) * 4
    light = "-" if math.isnan(verdict.light) else f"{verdict.light:.2%}"
    codes = "-" if math.isnan(verdict.codes) else f"{verdict.codes:.1f}"
    return f"{verdict.differing:.1%}", f"{verdict.wrong:.2%}", light, codes


def _section(folder: Path, number: int, verdict: PairVerdict, claim: str) -> Iterator[str]:
    """Yield what there is to say of a pair."""
    one, other = (html.escape(level) for level in verdict.levels)
    yield f'<section id="pair{number}"><h2>{number}. {html.escape(verdict.factor)}: {one} and'
    yield f"{other}, {_word(claim)}</h2>"
    yield f"<p>The factor acts on: {html.escape(verdict.acts)}.</p>"
    if verdict.moving:
        yield f'<p class="not">{html.escape(_sentence(verdict.moving))}</p>'
    if verdict.faults:
        items = "".join(f"<li>{html.escape(_sentence(fault))}</li>" for fault in verdict.faults)
        yield f'<ul class="faults">{items}</ul>'
    for words, some in (
        ("Not judged", verdict.not_judged),
        ("Not tested", verdict.not_tested),
        ("Part of the levels, or worth knowing", verdict.named),
    ):
        items = "".join(f"<li>{html.escape(_sentence(each))}</li>" for each in some)
        yield f"<p>{words}:</p><ul>{items}</ul>" if items else ""
    if verdict.picture:
        yield from _figure(folder, verdict)
    yield from _things(verdict.things)
    yield "</section>"


def _figure(folder: Path, verdict: PairVerdict) -> Iterator[str]:
    """Yield the two pictures and their difference."""
    content = base64.b64encode((folder / verdict.picture).read_bytes()).decode()
    one, other = html.escape(verdict.one), html.escape(verdict.other)
    frames = ", ".join(map(str, verdict.frames))
    yield (
        f'<figure><img alt="Left: {one}. Middle: {other}. Right: where they differ, which is'
        f' {verdict.differing:.1%} of the pixels; {verdict.wrong:.2%} wrongly."'
        f' src="data:image/png;base64,{content}">'
    )
    blue = "in shape or colour" if math.isnan(verdict.light) else "in any way"
    yield (
        f"<figcaption>{one}, {other}, and where they differ: blue is what differs {blue}, amber"
        " blocks that are lit otherwise, red what differs in shape or colour and should not."
        f"{_lit(verdict)} Compared frames: {frames}; the one shown differs most.</figcaption>"
        "</figure>"
    )


def _lit(verdict: PairVerdict) -> str:
    """Return how much of the pictures is lit otherwise; nothing where all light may be."""
    lit, beyond, most = verdict.lit
    if math.isnan(lit):
        return ""
    return (
        f" Lit otherwise where the factor does not act: {lit:.1%} of the blocks, of {most:.1%} that"
        f" may be for what it throws; out of its reach {beyond:.1%}, of {MOST_BEYOND:.1%}."
    )


def _things(things: Sequence[ThingDifference]) -> Iterator[str]:
    """Yield a table of what differs, object by object."""
    if not things:
        return
    yield '<div class="scroll"><table><caption>What differs, in pixels of the compared frames'
    yield "</caption><thead><tr>"
    yield '<th scope="col">thing</th><th scope="col">may differ in</th>'
    for title in ("seen in", "shape", "colour", "light", "codes"):
        yield f'<th scope="col" class="n">{title}</th>'
    yield "</tr></thead><tbody>"
    for thing in things[:_MOST_THINGS]:
        numbers = (thing.pixels, thing.shape, thing.paint, thing.light)
        cells = "".join(f'<td class="n">{value}</td>' for value in numbers)
        yield (
            f"<tr><td>{html.escape(thing.name)}</td><td>{thing.acts or '-'}</td>{cells}"
            f'<td class="n">{thing.codes:.1f}</td></tr>'
        )
    yield "</tbody></table></div>"
    if len(things) > _MOST_THINGS:
        yield f"<p>And {len(things) - _MOST_THINGS} more, in certificate.json.</p>"


def _sentence(text: str) -> str:
    """Return words as a sentence."""
    return f"{text[:1].upper()}{text[1:]}."
