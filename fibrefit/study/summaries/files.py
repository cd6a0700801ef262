"""Every kind of summary file, and reading any of them."""

from __future__ import annotations

import json

from pydantic import ValidationError

from fibrefit.core.errors import DataError, StudyError
from fibrefit.study.summaries.discovery import DiscoverySummary, DistinguishSummary, PlanSummary
from fibrefit.study.summaries.part import Part
from fibrefit.study.summaries.results import FitSummary, PosteriorSummary, PredictionSummary, SweepSummary
from fibrefit.study.summaries.series import BatchSummary, SeriesSummary

#: Model of every summary file, by its schema.
SUMMARIES: dict[str, type[Part]] = {
    model.model_fields["schema_name"].default: model
    for model in (
        FitSummary, DiscoverySummary, PosteriorSummary, PredictionSummary, BatchSummary, SweepSummary,
        DistinguishSummary, PlanSummary, SeriesSummary,
    )
}  # fmt: skip


def summary_of(text: bytes, where: str) -> Part:
    """Summary from the content of its file.

    Parameters
    ----------
    text : bytes
        JSON.
    where : str
        Name of the file, for messages.

    Returns
    -------
    Part
        Of the model its schema names, e.g. `FitSummary`.

    Raises
    ------
    DataError
        If it is not JSON.
    StudyError
        If it does not follow its schema.
    """
    try:
        content = json.loads(text)
    except ValueError as error:
        raise DataError(where, f"not JSON: {error}", "a summary.json of fibrefit") from None
    except RecursionError:
        raise DataError(where, "nested too deeply", "a summary.json of fibrefit") from None
    schema = content.get("schema") if isinstance(content, dict) else None
    model = SUMMARIES.get(schema) if isinstance(schema, str) else None
    if model is None:
        raise StudyError(where, f"schema {json.dumps(schema)}", f"one of {', '.join(SUMMARIES)}")
    try:
        return model.model_validate_json(text, strict=True)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        key = ".".join(map(str, first["loc"]))
        raise StudyError(f"{where}, {key}", first["msg"], f"what {schema} says", "Write the result again.") from None
