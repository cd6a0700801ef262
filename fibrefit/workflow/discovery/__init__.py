"""From a study to a finding on disk."""
