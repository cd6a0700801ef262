"""``fibrefit sample``: what it hands on, where it writes, how it goes on. The sampling itself is stubbed."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from fibrefit.store import ResultDirectory
from fibrefit.study import Study
from fibrefit.study.summaries.results import PosteriorSummary
from fibrefit.workflow.sampling import sample
from fibrefit.workflow.sampling.start import CHAINS
from tests.cli.conftest import Run
from tests.study.test_summaries import EXAMPLES


class Sampled:
    """A posterior with a given outcome."""

    def __init__(self, status: str) -> None:
        self.status = status

    def summary(self) -> PosteriorSummary:
        return EXAMPLES["fibrefit/posterior/1"].model_copy(update={"status": self.status})  # type: ignore[return-value]

    def report(self) -> str:
        return "the report"

    def write(self, directory: ResultDirectory) -> None:
        (directory.path / "summary.json").write_text("{}")


@pytest.fixture
def calls(monkeypatch: pytest.MonkeyPatch) -> list[tuple[Study, dict[str, Any]]]:
    """What the workflow was called with; the chains it keeps are the number of calls."""
    made: list[tuple[Study, dict[str, Any]]] = []

    def sample_study(study: Study, **options: Any) -> Sampled:
        made.append((study, options))
        if options["settings"].max_steps == 13:
            raise KeyboardInterrupt
        (options["folder"] / CHAINS).write_text(str(len(made)))
        if options["settings"].max_steps == 14:
            raise KeyboardInterrupt
        return Sampled("failed" if options["settings"].max_steps == 15 else "ok")

    monkeypatch.setattr(sample, "sample_study", sample_study)
    return made


@pytest.fixture
def demo(fibrefit: Run, calls: list[Any]) -> Run:
    """The demonstration study in the folder ``demo``."""
    fibrefit("init", "demo")
    return fibrefit


def test_it_prints_the_report_and_says_where_it_wrote(demo: Run) -> None:
    done = demo("sample", "demo", "--out", "out")
    assert (done.code, done.out) == (0, "the report\n")
    assert "Written to out" in done.err
    assert {path.name for path in Path("out").iterdir()} == {".fibrefit", "summary.json", CHAINS}


@pytest.mark.parametrize("tails", ["--student-t", "--heavy"])
def test_options_reach_the_sampler(demo: Run, calls: list[Any], tails: str) -> None:
    words = "--ess 100 --r-hat 1.05 --max-steps 50 --max-seconds 9 --ensembles 6 --walkers 40 --seed 3 --interval 0.5"
    Path("other").mkdir()
    demo("sample", "demo", *words.split(), "--noise", "white", tails, "--nuts", "--compare", "other", "--out", "o")
    settings, options = calls[0][1]["settings"], calls[0][1]["options"]
    assert (settings.ess, settings.r_hat, settings.max_steps, settings.max_seconds) == (100.0, 1.05, 50, 9.0)
    assert (settings.ensembles, settings.walkers, settings.seed, settings.interval) == (6, 40, 3, 0.5)
    assert (options.noise, options.heavy, options.nuts, options.compare) == ("white", True, True, ("other",))


def test_a_budget_does_not_make_another_run(demo: Run, calls: list[Any]) -> None:
    """The folder without --out is that of the same chains, whatever ends them."""
    first = demo("sample", "demo", "--max-steps", "50").err
    again = demo("sample", "demo", "--max-steps", "90", "--resume").err
    other = demo("sample", "demo", "--seed", "1").err
    folders = [line.split()[2] for text in (first, again, other) for line in text.splitlines() if "Written" in line]
    assert folders[0] == folders[1] != folders[2]
    assert calls[1][1]["settings"].max_steps == 90


def test_json_is_the_summary(demo: Run) -> None:
    assert demo("sample", "demo", "--json", "--out", "out").document["schema"] == "fibrefit/posterior/1"


def test_a_result_that_failed_its_checks_is_written_and_exits_with_5(demo: Run) -> None:
    assert demo("sample", "demo", "--max-steps", "15", "--out", "out").code == 5
    assert Path("out/summary.json").exists()


def test_interrupted_chains_are_kept_and_gone_on_with(demo: Run, calls: list[Any]) -> None:
    done = demo("sample", "demo", "--max-steps", "14", "--out", "out")
    assert done.code == 130
    assert "What was done is kept in out.partial; --resume goes on from there." in done.err
    assert not Path("out").exists()
    refused = demo("sample", "demo", "--out", "out")
    assert refused.code == 2
    assert "Add --resume to go on, or --force to begin anew." in refused.err
    assert demo("sample", "demo", "--out", "out", "--resume").code == 0
    assert Path("out", CHAINS).exists()
    assert not Path("out.partial").exists()


def test_interrupted_before_the_chains_nothing_is_kept(demo: Run) -> None:
    assert demo("sample", "demo", "--max-steps", "13", "--out", "out").code == 130
    assert not Path("out.partial").exists()


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("--ensembles", "2"), 'ensembles: got "2"'),
        (("--r-hat", "1"), "a number above 1"),
        (("--ess", "0"), "a positive number"),
        (("--interval", "95"), "a probability between 0 and 1"),
        (("--noise", "pink"), "'fit', 'auto', 'white', 'autoregressive', 'coloured'"),
    ],
)
def test_settings_that_cannot_work_are_refused(demo: Run, words: tuple[str, ...], says: str) -> None:
    done = demo("sample", "demo", *words, "--out", "out")
    assert done.code == 2
    assert says in done.err or says.replace('got "2"', "2") in done.err, done.err
    assert not Path("out").exists()


def test_show_prints_a_posterior_again(fibrefit: Run, tmp_path: Path) -> None:
    text = EXAMPLES["fibrefit/posterior/1"].model_dump_json(by_alias=True)
    (tmp_path / "summary.json").write_text(text)
    done = fibrefit("show", str(tmp_path))
    assert done.code == 0
    assert "What is known" in done.out
