"""Columns in counts, volts and amperes, of either sign, as a user declares them."""

from __future__ import annotations

from tests.records.exports.base import FORCE, POSITION, Kind, f, lines, t, tfu, u

CHANNELS = Kind()


def add(name: str, content: str, force: object = None, position: object = None, **more) -> None:
    said = {key: value for key, value in {"force": force, "position": position}.items() if value is not None}
    options = {**more.pop("options", {}), "channels": said}
    CHANNELS.add(name, content, options=options, **{"rtol": 1e-8, **more})


def two(head: str, force: float, position: float, form: str = ".10g") -> str:
    return head + "\n" + lines(lambda i: f"{t(i)},{FORCE[i] * force:{form}},{POSITION[i] * position:{form}}")


add(
    "volts, negative scale",
    two("Time [s],U1 [V],x [mm]", -1 / 200, 1),
    {"column": "U1", "unit": "V", "scale": "-200 N/V"},
)
add(
    "volts without a unit in the heading",
    two("Time [s],U1,x [mm]", 1 / 200, 1),
    {"column": "U1", "unit": "V", "scale": "200 N/V"},
)
add("millivolts under a scale in volts", two("Time [s],U1 [mV],x [mm]", 5, 1), {"column": "U1", "scale": "200 N/V"})
add("amperes of a motor", two("Time [s],I [A],x [mm]", 0.5, 1), {"column": "I [A]", "scale": "2 N/A"})
add(
    "amperes, uncertain scale",
    two("Time [s],I [A],x [mm]", 1 / 2.07, 1),
    {"column": "I [A]", "scale": "2.07 +/- 0.29 N/A"},
)
add(
    "uncertain scale with a sign of its own",
    two("Time [s],I [A],x [mm]", 1 / 2.07, 1),
    {"column": "I", "scale": "2.07 ± 0.29 N/A"},
)
add("counts of an encoder", two("Time [s],F [N],enc", 1, 1e3 / 0.25), None, {"column": "enc", "scale": "0.25 um"})
add(
    "counts named as the unit",
    two("Time [s],F [N],enc [counts]", 1, 1e3 / 17.857),
    None,
    {"column": "enc [counts]", "scale": "17.857 um"},
)
add(
    "counts per unit",
    two("Time [s],F [N],enc [counts]", 1, 1e3 / 5),
    None,
    {"column": "enc", "unit": "counts", "scale": "5 um/count"},
)
add("a sign alone", two("Time [s],F [N],x [mm]", -1, 1), {"column": "F [N]", "scale": "-1"})
add("a bare negative number", two("Time [s],F [N],x [mm]", -1, 1), {"column": "F [N]", "scale": -1})
add("a factor on newtons", two("Time [s],F [N],x [mm]", 1 / 1.05, 1), {"column": "F", "scale": "1.05"})
add("mV/V of a bridge", two("Time [s],S [mV/V],x [mm]", 0.01, 1), {"column": "S", "scale": "100 N/(mV/V)"})
add("unit overrides the heading", two("Time [s],F [N],x [mm]", 1e-3, 1), {"column": "F [N]", "unit": "kN"})
add("pressure of a cylinder", two("Time [s],p [bar],x [mm]", 0.02, 1), {"column": "p", "scale": "50 N/bar"})
add("degrees of a drum", two("Time [s],F [N],phi [deg]", 1, 2.0), None, {"column": "phi", "scale": "0.5 mm/deg"})
add(
    "a scale without what it needs",
    two("Time [s],U1 [V],x [mm]", 1 / 200, 1),
    {"column": "U1", "scale": "200 N"},
    refused="N/V|scale",
)
add(
    "a scale of another kind",
    two("Time [s],U1 [V],x [mm]", 1 / 200, 1),
    {"column": "U1", "scale": "200 mm/V"},
    refused="N/V|scale|N,",
)
add("a scale of zero", two("Time [s],U1 [V],x [mm]", 1 / 200, 1), {"column": "U1", "scale": "0 N/V"}, refused="0|scale")
add("no column named", two("Time [s],U1 [V],x [mm]", 1 / 200, 1), {"scale": "200 N/V"}, refused="column")
add("an unknown key", two("Time [s],U1 [V],x [mm]", 1 / 200, 1), {"column": "U1", "gain": "200 N/V"}, refused="gain")
add("the time named as the position", "Time [s],F [N],x [mm]\n" + lines(tfu()), None, "Time [s]", refused="time|Time")
add("a column that is not there", "Time [s],F [N],x [mm]\n" + lines(tfu()), "Kraft", None, refused="Kraft")
add(
    "one column for two roles",
    "Time [s],F [N],x [mm]\n" + lines(tfu()),
    "F [N]",
    "F [N]",
    refused="F .N.|two|twice|unit",
)
add("a unit for nothing", "Time [s],F [N],x [mm]\n" + lines(tfu()), options={"units": {"Kraft": "N"}}, refused="Kraft")
add("column number beyond the file", "Time [s],F [N],x [mm]\n" + lines(tfu()), "column 9", refused="column 9|3 columns")
add(
    "a text column by number",
    "Time [s],State,F [N],x [mm]\n" + lines(lambda i: f"{t(i)},on,{f(i)},{u(i)}"),
    "column 2",
    refused="text",
)
add(
    "column numbers count the file's columns",
    "Time [s],State,F,x\n" + lines(lambda i: f"{t(i)},on,{f(i)},{u(i)}"),
    "column 3",
    "column 4",
    options={"units": {"force": "N", "position": "mm"}},
)
add("a superscript as a column number", "Time [s],F [N],x [mm]\n" + lines(tfu()), "column ²", refused="column")
