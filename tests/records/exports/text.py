"""Tables of text: headings, units, separators, encodings, and what stands around the numbers."""

from __future__ import annotations

from tests.records.exports.base import FORCE, POSITION, Kind, N, de, f, fu, lines, t, tfu, u

TEXT = Kind()
add = TEXT.add
HEAD = "Time [s],Force [N],Position [mm]\n"
SEMI = "Zeit [s];Kraft [N];Weg [mm]\n"

add("channels called N and T", "T [s],N [N],X [mm]\n" + lines(tfu()))
add(
    "counter names as channels",
    "Time [s],N1 [N],Point [mm]\n" + lines(tfu()),
    options={"channels": {"force": "N1 [N]", "position": "Point [mm]"}},
)
add("a numbered channel", "t [s];No 1 [N];No 2 [mm]\n" + lines(tfu(";")))
add("a row counter N beside", "N,Time [s],Force [N],Position [mm]\n" + lines(lambda i: f"{i + 1},{tfu()(i)}"))
add(
    "header one cell more",
    "Time [s],Force [N],Position [mm],Note\n" + lines(tfu()),
    refused=r"4 (head|cells|names)|heading",
)
add(
    "header of six over five that end in a separator",
    "Time [s];Force [N];Note;Position [mm];A [V];B [V]\n" + lines(lambda i: f"{t(i)};{f(i)};{u(i)};1.0;2.0;"),
    refused=r"6|heading",
)
add("header one cell fewer", "Time [s],Force [N]\n" + lines(tfu()), refused="heading")
add(
    "index without a heading",
    "Time [s],Force [N],Position [mm]\n" + lines(lambda i: f"{i},{tfu()(i)}"),
    refused="heading|counts",
)
add(
    "R table with row names",
    '"Time" "Force" "Position"\n' + lines(lambda i: f'"{i + 1}" {t(i)} {f(i)} {u(i)}'),
    options={"units": {"time": "s", "force": "N", "position": "mm"}},
    refused="heading|counts",
)
add("units glued by underscore", "t_s,F_N,x_um\n" + lines(lambda i: f"{t(i)},{f(i)},{u(i, 1e3, 1)}"))
add("x_um beside others", "time_ms,force_mN,x_um\n" + lines(lambda i: f"{t(i, 1e3, 1)},{f(i, 1e3, 0)},{u(i, 1e3, 1)}"))
add(
    "inches with a dot",
    "Time (sec.),Load (N),Stroke (in.)\n" + lines(lambda i: f"{t(i)},{f(i)},{POSITION[i] / 25.4:.12f}"),
    rtol=1e-6,
)
add("micros column", "micros,force_N,pos_mm\n" + lines(lambda i: f"{i * 500},{f(i)},{u(i)}"))
add("millis column", "millis;force_N;pos_mm\n" + lines(lambda i: f"{t(i, 1e3, 1)};{f(i)};{u(i)}"))
add("full-width signs", "时间(s),力(N),位移(mm)\n" + lines(tfu()))
add("full-width brackets", "Time（s）,Force（N）,Position（mm）\n" + lines(tfu()))
add("Cyrillic words", "Время, с;Сила, Н;Перемещение, мм\n" + lines(tfu(";", de)))
add("Cyrillic in cp1251", ("Время [с];Сила [Н];Перемещение [мм]\n" + lines(tfu(";", de))), encoding="cp1251")
add("French words", "Temps (s);Effort (N);Déplacement (mm)\n" + lines(tfu(";", de)), encoding="cp1252")
add("Spanish words", "Tiempo (s);Fuerza (N);Desplazamiento (mm)\n" + lines(tfu(";", de)))
add("Italian words", "Tempo [s];Forza [N];Spostamento [mm]\n" + lines(tfu(";", de)))
add("Polish words", "Czas [s];Siła [N];Przemieszczenie [mm]\n" + lines(tfu(";", de)), encoding="cp1250")
add("single quotes", "'Time [s]','Force [N]','Position [mm]'\n" + lines(lambda i: f"'{t(i)}','{f(i)}','{u(i)}'"))
add("quoted numbers", '"Time [s]","Force [N]","Position [mm]"\n' + lines(lambda i: f'"{t(i)}","{f(i)}","{u(i)}"'))
add(
    "quoted decimal commas",
    '"t [s]","F [N]","u [mm]"\n' + lines(lambda i: de(f'"{t(i)}"|"{f(i)}"|"{u(i)}"').replace("|", ",")),
)
add(
    "units row with dashes beside",
    "Index,Time,Force,Position,Flag\n-,s,N,mm,-\n" + lines(lambda i: f"{i},{tfu()(i)},0"),
)
add(
    "units row in brackets",
    "Time;Force;Position\n[s];[kN];[m]\n" + lines(lambda i: f"{t(i)};{f(i, 1e-3, 6)};{u(i, 1e-3, 7)}"),
)
add("units row with one empty cell", "Time,Force,Position,Status\ns,N,mm,\n" + lines(lambda i: f"{tfu()(i)},1"))
add("unit row two lines below", "Time,Force,Position\nAI0,AI1,AI2\ns,N,mm\n" + lines(tfu()))
add("long names and descriptions", "Time,Force,Position\nElapsed,Load cell S2M,Laser ILD1420\ns,N,mm\n" + lines(tfu()))
add("min and max rows above", "Time,Force,Position\ns,N,mm\nMin,0,-10\nMax,100,10\n" + lines(tfu()))
add(
    "an LSB row under the units",
    "Time;Force;Position\ns;N;mm\nLSB;0.001;0.0001\n" + lines(lambda i: f"{t(i)};{f(i)};{u(i)}"),
)
add(
    "counts under an LSB row",
    "Time;Force;Position\ns;N;mm\nLSB;0.001;0.0001\n"
    + lines(lambda i: f"{t(i)};{FORCE[i] * 1e3:.0f};{POSITION[i] * 1e4:.0f}"),
    refused="LSB",
    remedy={
        "channels": {
            "force": {"column": "Force", "scale": "0.001"},
            "position": {"column": "Position", "scale": "0.0001"},
        }
    },
)
add("unlabelled LSB row", "Time;Force;Position\ns;N;mm\n1;0.001;0.0001\n" + lines(tfu(";")), refused="line 3|time")
add(
    "a scale row that is applied",
    "Time [s],Force [N],Position [mm]\nScale,1,1\n" + lines(tfu()),
    refused="scale|Scale|line 2",
)
add("row of zeros as offsets", "Time;Force;Position\ns;N;mm\nOffset;0;0\n" + lines(tfu(";")))
add("repeated header after a pause", HEAD + lines(tfu(), 30) + HEAD + "".join(tfu()(i) + "\n" for i in range(30, N)))
add("footer of statistics", HEAD + lines(tfu()) + "\nMean,12.5,0.1\nStd,2.1,1.0\n")
add("footer of words", HEAD + lines(tfu()) + "--- end of file ---\n")
add("comment block of hashes", "# rig 3\n# operator: A. B.\n# date 2024-05-12\n#\n" + HEAD + lines(tfu()))
add("commented names over data", "# t [s]\tF [N]\tx [mm]\n" + lines(tfu("\t")), suffix=".dat")
add("semicolon comments", "; rig 3\n; fs=2000 Hz\n" + HEAD + lines(tfu()))
add("double slash comments", "// time [s], force [N], position [mm]\n" + lines(tfu(", ")))
add("percent header of MATLAB", "%time (s)  force (N)  position (mm)\n" + lines(tfu("  ")), suffix=".txt")
add("exclamation comments", "! Ansys export\n! TIME FORCE DISP\nTIME [s] FORCE [N] DISP [mm]\n" + lines(tfu(" ")))
add("yaml front matter", "---\nrig: 3\nrate: 2000 Hz\n---\n" + HEAD + lines(tfu()))
add("ini sections above", "[Header]\nOperator=Novak\nSampleRate=2000\n[Data]\n" + HEAD + lines(tfu()))
add("XML-like header", '<meta rig="3" rate="2000"/>\n' + HEAD + lines(tfu()))
add("tabs and blanks mixed", "Time [s]\tForce [N]\tPosition [mm]\n" + lines(lambda i: f"{t(i)}\t {f(i)}\t {u(i)}"))
add(
    "fixed width",
    f"{'Time(s)':>12}{'Force(N)':>14}{'Pos(mm)':>14}\n" + lines(lambda i: f"{t(i):>12}{f(i):>14}{u(i):>14}"),
    suffix=".prn",
)
add(
    "decimal comma, semicolon, blank after",
    "Zeit [s]; Kraft [N]; Weg [mm]\n" + lines(lambda i: de(f"{t(i)}; {f(i)}; {u(i)}")),
)
add(
    "decimal comma and tabs, kN",
    "Zeit [ms]\tKraft [kN]\tWeg [µm]\n" + lines(lambda i: de(f"{t(i, 1e3, 1)}\t{f(i, 1e-3, 6)}\t{u(i, 1e3, 1)}")),
    encoding="cp1252",
)
add("UTF-16 little endian", "Zeit [s]\tKraft [N]\tWeg [mm]\r\n" + lines(tfu("\t", de), end="\r\n"), encoding="utf-16")
add("UTF-16 big endian without mark", HEAD + lines(tfu()), encoding="utf-16-be")
add("UTF-32", HEAD + lines(tfu()), encoding="utf-32")
add("UTF-8 with mark", SEMI + lines(tfu(";", de)), encoding="utf-8-sig")
add("Shift-JIS", "時間 [s],荷重 [N],変位 [mm]\n" + lines(tfu()), encoding="shift_jis")
add("GBK", "时间 [s],力 [N],位移 [mm]\n" + lines(tfu()), encoding="gbk")
add("Mac line ends", (HEAD + lines(tfu())).replace("\n", "\r"))
add(
    "NUL bytes in a file with times",
    (HEAD + lines(tfu(), 30)).encode() + b"\x00" * 40 + b"\n" + "".join(tfu()(i) + "\n" for i in range(30, N)).encode(),
)
add(
    "NUL block in a file without times",
    b"# fs = 2000 Hz\nForce [N],Position [mm]\n"
    + lines(fu(), 30).encode()
    + b"\x00" * 40
    + b"\n"
    + "".join(fu()(i) + "\n" for i in range(30, N)).encode(),
    refused="uncertain|NUL",
)
add(
    "NUL block that eats a line end",
    b"# fs = 2000 Hz\nForce [N],Position [mm]\n"
    + lines(fu(), 30).encode()
    + b"\x00" * 400
    + "".join(fu()(i) + "\n" for i in range(35, N)).encode(),
    refused="uncertain|NUL",
)
add(
    "thousands by apostrophe",
    "t [s];F [mN];u [um]\n" + lines(lambda i: f"{t(i)};{FORCE[i] * 1e3:,.0f};{u(i, 1e3, 1)}".replace(",", "'")),
    refused="thousands",
)
add(
    "thousands by comma in quotes",
    "t [s],F [mN],u [mm]\n" + lines(lambda i: f'{t(i)},"{FORCE[i] * 1e3:,.1f}",{u(i)}'),
    refused="thousands",
)
add(
    "thousands by point",
    "t [s];F [mN];u [mm]\n"
    + lines(lambda i: de(t(i)) + ";" + f"{FORCE[i] * 1e3:,.1f}".translate({44: ".", 46: ","}) + ";" + de(u(i))),
    refused="thousands",
)
add(
    "one column beyond a thousand by point",
    "t [s];F [mN];u [mm]\n"
    + lines(lambda i: de(t(i)) + ";" + f"{round(FORCE[i] * 1e3):,d}".replace(",", ".") + ";" + de(u(i))),
    refused="thousands|decimal",
)
add(
    "decimal comma separated by commas", "t [s],F [N],u [mm]\n" + lines(tfu(",", de)), refused="two|can be read|decimal"
)
add(
    "two tables one below the other",
    HEAD + lines(tfu()) + "\nFreq [Hz],Amp [mm]\n" + "".join(f"{k},{k * 0.1:.2f}\n" for k in range(40)),
    refused="table|heading",
)
add(
    "a text column between",
    "Time [s],State,Force [N],Position [mm]\n" + lines(lambda i: f"{t(i)},{'RUN' if i % 7 else 'HOLD'},{f(i)},{u(i)}"),
)
add("booleans beside", "Time [s],Trigger,Force [N],Position [mm]\n" + lines(lambda i: f"{t(i)},{i > 9},{f(i)},{u(i)}"))
add(
    "no heading at all", lines(tfu()), refused="columns", remedy={"columns": ("time [s]", "force [N]", "position [mm]")}
)
add(
    "heading without units",
    "Time,Force,Position\n" + lines(tfu()),
    refused="unit",
    remedy={"units": {"time": "s", "force": "N", "position": "mm"}},
)
add("heading that is a broken formula", "Time [s],$\\badmacro{F$ [N],$x_{1$ [mm]\n" + lines(tfu()))
add("mathematical headings", "$t$ [s],$F_N$ [N],$x_1$ [mm]\n" + lines(tfu()))
add("escapes in a heading", "Time [s],\x1b[31mForce [N],Position [mm]\n" + lines(tfu()))
add(
    "column named by number",
    "Note,Time,F,x\n" + lines(lambda i: f"ok,{tfu()(i)}"),
    options={
        "channels": {"time": "column 2", "force": "column 3", "position": "column 4"},
        "units": {"time": "s", "force": "N", "position": "mm"},
    },
)
add(
    "repeated headings",
    "Value,Value,Value\n" + lines(tfu()),
    options={
        "channels": {"time": "column 1", "force": "column 2", "position": "column 3"},
        "units": {"time": "s", "force": "N", "position": "mm"},
    },
)
add(
    "two-valued command in N",
    "Time [s],pulses [N],Position [mm]\n" + lines(lambda i: f"{t(i)},{40 if i // 5 % 2 else -40},{u(i)}"),
    refused="two values",
    force=None,
)
add(
    "two-valued command beside the force",
    "Time [s],F_cmd [N],Force [N],Position [mm]\n"
    + lines(lambda i: f"{t(i)},{40 if i // 5 % 2 else -40},{f(i)},{u(i)}"),
)
add(
    "a long header of free text",
    "".join(f"Line {i}: some words, and 3 more\n" for i in range(40)) + HEAD + lines(tfu()),
)
add("a sentence with as many commas", "Rig three, Monday, second run\n" + HEAD + lines(tfu()))
add(
    "markdown table",
    "| Time [s] | Force [N] | Position [mm] |\n|---:|---:|---:|\n" + lines(lambda i: f"| {t(i)} | {f(i)} | {u(i)} |"),
    suffix=".md",
)
add("unit in angle brackets", "Time <s>;Force <N>;Position <mm>\n" + lines(tfu(";")))
add("unit after at sign text", "Time [s],Force (CH1) [N],Position (CH2) [mm]\n" + lines(tfu()))
add("g-force beside", "Time [s],Acc [g],Force [N],Position [mm]\n" + lines(lambda i: f"{t(i)},0.01,{f(i)},{u(i)}"))
add(
    "kilograms-force",
    "Time [s],Load [kgf],Position [mm]\n" + lines(lambda i: f"{t(i)},{FORCE[i] / 9.80665:.9f},{u(i)}"),
    rtol=1e-6,
)
add(
    "mV/V beside",
    "Time [s],Bridge [mV/V],Force [N],Position [mm]\n" + lines(lambda i: f"{t(i)},{FORCE[i] / 100:.5f},{f(i)},{u(i)}"),
)
add("plus signs and exponents", HEAD + lines(lambda i: f"{i / 2000:+.6E},{FORCE[i]:+.6E},{POSITION[i]:+.6E}"))
add(
    "C hexadecimal status beside",
    "Time [s],Force [N],Position [mm],Status\n" + lines(lambda i: f"{tfu()(i)},0x0{i % 8}"),
)
add("trailing separators", "Time [s],Force [N],Position [mm],,,\n" + lines(lambda i: f"{tfu()(i)},,,"))
add("leading separator", ";Zeit [s];Kraft [N];Weg [mm]\n" + lines(lambda i: ";" + tfu(";", de)(i)))
add("data after a marker line", "Title: x\n#DATA\n" + HEAD + lines(tfu()))
add("blank between header and data", HEAD + "\n\n" + lines(tfu()))
add("missing cells", HEAD + lines(lambda i: tfu()(i) if i != 20 else f"{t(20)},,{u(20)}"))
add("NaN as text", HEAD + lines(lambda i: tfu()(i) if i != 20 else f"{t(20)},NaN,{u(20)}"))
add("gap of rows", HEAD + "".join(tfu()(i) + "\n" for i in range(N) if i not in (20, 21)))
