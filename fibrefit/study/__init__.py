"""The study file: models, reading, overriding, writing back."""

from __future__ import annotations

from fibrefit.study.load import as_study, load_study, study_from_files
from fibrefit.study.parameters import ParameterSetting, PriorSetting
from fibrefit.study.study import Study

__all__ = ["ParameterSetting", "PriorSetting", "Study", "as_study", "load_study", "study_from_files"]
