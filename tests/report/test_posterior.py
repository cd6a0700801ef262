"""The report of a posterior fits the terminal, and says what may be believed and what to do."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

from fibrefit.fitting.checks import CHECKS, CONVERGED, EXPLAINED
from fibrefit.report.layout import WIDTH
from fibrefit.report.posterior import REMEDIES, posterior_advice, posterior_report
from fibrefit.sampling.posterior import CHECKS as SAMPLED
from fibrefit.study.summaries import results as s
from fibrefit.study.summaries.check import Check
from fibrefit.workflow.fit_files import DETERMINED
from tests.study.test_summaries import EXAMPLES

PLAIN: s.PosteriorSummary = EXAMPLES["fibrefit/posterior/1"]  # type: ignore[assignment]
LONG = "guide.asymmetric_viscous_friction.viscous_asymmetry"
FAILED = Check(
    name="the residuals are noise",
    passed=False,
    says="The normalised residual RMS of force is 2.03, expected 1.",
    identifier="residual_size",
    quantity="residual size",
)
PACKAGE = Path(__file__).resolve().parents[2] / "fibrefit"


def known(mean: float, sd: float, unit: str, share: float = 0.001) -> s.PosteriorParameter:
    ends = (mean - 2.0 * sd, mean + 2.0 * sd)
    return s.PosteriorParameter(
        mean=mean, sd=sd, median=mean, interval=ends, unit=unit, r_hat=1.003, ess_bulk=900.0, ess_tail=800.0,
        prior="half-normal, sd 3 N", prior_share=share,
    )  # fmt: skip


def suspect() -> s.PosteriorSummary:
    return PLAIN.model_copy(
        update={
            "study": "a name that goes on " * 10,
            "status": "suspect",
            "effects": ("guide.asymmetric_viscous_friction",),
            "parameters": {
                "stiffness": known(11150.6, 4.2, "N/m"),
                "friction": known(2.5, 0.9, "N", share=0.6),
                LONG: known(0.0, 0.2, "-"),
            },
            "records": {"a.csv": {"release": known(0.2, 1e-5, "s")}},
            "steps": 90,
            "warm_up": 30,
            "ended": "budget",
            "acceptance": 0.45,
            "likelihood_says": "Likelihood: white noise, as requested.",
            "covered": {"force": 0.893, "position": 0.9},
            "log_evidence": s.Measure(value=-12.3, error=0.04),
            "cross_validation": s.CrossValidationSummary(
                total=s.Measure(value=-10.0, error=2.0), blocks=30, unsure=2, effective_parameters=4.2
            ),
            "compared": tuple(
                s.ComparedModel(
                    result="results/other",
                    study="drops",
                    effects=effects,
                    elpd=s.Measure(value=value, error=1.0),
                    log_evidence=None if not effects else s.Measure(value=3.0, error=0.1),
                )
                for effects, value in (((), 5.0), ((LONG,), -5.0), (("guide.quadratic_drag",), 0.5))
            ),
            "checks": (*PLAIN.checks, FAILED),
            "advice": posterior_advice((FAILED,), False, False),
            "remarks": ("Something worth a word. " * 6,),
        }
    )


@pytest.mark.parametrize("summary", [PLAIN, suspect()], ids=["plain", "suspect"])
def test_it_fits_80_columns_of_ascii(summary: s.PosteriorSummary) -> None:
    text = posterior_report(summary)
    assert max(map(len, text.splitlines())) <= WIDTH
    assert text.isascii()


def test_it_says_what_matters() -> None:
    text = " ".join(posterior_report(suspect()).split())
    for part in (
        "SUSPECT",
        "11.1506 0.0042 kN/m",
        "guide.asymmetric_viscous_friction. viscous_asymmetry 0.00 0.20",
        "The prior of friction matters: half-normal, sd 3 N; posterior / prior width 60 %.",
        "Each record has its own release: see summary.json.",
        "95 % equal-tailed credible intervals.",
        "walkers, 90 steps (warm-up of 30 discarded).",
        "Stopped by the budget before convergence; max. R-hat 1.0030, min. bulk/tail ESS 800; acceptance 45 %.",
        "89.3 % of force, 90.0 % of position",
        "PSIS-LOO over 30 time blocks, each left out in turn: elpd_loo = -10.0 +/- 2.0, p_loo = 4.2; Pareto k > 0.7 in "
        "2 blocks.",
        "base model, results/other +5.0 +/- 1.0 this one",
        "-5.0 +/- 1.0 +3.0 the other",
        "guide.quadratic_drag +0.5 +/- 1.0 +3.0 alike",
        "FAILED residual size: The normalised residual RMS of force is 2.03, expected 1.",
        "Terms: fibrefit glossary.",
        "Run fibrefit discover",
        "Go on with --resume",
    ):
        assert part in text, part


@pytest.mark.parametrize(
    ("share", "said"),
    [
        (0.5, "The prior of release[a.csv] matters: half-normal, sd 3 N; posterior / prior width 50 %."),
        (0.02, "Prior influence is negligible: posterior / prior width (2 % or less for all)."),
        (None, "No prior has a width that could be compared with the posterior's."),
    ],
)
def test_what_is_said_of_priors_holds_for_values_of_records_too(share: float | None, said: str) -> None:
    alone = {"stiffness": known(11150.6, 4.2, "N/m").model_copy(update={"prior_share": share and 0.01})}
    records = {"a.csv": {"release": known(0.2, 1e-5, "s").model_copy(update={"prior_share": share})}}
    text = posterior_report(PLAIN.model_copy(update={"parameters": alone, "records": records}))
    assert said in " ".join(text.split())


def test_a_good_posterior_is_told_of_the_cross_check_and_of_nothing_else() -> None:
    assert posterior_advice(PLAIN.checks, True, False) == ("Where much depends on it, cross-check with NUTS: --nuts.",)
    assert posterior_advice(PLAIN.checks, True, True) == ()


def test_every_remedy_belongs_to_a_check() -> None:
    """Identifiers stay where wording changes; here it shows when one is renamed in one place only."""
    tables = {*SAMPLED, *(row.identifier for row in CHECKS)}
    known = tables.union(*(identifiers(path) for path in PACKAGE.rglob("*.py")))
    assert {*REMEDIES, DETERMINED, CONVERGED, EXPLAINED} <= known
    assert {"hausman", "residual_size", "nuts"} <= known
    assert "no_such_check" not in known


def identifiers(path: Path) -> set[str]:
    """What stands behind ``identifier`` wherever a file makes a check: a text, or a constant that is one."""
    text = path.read_text(encoding="utf-8")
    if "identifier" not in text:
        return set()
    tree = ast.parse(text)
    constants = {
        node.targets[0].id: node.value.value
        for node in tree.body
        if isinstance(node, ast.Assign)
        and isinstance(node.targets[0], ast.Name)
        and isinstance(node.value, ast.Constant)
    }
    found = [node.value for node in ast.walk(tree) if isinstance(node, ast.keyword) and node.arg == "identifier"]
    for node in ast.walk(tree):
        if isinstance(node, ast.Dict):
            pairs = zip(node.keys, node.values, strict=True)
            found += [value for key, value in pairs if isinstance(key, ast.Constant) and key.value == "identifier"]
    texts = [constants.get(one.id) if isinstance(one, ast.Name) else getattr(one, "value", None) for one in found]
    return {text for text in texts if isinstance(text, str)}


def test_every_check_has_an_identifier_and_names_its_quantity() -> None:
    made = 0
    for path in sorted(PACKAGE.rglob("*.py")):
        text = path.read_text(encoding="utf-8")
        for node in ast.walk(ast.parse(text)) if "Check(" in text else ():
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "Check":
                said, made = {keyword.arg for keyword in node.keywords}, made + 1
                assert None in said or {"identifier", "quantity"} <= said, f"{path} line {node.lineno}"
    assert made > 10
    for identifier, quantity in [(row.identifier, row.quantity) for row in CHECKS] + [
        (identifier, quantity) for identifier, (_, quantity) in SAMPLED.items()
    ]:
        assert identifier
        assert quantity


def test_interval_kind_and_probability_are_stated() -> None:
    half = PLAIN.model_copy(update={"interval_probability": 0.5, "interval_kind": "highest_density"})
    text = posterior_report(half)
    assert "50 % interval" in text
    assert "50 % highest-density credible intervals." in text
