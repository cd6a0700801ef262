"""What every result on disk has in common: how it is saved, and its first four parts."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fibrefit.core.paths import FIGURES, requested_formats
from fibrefit.store import ResultDirectory, Run
from fibrefit.store.summary import write_summary
from fibrefit.study import Study
from fibrefit.workflow.outcome.result import AnyResult

if TYPE_CHECKING:
    from fibrefit.plots.figures import Figures
    from fibrefit.study.summaries.part import Variable


class Saved(ABC):
    """A result that was just found, or a simulation: it can be saved."""

    study: Study

    @abstractmethod
    def plot(self) -> Figures:
        """Its figures by name."""

    def first_figures(self) -> Figures:
        """Figures that are written where none were requested; the others are drawn when they are wanted."""
        return self.plot()

    def inputs(self) -> list[Path]:
        """Files it rests on: none of them may lie in the folder that it is saved to."""
        return self.study.input_files()

    @abstractmethod
    def write_data(self, directory: ResultDirectory) -> None:
        """Write all files but the figures into a folder that is being made."""

    def write(self, directory: ResultDirectory, stop: Callable[[], bool] = lambda: False) -> None:
        """Write all files into a folder that is being made."""
        self.write_data(directory)
        write_figures(directory, self.first_figures if FIGURES.get() is None else self.plot, stop)

    def save(self, out: Path | str, *, force: bool = False, stop: Callable[[], bool] = lambda: False) -> Path:
        """Write all files of the result into a folder, whole or not at all.

        Parameters
        ----------
        out : pathlib.Path or str
            Folder of the result.
        force : bool
            Replace an earlier result there.
        stop : callable
            Asked before each figure whether to leave out the rest of them.

        Returns
        -------
        pathlib.Path
            The folder.

        Raises
        ------
        UsageError
            If the folder exists and may not be replaced, or holds a file that the result rests on.

        Examples
        --------
        >>> fibrefit.load_result(result.save("results/kept")).to_dataframe().equals(result.to_dataframe())
        True
        """
        with ResultDirectory(Path(out), force=force, run=Run(tuple(self.inputs()))) as directory:
            self.write(directory, stop)
        return directory.out


class FoundResult(AnyResult, Saved):
    """A result that was just found: all that is kept of it is its summary, its arrays and the study to go on with."""

    def write_data(self, directory: ResultDirectory) -> None:
        """Write ``summary.json`` and, where there are arrays, ``result.h5`` and ``study.toml``."""
        if groups := self.groups():
            write_parts(directory, self.summary(), groups, self.study)
        else:
            write_summary(directory.path, self.summary())


def write_parts(
    directory: ResultDirectory, summary: Any, groups: Mapping[str, Mapping[str, Variable]], study: Study
) -> None:
    """Write ``summary.json``, ``result.h5`` and ``study.toml``.

    Parameters
    ----------
    summary : Part
        With its provenance.
    groups : mapping of group to mapping of name to Variable
    study : Study
        The one to go on with.
    """
    from fibrefit.store.hdf5 import write_result

    write_summary(directory.path, summary)
    write_result(directory.path / "result.h5", summary.schema_name, groups, summary.provenance)
    resolved = study.resolved_toml(directory.out, directory.path, as_written=True)
    (directory.path / "study.toml").write_text(resolved, encoding="utf-8")


def write_figures(
    directory: ResultDirectory, figures: Callable[[], Figures], stop: Callable[[], bool] = lambda: False
) -> None:
    """Write ``figures/``, unless none are requested, or it is stopped before they, or the next of them, are drawn."""
    if stop() or not requested_formats():
        return
    from fibrefit.plots.save import save_figures

    save_figures(figures(), directory.path / "figures", stop)
