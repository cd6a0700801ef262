"""How the files of a study are read, and what an uncertain scale of a column makes of its model."""
