"""Oscilloscopes, whose exports state the sample interval in a header and volts in the columns."""

from __future__ import annotations

from tests.records.exports.base import FORCE, POSITION, Kind, N, de, lines

SCOPES = Kind()
VOLTS = {
    "channels": {
        "force": {"column": "CH1", "unit": "V", "scale": "100 N/V"},
        "position": {"column": "CH2", "unit": "V", "scale": "10 mm/V"},
    }
}


def called(force: str, position: str) -> dict:
    return {
        "channels": {
            "force": {"column": force, "unit": "V", "scale": "100 N/V"},
            "position": {"column": position, "unit": "V", "scale": "10 mm/V"},
        }
    }


def v(i: int, form: str = ".5f") -> str:
    return format(FORCE[i] / 100, form)


def w(i: int, form: str = ".5f") -> str:
    return format(POSITION[i] / 10, form)


def vw(separator: str = ",", form: str = ".5f"):
    return lambda i: f"{v(i, form)}{separator}{w(i, form)}"


def tvw(separator: str = ",", start: float = 0.0, form: str = ".6E"):
    return lambda i: f"{i / 2000 + start:{form}}{separator}{v(i)}{separator}{w(i)}"


def add(name: str, content: str, **more) -> None:
    SCOPES.add(name, content, **{"options": VOLTS, "rtol": 1e-8, "atol_time": 1e-8, **more})


add(
    "Rigol DS1000Z",
    "X,CH1,CH2,Start,Increment,\nSequence,Volt,Volt,-1.500000e-02,5.000000e-04\n" + lines(lambda i: f"{i},{vw()(i)},,"),
)
add("Rigol with times", "X,CH1,CH2,\nSecond,Volt,Volt,\n" + lines(lambda i: tvw()(i) + ","))
add(
    "Rigol DHO",
    "Time(s),CH1V,CH2V,t0 =-0.015,tInc = 0.0005\n" + lines(lambda i: tvw()(i) + ",,"),
    options=called("CH1V", "CH2V"),
    refused="heading|CH1",
)
add(
    "Rigol MSO5000",
    "CH1,CH2,t0 =-1.500000e-02, tInc = 5.000000e-04,\n" + lines(lambda i: vw()(i) + ",,,"),
    refused="heading|rate|CH1",
)
add(
    "Tektronix TBS in columns beside",
    "".join(
        f"{left},,,,,{i / 2000 - 0.015:.12f},{v(i)},{w(i)},\n"
        for i, left in enumerate(
            [
                "Record Length,2.5e+03",
                "Sample Interval,5.0e-04",
                "Trigger Point,30",
                ",",
                ",",
                ",",
                "Source,CH1",
                "Vertical Units,V",
            ]
            + [","] * (N - 8)
        )
    ),
    refused="heading|columns",
    options={},
)
add(
    "Tektronix DPO",
    "Model,DPO2024\nFirmware Version,1.52\n\nPoint Format,Y\nHorizontal Units,S\nSample Interval,5.0E-4\nRecord Length,60\n\n"
    "TIME,CH1,CH2\n" + lines(tvw()),
)
add(
    "Tektronix MSO, labels",
    '"Model","MSO44"\n"Waveform Type","ANALOG"\n"Horizontal Units","s"\n"Sample Interval","0.0005"\n'
    '"Record Length","60"\n"Zero Index","30"\n\nLabels,,\nTIME,CH1,CH2\n' + lines(tvw()),
)
add("Keysight InfiniiVision", "x-axis,1,2\nsecond,Volt,Volt\n" + lines(tvw(form="+.8E")), options=called("1", "2"))
add(
    "Keysight Infiniium header",
    "Revision:,0\nType:,raw\nStart:,-0.015\nPoints:,60\nXInc:,5.0E-04\nXOrg:,-1.5E-02\nXUnits:,second\nYUnits:,Volt\nData:\n"
    "CH1,CH2\n" + lines(vw()),
)
add(
    "Keysight without headings",
    "XInc = 5.0E-04 s\n" + lines(vw()),
    options={},
    refused="heading|columns",
    remedy={"columns": ("CH1", "CH2"), **VOLTS},
)
add(
    "Yokogawa DL850",
    '"Header Size",10\n"Model Name","DL850E"\n"Comment",""\n"BlockNumber",1\n"TraceName","CH1","CH2"\n'
    '"BlockSize",60,60\n"VUnit","V","V"\n"SampleRate",2.0E+03,2.0E+03\n"HResolution",5.0E-04,5.0E-04\n"HUnit","s","s"\n\n'
    + lines(lambda i: "," + vw()(i)),
    refused="heading|CH1|rate",
)
add("Yokogawa DL, plain", "Model,DLM2024\nHResolution,5.0E-04\nHUnit,s\nVUnit,V,V\n\nCH1,CH2\n" + lines(vw()))
add(
    "LeCroy",
    "LECROYWS3024,12345,Waveform\nSegments,1,SegmentSize,60\nSegment,TrigTime,TimeSinceSegment1\n#1,12-May-2024 14:22:11,0\nTime,Ampl\n"
    + lines(lambda i: f"{i / 2000:.6E},{v(i)}"),
    options={"channels": {"force": {"column": "Ampl", "unit": "V", "scale": "100 N/V"}}, "units": {"time": "s"}},
    position=None,
)
add(
    "PicoScope",
    "Time,Channel A,Channel B\n(ms),(mV),(mV)\n\n"
    + lines(lambda i: f"{i * 0.5:.8f},{FORCE[i] * 10:.2f},{POSITION[i] * 100:.2f}"),
    options={
        "channels": {
            "force": {"column": "Channel A", "scale": "100 N/V"},
            "position": {"column": "Channel B", "scale": "0.01 mm/mV"},
        }
    },
)
add(
    "Siglent",
    "Record Length,Analog:60\nSample Interval,Analog:0.0005\nVertical Units,Analog:V\nHorizontal Units,s\nModel Number,SDS1104\n"
    "Source,CH1,CH2\nSecond,Volt,Volt\n" + lines(tvw()),
    refused="heading|CH1|column",
)
add("Rohde & Schwarz", "in s,CH1 in V,CH2 in V\n" + lines(tvw()))
add(
    "Hantek",
    "#CHANNEL:CH1,CH2\n#CLOCK=500.0uS\n#SIZE=60\n#UNITS:V\n" + lines(lambda i: f"{i + 1},{vw()(i)}"),
    refused="heading|columns|rate",
)
add(
    "GW Instek",
    "Memory Length,60\nSampling Period,5.0000E-04\nVertical Units,V\nHorizontal Units,s\nMode,Fast\nWaveform Data,\nCH1,CH2\n"
    + lines(vw()),
)
add(
    "Digilent WaveForms",
    "#Digilent WaveForms Oscilloscope Acquisition\n#Device Name: Discovery2\n#Sample rate: 2000 Hz\n#Samples: 60\n#Trigger: none\n\n"
    "Time (s),Channel 1 (V),Channel 2 (V)\n" + lines(tvw()),
    options=called("Channel 1", "Channel 2"),
)
add(
    "Saleae",
    "Time [s],Channel 0,Channel 1\n" + lines(lambda i: f"{i / 2000:.9f},{vw(form='.8f')(i)}"),
    options=called("Channel 0", "Channel 1"),
)
add(
    "OWON",
    "Channel :,CH1,CH2\nFrequency :,F=?\n1 Div Volt:,1.00V,500mV\nTime interval:,500.00us,500.00us\n\n"
    "index,CH1_Voltage(mV),CH2_Voltage(mV)\n" + lines(lambda i: f"{i},{FORCE[i] * 10:.2f},{POSITION[i] * 100:.2f}"),
    options={
        "channels": {
            "force": {"column": "CH1_Voltage(mV)", "scale": "100 N/V"},
            "position": {"column": "CH2_Voltage(mV)", "scale": "10 mm/V"},
        }
    },
)
add("HIOKI", '"HIOKI MEMORY HICORDER"\n"TIMEAXIS","500us"\n"Time","CH1","CH2"\n"[s]","[V]","[V]"\n' + lines(tvw()))
add(
    "Fluke, decimal commas",
    "Titel;Run\nX-Einheit;s\nY-Einheit;V\nX0;0,0\nDelta X;0,0005\nAnzahl Punkte;60\n\nZeit [s];CH1 [V];CH2 [V]\n"
    + lines(lambda i: de(tvw(";")(i))),
)
add(
    "engineering units set in the scope",
    "X,CH1,CH2\nSecond,N,mm\n" + lines(lambda i: f"{i / 2000:.6E},{FORCE[i]:.3f},{POSITION[i]:.4f}"),
    options={"channels": {"force": "CH1", "position": "CH2"}},
)
add(
    "volts and no scale",
    "Time [s],Force [V],Position [mm]\n" + lines(lambda i: f"{i / 2000:.4f},{v(i)},{POSITION[i]:.4f}"),
    options={},
    refused="scale",
    remedy={"channels": {"force": {"column": "Force [V]", "scale": "100 N/V"}}},
)
