"""What the programs of laboratories write: National Instruments, dSPACE, catman, DIAdem, testing machines, controllers."""

from __future__ import annotations

from tests.records.exports.base import POSITION, Kind, N, de, f, fu, lines, t, tfu, u

LABORATORY = Kind()
add = LABORATORY.add


def lvm(
    head: dict[str, str], segment: dict[str, str], names: str, body: str, separator: str = "\t", *, end: bool = True
) -> str:
    first = "".join(
        f"{key}{separator}{value}\n" for key, value in {"Writer_Version": "2", "Reader_Version": "2", **head}.items()
    )
    close = "***End_of_Header***\n" if end else ""
    tags = "".join(separator.join((key, *value.split("|"))) + "\n" for key, value in segment.items())
    return f"LabVIEW Measurement\t\n{first}{close}\n{tags}***End_of_Header***\n{names}\n{body}"


HEAD = {
    "Separator": "Tab",
    "Decimal_Separator": ".",
    "Multi_Headings": "No",
    "X_Columns": "One",
    "Time_Pref": "Relative",
}
TAGS = {
    "Channels": "2",
    "Samples": f"{N}|{N}",
    "Date": "2024/05/12|2024/05/12",
    "Time": "14:22:11.0|14:22:11.0",
    "Y_Unit_Label": "N|mm",
    "X_Dimension": "Time|Time",
    "X0": "0.0|0.0",
    "Delta_X": "5.0E-4|5.0E-4",
}
NAMES = "X_Value\tForce\tPosition\tComment"
NO_TIMES = {**HEAD, "X_Columns": "No"}
add("LVM with times", lvm(HEAD, TAGS, NAMES, lines(tfu("\t"))), suffix=".lvm")
add("LVM without times", lvm(NO_TIMES, TAGS, NAMES, lines(lambda i: "\t" + fu("\t")(i))), suffix=".lvm")
add(
    "LVM with decimal commas",
    lvm(
        {**HEAD, "Decimal_Separator": ","},
        {**TAGS, "X0": "0,0|0,0", "Delta_X": "5,0E-4|5,0E-4"},
        NAMES,
        lines(tfu("\t", de)),
    ),
    suffix=".lvm",
)
add(
    "LVM without its first end of header",
    lvm(HEAD, TAGS, NAMES, lines(tfu("\t")), end=False),
    suffix=".lvm",
    refused="header",
)
add(
    "LVM of times per channel",
    lvm(
        {**HEAD, "X_Columns": "Multi"},
        {key: value.replace("|", "||") for key, value in TAGS.items()},
        "X_Value\tForce\tX_Value\tPosition\tComment",
        lines(lambda i: f"{t(i)}\t{f(i)}\t{t(i)}\t{u(i)}"),
    ),
    suffix=".lvm",
)
add(
    "LVM with newtons in words",
    lvm(HEAD, {**TAGS, "Y_Unit_Label": "Newtons|Millimeters"}, NAMES, lines(tfu("\t"))),
    suffix=".lvm",
)
add("LVM as .txt", lvm(HEAD, TAGS, NAMES, lines(tfu("\t"))), suffix=".txt")
add("LVM truncated in its header", lvm(HEAD, TAGS, NAMES, "")[:260], suffix=".lvm", refused="header|names|rows")
add(
    "LabVIEW spreadsheet with repeated times",
    "Time - Force\tForce [N]\tTime - Position\tPosition [mm]\n" + lines(lambda i: f"{t(i)}\t{f(i)}\t{t(i)}\t{u(i)}"),
    suffix=".txt",
    refused="unit",
    remedy={"units": {"time": "s"}},
)
add(
    "SignalExpress with interval and unit rows",
    "Channel name\tForce\tPosition\nUnit\tN\tmm\nInterval\t5.0E-4\t5.0E-4\nStart\t0\t0\n"
    + lines(lambda i: "\t" + fu("\t")(i)),
    suffix=".txt",
    refused="rate",
    remedy={"rate": 2000.0},
)
add(
    "NI waveform graph export",
    "waveform\t[0]\t[1]\nt0\t12.05.2024 14:22:11,000\t12.05.2024 14:22:11,000\ndelta t\t0,000500\t0,000500\n\n"
    "time\tY[0]\tY[1]\n" + lines(lambda i: f"12.05.2024 14:22:{de(f'{11 + i / 2000:07.4f}')}\t{de(f(i))}\t{de(u(i))}"),
    suffix=".txt",
    options={"channels": {"force": "Y[0]", "position": "Y[1]"}, "units": {"force": "N", "position": "mm"}},
)
add(
    "FlexLogger with units in brackets",
    "Log Name,Run 3\nStart Time,2024-05-12 14:22:11\nSample Rate,2000 Hz\n\nTime (s),Force (N),Position (mm)\n"
    + lines(tfu()),
)
add("repeated time columns", "Time,Force,Time,Position\ns,N,s,mm\n" + lines(lambda i: f"{t(i)},{f(i)},{t(i)},{u(i)}"))
add(
    "repeated time columns named by the channel",
    "Force_Time [s],Force [N],Position_Time [s],Position [mm]\n" + lines(lambda i: f"{t(i)},{f(i)},{t(i)},{u(i)}"),
)
add(
    "interval and unit in rows",
    "Name,Force,Position\nUnit,N,mm\nInterval,0.0005 s,0.0005 s\n" + lines(lambda i: "," + fu()(i)),
)
add(
    "interval row with its unit apart",
    "Name;Kraft;Weg\nEinheit;N;mm\nIntervall [ms];0,5;0,5\n" + lines(lambda i: ";" + fu(";", de)(i)),
)
add(
    "channels of two intervals",
    "Name,Force,Temp\nUnit,N,degC\nInterval,0.0005 s,0.005 s\n"
    + lines(lambda i: f",{f(i)}," + (f"{20 + i}" if i < 6 else "")),
    position=None,
    refused="rate|interval|Interval",
)
add(
    "DIAdem ASCII with properties",
    "Name;Zeit;Kraft;Weg\nEinheit;s;N;mm\nLänge;60;60;60\nKommentar;;;\n" + lines(lambda i: ";" + tfu(";", de)(i)),
)
add(
    "DIAdem header of DAT",
    "DIAEXTENDED  {@:ENGLISH\n#BEGINGLOBALHEADER\n101,Run 3\n#ENDGLOBALHEADER\n#BEGINCHANNELHEADER\n200,Force\n202,N\n"
    "#ENDCHANNELHEADER\n",
    suffix=".dat",
    refused="table|rows",
)
add(
    "catman ASCII",
    "HBM DAQ\nT0=12.05.2024 14:22:11\nTime  1 - default sample rate [s]\tForce [N]\tPosition [mm]\t\n"
    "T0 = 12.05.2024 14:22:11\t\t\t\ndt=500 us\tdt=500 us\tdt=500 us\t\nSR=2000 Hz\t\t\t\n"
    + lines(lambda i: tfu("\t")(i) + "\t"),
    suffix=".asc",
)
add(
    "catman, German",
    "Zeit  1 - Standardmessrate [s]\tKraft [N]\tWeg [mm]\t\ndt=0,5 ms\tdt=0,5 ms\tdt=0,5 ms\t\nBereich\t0..200 N\t0..50 mm\t\n"
    + lines(lambda i: tfu("\t", de)(i) + "\t"),
    suffix=".asc",
    encoding="cp1252",
)
add(
    "catman without times",
    "Kraft [N]\tWeg [mm]\t\nAbtastrate: 2000 Hz\t\t\nSensor: U9C\tSensor: WA\t\n"
    + lines(lambda i: fu("\t", de)(i) + "\t"),
    suffix=".asc",
)
add(
    "dSPACE ControlDesk",
    "version,1.0\norigin,ControlDesk 7.1\ntype,Measurement\ndescription,\nfile_timestamp,2024-05-12 14:22:11\n"
    'path,"Model Root","Model Root/Force","Model Root/Pos"\nunit,s,N,mm\nraster,HostService,HostService,HostService\n'
    'descr,time,"Force","Position"\ntrace_values,,,\n' + lines(lambda i: "," + tfu()(i)),
    options={"channels": {"force": "column 3", "position": "column 4"}},
    refused="heading|time",
)
add(
    "dSPACE with a value header",
    "DSPACE,ControlDesk\nDate,2024-05-12\nSamplingPeriod,0.0005\n\nXAxis,Force,Position\n[s],[N],[mm]\n" + lines(tfu()),
)
add(
    "dSPACE headings with paths",
    'time [s],"Model Root/Plant/Force/Out1 [N]","Model Root/Plant/Position/Out1 [mm]"\n' + lines(tfu()),
)
add(
    "DEWESoft",
    "Data file: test.dxd\nStart time: 12.05.2024 14:22:11.000\nSample rate: 2000.00 Hz\nChannels: 2\n\nTime (s)\tForce (N)\tPosition (mm)\n"
    + lines(tfu("\t")),
    suffix=".txt",
)
add(
    "imc FAMOS ASCII",
    "Kraft\t\tWeg\nX/s\tY/N\tX/s\tY/mm\n" + lines(lambda i: f"{t(i)}\t{f(i)}\t{t(i)}\t{u(i)}"),
    suffix=".txt",
    refused="force|heading|unit|channel",
)
add(
    "Instron Bluehill",
    '"Results Table 1"\n"","Max load"\n"1","15.7"\n\n"Time","Displacement","Force"\n"(s)","(mm)","(N)"\n'
    + lines(lambda i: f'"{t(i)}","{u(i)}","{f(i)}"'),
)
add(
    "Zwick testXpert",
    '"Prüfzeit";"Kraft";"Weg"\n"s";"N";"mm"\n' + lines(tfu(";", de)),
    encoding="cp1252",
    suffix=".TRA",
)
add(
    "MTS TestSuite",
    "MTS793|MPT|ENU|1|2|.|/|:|1|0|0|A\n\nData Acquisition: Timed  Time: 11 Sec  5/12/2024 2:22:11 PM\n"
    "Running Time\tAxial Force\tAxial Displacement\nSec\tN\tmm\n" + lines(tfu("\t")),
    suffix=".txt",
)
add("Shimadzu", '"Time","Force","Stroke"\n"sec","N","mm"\n' + lines(tfu()))
add(
    "TwinCAT scope",
    "Name\tForce\tPosition\nSymbolComment\t\t\nData-Type\tREAL64\tREAL64\nSampleTime[ms]\t0.5\t0.5\nVariableSize\t8\t8\nUnit\tN\tmm\n\n"
    + lines(lambda i: f"{t(i, 1e3, 1)}\t{f(i)}\t{u(i)}"),
    suffix=".csv",
    refused="heading|time|unit",
)
add(
    "CODESYS trace",
    "Time;PLC_PRG.rForce;PLC_PRG.rPosition\n" + lines(lambda i: f"{i * 500};{f(i)};{u(i)}"),
    options={"units": {"time": "us", "force": "N", "position": "mm"}},
)
add("Simulink to CSV", "time,force_N,position_mm\n" + lines(tfu()), options={"units": {"time": "s"}})
add("pandas with an index", ",Time [s],Force [N],Position [mm]\n" + lines(lambda i: f"{i},{tfu()(i)}"))
add("pandas with two rows of headings", "Time,Force,Position\ns,N,mm\n\n" + lines(tfu()))
add(
    "numpy savetxt",
    "# time [s] force [N] position [mm]\n" + lines(lambda i: f"{i / 2000:.18e} {float(f(i)):.18e} {POSITION[i]:.18e}"),
    suffix=".txt",
)
add("Arduino serial", lines(lambda i: f"t_us:{i * 500},F_N:{f(i)},x_mm:{u(i)}"), refused="table|key")
add("Origin", 'Time\tForce\tPosition\ns\tN\tmm\n"run 3"\t"S2M"\t"laser"\n' + lines(tfu("\t")), suffix=".txt")
add(
    "LabChart",
    "Interval=\t0.0005 s\nExcelDateTime=\t4.5424598738425926e+004\t5/12/2024 14:22:11\nTimeFormat=\tStartOfBlock\n"
    "ChannelTitle=\tForce\tPosition\nRange=\t200 N\t10 mm\nUnitName=\tN\tmm\n" + lines(tfu("\t")),
    suffix=".txt",
    refused="heading|unit",
)
add(
    "AcqKnowledge",
    "rig3.acq\n0.5 msec/sample\n2 channels\nForce\nN\nPosition\nmm\nsec,CH1,CH2,\n" + lines(lambda i: tfu()(i) + ","),
    suffix=".txt",
    refused="channel|heading|unit|force",
)
add(
    "TA Instruments",
    "[step]\nRun 3\nTime\tForce\tGap\ns\tN\tmm\n" + lines(tfu("\t")),
    suffix=".txt",
    options={"channels": {"position": "Gap"}},
)
add("HBM MX with decimals by commas and times", "Zeit;MX840_CH1;MX840_CH2\n[s];[N];[mm]\n" + lines(tfu(";", de)))
add(
    "Kistler MARS",
    "Signal;Fz;s\nEinheit;N;mm\nAbtastrate;2000;Hz\n\nNr;Fz;s\n" + lines(lambda i: f"{i + 1};{fu(';', de)(i)}"),
)
add(
    "two blocks side by side",
    "Force,,Position,\nTime [s],F [N],Time [s],x [mm]\n" + lines(lambda i: f"{t(i)},{f(i)},{t(i)},{u(i)}"),
)
add(
    "key=value header",
    "rig=3\nfs=2000 Hz\nforce_unit=N\nchannels=Force [N];Position [mm]\n\n" + lines(fu(";")),
    refused="heading|columns",
    remedy={"columns": ("Force [N]", "Position [mm]")},
)
add(
    "key=value header with columns",
    "fs = 2000\ncolumns = force [N], position [mm]\n" + lines(fu()),
    refused="heading|columns",
    remedy={"columns": ("Force [N]", "Position [mm]")},
)
add(
    "key=value in every row",
    lines(lambda i: f"t={t(i)} F={f(i)} x={u(i)}"),
    suffix=".log",
    options={"units": {"t": "s", "F": "N", "x": "mm"}},
    refused="table|key",
)
add(
    "JSON header over a table",
    '{"rate": 2000, "rig": 3}\nForce [N],Position [mm]\n' + lines(fu()),
    refused="rate",
    remedy={"rate": 2000.0},
)
