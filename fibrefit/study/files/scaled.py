"""A scale with an uncertainty is a gain of its sensor with that prior."""

from __future__ import annotations

from typing import Any

from fibrefit.core.errors import StudyError
from fibrefit.core.units import Scale
from fibrefit.study.channels import ChannelTable
from fibrefit.study.parameters import NormalPrior, ParameterTable
from fibrefit.study.places import Places

#: The law whose gain stands for the scale of a channel; of a force that drives, that between it and the mass.
GAINS = {"force": "sensor.force_gain", "position": "sensor.position_gain"}
PUSHING = "push.force_gain"


def with_scale_parameters(study: Any, place: Places) -> Any:
    """Study with a gain, and its prior, for each channel whose scale is uncertain.

    The gain is one within the relative uncertainty of the scale. What the study itself says of the gain stands.

    Parameters
    ----------
    study : Study
        As validated.
    place : Places
        Finds keys for messages.

    Returns
    -------
    Study
        The same where no scale is uncertain.

    Raises
    ------
    StudyError
        If no law stands for the uncertainty: of another channel, or of one record alone.
    """
    effects, parameters = list(study.model.effects), dict(study.parameters)
    for role, error in _uncertain(study, place).items():
        gain = PUSHING if role == "force" and study.driven_by_force else GAINS[role]
        effects += [] if gain in effects else [gain]
        prior = NormalPrior(kind="normal", mean=1.0, sd=error)
        parameters.setdefault(f"{gain}.gain", ParameterTable(initial=1.0, prior=prior))
    if len(effects) == len(study.model.effects) and parameters == study.parameters:
        return study
    model = study.model.model_copy(update={"effects": tuple(effects)})
    return study.model_copy(update={"model": model, "parameters": parameters})


def _uncertain(study: Any, place: Places) -> dict[str, float]:
    """Relative uncertainty of each channel's scale, where it has one."""
    found = {role: error for role, said in study.channels if (error := _error(said))}
    for i, record in enumerate(study.records):
        for role, said in (record.channels or {}).items():
            if (error := _error(said)) and found.get(role) != error:
                do = "State the scale with its uncertainty under [channels]: it is one gain for all records."
                raise StudyError(place(f"records[{i}].channels.{role}"), "an uncertainty of one record alone", "", do)
    for role in found:
        if role not in GAINS:
            where = place(f"channels.{role}.scale")
            raise StudyError(where, "an uncertainty", f"it for {' or '.join(GAINS)} only", "Leave it out.")
    return found


def _error(said: Any) -> float:
    stated = said.scale if isinstance(said, ChannelTable) else None
    return 0.0 if stated is None else Scale.parse(stated, "scale").relative_error
