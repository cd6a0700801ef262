"""``make real DATA=folder``: every study of public records that are there, and a table of what was found."""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from fibrefit.cli.main import run
from fibrefit.store import read_summary
from tests.real.cases import CASES, Case

HEAD = 'schema = "fibrefit/study/1"\nname = "{name}"\n'
COLUMNS = ("records", "parameter", "published", "found", "95 % interval", "explained", "status", "time")


def carried_out(case: Case, data: Path, out: Path, words: list[str]) -> list[tuple[str, ...]]:
    """Rows of the table of one case."""
    missing = [file for file in case.files if not (data / file).is_file()]
    if missing:
        return [(case.name, "", "", f"not there: {missing[0]}", "", "", "", "")]
    folder = out / case.name.replace(" ", "_").replace(",", "").replace(".", "_")
    with TemporaryDirectory() as work:
        study = _written(Path(work) / "fit.toml", case, case.study, data)
        began = time.perf_counter()
        starts = [word for word in words if word.startswith("--starts=")]
        code = run(("fit", str(study), *starts, "--out", str(folder / "fit"), "--force", "-q"))
        seconds = time.perf_counter() - began
        if not (folder / "fit" / "summary.json").is_file():
            return [(case.name, "", "", f"not possible, exit code {code}: see above", "", "", "", f"{seconds:.0f} s")]
        rows = _rows(case, read_summary(folder / "fit"), seconds)
        if case.predicts:
            further = _written(Path(work) / "predict.toml", case, case.predicts, data)
            run(("predict", str(folder / "fit"), str(further), "--out", str(folder / "predict"), "--force", "-q"))
            rows.append((f"{case.name}, predicted", "", "", read_summary(folder / "predict").says, "", "", "", ""))
        if "--discover" in words:
            run(("discover", str(study), "--out", str(folder / "discover"), "--force", "-q"))
            said: Any = json.loads((folder / "discover" / "summary.json").read_text(encoding="utf-8"))
            names = ", ".join(said["added"]) or "nothing"
            rows.append((f"{case.name}, discover", "", "", f"{said['verdict']}: {names}", "", "", "", ""))
    return rows


def _written(path: Path, case: Case, text: str, data: Path) -> Path:
    path.write_text(HEAD.format(name=case.name) + text.replace("{folder}", data.as_posix()), encoding="utf-8")
    return path


def _rows(case: Case, summary: Any, seconds: float) -> list[tuple[str, ...]]:
    shares = ", ".join(
        f"{name} {100.0 * gap.explained:.2f} %" for name, gap in summary.gap.channels.items() if gap.explained
    )
    rows = []
    for i, (name, told) in enumerate(summary.parameters.items()):
        value, _ = case.published.get(name, (None, None))
        ends = (
            "held"
            if not told.free or told.interval_95 is None
            else " to ".join(f"{end:.4g}" for end in told.interval_95)
        )
        beside = (shares, summary.status, f"{seconds:.0f} s") if i == 0 else ("", "", "")
        published = "" if value is None else f"{value:.4g}"
        rows.append((case.name if i == 0 else "", name, published, f"{told.value:.4g} {told.unit}", ends, *beside))
    return rows


def main(words: list[str]) -> int:
    """Carry out all cases; with ``--only=PART`` those of that name; with ``--discover`` what each model lacks too.

    ``--starts=N`` is handed to the fits.
    """
    names = [word for word in words if not word.startswith("-")]
    asked = [word.partition("=")[2] for word in words if word.startswith("--only=")]
    if not names or not Path(names[0]).is_dir():
        print("make real DATA=folder: a folder with the repositories that docs/real_records.md names", file=sys.stderr)
        return 2
    out, rows = Path("results") / "real", [COLUMNS, ("---",) * len(COLUMNS)]
    for case in (case for case in CASES if not asked or any(part in case.name for part in asked)):
        rows += carried_out(case, Path(names[0]).resolve(), out, words)
    table = "\n".join(f"| {' | '.join(row)} |" for row in rows)
    out.mkdir(parents=True, exist_ok=True)
    (out / ("-".join(["table", *asked]).replace(" ", "_") + ".md")).write_text(table + "\n", encoding="utf-8")
    print(table)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
