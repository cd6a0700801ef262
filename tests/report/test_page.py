"""The page stands alone, shows every kind of result, and trusts no name."""

from __future__ import annotations

import base64
import hashlib
import importlib
import json
import math
import re
from html.parser import HTMLParser

import numpy as np
import pytest

from fibrefit.report.any import REPORTS
from fibrefit.report.page import Illustration, Result, page
from fibrefit.report.page.common import gaps_table
from fibrefit.report.page.discovery import discovery_page
from fibrefit.report.page.kinds import KINDS, page_of
from fibrefit.report.page.posterior import view_of_posterior
from fibrefit.report.text import fit_report
from fibrefit.study.summaries.files import SUMMARIES
from fibrefit.study.summaries.part import Variable, conditions_text
from tests.report.test_text import records_of_two_files
from tests.study.test_summaries import EXAMPLES, FIT, GAP

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
        self.ids: list[str] = []
        self.scripts: list[str] = []
        self.data: list[str] = []
        self.heads: list[dict[str, str | None]] = []
        self.alts: list[str] = []
        self.policy = self.text = ""

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        told = dict(attrs)
        if tag not in EMPTY:
            self.opened.append(tag)
        self.fetched += [value or "" for name, value in attrs if name in ("src", "href")]
        self.ids += [value or "" for name, value in attrs if name == "id"]
        if tag == "script":
            (self.data if told.get("type") == "application/json" else self.scripts).append("")
            self.kept = self.data if told.get("type") == "application/json" else self.scripts
        if tag == "th":
            self.heads.append(told)
        if tag == "img":
            self.alts.append(told.get("alt") or "")
        if told.get("http-equiv") == "Content-Security-Policy":
            self.policy = told["content"] or ""
        assert tag not in ("link", "iframe", "object", "embed", "base")

    def handle_endtag(self, tag: str) -> None:
        assert self.opened.pop() == tag

    def handle_data(self, data: str) -> None:
        if self.opened and self.opened[-1] == "script":
            self.kept[-1] += data
        elif not self.opened or self.opened[-1] != "style":
            self.text += data


def read(text: str) -> Reader:
    reader = Reader()
    reader.feed(text)
    assert not reader.opened
    return reader


def result(schema: str, folder: str = "results/a") -> Result:
    return Result(folder, EXAMPLES[schema], [Illustration("overview", "What is seen. Gap 1.3.", PNG)])


def groups() -> dict[str, dict[str, Variable]]:
    """What a fit of one record of a hundred samples keeps."""
    grid, times = ("record", "sample"), np.linspace(0.0, 0.2, 100)[None]
    name = {"record": Variable(np.array(["a.csv"], dtype=object), ("record",))}
    force, phase = 10.0 * np.sin(60.0 * times), np.where(times < 0.05, 1, 2)
    position = 1e-3 * times
    return {
        "observed_data": {
            **name,
            "time": Variable(times, grid, "s"),
            "force": Variable(force, grid, "N"),
            "position": Variable(position, grid, "m"),
        },
        "predictions": {
            **name,
            "force": Variable(force + 0.1, grid, "N"),
            "position": Variable(position, grid, "m"),
            "force_error": Variable(np.full_like(force, 0.2), grid, "N"),
        },
        "motion": {
            **name,
            "phase": Variable(phase, grid),
            "position": Variable(position, grid, "m"),
            "stretch_rate": Variable(position, grid, "m/s"),
        },
        "constant_data": {**name, "samples": Variable(np.array([90]), ("record",))},
    }


@pytest.mark.parametrize("schema", EXAMPLES)
def test_every_kind_of_result_is_shown_and_nothing_is_fetched(schema: str) -> None:
    reader = read(page([result(schema)], "one"))
    assert all(link.startswith(("data:image/png;base64,", "#")) for link in reader.fetched)
    assert len([link for link in reader.fetched if link.startswith("data:")]) == 1
    assert "The report of the terminal" in reader.text
    assert reader.alts == ["What is seen. Gap 1.3."]
    assert len(reader.ids) == len(set(reader.ids))


@pytest.mark.parametrize("schema", EXAMPLES)
def test_tables_say_what_their_heads_are_heads_of(schema: str) -> None:
    reader = read(page([result(schema)], "one"))
    assert all(head.get("scope") in ("col", "row") for head in reader.heads)


def test_the_browser_is_told_to_run_our_script_alone_and_to_fetch_nothing() -> None:
    reader = read(page([result("fibrefit/fit/1")], "one"))
    (script,) = reader.scripts
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    assert f"script-src 'sha256-{digest}'" in reader.policy
    assert reader.policy.startswith("default-src 'none'; img-src data:;")


def test_the_summary_is_inside_as_it_was_read() -> None:
    reader = read(page([result("fibrefit/fit/1")], "one"))
    assert FIT.model_validate_json(reader.data[-1], strict=True) == FIT


def test_the_verdict_comes_first_and_failed_checks_before_numbers() -> None:
    failed = FIT.checks[0].model_copy(update={"passed": False, "says": "It is 3.2, above 1.1."})
    fit = FIT.model_copy(update={"status": "suspect", "checks": (failed,)})
    text = page([Result("results/a", fit)], "one")
    places = [text.index(words) for words in ("Read these numbers with care", "It is 3.2, above 1.1.", "Parameters")]
    assert places == sorted(places)


def test_the_records_are_packed_with_their_noise_states_and_moments() -> None:
    reader = read(page([Result("results/a", FIT, (), groups())], "one"))
    view, data = (json.loads(text) for text in reader.data[:2])
    assert [one["name"] for one in view["channels"]] == ["force", "position"]
    assert [one["name"] for one in view["states"]] == ["position", "stretch rate"]
    (record,) = view["records"]
    assert record["noise"]["force"] == pytest.approx(0.41)
    assert record["moments"] == [{"kind": "take-up 1", "at": pytest.approx(0.0505, abs=2e-3)}]
    assert data["length"] == 90
    assert {one["name"] for one in data["series"]} >= {"time", "measured force", "final force", "above force", "phase"}


def test_what_a_model_does_after_the_end_of_a_record_chooses_no_unit() -> None:
    there = groups()
    rates = there["motion"]["stretch_rate"].values.copy()
    rates[:, 90:] = 1e3
    for values, unit in ((rates, "mm/s"), (1e4 * rates, "m/s")):
        there["motion"]["stretch_rate"] = Variable(values, ("record", "sample"), "m/s")
        view = json.loads(read(page([Result("results/a", FIT, (), there)], "one")).data[0])
        assert [one["unit"] for one in view["states"] if one["name"] == "stretch rate"] == [unit]


def test_the_band_holds_noise_and_errors_of_the_values() -> None:
    from fibrefit.report.page.records import fit_bands, simulated

    made = groups()
    readings = simulated(made, "predictions")
    band = fit_bands(made, readings, {name: one.gap for name, one in FIT.records.items()})["force"]
    np.testing.assert_allclose(band.high - readings["force"], 1.959964 * np.hypot(0.41, 0.2))
    np.testing.assert_allclose(band.high - readings["force"], readings["force"] - band.low)
    own = np.linspace(0.41, 1.2, readings["force"].size).reshape(readings["force"].shape)
    made["predictions"]["force_noise"] = Variable(own, ("record", "sample"), "N")
    band = fit_bands(made, readings, {name: one.gap for name, one in FIT.records.items()})["force"]
    np.testing.assert_allclose(band.high - readings["force"], 1.959964 * np.hypot(own, 0.2), rtol=1e-6)


def test_residuals_of_a_posterior_are_in_units_of_the_noise_of_its_draws() -> None:
    noise, spread, rng = 0.41, 0.3, np.random.default_rng(0)
    model = np.linspace(0.0, 30.0, 500) + np.array([-1.0, 0.0, 1.0])[:, None, None] * 1.645 * spread
    new = np.linspace(0.0, 30.0, 500) + np.array([-1.0, 0.0, 1.0])[:, None, None] * 1.645 * np.hypot(noise, spread)
    name = {"record": Variable(np.array(["a.csv"], dtype=object), ("record",))}
    time = {"time": Variable(np.arange(500)[None] / 2000.0, ("record", "sample"), "s")}
    drawn = {"force_model": model, "force_measured": new}
    kept = {
        "observed_data": {
            **name, **time, "force": Variable(model[1] + noise * rng.normal(size=(1, 500)), ("record", "sample"), "N"),
        },
        "posterior_predictive": {
            **name, **time, "quantile": Variable(np.array([0.05, 0.5, 0.95]), ("quantile",)),
            **{key: Variable(one, ("quantile", "record", "sample"), "N") for key, one in drawn.items()},
        },
    }  # fmt: skip
    block = view_of_posterior(Result("results/a", EXAMPLES["fibrefit/posterior/1"], [], kept))
    assert block is not None
    (told,) = block.view["records"]
    assert told["noise"]["force"] == pytest.approx(noise, rel=2e-3)
    without = view_of_posterior(Result("results/a", EXAMPLES["fibrefit/posterior/1"]))
    assert without is None


def test_the_interval_of_a_posterior_is_in_the_unit_of_its_mean() -> None:
    """Though one of its ends alone would be told in another one."""
    summary = EXAMPLES["fibrefit/posterior/1"]
    wide = {"mean": 1005.0, "sd": 10.0, "median": 1005.0, "interval": (985.0, 1025.0)}
    changed = {"stiffness": summary.parameters["stiffness"].model_copy(update=wide)}
    (table, *_) = page_of(Result("results/a", summary.model_copy(update={"parameters": changed}))).blocks
    assert table.rows[0][:5] == ("stiffness", "1.005", "0.010", "kN/m", "0.985 to 1.025")


def test_a_result_without_its_samples_has_no_view_of_records() -> None:
    assert "records-block" not in page([Result("results/a", FIT)], "one").partition("</style>")[2]


def test_several_results_stand_side_by_side() -> None:
    reader = read(page([result("fibrefit/fit/1"), result("fibrefit/posterior/1", "results/b")], "two"))
    assert "Side by side" in reader.text
    assert re.search(r"stiffness\s*34\.21 ± 0\.19 kN/m\s*1\.00 ± 0\.10 N/m", reader.text)
    assert [link for link in reader.fetched if link.startswith("#")] == ["#result-1", "#result-2"]
    assert len(reader.ids) == len(set(reader.ids))


def test_results_without_common_parameters_do_not() -> None:
    reader = read(page([result("fibrefit/fit/1"), result("fibrefit/batch/1")], "two"))
    assert "Side by side" not in reader.text


def test_names_are_text_and_nothing_else() -> None:
    wicked = "</script><script>alert('x')</script>&amp;"
    fit = FIT.model_copy(update={"study": wicked, "advice": (wicked,)})
    reader = read(page([Result(wicked, fit, [Illustration('"><script>', wicked, PNG)], groups())], wicked))
    assert len(reader.scripts) == 1
    assert "alert" not in reader.scripts[0]
    assert "alert('x')" in reader.text
    assert json.loads(reader.data[-1])["study"] == wicked


def test_where_it_comes_from_is_told() -> None:
    reader = read(page([result("fibrefit/fit/1")], "one"))
    assert "a.csv" in reader.text
    assert "0" * 64 in reader.text


def test_a_batch_has_a_row_an_item_with_numbers_to_sort_by() -> None:
    text = page([Result("results/a", EXAMPLES["fibrefit/batch/1"], link="a")], "one")
    assert re.search(r'<th scope="row">a</th><td class="status ok">ok</td><td class="number" data-value="1.0">', text)
    assert 'data-value="34.21" data-error="0.19">34.21 ± 0.19</td>' in text
    assert "b.csv: no such file." in text
    assert '["a/a/summary.json",""]' in text


@pytest.mark.parametrize("names", [("a", "b"), ("-a", "+b")], ids=["plain", "as formulas"])
def test_a_batch_shows_the_conditions_that_differ(names: tuple[str, str]) -> None:
    """From the summary alone: somebody's spreadsheet may have written the table anew."""
    said = [{"lift [m]": lift, "weight_mass [kg]": 3.0, "speed of stiffness [m/s]": lift} for lift in (0.005, 0.02)]
    both = zip(names, EXAMPLES["fibrefit/batch/1"].items.values(), said, strict=True)
    items = {name: item.model_copy(update={"conditions": of}) for name, item, of in both}
    text = page([Result("results/a", EXAMPLES["fibrefit/batch/1"].model_copy(update={"items": items}))], "one")
    told = read(text).text
    assert "lift [mm]" in told
    assert "weight mass" not in told
    assert "speed of stiffness" not in told
    assert 'data-value="5.0">5</td>' in text
    assert 'data-value="20.0">20</td>' in text


def test_numbers_that_a_page_is_filtered_by_are_those_that_are_shown() -> None:
    """``inclination = 60``: in degrees made of radians there are 59.99999999999999 of them."""
    item = next(iter(EXAMPLES["fibrefit/batch/1"].items.values()))
    said = {f"{n}": {"inclination [rad]": math.radians(n), "lift [m]": float(f"{n}e-3")} for n in (15, 60, 43)}
    items = {name: item.model_copy(update={"conditions": of}) for name, of in said.items()}
    text = page([Result("results/a", EXAMPLES["fibrefit/batch/1"].model_copy(update={"items": items}))], "one")
    for number in said:
        assert text.count(f'data-value="{number}.0">{number}</td>') == 2


def test_a_search_that_ran_out_of_time_says_so_before_all_else() -> None:
    whole = EXAMPLES["fibrefit/discovery/1"]
    cut = whole.model_copy(update={"untried": ("fibre.creep",), "undone": ("a further effect",)})
    text = page([Result("results/a", cut)], "one")
    said = text.index("What the time did not suffice for")
    assert text.index("Not tried: fibre.creep.") > said
    assert text.index("Not done: a further effect.") < text.index("What it does to the parameters")
    visible = page([Result("results/a", whole)], "one").partition("<details")[0]
    assert "What the time did not suffice for" not in visible


def test_a_search_tells_its_rounds() -> None:
    reader = read(page([result("fibrefit/discovery/1")], "one"))
    assert "NAMED: guide.viscous_friction" in reader.text
    assert "Round 1: guide.viscous_friction is added" in reader.text
    assert "3.10 before" in " ".join(reader.text.split())


def test_there_is_a_report_of_every_kind() -> None:
    assert set(REPORTS) == {kind.__name__ for kind in SUMMARIES.values()}
    for where in REPORTS.values():
        module, name = where.split(".")
        assert callable(getattr(importlib.import_module(f"fibrefit.report.{module}"), name))
    assert set(KINDS) <= set(SUMMARIES.values())


@pytest.mark.parametrize(
    ("verdict", "status", "badge"),
    [
        ("named", "ok", "ok"),
        ("named", "suspect", "suspect"),
        ("named", "failed", "failed"),
        ("nothing_missing", "failed", "failed"),
        ("unexplained", "ok", "suspect"),
        ("not_trusted", "ok", "failed"),
    ],
)
def test_a_search_is_marked_by_the_worse_of_its_verdict_and_its_final_fit(
    verdict: str, status: str, badge: str
) -> None:
    changed = EXAMPLES["fibrefit/discovery/1"].model_copy(update={"verdict": verdict, "status": status})
    assert discovery_page(Result("results/a", changed)).status == badge


def test_one_identification_is_one() -> None:
    whole = EXAMPLES["fibrefit/batch/1"]
    one = whole.model_copy(update={"items": {"a": whole.items["a"]}})
    assert "1 identification: 1 ok." in read(page([Result("results/a", one)], "one")).text
    assert "2 identifications: " in read(page([Result("results/a", whole)], "one")).text


def test_conditions_of_a_record_are_written_in_the_signs_of_print() -> None:
    constants = {
        "samples": Variable(np.array([90, 90]), ("record",)),
        "lift": Variable(np.array([0.01, 0.0]), ("record",), "m"),
        "inclination": Variable(np.radians([45.0, 90.0]), ("record",), "rad"),
    }
    assert [conditions_text(constants, r) for r in range(2)] == ["lift 10 mm, inclination 45°", "inclination 90°"]
    changed = groups()
    changed["constant_data"] |= {"lift": Variable(np.array([2e-5]), ("record",), "m")}
    view = json.loads(read(page([Result("results/a", FIT, groups=changed)], "one")).data[0])
    assert view["records"][0]["says"] == "lift 20 µm"


@pytest.mark.parametrize("schema", ["fibrefit/fit/1", "fibrefit/discovery/1", "fibrefit/prediction/1"])
def test_files_and_conditions_of_the_records_are_a_table(schema: str) -> None:
    result = Result("results/x", EXAMPLES[schema].model_copy(update={"records": records_of_two_files()}))
    (table,) = [block for block in page_of(result).blocks if block.heading == "Records and their conditions"]
    assert table.head == ("record", "file", "inclination", "lift", "gain")
    assert table.rows == [
        ("a.csv", "a.csv", "45°", "5.020 ± 0.030 mm (found)", ""),
        ("b.csv", "../../records/b.csv, c.csv", "90°", "10.00 ± 0.10 mm", "1.2"),
    ]
    assert table.note == "All records: weight mass 3.096 kg."
    assert "All records: weight mass 3.096 kg." in read(page([result], "x")).text


def test_records_stand_in_one_order_on_the_page_and_in_the_report() -> None:
    """One whose gap is not known comes first: its motion could not be simulated."""
    totals = {"a.csv": 1.0, "b.csv": None, "c.csv": 3.0, "d.csv": 0.0}
    gaps = {name: GAP.model_copy(update={"total": total}) for name, total in totals.items()}
    order = ["b.csv", "c.csv", "a.csv", "d.csv"]
    assert [row[0] for row in gaps_table(gaps, GAP, None, None).rows] == [*order, "all records"]
    records = {name: FIT.records["a.csv"].model_copy(update={"gap": gap}) for name, gap in gaps.items()}
    text = fit_report(FIT.model_copy(update={"records": records})).partition("worst first")[2]
    assert sorted(totals, key=lambda name: text.index(f"\n{name.removesuffix('.csv')} ")) == order
