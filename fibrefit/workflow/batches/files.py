"""A batch as the files of a result: its table, its checks, its status."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Literal

from fibrefit.report.batch import items_in_words
from fibrefit.store.csv_text import headed
from fibrefit.study.summaries.check import Check
from fibrefit.study.summaries.series import BatchItem

if TYPE_CHECKING:
    from fibrefit.workflow.batches.jobs import RecordConditions


def batch_status(items: Mapping[str, BatchItem]) -> Literal["ok", "suspect", "failed"]:
    """``ok`` where every item is, ``failed`` where none can be used, else ``suspect``."""
    found = {item.status for item in items.values()}
    if found == {"ok"}:
        return "ok"
    return "failed" if found <= {"failed", None} else "suspect"


def batch_checks(items: Mapping[str, BatchItem]) -> tuple[Check, ...]:
    """Whether every identification was possible, whether each can be trusted, and whether its model explains it."""
    stopped = [name for name, item in items.items() if item.status is None]
    failed = [name for name, item in items.items() if item.status == "failed"]
    doubted = [name for name, item in items.items() if item.status == "suspect"]
    lacking = [name for name, item in items.items() if item.lacks]
    total, done = len(items), len(items) - len(stopped)
    explains = _check("the model explains every item", "model", lacking, done, "leave more than noise")
    return (
        _check("every identification was possible", "identifications", stopped, total, "could not be carried out"),
        _check("no fit failed", "fits", failed, done, "failed"),
        _check("every fit passes its checks", "batch", doubted, done, "suspect"),
        explains.model_copy(update={"about": "model"}),
    )


def _check(name: str, quantity: str, wrong: list[str], total: int, what: str) -> Check:
    return Check.none_of(
        wrong,
        name=name,
        says=items_in_words(wrong, total, what),
        identifier=quantity.replace(" ", "_"),
        quantity=quantity,
    )


def batch_table(items: Mapping[str, BatchItem], conditions: Mapping[str, RecordConditions]) -> list[list[str]]:
    """Head and one row an item, for a spreadsheet; numbers in SI units, empty where there is none.

    Parameters
    ----------
    items : mapping of str to BatchItem
    conditions : mapping of str to RecordConditions
        Of the items that are one record.
    """
    known = {name: one.units[name] for one in conditions.values() for name in one.values}
    values = {name: found.unit for item in items.values() for name, found in item.parameters.items()}
    head = ["item", *(headed(n, u) for n, u in known.items()), "status", "gap", "lacks"]
    for name, unit in values.items():
        head += [headed(name, unit), headed(f"{name} std_error", unit), f"{name} at_bound"]
    rows = [[*head, "result", "error"]]
    for name, item in items.items():
        own = conditions[name].values if name in conditions else {}
        row = [name, *(_number(own.get(key)) for key in known), item.status or "not possible", _number(item.gap)]
        row.append("; ".join(item.lacks))
        for key in values:
            found = item.parameters.get(key)
            row += ["", "", ""] if found is None else [
                _number(found.value), _number(found.std_error), str(found.at_bound).lower()
            ]  # fmt: skip
        rows.append([*row, item.result or "", item.error or ""])
    return rows


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.9g}"
