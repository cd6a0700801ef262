"""Layouts of logger files with the known truth beside each, by kind."""

from __future__ import annotations

from tests.records.exports.base import Export
from tests.records.exports.benches import BENCHES
from tests.records.exports.boxes import BOXES
from tests.records.exports.cells import CELLS
from tests.records.exports.channels import CHANNELS
from tests.records.exports.clocks import CLOCKS
from tests.records.exports.containers import CONTAINERS
from tests.records.exports.desks import DESKS
from tests.records.exports.fresh import FRESH
from tests.records.exports.further import FURTHER, LAST
from tests.records.exports.laboratory import LABORATORY
from tests.records.exports.later import LATER
from tests.records.exports.rounds import ROUNDS
from tests.records.exports.scopes import SCOPES
from tests.records.exports.strangers import STRANGERS
from tests.records.exports.text import TEXT

KINDS: dict[str, list[Export]] = {
    "text": TEXT,
    "clocks": CLOCKS,
    "laboratory": LABORATORY,
    "scopes": SCOPES,
    "channels": CHANNELS,
    "containers": CONTAINERS,
    "fresh": FRESH,
    "further": FURTHER,
    "strangers": STRANGERS,
    "benches": BENCHES,
    "desks": DESKS,
    "cells": CELLS,
    "later": LATER,
    "last": LAST,
    "boxes": BOXES,
    **ROUNDS,
}
