"""A page of HTML that needs nothing else, with a section a recording: picture, runs of level and emotion, numbers.

Pictures are SVG inside the page, so that they turn dark where the reader's pages are; each says in words what it shows.
"""

import re
from collections.abc import Iterable, Iterator, Sequence
from html import escape

from fervor import __version__
from fervor.cli.meter import describe, is_demo, threshold
from fervor.cli.picture import figure
from fervor.cli.picture.palette import DARK, LIGHT, THEMED
from fervor.cli.picture.trace import Span, Trace, emotion_of, gaps, level_of, runs, spans, status_of
from fervor.emotions import UNKNOWN
from fervor.protocol.messages import Estimate, ModelInfo
from fervor.scoring.scored import Scored, summarise

MOST_ROWS = 120
"""Rows of a table of numbers."""

STEPS_S = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 30.0, 60.0, 300.0, 900.0, 3600.0)
"""Times between two rows that people count in, seconds."""


def _variables(palette: object) -> str:
    return " ".join(f"--{name}: {getattr(palette, name)};" for name in THEMED)


STYLE = f"""
:root {{ color-scheme: light dark; {_variables(LIGHT)} }}
@media (prefers-color-scheme: dark) {{ :root {{ {_variables(DARK)} }} }}
body {{ font: 15px/1.5 system-ui, sans-serif; color: var(--ink); background: var(--paper); max-width: 62rem;
  margin: 2rem auto; padding: 0 1.2rem; }}
h1 {{ font-size: 1.5rem; margin-bottom: .2rem; }} h2 {{ font-size: 1.15rem; margin: 2.6rem 0 .2rem; }}
h2 {{ overflow-wrap: anywhere; }}
p {{ margin: .3rem 0; }} .quiet {{ color: var(--quiet); }}
.caution {{ color: var(--caution); border-left: 4px solid; padding-left: .7rem; font-weight: 600; }}
figure {{ margin: .8rem 0; overflow-x: auto; }}
figure svg {{ display: block; width: 100%; min-width: 40rem; height: auto; }}
table {{ border-collapse: collapse; margin: .6rem 0; font-variant-numeric: tabular-nums; }}
th, td {{ padding: .15rem 1.1rem .15rem 0; text-align: left; }} th.n, td.n {{ text-align: right; }}
thead th {{ border-bottom: 1px solid var(--quiet); }} tbody tr {{ border-bottom: 1px solid var(--rule); }}
summary {{ cursor: pointer; }}
@media print {{ figure, tr {{ break-inside: avoid; }} }}
"""

CAPTION = (
    "Bodies: poses at even times, in the colour of their intensity, from the front; they always face the reader, for "
    "poses don't say where somebody stands or turns. Dotted limbs were not seen and keep their last pose. Dashed: from "
    "there on an intensity is strong; within the band around it the level stays what it is."
)


def section(trace: Trace, number: int) -> str:
    """One recording.

    Args:
        trace: with at least one estimate.
        number: of the section on its page, from 1.
    """
    rows = [_run_row(span, run) for span, run in runs(trace.curve, _level_and_emotion)]
    more = f"<p>{len(rows) - MOST_ROWS} more are not listed.</p>" if len(rows) > MOST_ROWS else ""
    step = _step(trace.end_s - trace.start_s)
    return "\n".join(
        (
            f'<section aria-labelledby="name-{number}">',
            f'<h2 id="name-{number}">{escape(trace.name)}</h2>',
            f'<p class="quiet">{escape(figure.facts(trace))}</p>',
            f'<figure tabindex="0">{_picture(trace, number)}</figure>',
            _table(("from, s", "to, s", "emotion", "level", "mean", "peak"), rows[:MOST_ROWS], words=(2, 3)),
            more,
            f"<details><summary>Numbers, a row every {step:g} s</summary>",
            _table(("time, s", "intensity", "level", "emotion", "status"), _rows(trace, step), words=(2, 3, 4)),
            "</details></section>",
        )
    )


def page(model: ModelInfo, sections: Sequence[str]) -> str:
    """The page of all recordings that one model scored."""
    told = "caution" if is_demo(model) else "quiet"
    parts = [
        "<h1>Emotional intensity</h1>",
        f'<p class="{told}">{escape(describe(model).capitalize())}.</p>',
        "<p>Intensity is the share of observers expected to recognise the emotion in the movement, 0 to 1.</p>",
        *sections,
        f'<p class="quiet">{CAPTION}</p>',
        f'<p class="quiet"><small>fervor {__version__}, model SHA-256 {model.sha256[:16]}…</small></p>',
    ]
    viewport = '<meta name="viewport" content="width=device-width, initial-scale=1">'
    head = f'<meta charset="utf-8">{viewport}<title>Emotional intensity</title><style>{STYLE}</style>'
    body = "\n".join(parts)
    return f'<!doctype html>\n<html lang="en"><head>{head}</head>\n<body>\n{body}\n</body></html>\n'


def in_words(trace: Trace) -> str:
    """What the picture shows, for those who don't see it."""
    summary = summarise(Scored.of(trace.name, trace.estimates))
    mark = threshold(trace.model, summary.emotion)
    whose = "of unknown emotion" if summary.emotion == UNKNOWN else f"of {summary.emotion}"
    levels = [f"{span.text} from {span.start:.1f} to {span.end:.1f} s" for span in spans(trace.curve, level_of)]
    odd = [span for span in spans(trace.curve, status_of) if span.text not in ("ok", "warming up")]
    sentences = [
        f"Intensity {whose} over {trace.end_s - trace.start_s:.1f} seconds: {figure.facts(trace)}",
        f"An intensity is strong from {mark:.2f} on",
        f"Level: {', '.join(levels[:MOST_ROWS])}" if levels else "No level: no pose was seen",
        *(f"{span.text.capitalize()} at {span.start:.1f} s" for span in [*gaps(trace.curve), *odd][:MOST_ROWS]),
    ]
    return ". ".join(sentences) + "."


def _picture(trace: Trace, number: int) -> str:
    """The SVG element, in the colours of the page, with a title and a description; its ids are this section's own."""
    drawn = figure.svg(trace)
    drawn = re.sub(r' (id="|xlink:href="#|href="#)', rf" \g<1>p{number}-", drawn[drawn.index("<svg") :])
    drawn = drawn.replace("url(#", f"url(#p{number}-")
    for name in THEMED:
        drawn = drawn.replace(getattr(LIGHT, name), f"var(--{name})")
    start, _, rest = drawn.partition(">")
    named = f'role="img" aria-labelledby="title-{number}" aria-describedby="words-{number}"'
    title = f'<title id="title-{number}">{escape(trace.name)}: intensity over time below its poses</title>'
    return f'{start} {named}>{title}<desc id="words-{number}">{escape(in_words(trace))}</desc>{rest}'


def _level_and_emotion(one: Estimate) -> str:
    return f"{level_of(one)} {emotion_of(one)}"


def _run_row(span: Span, run: Sequence[Estimate]) -> tuple[str, ...]:
    level, _, emotion = span.text.partition(" ")
    summary = summarise(Scored.of("", run))
    numbers = ("-" if value is None else f"{value:.2f}" for value in (summary.mean, summary.peak))
    return f"{span.start:.2f}", f"{span.end:.2f}", emotion, level or "-", *numbers


def _step(seconds: float) -> float:
    """The least time between rows with which they don't become too many, seconds."""
    return next((step for step in STEPS_S if seconds / step <= MOST_ROWS), seconds / MOST_ROWS)


def _rows(trace: Trace, step: float) -> Iterator[tuple[str, ...]]:
    due = trace.start_s
    for estimate in trace.curve:
        if estimate.t >= due - 1e-9:
            yield _numbers(estimate)
            due += step * (1 + int((estimate.t - due + 1e-9) / step))


def _numbers(one: Estimate) -> tuple[str, ...]:
    intensity = "-" if one.intensity is None else f"{one.intensity:.3f}"
    return f"{one.t:.2f}", intensity, level_of(one) or "-", emotion_of(one), status_of(one)


def _table(head: Sequence[str], rows: Iterable[Sequence[str]], *, words: tuple[int, ...]) -> str:
    """A table; all columns but `words` are numbers."""

    def cells(tag: str, texts: Sequence[str], scope: str = "") -> str:
        kinds = ["" if place in words else ' class="n"' for place in range(len(texts))]
        return "".join(f"<{tag}{scope}{kind}>{escape(text)}</{tag}>" for text, kind in zip(texts, kinds, strict=True))

    top = cells("th", head, ' scope="col"')
    body = "".join(f"<tr>{cells('td', row)}</tr>" for row in rows)
    return f"<table><thead><tr>{top}</tr></thead><tbody>{body}</tbody></table>"
