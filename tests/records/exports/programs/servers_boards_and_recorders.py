"""Exports of servers with types of their columns, boards that print hexadecimal counts, recorders with parts of a second."""

from __future__ import annotations

from tests.records.exports.base import FORCE, POSITION, Kind, de, f, fu, lines, t, u

SERVERS_BOARDS_AND_RECORDERS = Kind()
add = SERVERS_BOARDS_AND_RECORDERS.add

add(
    "types of the columns above a table of a server",
    "#group,false,true,false,false\n#datatype,string,dateTime:RFC3339,double,double\n#default,_result,,,\n"
    ",_time,force_N,position_mm\n" + lines(lambda i: f",2023-03-24T09:22:11.{5 * i:04d}Z,{fu()(i)}"),
)
HEX = {"refused": "holds hexadecimal numbers|no channel is known"}
add(
    "hexadecimal counts",
    "; rate 2000 Hz\nn,ch1,ch2\n" + lines(lambda i: f"{i},{2600 * i + 748:04X},{40000 - 600 * i:04X}"),
    **HEX,
)
add(
    "hexadecimal counts below units",
    "t (ms),force (cN),pos (mm)\n" + lines(lambda i: f"{i / 2},{0x2E0 + i:X},{0x1A0 + i:X}"),
    **HEX,
)
add(
    "the interval in a line of two cells, decimal commas",
    "Name\tScope YT Project\nSampleTime[ms]\t0,5\nForce [N]\tPosition [mm]\n" + lines(fu("\t", de)),
)
add(
    "microseconds in a column beside the clock",
    "Date,Time,us,Force [N],Position [mm]\n" + lines(lambda i: f"2023/03/24,10:22:11,{345000 + 500 * i},{fu()(i)}"),
)
low, high = float(FORCE.min()), float(FORCE.max())
add(
    "statistics below a table with an overload in it",
    "Time (s),101 (N),102 (mm)\n"
    + lines(lambda i: f"{t(i)},{'+9.90000000E+37' if i == 30 else f(i)},{u(i)}")
    + f"Min,{low:.3f},{POSITION.min():.4f}\nMax,{high:.3f},{POSITION.max():.4f}\nAverage,{FORCE.mean():.6f},{POSITION.mean():.6f}\n",
)
for bits, before in ((32, 12345), (16, 700)):
    add(
        f"a counter of {bits} bits that runs over",
        "micros,load_N,pos_mm\n"
        + lines(lambda i, bits=bits, before=before: f"{(2**bits - before + 500 * i) % 2**bits},{fu()(i)}"),
    )
add(
    "names and units of so many channels, each in a line of its own",
    "drop_03.acq\n0.5 msec/sample\n2 channels\nLoad cell - DA100C\nN\nDisplacement - DA100C\nmm\nmin\tCH1\tCH2\n"
    + lines(lambda i: f"{i / 120000:.8g}\t{fu(chr(9))(i)}"),
)
add(
    "a row of names and one of units behind labels",
    "サンプリング周期,500us\nチャンネル番号,CH1,CH2\nコメント,荷重,変位\n単位,N,mm\nNo.,時間[s],(1)ch,(2)ch\n"
    + lines(lambda i: f"{i + 1},{t(i)},{fu()(i)}"),
    encoding="cp932",
)
add(
    "a list of channels by the headings of columns",
    "Sampling interval,500us\nCH,Signal name,Input,Filter,Unit\nCH1,Force,DC,Off,N\nCH2,Displacement,DC,Off,mm\nData\n"
    "Number,CH1,CH2\n" + lines(lambda i: f"{i + 1},{fu()(i)}"),
)
