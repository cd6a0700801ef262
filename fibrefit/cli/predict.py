"""``fibrefit predict``: values that were found, on records they were not found from."""

from __future__ import annotations

from pathlib import Path

import click

from fibrefit.cli.options import Request, check_trust_of_result, study_command
from fibrefit.cli.progress import shown_progress
from fibrefit.cli.terminal import NOT_TRUSTED, Terminal


@study_command("predict")
@click.argument("result", type=click.Path(path_type=Path))
def command(terminal: Terminal, request: Request, result: Path) -> int:
    """Predict the records of STUDY with the model and the values of RESULT, the folder of an earlier result.

    Zero and start of each record, and the error of a measured input within its noise, are fitted to it, nothing else.
    Exit code 5 where the values do not hold or the prediction cannot be trusted.
    """
    check_trust_of_result(result)
    from fibrefit.core.paths import sha256_of
    from fibrefit.store.summary import files_of_result
    from fibrefit.workflow.prediction.predict import predict_study

    files = files_of_result(result)
    place = request.reserved("predict", *map(sha256_of, files), files=files)
    with place as folder, shown_progress(terminal) as progress:
        prediction = predict_study(result, request.study, progress=progress)
        progress("drawing and writing", None)
        prediction.save(folder, force=request.force)
    summary = prediction.summary()
    terminal.answer(prediction.report(), summary.model_dump(mode="json", by_alias=True))
    terminal.wrote(folder)
    return NOT_TRUSTED if summary.status != "ok" else 0
