"""``fibrefit simulate``: the model's response to each record's conditions."""

from __future__ import annotations

from fibrefit.cli.options import Request, study_command
from fibrefit.cli.progress import shown_progress
from fibrefit.cli.terminal import Terminal


@study_command("simulate")
def command(terminal: Terminal, request: Request) -> None:
    """Compute the response of the model to the conditions of each record of STUDY, as CSV and pictures.

    Of many records the first have pictures. Parameters take the initial values of the study; those it does not give are
    suggested by the records.
    What belongs to a measured record alone, its zero, its release or start and the error of a measured input, is fitted
    to it where the study does not state it.
    """
    from fibrefit.workflow.simulate import simulate_study

    with request.reserved("simulate") as folder, shown_progress(terminal) as progress:
        progress("simulating", None)
        simulate_study(request.study).save(folder, force=request.force)
    written = sorted(path.relative_to(folder).as_posix() for path in folder.glob("simulated/*.csv"))
    text = "\n".join([f"Simulated {request.study.name}; written to {folder}:", *(f"  {name}" for name in written)])
    terminal.answer(text, {"study": request.study.name, "out": str(folder), "files": written})
