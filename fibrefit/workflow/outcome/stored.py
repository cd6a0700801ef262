"""Results read again from disk, of every kind."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fibrefit.core.errors import DataError, UsageError
from fibrefit.core.formatting import Card, Shown
from fibrefit.core.paths import FORMATS, read_plain_file, record_stems, shown_path
from fibrefit.store.csv_text import as_named
from fibrefit.store.summary import LARGEST_SUMMARY, NAME, read_summary
from fibrefit.study.load import load_study
from fibrefit.workflow.outcome.result import AnyResult

if TYPE_CHECKING:
    import pandas as pd

    from fibrefit.plots.figures import Figures
    from fibrefit.study import Study
    from fibrefit.workflow.prediction.predict import Prediction

INSPECTION = "inspection.json"
"""All of an inspection that is kept, but for its text and its pictures."""


@dataclass(frozen=True, repr=False)
class StoredResult(AnyResult):
    """A result on disk, of any command that ends with a ``summary.json``.

    Parameters
    ----------
    folder : pathlib.Path
    """

    folder: Path

    @cached_property
    def _summary(self) -> Any:
        return read_summary(self.folder)

    def summary(self) -> Any:
        """Content of ``summary.json``."""
        return self._summary

    @cached_property
    def _groups(self) -> Mapping[str, Mapping[str, Any]]:
        from fibrefit.store.hdf5 import read_result

        path = self.folder / "result.h5"
        return read_result(path)[0] if path.exists() else {}

    def groups(self) -> Mapping[str, Mapping[str, Any]]:
        """Arrays of ``result.h5``; empty where there is none."""
        return self._groups

    @property
    def kind(self) -> str:
        """``fit``, ``discovery``, ``posterior``, ``batch``, ``sweep``, ..."""
        return self._kind()

    @property
    def parameters(self) -> dict[str, Any]:
        """What all records share, by name: ``value``, ``std_error``, ``interval_95``, ``unit``."""
        return dict(getattr(self.summary(), "parameters", {}))

    @property
    def verdict(self) -> str:
        """Of a discovery, or of a prediction.

        Raises
        ------
        UsageError
            If a result of this kind has none.
        """
        return str(self._of_summary("verdict", "that of discover or predict"))

    @property
    def added(self) -> tuple[str, ...]:
        """Of a discovery the effects that account for what the model lacked.

        Raises
        ------
        UsageError
            If a result of this kind has none.
        """
        return tuple(self._of_summary("added", "those of discover"))

    def _of_summary(self, name: str, whose: str) -> Any:
        if not hasattr(self.summary(), name):
            raise UsageError(f"{name} of a result", f"none in one of kind {self._kind()}", whose, "")
        return getattr(self.summary(), name)

    def predict(self, study: Study | str | Path) -> Prediction:
        """Predict records that the values were not found from, see `fibrefit.predict`.

        Parameters
        ----------
        study : Study, str or pathlib.Path
            Of those records.

        Returns
        -------
        Prediction

        Raises
        ------
        StudyError
            If its rig is of another kind or variant than that of the values, or their model goes by places of records.
        UsageError
            If this result holds no values that can be relied on.
        DataError
            If a record is not understood.

        Examples
        --------
        >>> saved = result.save("results/predicts")
        >>> fibrefit.load_result(saved).predict(fibrefit.example("drop_series") / "holdout").verdict
        'holds'
        """
        from fibrefit.workflow.prediction.predict import predict_study

        return predict_study(self, study)

    @property
    def study(self) -> Study:
        """The study to go on with; of a discovery that of the final model.

        Raises
        ------
        StudyError
            If its records are no longer where they were.
        """
        return load_study(self.folder / "study.toml")

    @property
    def figures(self) -> dict[str, Path]:
        """Pictures by name."""
        return _figures(self.folder)

    def to_dataframe(self) -> pd.DataFrame:
        """As of the result that was saved; of a series with the conditions of ``table.parquet``."""
        if (table := self.folder / "table.parquet").is_file() and self.kind == "series":
            import pandas as pd

            from fibrefit.tables.frames import values_frame

            return values_frame(pd.read_parquet(table))
        return super().to_dataframe()

    def _place(self) -> str:
        return str(self.folder)

    def __fspath__(self) -> str:
        """Its folder: whatever takes a path to a result takes a result that was loaded."""
        return str(self.folder)


@dataclass(frozen=True, repr=False)
class StoredInspection(Shown):
    """An inspection on disk.

    Parameters
    ----------
    folder : pathlib.Path
    """

    folder: Path

    @cached_property
    def _document(self) -> dict[str, Any]:
        path = self.folder / INSPECTION
        content = read_plain_file(path, "what fibrefit has written", DataError, most=LARGEST_SUMMARY)
        try:
            return dict(json.loads(content))
        except (ValueError, RecursionError) as error:
            raise DataError(str(path), f"not JSON: {error}", "what fibrefit has written") from None

    def document(self) -> dict[str, Any]:
        """For a program, as when it was made."""
        return self._document

    def report(self) -> str:
        """In words, as when it was made.

        Raises
        ------
        DataError
            If its text is gone.
        """
        path = self.folder / "inspection.txt"
        content = read_plain_file(path, "what fibrefit has written", DataError, most=LARGEST_SUMMARY)
        return content.decode("utf-8", "replace").rstrip("\n")

    def to_dataframe(self) -> pd.DataFrame:
        """One row a column of a file: header, unit, samples, range, what is masked."""
        from fibrefit.tables.frames import inspection_frame

        return inspection_frame(self._document)

    @property
    def figures(self) -> dict[str, Path]:
        """Pictures by name."""
        return _figures(self.folder)

    def _card(self) -> Card:
        return Card(f"Inspection in {self.folder}", f"files: {len(self._document['files'])}")


@dataclass(frozen=True, repr=False)
class StoredSimulation(Shown):
    """Simulated records on disk.

    Parameters
    ----------
    folder : pathlib.Path
    """

    folder: Path

    @cached_property
    def records(self) -> dict[str, pd.DataFrame]:
        """Samples of each record by its name in the study, in its order, with the units in the headers."""
        import pandas as pd

        files = {path.stem: path for path in sorted((self.folder / "simulated").glob("*.csv"))}
        names = {stem: name for stem, name in self._names.items() if stem in files}
        return {names.get(stem, stem): pd.read_csv(files[stem]) for stem in {**names, **files}}

    @property
    def _names(self) -> dict[str, str]:
        """Names of the records by those of their files, as ``result.h5`` tells them; none where it is gone."""
        from fibrefit.store.hdf5 import read_result

        path = self.folder / "result.h5"
        if not path.exists():
            return {}
        names = [str(name) for name in read_result(path)[0]["observed_data"]["record"].values]
        return dict(zip(record_stems(names), names, strict=True))

    def to_dataframe(self) -> pd.DataFrame:
        """All records below one another, with a column ``record``.

        Raises
        ------
        DataError
            If there are none.
        """
        import pandas as pd

        if not self.records:
            raise DataError(str(self.folder / "simulated"), "no files", "one for each record", "Run it again.")
        return pd.concat(self.records, names=["record"]).reset_index("record").reset_index(drop=True)

    def plot(self) -> Figures:
        """One figure a record, drawn again from ``result.h5``.

        Raises
        ------
        UsageError
            If its ``result.h5`` is gone.
        """
        from fibrefit.workflow.outcome.draw import simulated_figures

        return simulated_figures(self.folder)

    @property
    def figures(self) -> dict[str, Path]:
        """Pictures by name."""
        return _figures(self.folder)

    def _card(self) -> Card:
        rows = [(name, str(len(frame))) for name, frame in self.records.items()]
        number = f"{len(rows)} record{'s' * (len(rows) != 1)}"
        return Card(f"Simulation in {self.folder}", number, ("record", "samples"), rows)


def load_result(path: str | Path) -> StoredResult | StoredInspection | StoredSimulation:
    """Read a result again.

    Parameters
    ----------
    path : str or pathlib.Path
        Folder that a run has written, or its ``summary.json``.

    Returns
    -------
    StoredResult, StoredInspection or StoredSimulation
        Of a result with a summary: ``report()``, ``summary()``, ``parameters``, ``status``, ``to_dataframe()``,
        ``covariance``, ``correlation``, ``residuals``, ``draws``, ``to_datatree()``, ``study``, ``figures``,
        ``plot()``, ``predict(study)``, ``verdict``, ``added``; what a kind does not have raises `UsageError`. Of
        ``inspect``: ``report()``, ``document()``, ``to_dataframe()``. Of ``simulate``: ``records``,
        ``to_dataframe()`` and ``plot()``.

    Raises
    ------
    DataError
        If there is no result.
    StudyError
        If it does not follow its schema.

    Examples
    --------
    >>> out = fibrefit.fit(fibrefit.example("drop_series"), starts=2).save("results/once")
    >>> found = fibrefit.load_result(out)
    >>> found.status, found.kind
    ('ok', 'fit')
    >>> list(found.to_dataframe().columns)
    ['name', 'record', 'value', 'std_error', 'low', 'high', 'unit']
    """
    folder = Path(path)
    folder = folder.parent if os.path.isfile(folder) else folder
    if os.path.exists(folder / NAME):
        result = StoredResult(folder)
        result.summary()
        return result
    if os.path.exists(folder / INSPECTION):
        return StoredInspection(folder)
    if os.path.isdir(folder / "simulated"):
        return StoredSimulation(folder)
    raise DataError(shown_path(path), "no result", f"a folder with {NAME}, {INSPECTION} or simulated/", "")


def read_batch(path: str | Path) -> pd.DataFrame:
    """Table of a batch: one row an item, with its conditions, status, gap, values and errors.

    Parameters
    ----------
    path : str or pathlib.Path
        Folder of the batch, or its ``results.csv``.

    Returns
    -------
    pandas.DataFrame
        Indexed by item, as `Batch.items` names them; headers carry the SI unit, such as ``stiffness [N/m]`` and
        ``stiffness std_error [N/m]``.

    Raises
    ------
    DataError
        If there is no such table, or it is none of a batch.

    Examples
    --------
    >>> drop = fibrefit.example("drop_series") / "holdout"
    >>> table = fibrefit.read_batch(fibrefit.batch(drop, "results/each", starts=2, processes=1).folder)
    >>> table["status"].unique().tolist()
    ['ok']
    """
    from fibrefit.tables.frames import batch_frame

    folder = Path(path)
    table = batch_frame(folder / "results.csv" if os.path.isdir(folder) or not folder.suffix else folder)
    return table.rename(index=as_named)


def _figures(folder: Path) -> dict[str, Path]:
    """Pictures by name; of each the format that comes first among those that can be requested."""
    found = [path for kind in reversed(FORMATS) for path in (folder / "figures").glob(f"*.{kind}")]
    return dict(sorted({path.stem: path for path in found}.items()))
