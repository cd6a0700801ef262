"""From a study to a posterior on disk."""
