"""Layouts of many exporters, all holding the same samples: invented for the tests, none copied from a file."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

N = 24
RATE = 2000.0


def de(text: str) -> str:
    """With decimal commas."""
    return text.replace(".", ",")


def t(i: int, scale: float = 1.0, digits: int = 4) -> str:
    return f"{i / RATE * scale:.{digits}f}"


def f(i: int, scale: float = 1.0, digits: int = 3) -> str:
    return f"{(12.5 + 0.001 * i + 3.0 * (i % 5)) * scale:.{digits}f}"


def u(i: int, scale: float = 1.0, digits: int = 4) -> str:
    return f"{(-0.25 - 0.0001 * i) * scale:.{digits}f}"


def rows(make: Callable[[int], str], end: str = "\n", n: int = N) -> str:
    return "".join(make(i) + end for i in range(n))


@dataclass(frozen=True)
class Layout:
    """A file, how to read it, and what is in it."""

    name: str
    content: str | bytes
    options: dict[str, Any] = field(default_factory=dict)
    suffix: str = ".csv"
    #: Roles the record must hold; the samples are the same in every layout.
    holds: tuple[str, ...] = ("force", "position")


LAYOUTS: list[Layout] = []


def add(name: str, content: str | bytes, **more: Any) -> None:
    LAYOUTS.append(Layout(name, content, **more))


def plain(i: int) -> str:
    return f"{t(i)},{f(i)},{u(i)}"


def german(i: int) -> str:
    return de(f"{t(i)};{f(i)};{u(i)}")


def tabbed(i: int) -> str:
    return f"{t(i)}\t{f(i)}\t{u(i)}"


add("time in ms", "Time (ms),Force (N),Position (mm)\n" + rows(lambda i: f"{t(i, 1e3, 1)},{f(i)},{u(i)}"))
add("quantity slash unit", "t / s;Kraft / N;Weg / mm\n" + rows(german))
add("unit after in", "t in ms;F in kN;u in mm\n" + rows(lambda i: de(f"{t(i, 1e3, 1)};{f(i, 1e-3, 6)};{u(i)}")))
add("unit after a comma", '"Time, s","Force, N","Position, mm"\n' + rows(plain))
add("unit as a suffix", "Time_s,Force_N,Displacement_mm\n" + rows(plain))
add("units in capitals", "TIME (S),LOAD (KN),DISP (MM)\n" + rows(lambda i: f"{t(i)},{f(i, 1e-3, 6)},{u(i)}"))
add("unit row above the names", "s;N;mm\nZeit;Kraft;Weg\n" + rows(german))
add("unit row in words", "Time,Force,Position\nseconds,Newtons,Millimeters\n" + rows(plain))
add("unit row in brackets, blank lines", "Time,Load,Extension\n\n[s],[N],[mm]\n\n" + rows(plain))
add("commented header", "# time [s] force [N] position [mm]\n" + rows(lambda i: f"{t(i)} {f(i)} {u(i)}"), suffix=".txt")
add("percent comments", "% drop test 3\n% t [s]\tF [N]\tu [mm]\n" + rows(tabbed), suffix=".txt")
add("aligned columns", "Time [s]     Force [N]    Pos [mm]\n" + rows(lambda i: f"{t(i):>8} {f(i):>12} {u(i):>12}"))
add("header with commas over blanks", "time [s], force [N], position [mm]\n" + rows(lambda i: f"{t(i)} {f(i)} {u(i)}"))
add("comma and blank", "time [s], force [N], position [mm]\n" + rows(lambda i: f"{t(i)}, {f(i)}, {u(i)}"))
add("bars", "| t [s] | F [N] | u [mm] |\n|---|---|---|\n" + rows(lambda i: f"| {t(i)} | {f(i)} | {u(i)} |"))
add("quoted decimal commas", '"t [s]","F [N]","u [mm]"\n' + rows(lambda i: f'"{de(t(i))}","{de(f(i))}","{de(u(i))}"'))
add("exponents", "t [s];F [N];u [m]\n" + rows(lambda i: f"{i / RATE:.6E};{float(f(i)):.6E};{float(u(i)) / 1e3:.6E}"))
add("Fortran exponents", "t_s F_N pos_mm\n" + rows(lambda i: f"{t(i)} {float(f(i)):.6E} {u(i)}".replace("E", "D")))
add("typographic minus", "t [s];F [N];u [mm]\n" + rows(lambda i: german(i).replace("-", "\u2212")))
add("no-break spaces", "t [s];F [N];u [mm]\n" + rows(lambda i: "\xa0" + german(i).replace(";", "\xa0;\xa0")))
add("signs set apart", "No.;t [s];F [N];u [mm]\n" + rows(lambda i: f"{i + 1};{t(i)};+ {f(i)};- {u(i)[1:]}"))
add(
    "clock in ISO",
    "Timestamp,Force [N],Pos [mm]\n" + rows(lambda i: f"2024-05-12T14:22:{11 + i / RATE:07.4f}Z,{f(i)},{u(i)}"),
)
add(
    "date and clock apart",
    "Date,Time,Force [N],Pos [mm]\n" + rows(lambda i: f"5/12/2024,14:22:{11 + i / RATE:07.4f},{f(i)},{u(i)}"),
)
add(
    "twelve-hour clock",
    "Date/Time;Load (N);Stroke (mm)\n" + rows(lambda i: f"05/12/2024 02:22:{11 + i / RATE:07.4f} PM;{f(i)};{u(i)}"),
)
add(
    "past midnight",
    "Zeit;F [N];s [mm]\n"
    + rows(lambda i: f"{'23:59:59' if i < 10 else '00:00:00'},{de(t((i + 1990) % 2000, 1))[2:]};{de(f(i))};{de(u(i))}"),
)
add(
    "clock past midnight with date",
    "Datum Uhrzeit;F [N];Weg [mm]\n"
    + rows(
        lambda i: (
            f"{'31.12.2024 23:59:59' if i < 10 else '01.01.2025 00:00:00'},"
            f"{t((i + 1990) % 2000, 1)[2:]};{de(f(i))};{de(u(i))}"
        )
    ),
)
add(
    "thousandths after a colon",
    "time;force [N];pos [mm]\n" + rows(lambda i: f"14:22:11:{i * 10:03d};{f(i)};{u(i)}"),
    options={"scale": 20.0},
)
add(
    "rate in the header, no times",
    "Sample rate:\t2000 Hz\nForce [N]\tPosition [mm]\n" + rows(lambda i: f"{f(i)}\t{u(i)}"),
)
add(
    "step in the header, no times",
    "Abtastintervall;0,5;ms\nKraft [N];Weg [mm]\n" + rows(lambda i: de(f"{f(i)};{u(i)}")),
)
add("rate from the user", "Force [N],Position [mm]\n" + rows(lambda i: f"{f(i)},{u(i)}"), options={"rate": 2000.0})
add("numbered rows and a rate", "Nr;Kraft [N];Weg [mm]\nfs = 2 kHz\n" + rows(lambda i: f"{i + 1};{f(i)};{u(i)}"))
add(
    "coarse times, rate in the header",
    "fs: 2000 Hz\ntime [s],force [N],position [mm]\n" + rows(lambda i: f"{round(i / 2) / 1000:.3f},{f(i)},{u(i)}"),
)
add(
    "time without a unit, rate in the header",
    "Sampling frequency = 2000 Hz\ntime;force [N];position [mm]\n" + rows(lambda i: f"{t(i, 1e3, 1)};{f(i)};{u(i)}"),
)
add(
    "statistics at the end",
    "t [s];F [N];u [mm]\n" + rows(german) + "\nMax;24,5;-0,25\nMin;12,5;-0,2523\nMittelwert;18,1;-0,251\n",
)
add("footer", "t [s],F [N],u [mm]\n" + rows(plain) + "End of data\nChecksum: 1A2B\n")
add("empty rows of a spreadsheet", "t [s];F [N];u [mm];;\n" + rows(lambda i: german(i) + ";;") + ";;;;\n;;;;\n")
add(
    "heading on every page",
    "t [s],F [N],u [mm]\n"
    + "".join(rows(lambda i, p=p: plain(i + 8 * p), n=8) + "t [s],F [N],u [mm]\n" for p in range(3)),
)
add(
    "remarks between rows",
    "t [s],F [N],u [mm]\n" + "".join(plain(i) + "\n" + ("# marker 1\n" if i == 9 else "") for i in range(N)),
)
add("doubled line ends", "t [s],F [N],u [mm]\r\r\n" + rows(plain, "\r\r\n"))
add("old line ends", "t [s],F [N],u [mm]\r" + rows(plain, "\r"))
add("no line end at the end", ("t [s],F [N],u [mm]\n" + rows(plain)).rstrip("\n"))
add(
    "UTF-16 big end first",
    b"\xfe\xff" + ("Zeit [s]\tKraft [N]\tWeg [mm]\r\n" + rows(lambda i: de(tabbed(i)), "\r\n")).encode("utf-16-be"),
)
add(
    "UTF-16 without a mark",
    ("Zeit [s]\tKraft [N]\tWeg [mm]\r\n" + rows(lambda i: de(tabbed(i)), "\r\n")).encode("utf-16-le"),
)
add(
    "micrometres in cp1252",
    ("Zeit [s];Kraft [N];Weg [µm]\n" + rows(lambda i: de(f"{t(i)};{f(i)};{u(i, 1e3, 1)}"))).encode("cp1252"),
)
add("micrometres in UTF-8", "Zeit [s];Kraft [N];Weg [\u03bcm]\n" + rows(lambda i: de(f"{t(i)};{f(i)};{u(i, 1e3, 1)}")))
add(
    "setpoint beside the position",
    "Time [s],Position setpoint [mm],Position [mm],Force [N]\n" + rows(lambda i: f"{t(i)},0.0000,{u(i)},{f(i)}"),
)
add(
    "further quantities",
    "Time [s],Force [N],Position [mm],Velocity [mm/s],Temp [°C],Voltage [V],pH\n"
    + rows(lambda i: plain(i) + ",0.1,21.5,1.2,7.0"),
)
add("position before force", "u [mm];t [s];F [N]\n" + rows(lambda i: f"{u(i)};{t(i)};{f(i)}"))
add("time last", "F [N];u [mm];t [s]\n" + rows(lambda i: f"{f(i)};{u(i)};{t(i)}"))
add(
    "times for each channel",
    "Zeit 1 [s];Kraft [N];Zeit 2 [s];Weg [mm]\n" + rows(lambda i: de(f"{t(i)};{f(i)};{t(i)};{u(i)}")),
)
add(
    "drive beside the position",
    "time [s],force [N],position [mm],drive [mm]\n" + rows(lambda i: plain(i) + f",{0.01 * i:.3f}"),
    holds=("force", "position", "drive"),
)
add(
    "German drive",
    "Zeit [s];Kraft [N];Weg Schlitten [mm];Antriebsweg [mm]\n" + rows(lambda i: german(i) + de(f";{0.01 * i:.3f}")),
    holds=("force", "position", "drive"),
)
add("Czech", ("Čas (s);Síla (N);Dráha (mm)\n" + rows(german)).encode("cp1250"))
add("names by the user", rows(plain), options={"columns": ("time [s]", "force [N]", "position [mm]")})
add(
    "names by number",
    rows(plain),
    options={
        "channels": {"time": "column 1", "force": "column 2", "position": "column 3"},
        "units": {"time": "s", "force": "N", "position": "mm"},
    },
)
add("units by the user", "Zeit;Kraft;Weg\n" + rows(german), options={"units": {"time": "s", "force": "N", "Weg": "mm"}})
add(
    "channels by the user",
    "t [s];A1 [N];A2 [N];B1 [mm];B2 [mm]\n" + rows(lambda i: de(f"{t(i)};{f(i)};1.0;2.0;{u(i)}")),
    options={"channels": {"force": "A1 [N]", "position": "B2"}},
)
add(
    "block of numbers above the table",
    "Kanal;1;2;3\nSeriennummer;1234;5678;9012\nBereich;200;100;50\n;t [s];F [N];u [mm]\n"
    + rows(lambda i: ";" + german(i)),
)
add("counts above the table", "Time\tForce\tDisplacement\ns\tN\tmm\n24\t24\t24\n" + rows(tabbed))
add(
    "test report above the table",
    "Testing machine report\nOperator;Novak\nDate;12.05.2014\nSpecimen;fibre 7, L0 = 599 mm\n"
    "Load cell;200 N\nSpeed;10;mm/min\n\nTime;Load;Extension\nsec;N;mm\n" + rows(lambda i: f"{t(i)};{f(i)};{u(i)}"),
)
add(
    "channel list",
    "Channel;Name;Unit\n1;Time;s\n2;Force;N\n3;Position;mm\n\n" + rows(lambda i: f"{t(i)};{f(i)};{u(i)}"),
)
add(
    "columns listed in remarks",
    "# Column 1: Time [s]\n# Column 2: Force [N]\n# Column 3: Position [mm]\n"
    + rows(lambda i: f"{t(i)} {f(i)} {u(i)}"),
)
add("labelled rows", "Name\tTime\tForce\tPosition\nUnit\ts\tN\tmm\n" + rows(lambda i: "\t" + tabbed(i)))
add(
    "oscilloscope",
    "x-axis,1,2\nsecond,Newton,mm\n" + rows(lambda i: f"{i / RATE:+.6E},{float(f(i)):+.6E},{float(u(i)):+.6E}"),
    options={"channels": {"force": "1", "position": "2"}},
)
add(
    "dynamometer with blanks",
    "  Running Time      Axial Force     Axial Displacement\n  Sec               N               mm\n"
    + rows(lambda i: f"  {t(i)}      {f(i)}      {u(i)}"),
)
add("semicolons and points", "Time [s];Force [N];Displacement [mm]\n" + rows(lambda i: f"{t(i)};{f(i)};{u(i)}"))
add("sep line with a tab", "sep=\t\nTime [s]\tForce [N]\tDisplacement [mm]\n" + rows(tabbed))
add(
    "seconds since 1970",
    "time [s],force [N],position [mm]\n" + rows(lambda i: f"{1715523731 + i / RATE:.4f},{f(i)},{u(i)}"),
    options={"epoch": True},
)
add("minutes", "Time [min],Force [N],Position [mm]\n" + rows(lambda i: f"{i / RATE / 60:.12f},{f(i)},{u(i)}"))
add(
    "trailing zeros dropped",
    "t [s];F [N];u [mm]\n" + rows(lambda i: de(f"{i / RATE:g};{float(f(i)):g};{float(u(i)):g}")),
)
add(
    "two digits of year",
    "Datum;Zeit;Kraft [N];Weg [mm]\n"
    + rows(
        lambda i: f"12.05.24;14:22:{11 + i / RATE:07.4f};{f(i)};{u(i)}".replace(".", ",").replace(
            "12,05,24", "12.05.24"
        )
    ),
)
add("pandas index", ",time [s],force [N],position [mm]\n" + rows(lambda i: f"{i}," + plain(i)))
add("multi-line quoted header", '"Time\n[s]","Force\n[N]","Position\n[mm]"\n' + rows(plain))
add("header with comma in quotes", '"Time, rel. [s]","Force, axial [N]","Position, abs [mm]"\n' + rows(plain))
add("three header lines", "Time,Force,Displacement\nrelative,axial,guide\n(s),(N),(mm)\n" + rows(plain))
add("split names", "Running\tAxial\tAxial\nTime\tForce\tDisplacement\nSec\tN\tmm\n" + rows(tabbed))
add("trailing delimiter data only", "t [s];F [N];u [mm]\n" + rows(lambda i: german(i) + ";"))
add("leading blank lines", "\n\n\nt [s];F [N];u [mm]\n" + rows(german))
add("column of words", "t [s];F [N];u [mm];trigger\n" + rows(lambda i: german(i) + (";TRUE" if i % 3 else ";FALSE")))
add("remark after unit", "t in s;Kraft in N (gefiltert);Weg in mm (links)\n" + rows(german))
add(
    "long header, short data",
    "".join(f"Info {i};value {i * 7}\n" for i in range(230)) + "t [s];F [N];u [mm]\n" + rows(german),
)
add(
    "long header of as many cells",
    "".join(f"Info {i};value {i * 7};x\n" for i in range(230)) + "t [s];F [N];u [mm]\n" + rows(german),
)


def lvm(columns: str, separator: str, body: str) -> str:
    tags = ["LabVIEW Measurement", f"Separator|{'Tab' if separator == chr(9) else 'Comma'}", "Decimal_Separator|."]
    tags += [f"X_Columns|{columns}", "Multi_Headings|Yes", "***End_of_Header***", ""]
    return "".join(tag.replace("|", separator) + "\n" for tag in tags) + body.replace("|", separator)


def segment(samples: int, names: str, units: str, steps: str, start: float, body: str) -> str:
    head = ["Channels|2|", f"Samples|{samples}|{samples}", "Date|2014/05/12|2014/05/12", "Time|14:22:11.0|14:22:11.0"]
    head += [
        f"Y_Unit_Label|{units}",
        f"X0|{start}|{start}",
        f"Delta_X|{steps}",
        "***End_of_Header***",
        f"{names}|Comment",
    ]
    return "\n".join(head) + "\n" + body + "\n"


STEPS = "0.0005|0.0005"
add(
    "LVM, commas, one column of times",
    lvm("One", ",", segment(N, "X_Value|F|u", "Newtons|Millimeters", STEPS, 0, rows(plain))),
    suffix=".lvm",
)
add(
    "LVM, times for each channel",
    lvm(
        "Multi",
        "\t",
        segment(N, "X_Value|F|X_Value|u", "N||mm", "0.0005||0.0005", 0, rows(lambda i: f"{t(i)}|{f(i)}|{t(i)}|{u(i)}")),
    ),
    suffix=".lvm",
)
add(
    "LVM, two segments",
    lvm(
        "No",
        "\t",
        segment(12, "X_Value|F|u", "N|mm", STEPS, 0.0, rows(lambda i: f"|{f(i)}|{u(i)}", n=12))
        + segment(12, "X_Value|F|u", "N|mm", STEPS, 0.006, rows(lambda i: f"|{f(i + 12)}|{u(i + 12)}", n=12)),
    ),
    suffix=".lvm",
)
add(
    "acquisition report",
    "Data header\nFile name: test.dxd\nStart time: 5/12/2014 2:22:11.000 PM\nNumber of channels: 2\n"
    "Sample rate: 2000\nStore type: always fast\n\nTime (s),Force (N),Position (mm)\n" + rows(plain),
)
add(
    "oscilloscope report",
    "Record Length,24,Points\nSample Interval,5.0e-4,s\nTrigger Point,0,Samples\n,,\n"
    "Time [s],Force [N],Position [mm]\n" + rows(plain),
)
add(
    "no decimals in ms",
    "Time (ms);Force (N);Position (um)\n" + "".join(f"{i * 20};{f(i)};{float(u(i)) * 1000:.1f}\n" for i in range(N)),
    options={"scale": 40.0},
)
add("semi in header comma data", "Time [s];Force [N];Position [mm]\n" + rows(plain))
add(
    "German exponents",
    "t [s];F [N];u [mm]\n" + rows(lambda i: de(f"{i / RATE:.6E};{float(f(i)):.6E};{float(u(i)):.6E}")),
)
add(
    "aligned header with units no brackets",
    "Time/s      Force/N      Position/mm\n" + rows(lambda i: f"{t(i):>8} {f(i):>12} {u(i):>12}"),
)
add("hash header commas", "#time [s],force [N],position [mm]\n" + rows(plain))
add("pipe sep no edges", "time [s]|force [N]|position [mm]\n" + rows(lambda i: f"{t(i)}|{f(i)}|{u(i)}"))
add(
    "clock hh:mm:ss unit",
    "Time [hh:mm:ss.000];Kraft [N];Weg [mm]\n" + rows(lambda i: de(f"00:00:{i / RATE:07.4f};{f(i)};{u(i)}")),
)
add("space after semicolons", "t [s]; F [N]; u [mm]\n" + rows(lambda i: german(i).replace(";", "; ")))
add("quoted header plain data", '"t [s]";"F [N]";"u [mm]"\n' + rows(german))
add("excel trailing sep header", "t [s];F [N];u [mm];\n" + rows(german))
add(
    "two header blocks with other counts",
    "Channel;CH1;CH2;CH3\nSensitivity;1,0;2,0;3,0\n\nZeit [s];Kraft [N];Weg [mm]\n" + rows(german),
)
add(
    "kilonewtons and metres",
    "Time(s)\tLoad(kN)\tStroke(m)\n" + rows(lambda i: f"{t(i)}\t{f(i, 1e-3, 6)}\t{u(i, 1e-3, 7)}"),
)
add(
    "empty first column",
    '"Name","Time","Force","Stroke"\n"","sec","N","mm"\n' + rows(lambda i: f'"","{t(i)}","{f(i)}","{u(i)}"'),
)
add("name of the test above", '"1 _ 1"\n"Time","Force","Stroke"\n"sec","N","mm"\n' + rows(plain))
add(
    "gap-free integer ms 1kHz coarse",
    "t [ms],F [N],u [mm]\n" + "".join(f"{i},{f(i)},{u(i)}\n" for i in range(N)),
    options={"scale": 2.0},
)
