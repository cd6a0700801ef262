"""Reading, checking and preparing measured records."""

from fibrefit.core.declarations import ROLES
from fibrefit.records.clock.base import TimeBase, TimeGap
from fibrefit.records.describe import describe
from fibrefit.records.join import joined, side_by_side
from fibrefit.records.options import ReadOptions
from fibrefit.records.read import read_record, read_table, record_of
from fibrefit.records.record import Record
from fibrefit.records.table import Column, Table

__all__ = [
    "ROLES",
    "Column",
    "ReadOptions",
    "Record",
    "Table",
    "TimeBase",
    "TimeGap",
    "describe",
    "joined",
    "read_record",
    "read_table",
    "record_of",
    "side_by_side",
]
