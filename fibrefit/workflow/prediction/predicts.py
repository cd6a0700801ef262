"""What every result with values offers: to hold them against records that they were not found from."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from fibrefit.study import Study
from fibrefit.workflow.saved import FoundResult

if TYPE_CHECKING:
    from fibrefit.workflow.prediction.predict import Prediction


class Predicts(FoundResult):
    """A result whose values can be held against other records: of `fit`, `discover` and `sample`."""

    def predicting(self) -> Study:
        """The study with the model that the values belong to."""
        return self.study

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
        >>> result.predict(fibrefit.example("drop_series") / "holdout").verdict
        'holds'
        """
        from fibrefit.workflow.prediction.predict import predict_study

        return predict_study(self, study)
