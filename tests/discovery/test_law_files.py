"""A law that was composed: written beside a result, used by its study, and not the law of an earlier result."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest

from fibrefit.core.errors import StudyError
from fibrefit.discovery.curves.probes import FrictionOfPosition
from fibrefit.discovery.laws.forms import FORMS, FittedForm
from fibrefit.discovery.laws.source import Composed, composed, effect_of_law, start_of_law
from fibrefit.discovery.laws.told import told_by_fit
from fibrefit.discovery.model.finding import Finding
from fibrefit.discovery.model.law import LAWS, ProposedLaw
from fibrefit.problem.task import Task
from fibrefit.report.discovery import discovery_report
from fibrefit.report.page.discovery import _law
from fibrefit.store import read_summary
from fibrefit.study import load_study
from fibrefit.study.summaries.discovery import DiscoverySummary, LawParameter, OtherLaw, ProposedLawSummary
from fibrefit.workflow.discovery.discover import Discovery
from fibrefit.workflow.prepare import model_of
from tests.discovery.made import FINDINGS, identified

Make = Callable[..., Discovery]
KNOTS = np.linspace(-0.02, 0.01, 40)


@pytest.fixture(autouse=True)
def undrawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave out the figures, which take most of the time."""
    monkeypatch.setattr(Discovery, "plot", lambda self: {})


def law_over(knots: np.ndarray) -> Composed:
    """A friction that varies as a sine of the position."""
    form = next(form for form in FORMS if form.name == "sine")
    return composed(FrictionOfPosition, FittedForm(form, (1.0, 0.012, 0.5), 0.0), knots)


def with_law(task: Task, law: Composed) -> Finding:
    """An unexplained gap for which a law was composed."""
    effect, values = effect_of_law(law), start_of_law(law)
    terms = law.fitted.form.quantities
    parameters = {
        term.name: LawParameter(symbol=term.symbol, value=value, std_error=0.1, unit="N")
        for term, value in zip(terms, values.values(), strict=True)
    }
    summary = ProposedLawSummary(
        name=law.name,
        file=f"{LAWS}/{law.file}",
        effect=f"{LAWS}/{law.file}:{law.title}",
        says=law.says,
        port="guide.friction",
        variables=("position",),
        variable_units=("m",),
        valid_range=(float(KNOTS[0]), float(KNOTS[-1])),
        form="sine",
        expression=law.expression,
        parameters=parameters,
        evidence=50.0,
        gap_before=1.3,
        gap_after=1.02,
        gap_left_out_before=1.4,
        gap_left_out=1.1,
        elpd_left_out=60.0,
        runners_up=(OtherLaw(name="guide.other", says="Another.", evidence=-9.0),),
    )
    after = identified(task, (effect,))
    told = told_by_fit(
        ProposedLaw(summary, law.file, law.source, law.probe.says, lambda values: np.zeros(40)), law.name, after
    )
    return replace(FINDINGS["unexplained"](task), added=(), after=after, proposed_law=told)


def test_the_study_of_a_result_holds_the_law_and_the_values_that_are_told(
    task: Task, discovery: Make, elsewhere: Path
) -> None:
    law = law_over(KNOTS)
    made = replace(discovery("unexplained"), finding=with_law(task, law))
    out = made.save(elsewhere / "out")
    again = load_study(out / "study.toml")
    assert [effect.name for effect in model_of(again).effects] == [law.name]
    assert list(again.model.laws) == [f"{LAWS}/{law.file}"]
    summary = read_summary(out)
    assert isinstance(summary, DiscoverySummary)
    assert summary.proposed_law is not None
    assert summary.verdict == "unexplained"
    settings = again.settings({p.name: p for p in model_of(again).parameters})
    told = {f"{law.name}.{name}": one.value for name, one in summary.proposed_law.parameters.items()}
    assert told == {name: settings[name].initial for name in told}
    assert set(told) == set(start_of_law(law))
    said = discovery_report(summary)
    assert law.expression in " ".join(said.split())
    assert "from -0.02 to 0.01 m" in " ".join(said.split())
    assert (
        "records predicted from the others leave 1.1, without it 1.4, and are 60 nats more probable with it"
        in " ".join(said.split())
    )
    unheld = summary.proposed_law.model_copy(update={"gap_left_out": None})
    says = discovery_report(summary.model_copy(update={"proposed_law": unheld}))
    assert "; it was not held against records left out" in " ".join(says.split())
    assert max(map(len, said.splitlines())) <= 80
    block = _law(summary)
    assert block is not None
    assert block.note.startswith(law.expression)
    assert [row[1] for row in block.rows] == [term.name for term in law.fitted.form.quantities]
    assert "put it in a Python file" not in said


def test_a_law_that_was_changed_after_the_result_was_written_is_refused(
    task: Task, discovery: Make, elsewhere: Path
) -> None:
    law = law_over(KNOTS)
    out = replace(discovery("unexplained"), finding=with_law(task, law)).save(elsewhere / "out")
    file = out / LAWS / law.file
    file.write_text(file.read_text() + "# another one\n")
    with pytest.raises(StudyError, match="has changed"):
        load_study(out / "study.toml")


def test_a_result_in_the_place_of_another_has_the_law_it_says(task: Task, discovery: Make, elsewhere: Path) -> None:
    """The same form over another range is another file of the same name."""
    first, second = law_over(KNOTS), law_over(KNOTS - 0.003)
    assert first.file == second.file
    assert first.source != second.source
    for law in (first, second):
        made = replace(discovery("unexplained"), finding=with_law(task, law))
        out = made.save(elsewhere / "out", force=True)
        (effect,) = model_of(load_study(out / "study.toml")).effects
        one = cast(Any, effect)(*start_of_law(law).values())
        np.testing.assert_allclose(
            one._at(KNOTS), cast(Any, effect_of_law(law))(*start_of_law(law).values())._at(KNOTS)
        )


def test_a_result_that_was_not_saved_has_the_law_too(task: Task, discovery: Make) -> None:
    law = law_over(KNOTS)
    made = replace(discovery("unexplained"), finding=with_law(task, law))
    assert [effect.name for effect in model_of(made.final).effects] == [law.name]
    settings = made.final.settings({p.name: p for p in model_of(made.final).parameters})
    assert settings[f"{law.name}.period"].initial == made.parameters[f"{law.name}.period"].value
