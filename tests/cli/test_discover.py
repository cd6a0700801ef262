"""``fibrefit discover``: what it hands on, where it writes, when it does not search again. The search is stubbed."""

from __future__ import annotations

import io
import json
from pathlib import Path
from typing import Any

import pytest

import fibrefit.workflow.discovery.discover as workflow
from fibrefit.core.errors import UsageError
from fibrefit.laws.catalogue import CATALOGUE
from fibrefit.store import ResultDirectory, provenance, write_summary
from fibrefit.study import Study
from fibrefit.study.summaries.discovery import DiscoverySummary
from fibrefit.workflow.discovery.discover import SearchOptions, inputs_of
from tests.cli.conftest import Run
from tests.cli.test_choosing import FIRST
from tests.report.test_discovery import ALL


class Found:
    """A discovery with a given outcome."""

    def __init__(self, study: Study, options: SearchOptions, summary: DiscoverySummary) -> None:
        origin = provenance(
            study.resolved_toml(), inputs_of(study, options), seed=options.seed, settings=options.as_settings()
        )
        self.content = summary.model_copy(update={"provenance": origin})

    def summary(self) -> DiscoverySummary:
        return self.content

    def write(self, directory: ResultDirectory) -> None:
        write_summary(directory.path, self.content)


@pytest.fixture
def calls(monkeypatch: pytest.MonkeyPatch) -> list[dict[str, Any]]:
    """What the workflow was called with; the search names an effect."""
    return stub(monkeypatch, "named")


def stub(monkeypatch: pytest.MonkeyPatch, outcome: str) -> list[dict[str, Any]]:
    made: list[dict[str, Any]] = []

    def discover_study(study: Study, *, progress: Any, choose: Any, folder: Path, **options: Any) -> Found:
        assert folder.is_dir()
        made.append(options | {"choose": choose and choose(FIRST)})
        return Found(study, SearchOptions(**options), ALL[outcome])

    monkeypatch.setattr(workflow, "discover_study", discover_study)
    return made


@pytest.fixture
def demo(fibrefit: Run) -> Run:
    fibrefit("init", "demo")
    return fibrefit


def test_it_prints_the_report_and_says_where_it_wrote(demo: Run, calls: list[Any]) -> None:
    done = demo("discover", "demo", "--out", "out")
    assert done.code == 0
    assert done.out.startswith("NAMED: guide.viscous_friction")
    assert "Written to out: summary.json" in done.err
    assert done.err.strip().endswith("The study is that of the final model.")


def test_options_reach_the_workflow(demo: Run, calls: list[dict[str, Any]]) -> None:
    Path("demo/my.py").write_text("")
    words = ("--only", "guide.*", "--only", "fibre.*", "--exclude", "guide.quadratic_drag", "--also", "my.py:Mine")
    few = ("--seed", "7", "--max-effects", "2", "--time", "1 min", "--least", "0.5")
    assert demo("discover", "demo", "--out", "out", *few, *words).code == 0
    assert calls == [
        {
            "seed": 7,
            "seconds": 60.0,
            "least": 0.5,
            "max_effects": 2,
            "only": ("guide.*", "fibre.*"),
            "exclude": ("guide.quadratic_drag",),
            "also": ("my.py:Mine",),
            "choose": None,
        }
    ]


def test_json_is_one_document_also_when_a_person_chooses(
    demo: Run, calls: list[dict[str, Any]], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.stdin", io.StringIO("2\n"))
    done = demo("discover", "demo", "--out", "out", "--json", "--interactive")
    assert done.document["schema"] == "fibrefit/discovery/1"
    assert calls[0]["choose"] == FIRST[1].effect
    # The stubbed search keeps another.
    assert f"{FIRST[1].effect} was chosen but not kept" in done.err
    assert "Which one is added?" in done.err


@pytest.mark.parametrize(
    ("outcome", "code"), [("named", 0), ("nothing_missing", 0), ("unexplained", 0), ("not_trusted", 5)]
)
def test_the_exit_code(demo: Run, monkeypatch: pytest.MonkeyPatch, outcome: str, code: int) -> None:
    stub(monkeypatch, outcome)
    assert demo("discover", "demo", "--out", "out").code == code
    assert Path("out/summary.json").exists()
    assert demo("discover", "demo", "--out", "out").code == code  # also when it is shown again


def test_the_same_search_is_not_made_twice(demo: Run, calls: list[Any]) -> None:
    first = demo("discover", "demo")
    again = demo("discover", "demo")
    assert len(calls) == 1
    assert again.out == first.out
    assert "The same search was made before; this is its result in results/" in again.err
    assert demo("discover", "demo", "--force").code == 0
    assert len(calls) == 2


def test_another_search_does_not_take_its_place(demo: Run, calls: list[Any]) -> None:
    demo("discover", "demo", "--out", "out")
    refused = "error: out: exists already; expected a new folder. Add {}--force to replace it, or name another --out.\n"
    for words in (("--seed", "1"), ("--set", "rig.weight_mass=2 kg"), ("--max-effects", "1")):
        done = demo("discover", "demo", "--out", "out", *words)
        assert (done.code, done.err) == (2, refused.format("")), words
    # Asked at each round it is the same search.
    done = demo("discover", "demo", "--out", "out", "--interactive")
    assert (done.code, done.err) == (2, refused.format("--resume to go on with it, "))
    assert len(calls) == 1


def test_show_prints_the_report_again(demo: Run, calls: list[Any]) -> None:
    done = demo("discover", "demo", "--out", "out")
    assert demo("show", "out").out == done.out
    assert demo("show", "out", "--json").document["verdict"] == "named"


@pytest.mark.parametrize(
    ("words", "code", "says"),
    [
        (("--max-effects", "0"), 2, "0 is not in the range x>=1"),
        (("--max-effects", "1000"), 2, f"max_effects: 1000; expected 1 to {len(CATALOGUE)}, as many as the catalogue"),
        (("--time", "0"), 2, "0 is not a time of 1 s or more."),
        (("--time", "5 mm"), 2, "expected"),
        (("--time", "soon"), 2, '"soon" is not a quantity'),
        (("--least", "-1"), 2, "-1.0 is not in the range x>=0"),
        (("--only", "guide.viscos_friction"), 2, 'Did you mean "guide.viscous_friction"?'),
        (("--exclude", "*"), 2, "no effect is left to try"),
        (("--also", "my.py:Mine"), 4, "Check the path."),
    ],
)
def test_refusals(demo: Run, words: tuple[str, ...], code: int, says: str) -> None:
    done = demo("discover", "demo", "--out", "out", *words)
    assert done.code == code
    assert says in done.err
    assert not list(Path().glob("out*"))


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"seconds": -1.0}, "seconds: -1; expected a time in seconds."),
        ({"seconds": float("inf")}, "seconds: inf; expected a time in seconds."),
        ({"seconds": float("nan")}, "seconds: nan; expected a time in seconds."),
        ({"least": -0.5}, "least: -0.5; expected 0 or more, in units of the noise."),
        ({"least": float("nan")}, "least: nan; expected 0 or more, in units of the noise."),
    ],
)
def test_options_that_no_search_has_are_refused_in_a_program_too(options: dict[str, float], says: str) -> None:
    with pytest.raises(UsageError) as refused:
        SearchOptions(**options)  # type: ignore[arg-type]
    assert str(refused.value) == says


def test_what_was_found_before_an_interruption_is_kept(
    demo: Run, calls: list[Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    whole, journals = workflow.discover_study, []

    def interrupted(study: Study, *, folder: Path, **options: Any) -> None:
        journals.append(sorted(path.name for path in folder.glob("*.job")))
        (folder / f"{len(journals)}.job").write_bytes(b"found")
        raise KeyboardInterrupt

    monkeypatch.setattr(workflow, "discover_study", interrupted)
    assert demo("discover", "demo", "--out", "out").code == 130
    assert demo("discover", "demo", "--out", "out", "--resume").code == 130
    assert journals == [[], ["1.job"]]
    monkeypatch.setattr(workflow, "discover_study", whole)
    refused = demo("discover", "demo", "--out", "out")
    assert (refused.code, "Add --resume to go on" in refused.err) == (2, True)
    other = demo("discover", "demo", "--out", "out", "--resume", "--set", "rig.weight_mass=2 kg")
    assert (other.code, "study" in other.err) == (2, True), other.err
    assert demo("discover", "demo", "--out", "out", "--resume", "--time", "60").code == 0
    assert not list(Path("out").glob("journal*"))


def test_a_search_whose_time_ended_goes_on_where_it_is_asked_to(demo: Run, calls: list[Any]) -> None:
    demo("discover", "demo", "--out", "out")
    summary = json.loads(Path("out/summary.json").read_text())
    Path("out/summary.json").write_text(json.dumps(summary | {"untried": ["fibre.creep"]}))
    again = demo("discover", "demo", "--out", "out")
    assert len(calls) == 1
    assert "--resume goes on with it" in again.err
    assert demo("discover", "demo", "--out", "out", "--resume").code == 0
    assert len(calls) == 2
    # What was tried to its end is not: there is nothing to go on with.
    assert "--force makes it again" in demo("discover", "demo", "--out", "out", "--resume").err
    assert len(calls) == 2


def test_a_search_with_no_more_time_is_the_same_and_with_more_where_its_own_ended(demo: Run, calls: list[Any]) -> None:
    """One that came to its end is shown; to one whose time ended more is given with --resume."""
    assert demo("discover", "demo", "--out", "out", "--time", "10 min").code == 0
    assert "exists already" in demo("discover", "demo", "--out", "out", "--time", "20 min").err
    for time in ((), ("--time", "10 min")):
        assert "The same search was made before" in demo("discover", "demo", "--out", "out", *time).err
    summary = json.loads(Path("out/summary.json").read_text())
    assert summary["provenance"]["settings"]["time"] == "600"
    Path("out/summary.json").write_text(json.dumps(summary | {"untried": ["fibre.creep"]}))
    assert "--resume goes on with it" in demo("discover", "demo", "--out", "out", "--time", "20 min").err
    assert len(calls) == 1
    assert demo("discover", "demo", "--out", "out", "--time", "20 min", "--resume").code == 0
    assert len(calls) == 2
