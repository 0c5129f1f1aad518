"""The page of HTML: it needs nothing else, says in words what it shows, and no id stands twice."""

import re
from html.parser import HTMLParser

from fervor.cli.picture import page
from fervor.cli.picture.palette import DARK, LIGHT, THEMED
from pictures import MODEL, estimate, trace

STREAM = [estimate(n, 0.2 if n < 90 else 0.8, emotion="joy" if n < 120 else "pride") for n in range(180)]


class Elements(HTMLParser):
    """All elements of a page, and whether each is closed."""

    VOID = frozenset({"meta", "path", "use", "rect", "image", "line"})

    def __init__(self, text: str) -> None:
        super().__init__()
        self.found: list[tuple[str, dict[str, str | None]]] = []
        self.open: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.found.append((tag, dict(attrs)))
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.found.append((tag, dict(attrs)))

    def handle_endtag(self, tag):
        if tag not in self.VOID:
            assert self.open.pop() == tag


def written(*names: str) -> str:
    return page.page(MODEL, [page.section(trace(STREAM, name=name), at) for at, name in enumerate(names, start=1)])


def test_it_needs_nothing_else_and_runs_nothing():
    for tag, given in Elements(written("a.bvh")).found:
        assert tag not in ("script", "link", "img", "iframe")
        for name in ("src", "href", "xlink:href"):
            assert (given.get(name) or "#").startswith("#")


def test_no_id_stands_twice_and_every_reference_leads_somewhere():
    text = written("a.bvh", "b.bvh")
    ids = re.findall(r' id="([^"]+)"', text)
    assert len(ids) == len(set(ids))
    referred = re.findall(r'href="#([^"]+)"|url\(#([^)]+)\)|(?:labelledby|describedby)="([^"]+)"', text)
    assert referred
    assert {name for found in referred for name in found if name} <= set(ids)


def test_pictures_say_in_words_what_they_show():
    elements = Elements(written("a.bvh"))
    assert elements.open == []
    (svg,) = (given for tag, given in elements.found if tag == "svg")
    assert svg["role"] == "img"
    said = page.in_words(trace(STREAM))
    assert "weak from 0.0 to 3.0 s, strong from 3.0 to 6.0 s" in said
    assert "strong from 0.50 on" in said  # pride's threshold: the label at the end


def test_gaps_and_statuses_are_said_too():
    said = page.in_words(trace([estimate(n) for n in range(60) if not 20 <= n < 50]))
    assert "Gap 1.0 s at 0.6 s" in said
    odd = [estimate(n, None, status="insufficient", level=None) for n in range(9)]
    assert "Insufficient at 0.0 s" in page.in_words(trace(odd))
    assert "no pose was seen" in page.in_words(trace(odd))


def test_a_name_is_text_and_no_markup():
    text = written("<b onload=x>&.bvh")
    assert "<b onload" not in text
    assert "&lt;b onload=x&gt;&amp;.bvh" in text


def test_colours_of_paper_follow_the_readers_theme():
    text = written("a.bvh")
    drawn = text[text.index("<svg") : text.index("</svg>")]
    for name in THEMED:
        assert getattr(LIGHT, name) not in drawn
        assert f"--{name}: {getattr(DARK, name)};" in text
    assert "var(--ink)" in drawn
    assert LIGHT.strong in drawn


def test_a_demo_model_is_named_as_one():
    assert "not science" in written("a.bvh")
    research = MODEL.model_copy(update={"purpose": "research"})
    assert "not science" not in page.page(research, [])


def test_runs_and_numbers_are_those_of_the_estimates():
    text = written("a.bvh")
    rows = [re.findall(r"<td[^>]*>([^<]*)</td>", row) for row in re.findall(r"<tr>.*?</tr>", text)]
    assert ["0.00", "3.00", "joy", "weak", "0.20", "0.20"] in rows
    assert ["3.00", "4.00", "joy", "strong", "0.80", "0.80"] in rows
    assert ["4.00", "5.97", "pride", "strong", "0.80", "0.80"] in rows
    numbers = [row for row in rows if len(row) == 5]
    assert [float(row[0]) for row in numbers] == [round(0.1 * n, 2) for n in range(60)]
    assert {row[1] for row in numbers} == {"0.200", "0.800"}


def test_a_label_that_flickers_has_few_rows_too():
    wild = [estimate(n, emotion="joy" if n % 2 else "pride") for n in range(2 * page.MOST_ROWS + 7)]
    text = page.section(trace(wild), 1)
    assert f"<p>{page.MOST_ROWS + 7} more are not listed.</p>" in text


def test_a_long_recording_has_few_rows():
    hours = [estimate(n, t=n * 0.2) for n in range(40_000)]
    text = page.section(trace(hours), 1)
    assert text.count("<tr>") < page.MOST_ROWS + 10
    assert "a row every 300 s" in text
