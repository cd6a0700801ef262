"""Long files go through NumPy's parser: what comes out is what the reader of cells makes of them, to the last bit."""

from __future__ import annotations

import numpy as np
import pytest

from fibrefit.records import ReadOptions, read_table
from fibrefit.records.files import block

N = 3000


def table(make, head: str, end: str = "\n") -> str:
    return head + end + "".join(make(i) + end for i in range(N))


def plain(i: int) -> str:
    return f"{i / 2000:.4f},{12.5 + np.sin(0.01 * i) + 0.05 * np.sin(7.7 * i):.3f},{-0.25 + 0.5 * np.cos(0.01 * i):.4f}"


def exponents(i: int) -> str:
    return ",".join(f"{float(cell):.6E}" for cell in plain(i).split(","))


HEAD = "time [s],force [N],position [mm]"
LAYOUTS = {
    "plain": table(plain, HEAD),
    "line ends of Windows": table(plain, HEAD, "\r\n"),
    "decimal commas": table(lambda i: plain(i).replace(",", ";").replace(".", ","), HEAD.replace(",", ";")),
    "tabs at the end": table(lambda i: plain(i).replace(",", "\t") + "\t", HEAD.replace(",", "\t") + "\t"),
    "exponents": table(exponents, HEAD),
    "whole numbers in one column": table(
        lambda i: f"{i * 500},{plain(i).partition(',')[2]}", "t [us],force [N],position [mm]"
    ),
    "no digit before the mark": table(lambda i: plain(i).replace(",0.", ",.").replace(",-0.", ",-."), HEAD),
    "empty cells": table(lambda i: plain(i) if i % 97 else plain(i).rpartition(",")[0] + ",", HEAD),
    "a header and a footer": table(plain, "rig;3\nfs = 2000 Hz\n" + HEAD) + "end of data\n",
    "a gap": "".join(line for k, line in enumerate(table(plain, HEAD).splitlines(True)) if not 500 < k < 520),
    "doubled rows": table(plain, HEAD).replace(plain(700) + "\n", (plain(700) + "\n") * 2),
    "a digit lost": table(plain, HEAD).replace(plain(900), plain(900)[:-1]),
    "zeros dropped": table(lambda i: ",".join(f"{float(cell):g}" for cell in plain(i).split(",")), HEAD),
    "stuck and saturated": table(
        lambda i: ",".join((plain(i).split(",")[0], f"{min(12.9 + 0.2 * np.sin(3.1 * i), 13.0):.3f}", "1.0000")), HEAD
    ),
}


@pytest.mark.parametrize("name", LAYOUTS)
def test_both_ways_agree(name: str, write, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write(LAYOUTS[name])
    slow = read_table(path)
    monkeypatch.setattr(block, "_LONG", 1000)
    took = []
    parsed = block._parsed
    monkeypatch.setattr(block, "_parsed", lambda *given: took.append(given) or parsed(*given))
    fast = read_table(path)
    assert took
    assert fast.understood == slow.understood
    for one, other in zip(fast.columns, slow.columns, strict=True):
        np.testing.assert_array_equal(one.values, other.values)
        np.testing.assert_array_equal(one.valid, other.valid)
    for one, other in zip(fast.times, slow.times, strict=True):
        np.testing.assert_array_equal(one.time, other.time)


IRREGULAR = {
    "a word in a cell": table(lambda i: plain(i) if i != 1500 else plain(i).replace(",", ",x", 1), HEAD),
    "a cell too few": table(lambda i: plain(i) if i != 1500 else plain(i).rpartition(",")[0], HEAD),
    "a cell too many and one too few": table(
        lambda i: plain(i) if i not in (1500, 1501) else plain(i) + ",1" if i == 1500 else plain(i).rpartition(",")[0],
        HEAD,
    ),
    "an empty line": table(lambda i: plain(i) if i != 1500 else "", HEAD),
    "two marks in a cell": table(lambda i: plain(i) if i != 1500 else plain(i).replace(",1", ",1.1", 1), HEAD),
    "a sign alone": table(lambda i: plain(i) if i != 1500 else plain(i).rpartition(",")[0] + ",-", HEAD),
}


@pytest.mark.parametrize("name", IRREGULAR)
def test_what_is_irregular_is_read_cell_by_cell(name: str, write, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write(IRREGULAR[name])
    slow = read_table(path)
    monkeypatch.setattr(block, "_LONG", 1000)
    assert block.read_long(path.read_bytes(), path.name, ReadOptions()) is None
    assert read_table(path).understood == slow.understood


def test_an_unusual_sign_between_cells_is_no_hindrance(write) -> None:
    path = write(table(lambda i: plain(i).replace(",", "~"), HEAD.replace(",", "~")))
    options = ReadOptions(delimiter="~")
    assert len(read_table(path, options).columns[0].values) == N
