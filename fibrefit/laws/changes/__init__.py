"""Laws that change: at an instant, from one record on, with time, with use, or from record to record."""
