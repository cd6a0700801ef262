"""Settings of matplotlib, which may come from a file in the working folder, change no figure."""

from __future__ import annotations

import warnings
from pathlib import Path

import matplotlib as mpl
import pytest

from fibrefit.plots.save import save_figures
from fibrefit.plots.table import table_figure
from fibrefit.records import read_table

RECORD = Path(__file__).resolve().parents[2] / "configs" / "drop_series" / "drop_10mm_90deg.csv"
ANYBODYS = {
    "savefig.dpi": 1e9,
    "savefig.transparent": True,
    "text.usetex": True,
    "font.size": 40.0,
    "axes.facecolor": "red",
    "lines.linewidth": 9.0,
    "xtick.direction": "inout",
    "axes.grid": True,
    "path.sketch": (10.0, 10.0, 10.0),
}


@pytest.mark.parametrize("kind", ["png", "svg"])
def test_settings_of_others_change_no_figure(tmp_path: Path, kind: str) -> None:
    table = read_table(RECORD)
    (usual,) = save_figures({"usual": table_figure(table)}, tmp_path, formats=(kind,))
    with mpl.rc_context(ANYBODYS), warnings.catch_warnings():
        warnings.simplefilter("error")
        (other,) = save_figures({"other": table_figure(table)}, tmp_path, formats=(kind,))
        assert {name: mpl.rcParams[name] for name in ("font.size", "text.usetex")} == {
            "font.size": 40.0,
            "text.usetex": True,
        }
    if kind == "png":
        assert other.read_bytes() == usual.read_bytes()
    else:  # numbers of its own for what it refers to
        assert abs(len(other.read_bytes()) - len(usual.read_bytes())) < 0.01 * len(usual.read_bytes())
