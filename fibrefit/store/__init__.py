"""Results on disk: folders written whole or not at all, summary.json, result.h5."""

from __future__ import annotations

from fibrefit.store.directory import ResultDirectory, Run, default_directory
from fibrefit.store.hdf5 import read_result, write_result
from fibrefit.store.summary import provenance, read_summary, write_summary

__all__ = [
    "ResultDirectory",
    "Run",
    "default_directory",
    "provenance",
    "read_result",
    "read_summary",
    "write_result",
    "write_summary",
]
