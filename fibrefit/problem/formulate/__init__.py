"""From a study and its records to a task with starting values."""
