"""Where, when and in which band model and measurement differ."""
