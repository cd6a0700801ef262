"""A constant of the rig with an uncertainty is a parameter with that prior."""

from __future__ import annotations

from typing import Any

from fibrefit.core.errors import Mistakes, StudyError
from fibrefit.core.units import uncertain
from fibrefit.study.places import Places


def take_uncertainties(raw: dict[str, Any]) -> None:
    """Put in place of each ``"3.1 +/- 0.05 kg"`` under ``[rig]`` its value, and a parameter with that prior.

    Parameters
    ----------
    raw : dict
        Content of a study, changed in place. What it says of the parameter itself stands.
    """
    rig, parameters = raw.get("rig"), raw.get("parameters", {})
    if not isinstance(rig, dict) or not isinstance(parameters, dict):
        return
    for key, said in rig.items():
        if (parts := uncertain(said)) is None:
            continue
        rig[key] = parts[0] if " " in parts[0] else float(parts[0])
        table = raw.setdefault("parameters", parameters).setdefault(key, {})
        if isinstance(table, dict):
            table.update({"initial": parts[0], "prior": said} | table)


def check_uncertain(study: Any, place: Places, mistakes: Mistakes) -> None:
    """Note each constant that is a parameter of all records and stated otherwise in one of them."""
    for name, value in study.found_constants.items():
        for i, record in enumerate(study.records):
            if getattr(record, name, value) != value:
                got = "another value than under [rig], where it is a parameter"
                do = f"Leave it out here, or state {name} without an uncertainty."
                mistakes.note(StudyError(place(f"records[{i}].{name}"), got, "one value for all records", do))
