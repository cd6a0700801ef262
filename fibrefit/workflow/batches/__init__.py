"""One identification a record or a study, many of them."""
