"""Writes the page of the certificate: a table of all pairs, and each with its pictures."""

from __future__ import annotations

import base64
import html
import math
from collections.abc import Iterator, Sequence
from pathlib import Path

from sumo3dviz_pt.files.whole import write_whole
from sumo3dviz_pt.pipeline.certificate.comparison import ThingDifference
from sumo3dviz_pt.pipeline.certificate.verdicts import TYPICAL_CODES, TYPICAL_LIGHT, PairVerdict

_MOST_THINGS = 12
"""Most objects that a pair's table lists; `certificate.json` has all."""

_STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; color: #1a1a1a; background: #fff; margin: 2rem auto;
  max-width: 1200px; padding: 0 1rem }
h1 { font-size: 1.7rem } h2 { font-size: 1.2rem; margin: 2.5rem 0 .3rem }
table { border-collapse: collapse; margin: .8rem 0; font-size: .93rem }
caption { text-align: left; color: #444; padding-bottom: .3rem }
th, td { text-align: left; padding: .25rem .8rem .25rem 0; border-bottom: 1px solid #ddd;
  vertical-align: top }
td.n, th.n { text-align: right; font-variant-numeric: tabular-nums }
figure { margin: .6rem 0 } figure img { width: 100%; image-rendering: auto; display: block }
figcaption { color: #444; font-size: .9rem; margin-top: .3rem }
.passed { color: #0a5c2b; font-weight: 600 } .failed { color: #a30000; font-weight: 700 }
.faults { border-left: 4px solid #a30000; padding-left: 1rem; list-style: none; margin: .6rem 0 }
.scroll { overflow-x: auto }
"""


def write_page(path: Path, verdicts: Sequence[PairVerdict]) -> Path:
    """Write `certificate.html`; pictures are within it, so that it can be sent as it is.

    Args:
        path: In the study's folder, below which the pictures of verdicts lie.
        verdicts: On all pairs.
    """
    lines = [
        "<!doctype html>",
        '<html lang="en"><head><meta charset="utf-8"><title>Certificate of the stimuli</title>',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        f"<style>{_STYLE}</style></head><body><main><h1>Certificate of the stimuli</h1>",
        *_summary(verdicts),
    ]
    for number, verdict in enumerate(verdicts, start=1):
        lines += _section(path.parent, number, verdict)
    write_whole(path, "\n".join([*lines, "</main></body></html>", ""]))
    return path


def _summary(verdicts: Sequence[PairVerdict]) -> Iterator[str]:
    """Yield what was found on all pairs together."""
    failed = [each for each in verdicts if not each.passed]
    if not verdicts:
        yield "<p>No two films of this design differ in one factor alone: there are no pairs.</p>"
        return
    if failed:
        some = "One pair differs" if len(failed) == 1 else f"{len(failed)} pairs differ"
        yield f'<p class="failed">{some} where nothing should, of {len(verdicts)}.</p>'
    else:
        yield f'<p class="passed">All {len(verdicts)} pairs differ in their factor alone.</p>'
    yield (
        "<p>Two films of a pair differ by design in one factor. Frames, times, camera, road users,"
        " signals, exposure and tone curve were compared in all frames, as the films' accounts tell"
        " them; what pixels show was compared in some frames: which thing, how far away, facing"
        " where and of which colour must be exactly the same where the factor does not act. Light"
        " spreads, as shadows and reflections do; it may differ anywhere, but a typical pixel where"
        f" the factor does not act must not, by more than {TYPICAL_LIGHT:.0%} or"
        f" {TYPICAL_CODES:g} of 255 codes of the film's picture.</p>"
    )
    yield '<div class="scroll"><table><caption>Differs: pixels that differ in any way. Wrongly: in'
    yield " shape or colour, where the factor does not act. Light, codes: by how much a typical"
    yield " pixel differs there; - where the factor acts on all of them</caption><thead><tr>"
    for title, numeric in _COLUMNS:
        yield f'<th scope="col"{_NUMBER if numeric else ""}>{title}</th>'
    yield "</tr></thead><tbody>"
    for number, verdict in enumerate(verdicts, start=1):
        yield _row(number, verdict)
    yield "</tbody></table></div>"


_NUMBER = ' class="n"'
_COLUMNS = (
    *(("pair", False), ("factor", False), ("films", False), ("verdict", False)),
    *(("differs", True), ("wrongly", True), ("light", True), ("codes", True)),
)


def _row(number: int, verdict: PairVerdict) -> str:
    """Return a row of the table of all pairs."""
    levels = f"{verdict.factor}: {verdict.levels[0]} / {verdict.levels[1]}"
    cells = [
        f'<td><a href="#pair{number}">{number}</a></td>',
        f"<td>{html.escape(levels)}</td>",
        f"<td>{html.escape(verdict.one)}<br>{html.escape(verdict.other)}</td>",
        f"<td>{_verdict(verdict)}</td>",
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


def _verdict(verdict: PairVerdict) -> str:
    """Return whether a pair passed, in a word that is not told by colour alone."""
    return (
        '<span class="passed">passed</span>'
        if verdict.passed
        else '<span class="failed">failed</span>'
    )


def _section(folder: Path, number: int, verdict: PairVerdict) -> Iterator[str]:
    """Yield what there is to say of a pair."""
    one, other = (html.escape(level) for level in verdict.levels)
    yield f'<section id="pair{number}"><h2>{number}. {html.escape(verdict.factor)}: {one} and'
    yield f"{other}, {_verdict(verdict)}</h2>"
    yield f"<p>The factor acts on: {html.escape(verdict.acts)}.</p>"
    if verdict.faults:
        items = "".join(f"<li>{html.escape(_sentence(fault))}</li>" for fault in verdict.faults)
        yield f'<ul class="faults">{items}</ul>'
    if verdict.named:
        items = "".join(f"<li>{html.escape(_sentence(each))}</li>" for each in verdict.named)
        yield f"<p>Part of the levels, or worth knowing:</p><ul>{items}</ul>"
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
        f"<figcaption>{one}, {other}, and where they differ: blue is what differs {blue}, red what"
        f" differs in shape or colour and should not. Compared frames: {frames}; the one shown"
        " differs most.</figcaption></figure>"
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
