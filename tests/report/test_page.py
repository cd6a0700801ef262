"""The page stands alone, shows every kind of result, and trusts no name."""

from __future__ import annotations

import base64
import re
from html.parser import HTMLParser

import pytest

from fibrefit.report.any import REPORTS
from fibrefit.report.page import Result, page
from fibrefit.study.summaries.files import SUMMARIES
from tests.study.test_summaries import EXAMPLES, FIT

PNG = base64.b64decode(
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg=="
)
EMPTY = {"meta", "img", "br", "link", "input", "hr"}


class Reader(HTMLParser):
    """Sees whether every element is closed in its order, and collects what would be fetched."""

    def __init__(self) -> None:
        super().__init__()
        self.opened: list[str] = []
        self.fetched: list[str] = []
        self.text = ""

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag not in EMPTY:
            self.opened.append(tag)
        self.fetched += [value or "" for name, value in attrs if name in ("src", "href")]
        assert tag not in ("script", "link", "iframe")

    def handle_endtag(self, tag: str) -> None:
        assert self.opened.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text += data


def read(text: str) -> Reader:
    reader = Reader()
    reader.feed(text)
    assert not reader.opened
    return reader


def result(schema: str, folder: str = "results/a") -> Result:
    return Result(folder, EXAMPLES[schema], [("record drop", PNG)])


@pytest.mark.parametrize("schema", EXAMPLES)
def test_every_kind_of_result_is_shown_and_nothing_is_fetched(schema: str) -> None:
    reader = read(page([result(schema)], "one"))
    assert all(link.startswith(("data:image/png;base64,", "#")) for link in reader.fetched)
    assert len(reader.fetched) == 1
    assert "In words" in reader.text


def test_several_results_stand_side_by_side() -> None:
    reader = read(page([result("fibrefit/fit/1"), result("fibrefit/posterior/1", "results/b")], "two"))
    assert "Side by side" in reader.text
    assert re.search(r"stiffness\s*34\.21 ± 0\.19 kN/m\s*1\.00 ± 0\.10 N/m", reader.text)
    assert [link for link in reader.fetched if link.startswith("#")] == ["#result-1", "#result-2"]


def test_results_without_common_parameters_do_not() -> None:
    reader = read(page([result("fibrefit/fit/1"), result("fibrefit/batch/1")], "two"))
    assert "Side by side" not in reader.text


def test_names_are_text_and_nothing_else() -> None:
    wicked = "<script>alert('x')</script>&amp;"
    fit = FIT.model_copy(update={"study": wicked})
    text = page([Result(wicked, fit, [('"><script>', PNG)])], wicked)
    assert "<script" not in text
    assert "alert('x')" in read(text).text


def test_where_it_comes_from_is_told() -> None:
    reader = read(page([result("fibrefit/fit/1")], "one"))
    assert "a.csv" in reader.text
    assert "0" * 64 in reader.text


def test_there_is_a_report_of_every_kind() -> None:
    assert set(REPORTS) == set(SUMMARIES.values())
