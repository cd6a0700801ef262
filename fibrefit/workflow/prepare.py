"""What every command does first: read the records of a study, assemble its model, state the problem."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from fibrefit.core.errors import DataError, FibrefitError, Mistakes, StudyError
from fibrefit.core.programs import bound_programs
from fibrefit.laws.catalogue import select_effects
from fibrefit.laws.families import goes_by_place
from fibrefit.laws.law import Effect
from fibrefit.problem import Task, formulate, formulate_planned, refuse_contradictory, stated_numbers, trace_of
from fibrefit.records import Record, joined, read_record, side_by_side
from fibrefit.records.copies import first_copy
from fibrefit.rigs.catalogue import RIGS, rig_of
from fibrefit.rigs.rig import Rig
from fibrefit.simulation.model import Model
from fibrefit.study import Study
from fibrefit.workflow.readings import readings_of


def model_of(study: Study) -> Model:
    """Model of a study: its rig with the effects it names.

    Raises
    ------
    StudyError
        If an effect is unknown or does not suit the rig, or something is stated that its variant makes no use of.
    """
    points = getattr(study.rig, "masses_per_fibre", None)
    rig = _rig(study)
    _refuse_unused_noise(study, rig)
    _refuse_unused_keys(study, rig)
    try:
        effects = select_effects(study.model.effects, rig, study.source.parent, points)
    except StudyError as error:
        raise error.inside(study.place_of("model.effects")) from None
    return Model(rig, effects, study.model.tension_law)


def _rig(study: Study) -> Rig:
    try:
        return rig_of(study.kind, study.variant, tuple(study.found_constants.items()), tuple(study.possible.items()))
    except KeyError as error:
        do = "State it without an uncertainty."
        got = "an uncertainty, or a parameter, of what the model does not contain"
        raise StudyError(f"{study.source}, rig.{error.args[0]}", got, "", do) from None


def _refuse_unused_noise(study: Study, rig: Rig) -> None:
    """Refuse a level of noise of a channel that this rig was not measured by: a slip, or of another study."""
    for name in type(study.noise).model_fields:
        if name not in rig.measured and getattr(study.noise, name) is not None:
            got = f"noise of the {name}, of which the model of these records makes no use"
            raise StudyError(
                study.place_of(f"noise.{name}"), got, f"noise of {' or '.join(rig.measured)}", "Leave it out."
            )


def _refuse_unused_keys(study: Study, rig: Rig) -> None:
    """Refuse what is stated of records and what only the same rig with other channels, or driven otherwise, knows."""
    usual = RIGS[study.kind]
    unknown = {one.name for one in (*usual.nuisances, *usual.conditions)}
    unknown |= {"window"} if rig.anchor is None and usual.anchor is not None else set()
    unknown -= {one.name for one in (*rig.nuisances, *rig.conditions)}
    for i, record in enumerate(study.records):
        for name in sorted(unknown):
            if getattr(record, name, None) is not None:
                where = f"records[{i}].{name}" if getattr(study.rig, name, None) is None else f"rig.{name}"
                got = f"{name} of a rig that is measured or driven so that its model has none"
                raise StudyError(study.place_of(where), got, "", "Leave it out.")


def refuse_places(effects: Iterable[type[Effect]], where: str, do: str) -> None:
    """Refuse effects that go by the place of a record in its series, where records are looked at that have none.

    Parameters
    ----------
    effects : iterable of Effect classes
    where : str
        What the model belongs to.
    do : str
        What can be done about it.

    Raises
    ------
    StudyError
        Naming the first of them.
    """
    if effect := next((effect for effect in effects if goes_by_place(effect)), None):
        got = f'the effect "{effect.name}", which goes by the place of a record in its series'
        raise StudyError(where, got, "effects that are the same in every record", do)


def read_records(study: Study) -> tuple[Record, ...]:
    """Records of a study, in its order.

    Raises
    ------
    DataError
        If files are not understood: all of them, up to as many as are told at once.
    StudyError
        If a record is planned only and has no file, or is there twice.
    """
    records: list[Record] = []
    with Mistakes(str(study.source)) as mistakes:
        for record in study.records:
            if not mistakes.full:  # reading takes long, and what comes after these is not told
                with mistakes.collect():
                    records.append(_read(study, record))
    refuse_copies(records, str(study.source))
    return tuple(records)


def refuse_copies(records: Sequence[Record], where: str) -> None:
    """Refuse one measurement that is listed as several: copies would make the error bars too small.

    Raises
    ------
    StudyError
        Naming both.
    """
    if (copies := first_copy(records)) is not None:
        one, other = copies
        raise StudyError(
            where, f'records "{one.name}" and "{other.name}" hold the same data', "each measurement once",
            "Take one of the two off the list: a copy is no further evidence.",
        )  # fmt: skip


def task_of(study: Study, records: Sequence[Record] | None = None) -> Task:
    """Task of a study, of measured records or of planned ones.

    Parameters
    ----------
    records : sequence of Record, optional
        Its records where they have been read already.
    """
    bound_programs()
    model = model_of(study)
    if records is None and is_planned(study):
        return formulate_planned(study, model)
    return formulate(study, read_records(study) if records is None else records, model)


def task_to_fit(study: Study, task: Task) -> Task:
    """The same task of a study, in which something is free.

    Raises
    ------
    StudyError
        If every parameter is held.
    """
    if task.problem.layout.size == 0:
        do = "Leave out fixed = true for one of them, or ask for fibrefit simulate."
        raise StudyError(str(study.source), "every parameter is held", "at least one that is free", do)
    return task


def is_planned(study: Study) -> bool:
    """Whether none of a study's records has been measured yet."""
    return all(record.file is None for record in study.records)


def _read(study: Study, record: object) -> Record:
    file, label = record.file, record.label  # type: ignore[attr-defined]
    if file is None:
        raise StudyError(str(study.source), f'record "{label}" has no file', "a measured record", "Name its file.")
    first, other = readings_of(study, record)

    def read(path: Path, said: dict[str, Any]) -> Record:
        found = read_record(path, **said, name=label)
        study.digests[path] = found.sha256
        return found

    return _whole(record, [read(path, said) for path, said in (*first, *([other] if other else []))])


def _whole(record: Any, parts: Sequence[Record]) -> Record:
    """A record of its parts one after the other, and of the file beside it, the last one, where it has one."""
    if record.beside is None:
        return joined(parts)
    return side_by_side(joined(parts[:-1]), parts[-1], record.beside.clock_offset)


def refused_by_rig(study: Study, record: Any, parts: Sequence[Record]) -> str:
    """Why a record that was read cannot be one of its rig, by Newton's law; empty where nothing speaks against it.

    What a study lacks is reported by the commands that need it. Laws are read for their names alone: code that a study
    names is not run where it is looked at.

    Parameters
    ----------
    record : object
        One of the study's.
    parts : sequence of Record
        Its files as read, the one beside them last.
    """
    try:
        rig = _rig(study)
        trace = trace_of(_whole(record, parts), rig, stated_numbers(record))
    except FibrefitError:
        return ""
    try:
        refuse_contradictory([trace], rig, study.model.effects)
    except DataError as error:
        return str(error)
    return ""
