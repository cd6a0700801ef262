"""A remark of an offset is asked of the channels in its unit, and a stated zero answers it."""

from __future__ import annotations

import pytest
from layouts import f, rows, t, u

from fibrefit.core.errors import DataError
from fibrefit.records import read_record

BODY = "t [s],F [N],x [mm]\n" + rows(lambda i: f"{t(i)},{f(i)},{u(i)}")

#: Remark, role that is asked of, and the zero that is advised.
REMARKS = {
    "Offset (not removed): 1.8 N": ("force", "1.8"),
    "Zero offset of the load cell: -3.2 N, still in the data": ("force", "-3.2"),
    "Tare 0.35 kN was not subtracted": ("force", "350"),
    "Tara nicht abgezogen: 500 g": ("force", "4.903325"),
    "Offset: 0.4 mm (not removed)": ("position", "0.4"),
    "Versatz 120 um nicht korrigiert": ("position", "0.12"),
    "Nullpunkt nicht abgezogen: 1,8 N": ("force", "1.8"),
    "Décalage du zéro non corrigé : 2,25 N": ("force", "2.25"),
    "Offset not removed: 1.250 N": ("force", "1.25"),
    "Offset not removed: 1,250 N": ("force", "..."),
}


@pytest.mark.parametrize("remark", REMARKS)
def test_an_offset_is_asked_of_channels_in_its_unit_and_a_zero_answers_it(remark: str, write) -> None:
    role, zero = REMARKS[remark]
    path = write(f"# {remark}\n{BODY}")
    other = {"force": "position", "position": "force"}[role]
    heading = {"force": "F [N]", "position": "x [mm]"}[role]
    with pytest.raises(DataError) as refused:
        read_record(path)
    assert f'{role} = {{ column = "{heading}", zero = {zero} }}' in str(refused.value)
    assert f"{other} = {{" not in str(refused.value)
    stated = 1.8 if zero == "..." else float(zero)
    plain = read_record(write(BODY, "plain.csv"))
    record = read_record(path, channels={role: {"column": heading, "zero": stated}})
    unit = {"force": 1.0, "position": 1e-3}[role]
    assert record.channels[role] == pytest.approx(plain.channels[role] - stated * unit)
    assert read_record(path, channels={role: {"column": heading, "scale": "1"}}).channels[role][0] == pytest.approx(
        plain.channels[role][0]
    )


def test_two_offsets_in_a_line_are_asked_of_both(write) -> None:
    with pytest.raises(DataError, match=r"(?s)zero = 1\.8.*zero = 0\.4"):
        read_record(write(f"# Offset (not removed): 1.8 N; 0.4 mm\n{BODY}"))


@pytest.mark.parametrize("remark", ["Gain 2.0 not applied", "Force offset 1.8 N, gain 2", "zero 3 N, scale factor 0.5"])
def test_a_zero_answers_no_factor(remark: str, write) -> None:
    with pytest.raises(DataError, match="scale = "):
        read_record(write(f"# {remark}\n{BODY}"), channels={"force": {"column": "F [N]", "zero": 1.8}})


def test_a_zero_of_another_channel_answers_none(write) -> None:
    with pytest.raises(DataError, match=r"zero = 1\.8"):
        read_record(
            write(f"# Offset (not removed): 1.8 N\n{BODY}"), channels={"position": {"column": "x [mm]", "zero": 1.8}}
        )


def test_what_was_removed_stays_read(write) -> None:
    assert read_record(write(f"# Offset removed: 1.8 N\n{BODY}")).channels["force"].size > 3
