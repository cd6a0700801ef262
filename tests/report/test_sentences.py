"""Every check that numerics make has a sentence, and none of them brings one along."""

from __future__ import annotations

import ast
from pathlib import Path
from typing import Any

import pytest

from fibrefit.core.declarations import Statement
from fibrefit.discovery.search.effect_sizes import share_of_gap
from fibrefit.fitting.advice import ForceAlone
from fibrefit.fitting.checks import BARS, CHECKS, CONVERGED, bars_too_small, converged, explained_otherwise
from fibrefit.fitting.checks import check as judged
from fibrefit.fitting.misstatements import Alternative, Misstated
from fibrefit.fitting.result import Advice, Why
from fibrefit.fitting.values import Weakness
from fibrefit.report.sentences import discovery, fit, minima, posterior, prediction
from fibrefit.sampling.posterior import CHECKS as SAMPLED
from fibrefit.study.summaries.check import Check, status_by
from fibrefit.study.summaries.discovery import Weight

PACKAGE = Path(fit.__file__).resolve().parents[2]
MADE_IN = {
    "problem": fit.SENTENCES,
    "workflow/sampling": posterior.SENTENCES,
}


def constants(tree: ast.Module) -> dict[str, Any]:
    """Constants of a module by their names."""
    return {
        node.targets[0].id: node.value.value
        for node in tree.body
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name)
        if isinstance(node.value, ast.Constant)
    }


def identifiers(folder: str, kind: str = "Check") -> set[str]:
    """What checks, or another kind, made in a folder are identified by; names of constants stand for their values."""
    found: set[str] = set()
    shared = constants(ast.parse((PACKAGE / "study/summaries/check.py").read_text(encoding="utf-8")))
    for file in sorted((PACKAGE / folder).rglob("*.py")):
        tree = ast.parse(file.read_text(encoding="utf-8"))
        known = shared | constants(tree)
        for node in ast.walk(tree):
            if isinstance(node, ast.Call) and ast.unparse(node.func) == kind:
                first = node.args[0] if node.args and kind != "Check" else None
                either = (first.body, first.orelse) if isinstance(first, ast.IfExp) else (first,)
                found |= {one.value for one in either if isinstance(one, ast.Constant)}
                for word in node.keywords:
                    if word.arg == "identifier" and isinstance(word.value, ast.Constant | ast.Name):
                        of = word.value
                        found.add(of.value if isinstance(of, ast.Constant) else known[of.id])
    return found


def calls(file: str, name: str) -> list[Any]:
    tree = ast.parse((PACKAGE / file).read_text(encoding="utf-8"))
    return [node for node in ast.walk(tree) if isinstance(node, ast.Call) and ast.unparse(node.func) == name]


@pytest.mark.parametrize("folder", MADE_IN)
def test_every_check_has_a_sentence(folder: str) -> None:
    made = identifiers(folder)
    assert made
    assert made <= set(MADE_IN[folder])


def test_every_check_of_the_table_has_a_sentence() -> None:
    assert {row.identifier for row in CHECKS} - {"{}" + fit.ERROR_OF_INPUT} == set(fit.SENTENCES)
    assert set(SAMPLED) <= set(posterior.SENTENCES)


def test_every_statement_has_a_sentence_and_every_sentence_a_statement() -> None:
    made = identifiers("discovery", "Statement") | identifiers("discovery", "Alarm")
    assert made == set(discovery.SENTENCES)
    assert identifiers("sampling", "Statement") == set(posterior.REMARKS)
    parts = {node.args[0].value for node in calls("discovery/conclusion.py", "parts.take")}
    rounds = {node.args[0].value for node in calls("discovery/forward_selection.py", "at.took")}
    assert {*parts, *rounds, "further", "final_fit"} == set(discovery.UNDONE)


def test_a_channel_is_named_by_the_identifier() -> None:
    error = Check(
        name="the drive is as measured", passed=False, statistic=1.3, threshold=1.15, identifier="drive_error"
    )
    assert fit.fit_sentence(error).startswith("The error of the drive would have to be 1.3 times its noise")
    off = Check(
        name="the force is as predicted", passed=False, statistic=2.0, threshold=1.2, identifier="force_predicted"
    )
    assert prediction.prediction_sentence(off).startswith("The force differs from its prediction by 2 times")


def test_a_summary_has_the_numbers_of_its_check() -> None:
    check = Check(
        name="it holds",
        passed=False,
        statistic=2.0,
        threshold=1.0,
        unit="N",
        fatal=True,
        identifier="bounds",
        quantity="what",
        about="model",
        facts={"parameters": ("damping",), "by_chance": ()},
    )
    (found,) = fit.fit_checks((check,))
    assert (found.statistic, found.threshold, found.unit, found.fatal) == (2.0, 1.0, "N", True)
    assert (found.identifier, found.quantity, found.about) == ("bounds", "what", "model")
    assert found.says.startswith("damping stopped at the bound")


def test_every_advice_and_every_reason_has_a_sentence() -> None:
    asked = identifiers("fitting", "Advice")
    assert asked == {*fit.ADVICE, "force_alone", "further_record", "correct", "widen", "lone_samples", "slack_zero"}
    assert identifiers("fitting", "Why") - {"gls", "loses_less", "louder", "not_noise"} == set(fit.NO_GLS)


def test_what_has_to_be_settled_first_is_advised() -> None:
    found = Alternative("study.lift", -1e-3, "m", "damping", "N s/m", 20.0, 8.0, 2.5)
    said = fit.advice_sentence(Advice("correct", {"alternative": found}))
    assert said == (
        "Look at what the study states: a lift 1 mm smaller than stated would explain the records to their noise. "
        "First measure the lift; correct it if it is so, and fit again."
    )
    weight = Misstated("study.weight_mass", -0.096, "-")
    alike = Alternative("sensor.force_gain", 0.904, "-", "damping", "N s/m", 14.0, 12.0, 1.2, (weight,))
    said = fit.advice_sentence(Advice("correct", {"alternative": alike}))
    assert said == (
        "Look at what the study states: a force that is read 0.904 times as large as it is, or a mass 9.6 % smaller "
        "than stated would explain the records to their noise. The records do not tell these apart, and the values "
        "hang on which it is: check the calibration of the force with a known load; weigh the weight with all that "
        "moves with it. Correct only what turns out to be wrong, and fit again."
    )
    assert fit.fit_sentence(judged("otherwise", explained_otherwise(alike))) == (
        "With a force that is read 0.904 times as large as it is (sensor.force_gain), or a mass 9.6 % smaller than "
        "stated (study.weight_mass), the model would leave nothing but noise, and the damping would be 12 N s/m in "
        "place of 14 N s/m, with the first of them: look at what the study states."
    )
    said = fit.advice_sentence(Advice("widen", {"parameters": ("damping",)}))
    assert said.startswith("Widen the bound of damping under [parameters] if it was a guess")


def test_numbers_are_told_so_that_they_can_be_compared() -> None:
    assert minima.beyond(0.1048, 0.1) == "0.105"
    assert minima.beyond(0.3, 0.1) == "0.3"
    weak = Weakness(("damping",), "vague", share=1e20)
    assert fit.weakness_sentence(weak) == "damping is hardly visible: its error is far larger than its value."
    check = Check(
        name="x", passed=False, statistic=1e-7, threshold=0.05, identifier="hausman",
        facts={"worst": (("lift[../May/drop 10mm.csv]", 3.3), ("damping", 2.0))},
    )  # fmt: skip
    assert '(lift of "drop 10mm" by 3.3, damping by 2 standard errors' in fit.hausman_sentence(check)


def test_an_estimate_that_stands_though_its_residuals_are_not_noise_says_so() -> None:
    found = fit.estimator_sentence(Why("loses_less", failed=("residual size",)))
    assert found.startswith("Generalised least squares (GLS): records differ, and values that all of them share lose")
    assert found.endswith("Residuals are not noise alone (failed: residual size): error bars are too small.")
    # Its error bars are doubted where all checks are, and nowhere else.
    found_small = bars_too_small(Why("loses_less", failed=("residual size",)))
    assert found_small is not None
    (check,) = fit.fit_checks((judged(BARS, found_small),))
    assert status_by([check]) == "suspect"
    assert "not noise alone (failed: residual size): they are too small" in check.says
    assert not any(bars_too_small(Why(other, failed=("residual size",))) for other in ("gls", "louder", "not_noise"))
    louder = fit.estimator_sentence(Why("louder", failed=("residual size",)))
    assert "the structure of noise, which is louder than at rest (failed: residual size)" in louder


def test_a_search_that_did_not_quite_arrive_says_nothing_of_the_noise() -> None:
    arrived = judged(CONVERGED, converged(0.2, True, rough=True)).quantity
    set_aside = fit.estimator_sentence(Why("not_noise", failed=(arrived,)))
    assert set_aside.endswith("(GLS) was set aside. Its search did not quite come to its end.")
    both = fit.estimator_sentence(Why("not_noise", failed=(arrived, "residual size")))
    assert "what it leaves is not noise alone (failed: residual size). Its search did not quite" in both
    own = fit.estimator_sentence(Why("loses_less", failed=(arrived,)))
    assert own.endswith("values that all of them share lose bounces. Its search did not quite come to its end.")
    # Nothing says that its error bars are too small.
    assert bars_too_small(Why("loses_less", failed=(arrived,))) is None


def test_the_load_at_rest_is_that_of_the_stated_mass() -> None:
    found = ForceAlone((("stiffness", 3e3, "1/s^2", 0.004),), 30.4)
    said = fit.advice_sentence(Advice("force_alone", {"determined": found}))
    assert said == (
        "Force alone determines stiffness over mass, 3000 1/s^2 within 0.4 %: stiffness, damping and friction "
        "themselves are as sure as the mass that is stated, by which the load at rest is 30.4 N."
    )


def test_a_prior_that_a_fit_leaves_out_is_told() -> None:
    assert fit.prior_not_weighed("damping", False) == (
        "This fit does not weigh the prior of damping: each record has a value of its own (shared = false). State "
        "bounds, or share the value; fibrefit sample weighs it."
    )
    assert "it says nothing but limits. State bounds where" in fit.prior_not_weighed("damping", True)


@pytest.mark.parametrize(
    ("chance", "said"),
    [
        (3.04e-5, "; by chance the best of all candidates reaches it with a probability of 3e-05 at the most)."),
        (0.0, "; by chance the best of all candidates reaches it with a probability of 1e-12 at the most)."),
        (None, "threshold 5)."),
    ],
)
def test_the_probability_of_a_false_alarm_stands_beside_every_name(chance: float | None, said: str) -> None:
    facts = {"effects": "fibre.mass", "gaps": (1.2, 1.0), "gain": 12.0, "threshold": 5.0, "chance": chance}
    assert discovery.discovery_sentence(Statement("added", facts | {"changes": ()})).endswith(said)


@pytest.mark.parametrize(
    ("gaps", "said"),
    [
        ((1.2, 1.0), "falls from 1.2 to 1 "),
        ((0.98, 1.03), "rises from 0.98 to 1.03 "),
        ((0.98, 0.9801), "stays at 0.98 "),
    ],
)
def test_a_round_says_where_the_gap_went(gaps: tuple[float, float], said: str) -> None:
    facts = {"effects": "fibre.mass", "gaps": gaps, "gain": 12.0, "threshold": 5.0, "chance": None, "changes": ()}
    assert f"the normalised residual RMS {said}(logarithm" in discovery.discovery_sentence(Statement("added", facts))


@pytest.mark.parametrize(("cut", "known"), [(True, "was tried"), (False, "is known of")])
def test_a_search_that_was_cut_short_does_not_speak_of_all_that_is_known(cut: bool, known: str) -> None:
    said = discovery.discovery_sentence(Statement("unknown", {"lies": Statement("no_place", {}), "cut": cut}))
    assert said.startswith(f"nothing that {known}; no channel exceeds its noise")


@pytest.mark.parametrize(
    ("share", "said"),
    [
        (0.25, "a makes up 4 % of the force and accounts for 25 % of the gap; its strength"),
        (
            None,
            "a makes up 4 % of the force and does not show in the gap, which was that of noise without it; its",
        ),
    ],
)
def test_an_effect_that_does_not_show_in_the_gap_accounts_for_none_of_it(share: float | None, said: str) -> None:
    one = Weight(effect="a", share_of_signal=0.04, signal="force", share_of_gap=share, standard_errors=50.0)
    assert discovery.worded_weight(one).says.startswith(said)


@pytest.mark.parametrize(("beyond", "share"), [(50.0, 0.4), (10.0, 1.0), (0.0, None), (-30.0, None)])
def test_of_no_gap_nothing_is_a_share(beyond: float, share: float | None) -> None:
    assert share_of_gap(beyond, 20.0) == share
