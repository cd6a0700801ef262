"""The same reading before and after a filter: which one is meant is a question, and the advice is the one before."""

from __future__ import annotations

import pytest
from layouts import f, rows, t, u

from fibrefit.core.errors import DataError
from fibrefit.records import read_record

#: Headings, role in doubt, and the heading that is advised.
ASKED = {
    "Time [s],F raw [N],F filt [N],x [mm]": ("force", "F raw [N]"),
    "Time [s],Load raw (N),Load lowpass (N),x [mm]": ("force", "Load raw (N)"),
    "Time [s],F_cal [N],F_raw [N],x [mm]": ("force", "F_raw [N]"),
    "Time [s],F_cal,F_raw,x [mm]": ("force", "F_raw"),
    "Time [s],Force smoothed [N],F [N],x [mm]": ("force", "F [N]"),
    "Time [s],Force (low-pass) [N],F [N],x [mm]": ("force", "F [N]"),
    "Zeit [s],Seilkraft geglättet [N],F roh [N],x [mm]": ("force", "F roh [N]"),
    "t [s],F brute [N],Effort lissé [N],x [mm]": ("force", "F brute [N]"),
    "t [s],fuerza sin filtrar [N],F filtrada [N],x [mm]": ("force", "fuerza sin filtrar [N]"),
    "t [s],F grezza [N],Forza filtrata [N],x [mm]": ("force", "F grezza [N]"),
    "t [s],F surová [N],Síla vyhlazená [N],x [mm]": ("force", "F surová [N]"),
    "t [s],F surowa [N],Siła wygładzona [N],x [mm]": ("force", "F surowa [N]"),
    "t [s],Weg roh [mm],s gefiltert [mm],F [N]": ("position", "Weg roh [mm]"),
    "t [s],raw [N],low pass [N],x [mm]": ("force", "raw [N]"),
}

#: Headings and the force that is read: one column only, or the other one in another unit, or plainly the measured one.
READ = {
    "t [s],F raw [V],F cal [N],x [mm]": "F cal [N]",
    "t [s],Force raw,F [N],x [mm]": "F [N]",
    "t [s],Force [N],F filt [N],x [mm]": "Force [N]",
    "t [s],force filtered [N],position filtered [mm],temp [°C]": "force filtered [N]",
    "t [s],Force filtered [N],force soll [N],x [mm]": "Force filtered [N]",
    "t [s],Rohrkraft [N],x [mm],y [V]": "Rohrkraft [N]",
    "t [s],F raw [N],x raw [mm],T [°C]": "F raw [N]",
}


def _content(head: str) -> str:
    return head + "\n" + rows(lambda i: f"{t(i)},{f(i)},{u(i)},{f(i + 1)}")


@pytest.mark.parametrize("head", ASKED)
def test_a_filtered_column_is_not_taken_in_silence(head: str, write) -> None:
    role, advised = ASKED[head]
    with pytest.raises(DataError) as refused:
        read_record(write(_content(head)))
    assert f"could each be the {role}" in str(refused.value)
    assert "wanted as it was measured" in str(refused.value)
    assert f'{role} = "{advised}"' in str(refused.value)


@pytest.mark.parametrize("head", READ)
def test_what_is_plain_stays_read(head: str, write) -> None:
    assert read_record(write(_content(head))).headers["force"] == READ[head]


def test_the_advice_leads_to_the_record(write) -> None:
    path = write(_content("t [s],F raw [N],F filt [N],x [mm]"))
    assert read_record(path, channels={"force": "F raw [N]"}).headers["force"] == "F raw [N]"
