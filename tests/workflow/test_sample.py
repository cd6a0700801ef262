"""From a study to a posterior and its files, on two short drops that are made."""

from __future__ import annotations

import dataclasses
import json
import shutil
import warnings
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import h5py
import jsonschema
import numpy as np
import pandas as pd
import pytest

import fibrefit
from fibrefit.core.errors import StudyError, UsageError
from fibrefit.core.limits import quiet
from fibrefit.problem.task import Task
from fibrefit.report.posterior import posterior_report
from fibrefit.sampling.settings import Settings
from fibrefit.store.summary import read_summary
from fibrefit.study import Study, load_study
from fibrefit.study.summaries.results import PosteriorSummary
from fibrefit.workflow.compare import compared, refuse_other_readings, rival_of
from fibrefit.workflow.fit import Fit
from fibrefit.workflow.outcome.draw import draw_result
from fibrefit.workflow.prepare import read_records
from fibrefit.workflow.sampling.sample import Sampled, SamplingOptions, sample_study
from fibrefit.workflow.sampling.start import START, SamplingStart, _read, begin, digest_of
from tests.fitting import made

SCHEMA = Path(__file__).resolve().parents[2] / "data_schemas" / "posterior.schema.json"
SHARED = ["stiffness", "damping", "friction", "noise.force", "noise.position"]
SURE = 4.0
"""Standard deviations from the truth that one of three values may be."""
RATIO = (0.5, 1.4)
"""Posterior sd over the fit's standard error: whitened estimates are the better ones, so it may be below one."""


@pytest.fixture(scope="session")
def sampled(study: Study, fit: Fit, tmp_path_factory: pytest.TempPathFactory) -> Sampled:
    return fibrefit.sample(study, start=fit, seed=1, ess=100.0, checkpoint=tmp_path_factory.mktemp("chains"))


@pytest.fixture(scope="session")
def kept(sampled: Sampled, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with the files of the posterior."""
    return sampled.save(tmp_path_factory.mktemp("posteriors") / "out")


def test_it_holds_the_truth_and_is_as_wide_as_the_fit_says(sampled: Sampled, fit: Fit) -> None:
    assert sampled.status == "ok", [check.name for check in sampled.checks if not check.passed]
    assert list(sampled.parameters) == SHARED
    for name, truth in made.TRUTH.items():
        found, fitted = sampled.parameters[name], fit.parameters[name]
        assert abs(found.mean - truth) < SURE * found.sd
        assert RATIO[0] < found.sd / fitted.std_error < RATIO[1]


def test_draws_are_offered_by_name(sampled: Sampled) -> None:
    draws, full = sampled.draws, sampled.posterior.draws
    assert draws.index.names == ["chain", "draw"]
    assert draws.index.get_level_values("chain").nunique() == len(full) == 4
    assert float(draws["stiffness"].mean()) == pytest.approx(sampled.parameters["stiffness"].mean, rel=1e-4)
    assert sorted(draws.columns) == sorted(sampled.posterior.target.names)
    for i, name in enumerate(sampled.posterior.target.names):
        assert set(draws[name].loc[0]) <= set(full[0, :, i])


def test_the_summary_keeps_to_its_schema_and_tells_all(kept: Path) -> None:
    content = json.loads((kept / "summary.json").read_text(encoding="utf-8"))
    jsonschema.validate(content, json.loads(SCHEMA.read_text(encoding="utf-8")))
    assert content["schema"] == "fibrefit/posterior/1"
    assert content["ended"] == "converged"
    assert content["fit_status"] == "ok"
    assert content["interval_kind"] == "equal_tailed"
    assert content["likelihood"] == "coloured"
    for channel, noise in made.NOISE.items():
        left = content["gap"][channel]
        assert left["noise"] == pytest.approx(noise, rel=0.15)
        assert left["rms"] == pytest.approx(left["ratio"] * left["noise"])
    (size,) = (check for check in content["checks"] if check["identifier"] == "residual_size")
    assert size["statistic"] == pytest.approx(max(content["gap"][channel]["ratio"] for channel in made.NOISE))
    stiffness = content["parameters"]["stiffness"]
    assert stiffness["unit"] == "N/m"
    assert stiffness["prior"].endswith("(default)")
    assert stiffness["prior_share"] < 0.1
    assert stiffness["interval"][0] < stiffness["median"] < stiffness["interval"][1]
    assert all(set(own) == {"position_zero", "release"} for own in content["records"].values())
    assert all(abs(share - 0.9) < 0.04 for share in content["covered"].values())
    assert content["cross_validation"]["effective_parameters"] == pytest.approx(9.0, abs=4.0)
    assert len(content["modes"]) == 1
    assert content["modes"][0]["weight"] == 1.0
    assert len(content["provenance"]["inputs"]) == 3


def test_the_report_reads_back_and_fits_the_terminal(kept: Path, sampled: Sampled) -> None:
    summary = read_summary(kept)
    assert isinstance(summary, PosteriorSummary)
    text = posterior_report(summary)
    assert max(map(len, text.splitlines())) <= 80
    assert text.isascii()
    for part in ("OK", "95 % interval", "4 ensembles of", "Converged; max. R-hat", "Log marginal likelihood"):
        assert part in " ".join(text.split()), part
    assert sampled.report() == text


def test_the_result_has_the_groups_of_arviz(kept: Path, sampled: Sampled) -> None:
    with h5py.File(kept / "result.h5") as file:
        known = {"posterior", "sample_stats", "prior", "observed_data", "posterior_predictive", "constant_data"}
        assert known <= set(file)
        assert list(file["posterior/stiffness"][0]) == list(sampled.draws["stiffness"].loc[0])
        assert file["posterior/stiffness"].shape[1] > 800
        assert file["posterior/stiffness"].attrs["units"] == "N/m"
        assert len(file["cross_validation/elpd"]) == len(sampled.cross_validation.blocks)


@pytest.mark.slow
def test_figures_are_drawn_and_chosen_by_name(kept: Path, sampled: Sampled) -> None:
    names = {path.name for path in (kept / "figures").iterdir()}
    assert {"corner.png", "traces.png", "prior.png"} < names
    assert sum(name.startswith("record_") for name in names) == 2
    again = draw_result(kept)
    assert set(again) == set(sampled.plot())
    assert [figure.get_label() for figure in again.values()] == [
        figure.get_label() for figure in sampled.plot().values()
    ]
    assert len(sampled.plot_prior("release[drop_5mm.csv]")["prior"].axes) == 1
    assert len(sampled.plot_traces("friction")["traces"].axes) == 2
    two = sampled.plot_corner("stiffness", "friction")["corner"]
    assert len(two.axes) == 3
    assert "stiffness / (kN/m)" in {axes.get_xlabel() for axes in two.axes}
    with pytest.raises(UsageError, match='Did you mean "friction"'):
        sampled.plot_corner("fricton")
    with pytest.raises(UsageError, match="not in this study"):
        sampled.plot_bands("nothing.csv")


@pytest.mark.slow
def test_a_checkpoint_goes_on_and_ends_the_same(study: Study, fit: Fit, sampled: Sampled, tmp_path: Path) -> None:
    cut = Settings(seed=1, max_steps=20)
    first = sample_study(study, start=fit, settings=cut, folder=tmp_path)
    assert first.status != "ok"
    assert "--resume" in first.summary().advice[-1]
    assert first.summary().ended == "budget"
    lines: list[str] = []
    again = fibrefit.sample(study, seed=1, checkpoint=tmp_path, progress=lambda line, share: lines.append(line))
    assert next(line for line in lines if line.startswith("step ")).startswith("step 20,")
    np.testing.assert_array_equal(again.posterior.points, sampled.posterior.points)
    np.testing.assert_array_equal(again.draws["stiffness"], sampled.draws["stiffness"])


@pytest.mark.slow
def test_the_better_model_predicts_better(study: Study, kept: Path) -> None:
    """The same data; the fibre is held too stiff by a tenth."""
    held = load_study(study.source, [f'parameters.stiffness.fixed="{1.1 * made.TRUTH["stiffness"]} N/m"'])
    options = SamplingOptions(compare=(str(kept),))
    wrong = sample_study(held, settings=Settings(seed=1, max_steps=30), options=options)
    against = wrong.summary().compared[0]
    # A bias that every bounce shows anew differs among the few blocks about as much as it is.
    assert against.elpd.value < -3.0 * against.elpd.error
    assert against.log_evidence is not None
    assert against.log_evidence.value < -50.0
    assert "the other" in wrong.report()


def test_models_are_compared_block_by_block(study: Study, sampled: Sampled, kept: Path) -> None:
    rival = rival_of(kept, study)
    own = dataclasses.replace(sampled.cross_validation, blocks=rival.blocks + 0.5)
    found = compared(own, sampled.posterior.log_evidence, rival, "coloured")
    assert found.elpd.value == pytest.approx(0.5 * len(rival.blocks))
    # What both find hard cancels, however much the blocks differ among themselves.
    assert found.elpd.error < 1e-6
    assert found.log_evidence is not None
    assert found.log_evidence.value == 0.0
    fewer = dataclasses.replace(own, blocks=own.blocks[1:])
    with pytest.raises(UsageError, match="Both must use the same samples"):
        compared(fewer, None, rival, "coloured")


def test_a_posterior_of_other_readings_of_the_same_files_is_no_rival(
    study: Study, sampled: Sampled, kept: Path
) -> None:
    rival, problem = rival_of(kept, study), sampled.posterior.density.problem
    refuse_other_readings(rival, problem)
    other = {"force": 1.001 * rival.observed["force"]}
    fewer = {"force": np.where(np.arange(rival.observed["force"].shape[1]) == 7, np.nan, rival.observed["force"])}
    for changed in (other, fewer):
        with pytest.raises(UsageError, match="other readings of force"):
            refuse_other_readings(dataclasses.replace(rival, observed={**rival.observed, **changed}), problem)
    with pytest.raises(UsageError, match="other readings of position"):
        some = {name: rival.observed[name] for name in ("time", "force")}
        refuse_other_readings(dataclasses.replace(rival, observed=some), problem)
    late = {**rival.observed, "time": 2.0 * rival.observed["time"]}
    with pytest.raises(UsageError, match="a posterior of other times"):
        refuse_other_readings(dataclasses.replace(rival, observed=late), problem)


def test_a_comparison_is_reported(sampled: Sampled, kept: Path, study: Study) -> None:
    rivals = dataclasses.replace(sampled, rivals=(rival_of(kept, study),))
    assert "alike" in rivals.report()
    assert max(map(len, rivals.report().splitlines())) <= 80


def test_a_posterior_of_other_records_is_no_rival(kept: Path) -> None:
    other = load_study(Path(__file__).resolve().parents[2] / "configs" / "drop_series")
    with pytest.raises(UsageError, match="a posterior of other records"):
        rival_of(kept, other)


def test_other_results_are_no_rivals(study: Study, saved: Path, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="not a posterior"):
        sample_study(study, options=SamplingOptions(compare=(str(saved),)))


def test_the_fit_of_another_model_is_no_start(study: Study, fit: Fit) -> None:
    other = load_study(study.source, ['parameters.friction.fixed="4 N"'])
    with pytest.raises(UsageError, match=r"a fit of other parameters \(friction\)"):
        fibrefit.sample(other, start=fit)


def test_the_fit_of_other_records_is_no_start(study: Study, fit: Fit, tmp_path: Path) -> None:
    """Of the same names and number: what is sampled are the records of the study."""
    other = made.study(tmp_path)
    made.write(tmp_path, made.records(share=0.5, seed=4))
    with pytest.raises(UsageError, match="start: a fit of another rig, another model or other data"):
        fibrefit.sample(other, start=fit)
    with pytest.raises(UsageError, match="start: a FibreMassStudy; expected a fit, as fibrefit.fit returns it"):
        fibrefit.sample(study, start=study)  # type: ignore[arg-type]


def test_a_start_does_not_depend_on_where_the_study_lies(study: Study, fit: Fit, saved: Path, tmp_path: Path) -> None:
    moved = shutil.copytree(study.source.parent, tmp_path / "moved")
    for same in (load_study(moved), load_study(saved)):
        assert digest_of(same, read_records(same)) == digest_of(fit.study, fit.records)
    with_prior = load_study(moved, ['parameters.stiffness.prior="20 +/- 1 kN/m"'])
    assert digest_of(with_prior, fit.records) == digest_of(fit.study, fit.records)
    heavier = load_study(moved, ['rig.weight_mass="3.2 kg"'])
    assert digest_of(heavier, fit.records) != digest_of(fit.study, fit.records)


def test_what_was_kept_of_another_run_is_not_gone_on_with(fit: Fit, tmp_path: Path) -> None:
    task = cast(Task, SimpleNamespace(problem=fit.identification.problem))
    rests_on = digest_of(fit.study, fit.records)
    begun = begin(rests_on, task, fit, 0, tmp_path, quiet)
    for given in (None, fit):
        np.testing.assert_array_equal(begin(rests_on, task, given, 0, tmp_path, quiet).values, begun.values)
    with pytest.raises(UsageError, match=f"{START}: a fit of another rig, another model or other data.*Start anew"):
        begin("0", task, None, 0, tmp_path, quiet)
    dataclasses.replace(begun, values=1.001 * begun.values).save(tmp_path)
    with pytest.raises(UsageError, match=f"{START}: kept of a run around another fit.*Leave the start out"):
        begin(rests_on, task, fit, 0, tmp_path, quiet)


def test_what_was_kept_must_be_readable(study: Study, tmp_path: Path) -> None:
    (tmp_path / START).write_text("{")
    with pytest.raises(UsageError, match="Start anew, with --force"):
        fibrefit.sample(study, checkpoint=tmp_path)


@pytest.mark.parametrize("walkers", [1, 13, 4])
def test_walkers_that_are_too_few_are_refused_before_the_fit(
    study: Study, walkers: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("fibrefit.workflow.sampling.start.identify", lambda *given, **how: pytest.fail("it computed"))
    with pytest.raises(UsageError, match="walkers: .*; expected an even number"):
        sample_study(study, settings=Settings(walkers=walkers))


def test_a_prior_that_contradicts_the_bounds_is_refused_at_once(study: Study) -> None:
    wrong = ["parameters.stiffness.prior={kind='uniform', lower='1 MN/m', upper='2 MN/m'}"]
    with pytest.raises(StudyError, match="prior of stiffness"):
        sample_study(load_study(study.source, [*wrong, 'parameters.stiffness.bounds=["10 N/m", "90 kN/m"]']))


def test_what_a_run_begins_around_is_kept_to_the_last_bit(tmp_path: Path) -> None:
    random = np.random.default_rng(0)
    start = SamplingStart(
        ("k", "b"),
        random.random(2),
        random.random(2),
        (random.random(2),),
        "ok",
        {"drive": random.random((3, 4))},
        "12",
    )
    start.save(tmp_path)
    read = _read(tmp_path / START)
    assert (read.names, read.status, read.rests_on) == (start.names, start.status, start.rests_on)
    np.testing.assert_array_equal(read.values, start.values)
    np.testing.assert_array_equal(read.plain, start.plain)
    np.testing.assert_array_equal(read.basins, start.basins)
    np.testing.assert_array_equal(read.coefficients["drive"], start.coefficients["drive"])


def test_what_an_older_program_kept_goes_on(tmp_path: Path) -> None:
    """It kept what records differ by, too."""
    start = SamplingStart(("k",), np.ones(1), np.ones(1), (), "ok", {"drive": np.zeros((3, 4))}, "12")
    start.save(tmp_path)
    kept = json.loads((tmp_path / START).read_text(encoding="utf-8"))
    (tmp_path / START).write_text(json.dumps({**kept, "differ": {"k": 0.018}}), encoding="utf-8")
    assert _read(tmp_path / START).names == ("k",)


def test_a_setting_that_is_misspelt_is_refused() -> None:
    says = 'setting "max_step": not known; expected one of seed, ensembles, .*Did you mean "max_steps"?'
    with pytest.raises(UsageError, match=says):
        fibrefit.sample(fibrefit.example("drop_series"), max_step=20)


def test_arviz_compares_models_by_it(sampled: Sampled, kept: Path) -> None:
    arviz_stats = pytest.importorskip("arviz_stats")
    tree = fibrefit.load_result(kept).to_datatree()  # type: ignore[union-attr]
    live = sampled.to_datatree()
    # A dimension of that name is what ArviZ makes of chains and draws, for its pictures of new measurements.
    assert not any("sample" in group.dims for group in tree.subtree)
    assert tree["posterior_predictive"]["force"].dims == ("chain", "draw", "record", "instant")
    assert live["log_likelihood"]["readings"].equals(tree["log_likelihood"]["readings"])
    assert tree["posterior"].sizes["draw"] == tree["log_likelihood"].sizes["draw"] >= 200
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Estimated shape parameter")  # a short example: one block in many is unsure
        found = arviz_stats.loo(tree)
    ours = sampled.cross_validation
    usual = float(tree["log_likelihood"]["usual"].sum())
    assert float(found.elpd) + usual == pytest.approx(ours.total, abs=0.2 * ours.error)
    assert usual > 300.0 * len(ours.blocks)
    assert abs(tree["log_likelihood"]["readings"]).max() < 300.0
    assert found.n_data_points == len(ours.blocks)
    worse = tree.copy()
    worse["log_likelihood"]["readings"] = tree["log_likelihood"]["readings"] - 1.0
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # it sorts in a way pandas is about to give up
        warnings.simplefilter("error", RuntimeWarning)  # a density that no number holds
        table = arviz_stats.compare({"this": tree, "worse": worse})
    assert list(table.index) == ["this", "worse"]
    assert table["weight"].to_list() == pytest.approx([1.0, 0.0], abs=1e-3)
    summary = arviz_stats.summary(tree, var_names=["stiffness"], round_to="none")
    assert float(summary.loc["stiffness", "mean"]) == pytest.approx(sampled.parameters["stiffness"].mean, rel=1e-3)


def test_the_classic_arviz_takes_it_too(sampled: Sampled) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        az = pytest.importorskip("arviz")
        found = az.loo(az.from_datatree(tree := sampled.to_datatree()))
    assert float(found.elpd_loo) + float(tree["log_likelihood"]["usual"].sum()) == pytest.approx(
        sampled.cross_validation.total, rel=0.01
    )


def test_draws_come_back_from_disk_as_they_were(sampled: Sampled, kept: Path) -> None:
    again = fibrefit.load_result(kept)
    pd.testing.assert_frame_equal(again.draws, sampled.draws, check_exact=True)  # type: ignore[union-attr]
    assert np.sqrt(again.covariance.loc["damping", "damping"]) == pytest.approx(  # type: ignore[union-attr]
        sampled.parameters["damping"].sd, rel=0.05
    )
    assert repr(again) == repr(sampled)
    frame = again.to_dataframe().set_index("name")  # type: ignore[union-attr]
    assert frame.loc["friction", "low"] == sampled.parameters["friction"].interval[0]
