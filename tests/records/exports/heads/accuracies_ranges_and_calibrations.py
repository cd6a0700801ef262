"""Lines of accuracy, tolerance and calibration that change nothing, and ranges, ticks, zeros and sheets of calibrations that do."""

from __future__ import annotations

import json

from tests.records.exports.base import FORCE, POSITION, TIME, Kind, N, f, fu, lines, t, tfu, u
from tests.records.exports.boxes import told
from tests.records.exports.heads.factors_levers_and_zeros import FU, HALVED, HEAD
from tests.records.exports.programs.channel_blocks import said
from tests.records.exports.programs.workbooks_and_binary_files import book, mat

ACCURACIES_RANGES_AND_CALIBRATIONS = Kind()
add = ACCURACIES_RANGES_AND_CALIBRATIONS.add

for head in (
    "Sampling: 2 kHz, every sample stored",
    "Accuracy 0.05 % FS, linearity 0.02 %, zero balance +/-1 %",
    "Temperature coefficient of zero: 0.002 %/K",
    "Rated output 2 mV/V, tolerance 0.1 %",
    "Two-point calibration on 3 May 2024",
    "Third of five drops, rope 2 x 3 m",
    "Weights: 2 x 1.25 kg",
    "Sensor noise 0.01 N rms",
    "ADC 24 bit, gain 128, 2 kSPS",
    "Scale division 0.1 N",
    "Force positive in tension",
    "Screw M8 x 20, torque 10 Nm",
    "Offset corrected",
    "Calibration factor already applied: 2.13 N/mV",
    "Averaging: none; damping ratio 0.02",
    "Fixture: double shear, half-inch pin",
    "Time zone: UTC+2, daylight saving +1 h",
    "Test aborted at 95 % of the maximum force",
    "Load rate 5 N/s, stroke rate 10 mm/s",
    "Preload 2 N, then zero of extension set",
):
    add(f"ordinary: {head}", head + "\n" + HEAD + lines(tfu()))

for head, remedy in (
    ("NB: force channel reads double because of the wrong range", said("0.5")),
    ("Load values should be halved", said("0.5")),
    ("Force = reading / 2", said("0.5")),
):
    add(
        f"nasty: {head}",
        head + "\n" + HEAD + lines(lambda i: f"{t(i)},{FORCE[i] * 2:.3f},{u(i)}"),
        refused="double|halved|reading",
        remedy=remedy,
    )
for head in (
    "Range factor x2 selected on the amplifier, force not corrected",
    "F_cal = 2.0",
    "force: sensitivity entered as 2.0 instead of 1.0 mV/V",
    "Each ring of the pulley carries half of the force",
):
    add(f"nasty: {head}", head + "\n" + HEAD + HALVED, refused="factor|cal|sensitivity|half", remedy=said("2"))
add(
    "nasty: offset (N), -3.2",
    "offset (N),-3.2\n" + HEAD + lines(lambda i: f"{t(i)},{FORCE[i] - 3.2:.3f},{u(i)}"),
    refused="offset",
    remedy=said("1"),
    force=FORCE - 3.2,
)
add(
    "nasty: zero shift",
    HEAD + lines(lambda i: f"{t(i)},{FORCE[i] + 0.8:.3f},{u(i)}") + "Zero after the test: 0.8 N\n",
    refused="Zero",
    remedy=said("1"),
    force=FORCE + 0.8,
)
add(
    "nasty: position in tenths",
    "Position in 1/10 mm\n" + HEAD + lines(lambda i: f"{t(i)},{f(i)},{POSITION[i] * 10:.3f}"),
    refused="1/10",
    remedy=said("0.1", "position [mm]", "position"),
)
add(
    "nasty: unit of ten",
    "Force unit: 10 mN\n" + HEAD + lines(lambda i: f"{t(i)},{FORCE[i] * 100:.1f},{u(i)}"),
    refused="10 mN",
    remedy=said("0.01"),
)
add(
    "nasty: an encoder",
    "displacement = encoder x 0.5\n" + HEAD + lines(lambda i: f"{t(i)},{f(i)},{POSITION[i] * 2:.4f}"),
    refused="0.5",
    remedy=said("0.5", "position [mm]", "position"),
)
add(
    "nasty: every second scan",
    "Scan: 4 kHz, every 2nd stored\n" + FU + lines(fu()),
    refused="rate|2nd",
    remedy={"rate": 2000.0},
)
add(
    "nasty: pushing is positive",
    "Sign: + = push, - = pull\n" + HEAD + lines(lambda i: f"{t(i)},{-FORCE[i]:.3f},{u(i)}"),
    refused="push|pull",
    remedy=said("-1"),
)
add(
    "nasty: ticks",
    "Time column counts ticks of 0.5 ms\n" + HEAD + lines(lambda i: f"{i},{fu()(i)}"),
    refused="tick",
    remedy={"channels": {"time": {"column": "time [s]", "scale": "0.0005"}}},
)
add(
    "nasty: HDF5, a gain at the root",
    told({"time": TIME}, time={"units": "s"}, file={"force_gain": 0.5}),
    suffix=".h5",
    refused="gain",
    remedy=said("1 N/N", "force"),
)
add(
    "nasty: MATLAB, a structure of calibrations",
    mat(time_s=TIME, force_N=FORCE / 2, position_mm=POSITION, cal={"force": 2.0, "position": 1.0}),
    suffix=".mat",
    refused="cal",
    remedy=said("2", "force_N"),
)


def calibrations(made_book) -> None:
    data = made_book.active
    data.append(["Time [s]", "Force [N]", "Position [mm]"])
    for i in range(N):
        data.append([float(TIME[i]), float(FORCE[i] / 2), float(POSITION[i])])
    page = made_book.create_sheet("Calibration")
    for row in (["Channel", "Slope", "Intercept"], ["Force", 2.0, 0.0], ["Position", 1.0, 0.0]):
        page.append(row)


add(
    "nasty: xlsx, a sheet of calibrations",
    book(calibrations),
    suffix=".xlsx",
    refused="Slope|Force|Calib",
    remedy=said("2", "Force [N]"),
)
add(
    "nasty: JSON, calibrations by channel",
    json.dumps(
        {
            "calibration": {"force": {"slope": 2.0, "offset": 0.0}, "position": {"slope": 1.0, "offset": 0.0}},
            "t_s": TIME.tolist(),
            "force_N": (FORCE / 2).tolist(),
            "position_mm": POSITION.tolist(),
        }
    ),
    suffix=".json",
    refused="slope",
    remedy=said("2", "force_N"),
)
