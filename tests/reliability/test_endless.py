"""Words without end, keys of thousands of parts, pipes, files that never end: told at once, in little memory."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import pytest

from fibrefit import load_result
from fibrefit.core.errors import LONGEST, DataError, FibrefitError, StudyError, UsageError
from fibrefit.core.paths import read_plain_file, sha256_of
from fibrefit.records.read import read_table
from fibrefit.store.hdf5 import read_result
from fibrefit.store.summary import read_summary
from fibrefit.study import load_study
from tests.reliability.studies import CONFIGS

RECORD = CONFIGS / "drop_series" / "drop_10mm_90deg.csv"
LETTERS = 40_000
LONGEST_LOOK = 10.0
"""Seconds of processor time: 0.1 to 3 were seen, and minutes where every place of a word was tried."""
WORDS = ("a", "1", "1e", ":", ";", "|", "/*", "1/", "a:", "ab=", "é", "_", "\t", "[a]", '"a"')


@pytest.mark.parametrize("word", WORDS)
@pytest.mark.parametrize("place", ["heading", "cell", "nothing else"])
def test_a_word_of_thousands_of_letters_takes_no_time(tmp_path: Path, place: str, word: str) -> None:
    """As in a file that is no table, such as one line of another alphabet."""
    head, rows = RECORD.read_text("utf-8").split("\n", 1)
    long = word * (LETTERS // len(word)) + "z"
    lines = rows.splitlines()[:200]
    text = {
        "heading": "\n".join([f"{long},force [N],position [mm]", *lines]),
        "cell": "\n".join([head, *lines[:50], f"{long},1,2", *lines[50:]]),
        "nothing else": long,
    }[place]
    (tmp_path / "long.csv").write_text(text + "\n", "utf-8")
    began = time.process_time()
    with suppress(DataError):
        read_table(tmp_path / "long.csv")
    assert time.process_time() - began < LONGEST_LOOK


def test_a_message_quotes_no_more_than_a_person_reads() -> None:
    said = str(DataError("a.csv" * 1000, "x" * 10_000_000, "a number", "Save it again."))
    assert len(said) < 3 * LONGEST
    assert said.startswith("a.csv")
    assert said.endswith("expected a number. Save it again.")


@pytest.mark.skipif(not os.path.exists("/proc/self/statm"), reason="the system does not tell what memory a process has")
@pytest.mark.parametrize("form", ["{} = 1", "[{}]", "x = {{ {} = 1 }}", '"a" . {} = 1'])
def test_a_key_of_thousands_of_parts_is_refused_before_memory_is_taken(tmp_path: Path, form: str) -> None:
    """A file of 40 kB took 2.3 GB."""
    (tmp_path / "study.toml").write_text(form.format(".".join("a" * 20_000)), "utf-8")
    code = """
import resource, sys
from pathlib import Path
from fibrefit.core.errors import StudyError
from fibrefit.study import load_study
load_study(sys.argv[2])  # so that all it needs is there
pages = Path("/proc/self/statm").read_text().split()[0]
most = int(pages) * resource.getpagesize() + 100_000_000
resource.setrlimit(resource.RLIMIT_AS, (most, most))
try:
    load_study(sys.argv[1])
except StudyError as error:
    print(error)
"""
    command = [sys.executable, "-c", code, str(tmp_path), str(CONFIGS / "drop_series")]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=60.0)
    assert done.returncode == 0, done.stderr
    assert "nested too deeply" in done.stdout


def test_dots_that_are_no_keys_are_read(tmp_path: Path) -> None:
    """The negative control: numbers and words in values, a remark, a ruler."""
    text = (CONFIGS / "drop_series" / "study.toml").read_text("utf-8")
    ruler = "." * 200
    text = text.replace('name = "drop series', f'name = "a. b. c. {ruler} drop series', 1)
    (tmp_path / "study.toml").write_text(f"# {ruler}\n# {'0.5, ' * 200}\n{text}", "utf-8")
    for record in RECORD.parent.glob("*.csv"):
        (tmp_path / record.name).symlink_to(record)
    assert len(load_study(tmp_path).records) == 5


def test_a_path_of_thousands_of_folders_is_told(tmp_path: Path) -> None:
    text = (CONFIGS / "drop_series" / "study.toml").read_text("utf-8")
    head, *_ = text.split("[[records]]")
    record = f'[[records]]\nfile = "{"a/" * 3000}b"\nlift = "10 mm"\ninclination = "90 deg"\n'
    (tmp_path / "study.toml").write_text(head + record, "utf-8")
    with pytest.raises(StudyError, match="no folder for"):
        load_study(tmp_path)


def test_an_index_of_thousands_of_digits_is_told() -> None:
    with pytest.raises(UsageError, match="not understood"):
        load_study(CONFIGS / "drop_series", [f"records[{'9' * 5000}].lift=1 mm"])


def test_a_file_that_is_longer_than_it_said_is_not_read_to_its_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One that grows while it is read, or one of the system's that has no size."""
    (tmp_path / "grows.csv").write_bytes(b"0123456789")
    assert read_plain_file(tmp_path / "grows.csv", "a file", DataError, most=10) == b"0123456789"
    size = os.stat_result([0o100644, 0, 0, 1, 0, 0, 0, 0, 0, 0])
    monkeypatch.setattr(Path, "stat", lambda path, **_: size)
    with pytest.raises(DataError, match="grows, or never ends"):
        read_plain_file(tmp_path / "grows.csv", "a file", DataError, most=5)


KERNEL = Path("/proc/kmsg")
"""A plain file by its kind that waits for ever."""


def readable(path: Path) -> bool:
    """Whether it can be opened: what its permissions say is not all that counts."""
    try:
        os.close(os.open(path, os.O_RDONLY | os.O_NONBLOCK))
    except OSError:
        return False
    return True


@pytest.mark.skipif(not readable(KERNEL), reason="the system lets nobody read it")
def test_a_file_that_waits_for_ever_is_not_waited_for() -> None:
    code = """
import sys
from pathlib import Path
from fibrefit.core.errors import DataError
from fibrefit.core.paths import read_plain_file, sha256_of
path = Path(sys.argv[1])
print(len(sha256_of(path)))
try:
    # Whatever the system has said before is its content, and then it waits.
    print("read" if isinstance(read_plain_file(path, "a file", DataError), bytes) else "nothing")
except DataError as error:
    print("told" if "grows, or never ends" in str(error) else error)
"""
    done = subprocess.run([sys.executable, "-c", code, str(KERNEL)], timeout=60.0, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    length, outcome = done.stdout.split()
    assert length == "64"
    assert outcome in ("told", "read")


def test_the_digest_of_a_file_is_that_of_all_of_it(tmp_path: Path) -> None:
    (tmp_path / "long").write_bytes(b"a" * 3_000_000)
    found = subprocess.run(["sha256sum", tmp_path / "long"], capture_output=True, text=True, check=True).stdout
    assert sha256_of(tmp_path / "long") == found.split()[0]


@pytest.mark.parametrize("file", ["summary.json", "result.h5", "inspection.json"])
def test_a_pipe_in_place_of_a_part_of_a_result_is_not_waited_for(tmp_path: Path, file: str) -> None:
    os.mkfifo(tmp_path / file)
    with pytest.raises(FibrefitError):
        if file == "summary.json":
            read_summary(tmp_path)
        elif file == "result.h5":
            read_result(tmp_path / file)
        else:
            load_result(tmp_path).document()


@pytest.mark.parametrize("content", [b"[" * 100_000, b'{"a":' * 100_000, b"", b"\xff", b"[]", b'{"schema": 3}'])
def test_a_summary_that_is_none_is_told(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "summary.json").write_bytes(content)
    with pytest.raises(FibrefitError):
        read_summary(tmp_path)


def test_a_summary_of_gigabytes_is_refused_by_its_size(tmp_path: Path) -> None:
    with (tmp_path / "summary.json").open("wb") as file:
        file.truncate(2_000_000_000)
    with pytest.raises(DataError, match="at most"):
        read_summary(tmp_path)


@pytest.mark.parametrize("link", ["nowhere", "round", "outside"])
def test_a_result_whose_links_lead_elsewhere_is_told(tmp_path: Path, link: str) -> None:
    import h5py

    with h5py.File(tmp_path / "result.h5", "w") as file:
        where = {"nowhere": h5py.SoftLink("/none"), "round": h5py.SoftLink("/evil")}
        file["evil"] = where.get(link, h5py.ExternalLink("/etc/passwd", "x"))
    with pytest.raises(DataError, match=r"result\.h5"):
        read_result(tmp_path / "result.h5")
