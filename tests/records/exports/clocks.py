"""When the samples were taken: clocks, epochs, rates in headers, and neither."""

from __future__ import annotations

from tests.records.exports.base import TIME, Kind, N, de, f, fu, lines, tfu, u

CLOCKS = Kind()
add = CLOCKS.add
FU = "Force [N],Position [mm]\n"


def row(stamp: str, i: int, separator: str = ",") -> str:
    return separator.join((stamp, f(i), u(i)))


def clock(i: int, start: float = 11.0, digits: int = 4) -> str:
    """hh:mm:ss after 14:22."""
    return f"14:22:{start + i / 2000:0{3 + digits}.{digits}f}"


add("ISO with Z", "Timestamp," + FU + lines(lambda i: row(f"2024-05-12T{clock(i)}Z", i)))
add("ISO with an offset", "Timestamp," + FU + lines(lambda i: row(f"2024-05-12T{clock(i)}+02:00", i)))
add("ISO with a blank and an offset", "time," + FU + lines(lambda i: row(f"2024-05-12 {clock(i)} +0200", i)))
add("ISO, six decimals", "time," + FU + lines(lambda i: row(f"2024-05-12T{clock(i, digits=6)}", i)))
add("ISO, nine decimals", "time," + FU + lines(lambda i: row(f"2024-05-12T{clock(i, digits=9)}", i)))
add(
    "end of summer time with offsets",
    "time,"
    + FU
    + lines(
        lambda i: row(
            f"2024-10-27T02:59:{59.99 + i / 2000:.4f}+02:00"
            if i < 20
            else f"2024-10-27T02:00:{(i - 20) / 2000:07.4f}+01:00",
            i,
        )
    ),
)
add(
    "begin of summer time with offsets",
    "time,"
    + FU
    + lines(
        lambda i: row(
            f"2024-03-31T01:59:{59.99 + i / 2000:.4f}+01:00"
            if i < 20
            else f"2024-03-31T03:00:{(i - 20) / 2000:07.4f}+02:00",
            i,
        )
    ),
)
add(
    "end of summer time without offsets",
    "time,"
    + FU
    + lines(
        lambda i: row(
            f"2024-10-27 02:59:{59.99 + i / 2000:.4f}" if i < 20 else f"2024-10-27 02:00:{(i - 20) / 2000:07.4f}", i
        )
    ),
    refused="hour|summer|backward|starts again",
)
add(
    "begin of summer time without offsets",
    "time,"
    + FU
    + lines(
        lambda i: row(
            f"2024-03-31 01:59:{59.99 + i / 2000:.4f}" if i < 20 else f"2024-03-31 03:00:{(i - 20) / 2000:07.4f}", i
        )
    ),
    refused="hour|summer|gap",
)
add("epoch in s", "epoch," + FU + lines(lambda i: row(f"{1715523731 + i / 2000:.4f}", i)), atol_time=1e-6)
add("epoch in ms", "epoch_ms," + FU + lines(lambda i: row(f"{1715523731000 + i * 0.5:.1f}", i)), atol_time=1e-6)
add("epoch in us", "timestamp_us," + FU + lines(lambda i: row(str(1715523731000000 + i * 500), i)), atol_time=1e-6)
add(
    "epoch in ns",
    "timestamp [ns]," + FU + lines(lambda i: row(str(1715523731000000000 + i * 500000), i)),
    atol_time=1e-6,
)
add(
    "epoch in ns, bare",
    "timestamp," + FU + lines(lambda i: row(str(1715523731000000000 + i * 500000), i)),
    atol_time=1e-6,
)
add(
    "ROS seconds and nanoseconds",
    "secs,nsecs," + FU + lines(lambda i: f"{1715523731},{i * 500000},{f(i)},{u(i)}"),
    refused="time|secs",
    atol_time=1e-6,
)
add("time of day, decimal comma", "Zeit;Kraft [N];Weg [mm]\n" + lines(lambda i: de(row(clock(i), i, ";"))))
add(
    "time of day over midnight",
    "Time;"
    + FU.replace(",", ";")
    + lines(lambda i: row(f"23:59:{59.99 + i / 2000:.4f}" if i < 20 else f"00:00:{(i - 20) / 2000:07.4f}", i, ";")),
)
add(
    "German date and time in one",
    "Datum/Uhrzeit;Kraft [N];Weg [mm]\n" + lines(lambda i: f"12.05.2024 {de(clock(i))};{de(f(i))};{de(u(i))}"),
)
add(
    "date and time in two columns",
    "Date;Time;" + FU.replace(",", ";") + lines(lambda i: f"12/05/2024;{row(clock(i), i, ';')}"),
)
add("American with am and pm", "Date Time," + FU + lines(lambda i: row(f"5/12/2024 2:22:{11 + i / 2000:07.4f} PM", i)))
add("month by name", "Time," + FU + lines(lambda i: row(f"12-May-2024 {clock(i)}", i)))
add(
    "weekday and month by name",
    "Time;" + FU.replace(",", ";") + lines(lambda i: row(f"Sun May 12 {clock(i)} 2024", i, ";")),
    refused="time|Time",
)
add("compact ISO", "Time," + FU + lines(lambda i: row(f"20240512T1422{11 + i / 2000:07.4f}", i)))
add("date with slashes, year first", "Time," + FU + lines(lambda i: row(f"2024/05/12 {clock(i)}", i)))
add(
    "milliseconds after a colon",
    "Time;" + FU.replace(",", ";") + lines(lambda i: row(f"14:22:11:{i * 10:03d}", i, ";")),
    time=TIME * 20,
)
add(
    "milliseconds in their own column",
    "Time;ms;" + FU.replace(",", ";") + lines(lambda i: f"14:22:11;{i * 10};{f(i)};{u(i)}"),
    time=TIME * 20,
    refused="time|Time",
)
add("minutes and seconds", "Time [mm:ss.ffff]," + FU + lines(lambda i: row(f"00:{i / 2000:07.4f}", i)))
add("elapsed hours over 24", "Elapsed," + FU + lines(lambda i: row(f"26:10:{i / 2000:07.4f}", i)))
add(
    "Excel serial days",
    "Time [d]," + FU + lines(lambda i: row(f"{45424.6 + i / 2000 / 86400:.12f}", i)),
    atol_time=5e-6,
    refused="rate|unit|day|grid|coarse",
    rtol=1e-9,
)
add(
    "LabVIEW absolute seconds",
    "Time (s)," + FU + lines(lambda i: row(f"{3798368531 + i / 2000:.4f}", i)),
    atol_time=1e-6,
)
add("date alone beside seconds", "Date,Time [s]," + FU + lines(lambda i: f"2024-05-12,{tfu()(i)}"))
add("start of the test in the header", "Start: 2024-05-12 14:22:11\nTime [s]," + FU + lines(tfu()))
add("time from a trigger", "Time [s]," + FU + lines(lambda i: row(f"{(i - 20) / 2000:.4f}", i)))
add("time in minutes", "Time [min]," + FU + lines(lambda i: row(f"{i / 120000:.10f}", i)), atol_time=1e-7)
add("time in hours", "Time [h]," + FU + lines(lambda i: row(f"{i / 7200000:.12f}", i)), atol_time=1e-7)
add("time printed coarsely with a rate", "Rate = 2000 Hz\nTime [s]," + FU + lines(lambda i: row(f"{i / 2000:.3f}", i)))
add(
    "time printed coarsely without a rate",
    "Time [s]," + FU + lines(lambda i: row(f"{i // 20 / 100:.2f}", i)),
    refused="rate",
    remedy={"rate": 2000.0},
)
add(
    "repeated stamps of a bus",
    "Time [s]," + FU + lines(lambda i: row(f"{i // 2 * 2 / 2000:.4f}", i)),
    refused="rate|stands still|time",
    remedy={"rate": 2000.0},
)
add(
    "a near-duplicate first stamp",
    "Time [s]," + FU + lines(lambda i: row(f"{max(i, 1) / 2000 - (1e-6 if i == 0 else 0):.7f}", i)),
    time=TIME[1:],
    force=None,
    position=None,
)
add(
    "jittered stamps",
    "Time [s]," + FU + lines(lambda i: row(f"{i / 2000 + 2e-5 * ((i * 7) % 5 - 2):.6f}", i)),
    atol_time=1e-5,
)

RATES = {
    "Sample rate: 2000 Hz": {},
    "Sample rate: 2,000 Hz": {},
    "Abtastrate: 2.000 Hz": {"refused": "2.000"},
    "Abtastrate: 2.000,0 Hz": {},
    "Sampling rate = 2 000 Hz": {},
    "Sample rate: 2,000.00 Hz": {},
    "Rate 2'000 Hz": {},
    '"Sample Rate","2,000"': {"refused": "2,000"},
    "Sample rate: 2.0 kHz": {},
    "Abtastfrequenz: 2,0 kHz": {},
    "Abtastfrequenz;2,0;kHz": {},
    "Sampling Rate (Hz): 2000": {},
    "SampleRate=2000": {},
    "fs=2e3": {},
    "Fs [Hz]\t2000": {},
    "Sampling frequency,2000,Hz": {},
    "Samples per second: 2000": {},
    "Sample interval: 0.5 ms": {},
    "dt = 500 us": {},
    "Delta t: 0.0005 s": {},
    "Time increment;0,0005;s": {},
    "Sampling period [ms]: 0.5": {},
    "Interval,5.0E-04,s": {},
    "Ts = 0.0005": {"refused": "unit|rate"},
    "Sampling interval (s)\t5.000000E-04": {},
    "Sample time 500 µs": {},
    "Scan rate: 2000 samples/s": {},
    "Scan rate: 2000 S/s": {},
    "Data rate: 2 kS/s": {},
    "Abtastrate [1/s]: 2000": {},
    "Vzorkovací frekvence: 2000 Hz": {},
    "Fréquence d'échantillonnage : 2000 Hz": {},
    "sample_rate_hz: 2000": {},
    "sampling_frequency_khz = 2": {},
    "Rate: 2000/s": {},
    "# 2000 Hz": {"refused": "rate"},
    "ADC clock 2000000 Hz": {"refused": "rate"},
    "Update rate: 50 Hz\nSample rate: 2000 Hz": {},
    "Low pass: 500 Hz\nfs: 2000 Hz": {},
    "Sample rate: 2000 Hz\nSample rate: 2000 Hz": {},
    "Sample rate: 2000 Hz\nInterval: 0.5 ms": {},
    "Sample rate: 2000 Hz\nInterval: 1 ms": {"refused": "rate"},
    "Mains frequency: 50 Hz": {"refused": "rate"},
    "2,000 samples at 2,000 Hz": {"refused": "rate"},
}
for said, more in RATES.items():
    add(f"rate: {said!r}", said + "\n" + FU + lines(fu()), remedy={"rate": 2000.0} if more else None, **more)
add("rate as a remark behind", FU + lines(fu()) + "# fs = 2000 Hz\n", refused="rate", remedy={"rate": 2000.0})
add("no rate at all", FU + lines(fu()), refused="rate", remedy={"rate": 2000.0})
add("counter and rate", "Rate: 2 kHz\nSample," + FU + lines(lambda i: f"{i},{fu()(i)}"))
add(
    "counter with a gap and a rate",
    "Rate: 2 kHz\nSample," + FU + "".join(f"{i},{fu()(i)}\n" for i in range(N) if i != 30),
)
add(
    "counter without a rate",
    "Sample," + FU + lines(lambda i: f"{i},{fu()(i)}"),
    refused="rate",
    remedy={"rate": 2000.0},
)
