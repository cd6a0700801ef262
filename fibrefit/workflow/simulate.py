"""``simulate``: what the model of a study says of each record's conditions."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import jax.numpy as jnp
import numpy as np

from fibrefit.core.formatting import Card, Shown
from fibrefit.core.paths import record_stems, write_whole
from fibrefit.problem import Motion, Task
from fibrefit.store import ResultDirectory
from fibrefit.store.hdf5 import write_result
from fibrefit.store.summary import provenance
from fibrefit.study import Study, as_study
from fibrefit.study.summaries.part import Variable
from fibrefit.workflow.prediction.held import with_nuisances_found
from fibrefit.workflow.prepare import is_planned, task_of
from fibrefit.workflow.saved import Saved

if TYPE_CHECKING:
    import pandas as pd

    from fibrefit.plots.figures import Figures

PRINTED = {
    "force": ("force [N]", 1.0),
    "position": ("position [mm]", 1e3),
    "velocity": ("velocity [mm/s]", 1e3),
    "drive": ("drive [mm]", 1e3),
    "angle": ("angle [rad]", 1.0),
    "force_1": ("force_1 [N]", 1.0),
    "force_2": ("force_2 [N]", 1.0),
}
"""Header of each channel as it is written, and factor from SI."""
SCHEMA = "fibrefit/simulation/1"
"""Of ``result.h5``, from which figures are drawn again."""


@dataclass(frozen=True, repr=False)
class Simulation(Shown, Saved):
    """Simulated records.

    Parameters
    ----------
    study : Study
    task : Task
    readings : dict of channel to (n_record, n_time) in SI units
    """

    study: Study
    task: Task
    readings: dict[str, np.ndarray]

    def groups(self) -> dict[str, dict[str, Variable]]:
        """What was measured, and what the model says, by group and name; NaN beyond the end of a record."""
        traces, units = self.task.traces, self.task.units
        names, grid = np.array([trace.name for trace in traces], dtype=object), ("record", "sample")
        size = max(len(trace.times) for trace in traces)

        def rows(each: list[np.ndarray], unit: str) -> Variable:
            return Variable(np.stack([_filled(one, size) for one in each]), grid, unit)

        observed = {name: rows([trace.channels[name] for trace in traces], units[name]) for name in self.readings}
        simulated = {
            name: rows([row[: len(trace.times)] for row, trace in zip(values, traces, strict=True)], units[name])
            for name, values in self.readings.items()
        }
        shared = {"record": Variable(names, ("record",)), "time": rows([trace.times for trace in traces], "s")}
        return {"observed_data": shared | observed, "predictions": simulated}

    def table(self, record: int) -> tuple[list[str], np.ndarray]:
        """One record as it is written.

        Parameters
        ----------
        record : int
            Place among the records of the study.

        Returns
        -------
        headers : list of str
            With their units.
        columns : (n_time, n_column) float array
            In those units.

        Examples
        --------
        >>> headers, columns = simulation.table(0)
        >>> headers, columns.shape[1]
        (['time [s]', 'force [N]', 'position [mm]'], 3)
        """
        trace = self.task.traces[record]
        headers, columns = ["time [s]"], [trace.times]
        for channel, values in self.readings.items():
            header, factor = PRINTED[channel]
            headers.append(header)
            columns.append(values[record, : len(trace.times)] * factor)
        inputs = self.task.problem.observations.experiment.inputs
        rig = self.task.problem.model.rig
        for name in (name for name in rig.inputs if name not in rig.derived):
            header, factor = PRINTED[name]
            headers.append(header)
            columns.append(np.asarray(inputs[name].values)[record, : len(trace.times)] * factor)
        return headers, np.column_stack(columns)

    def to_dataframe(self) -> pd.DataFrame:
        """All records below one another, as they are written.

        Returns
        -------
        pandas.DataFrame
            ``record``, ``time [s]`` and the channels, with their units in the headers.
        """
        import pandas as pd

        tables = {trace.name: self.table(r) for r, trace in enumerate(self.task.traces)}
        frames = {name: pd.DataFrame(columns, columns=headers) for name, (headers, columns) in tables.items()}
        return pd.concat(frames, names=["record"]).reset_index("record").reset_index(drop=True)

    def _card(self) -> Card:
        rows = [(trace.name, str(len(trace.times))) for trace in self.task.traces]
        line = f"{len(rows)} record{'s' * (len(rows) != 1)}: {', '.join(self.readings)}"
        return Card(f'Simulation of "{self.study.name}"', line, ("record", "samples"), rows)

    def plot(self) -> Figures:
        """One figure a record."""
        from fibrefit.plots.simulated import simulation_figures

        return simulation_figures(self.groups())

    def write_data(self, directory: ResultDirectory) -> None:
        """Write ``simulated/<record>.csv``, and ``result.h5`` with what was measured beside it."""
        for r, stem in enumerate(record_stems([trace.name for trace in self.task.traces])):
            headers, columns = self.table(r)
            # A logger that has run for days counts times of which nine digits would be alike.
            rows = [",".join([f"{time:.15g}", *(f"{value:.9g}" for value in row)]) for time, *row in columns]
            path = directory.path / "simulated" / f"{stem}.csv"
            path.parent.mkdir(parents=True, exist_ok=True)
            write_whole(path, "\n".join([",".join(headers), *rows]) + "\n")
        origin = provenance(self.study, self.study.input_files())
        write_result(directory.path / "result.h5", SCHEMA, self.groups(), origin)


def _filled(values: np.ndarray, size: int) -> np.ndarray:
    return np.append(values, np.full(size - len(values), np.nan))


def simulate_study(study: Study | str | Path) -> Simulation:
    """Simulate every record of a study at the study's initial values.

    Parameters without an `initial` take the value the records suggest. What belongs to a record alone, its zero, its
    release and the error of a measured input, is found from its data where it has any and the study does not state it.

    Parameters
    ----------
    study : Study, str or pathlib.Path
        A path is that of a study file, or of a folder with a ``study.toml``.

    Returns
    -------
    Simulation
        With ``readings``, ``table(record)``, ``plot()`` and ``save(folder)``.

    Raises
    ------
    DataError
        If a record is not understood.
    StudyError
        If the study and the model do not fit together.

    Examples
    --------
    >>> study = fibrefit.load_study(fibrefit.example("drop_series"), ['parameters.stiffness.initial="20 kN/m"'])
    >>> fibrefit.simulate(study).readings["force"].shape[0]
    5
    """
    study = as_study(study)
    task = task_of(study)
    if not is_planned(study):
        task = with_nuisances_found(task).task
    return Simulation(study, task, Motion.of(task.problem, jnp.asarray(task.start)).readings)
