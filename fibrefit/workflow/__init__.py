"""From a study to a result on disk: the only floor that knows all the others."""
