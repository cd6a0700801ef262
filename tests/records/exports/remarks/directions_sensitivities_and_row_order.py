"""Directions, sensitivities and ranges told beside the numbers, in six languages, and orders of rows, implied decimals and increments."""

from __future__ import annotations

from tests.records.exports.base import FORCE, POSITION, TIME, Kind, N, f, lines, t, u
from tests.records.exports.heads.heads_and_feet import nasty, ordinary

DIRECTIONS_SENSITIVITIES_AND_ROW_ORDER = Kind()

for language, head in (
    (
        "de",
        "Prüfling\tAramid Ø 1,2 mm, Charge 44-17\nKraftaufnehmer\tU9C/500N, S/N 173410032, kalibriert am 12.03.2024",
    ),
    ("en", "# fw 1.4.2 HX-board rev C\n# ready"),
    ("en", "Recorded by day shift, rig 4"),
    ("fr", "N° de série capteur;FR-20871\nFiltre;désactivé"),
    ("en", "Load cell,2580-500N, s/n 60112, cal due 2025-02-01"),
    ("it", "Cella di carico tarata il 05/05/2022"),
    ("en", "Model Number,SDS2104X Plus\nSoftware Version,1.3.9R6"),
    ("en", "Zero balance,performed before recording\nSensitivity CH1,2.0012 mV/V (applied)"),
):
    ordinary(DIRECTIONS_SENSITIVITIES_AND_ROW_ORDER, head, language)

for language, head, role, worth in (
    ("de", "Anmerkung: Kraftanzeige war auf kp eingestellt, Spaltenkopf stammt aus der Vorlage", "force", 9.80665),
    ("en", "# sample 31 onwards recorded at 500 Hz (memory saver)", "time", 4.0),
    ("en", "# laser on the floor: distance laser-weight, decreases as weight falls", "position", -1.0),
    ("en", "distance to the head: larger readings mean a higher weight", "position", -1.0),
    ("cs", "Pozn.: poloha kladná směrem vzhůru", "position", -1.0),
    ("it", "Nota: lo spostamento è positivo verso l'alto", "position", -1.0),
    ("en", "Amplifier left on range 5; the values are for range 2", "force", 2.5),
    ("en", "Force channel setup: 500 N = 1 mV/V\nCertificate of cell 88213: 500 N = 2.0 mV/V", "force", 2.0),
    ("en", "Load cell sensitivity 1.0 mV/V; table made with 2.0", "force", 2.0),
    ("de", "Werte gelten je Strang, Gesamtkraft = 2 x Anzeige", "force", 2.0),
    ("en", "# encoder wire runs over a loose block: reads double the weight's travel", "position", 0.5),
):
    nasty(DIRECTIONS_SENSITIVITIES_AND_ROW_ORDER, head, role, worth, language)

DIRECTIONS_SENSITIVITIES_AND_ROW_ORDER.add(
    "ordinary: ruled output of a database, names in small letters",
    "   t_s   | force_n | pos_mm  | operator \n---------+---------+---------+----------\n"
    + lines(lambda i: f"  {t(i)} | {f(i)} | {u(i)} | rh"),
)
DIRECTIONS_SENSITIVITIES_AND_ROW_ORDER.add(
    "ordinary: units by name in front",
    "---\nlogger: {model: U3-HV, serial: 320059112}\nunits: {time: s, force: N, position: mm}\n---\ntime,force,position\n"
    + lines(lambda i: f"{t(i)},{f(i)},{u(i)}"),
)
DIRECTIONS_SENSITIVITIES_AND_ROW_ORDER.add(
    "ordinary: a remark behind one row, beyond the last column",
    "Zeit;Kraft;Weg\ns;N;mm\n" + lines(lambda i: f"{t(i)};{f(i)};{u(i)}" + (";losgelassen" if i == 20 else "")),
)
DIRECTIONS_SENSITIVITIES_AND_ROW_ORDER.add(
    "nasty: a change of range told inside the table",
    "t[s]\tF[N]\tx[mm]\n"
    + lines(
        lambda i: (
            ("*** autorange: force x10 from here\n" if i == 30 else "")
            + f"{t(i)}\t{f(i, 0.1 if i >= 30 else 1.0, 4)}\t{u(i)}"
        )
    ),
    refused="autorange",
)
DIRECTIONS_SENSITIVITIES_AND_ROW_ORDER.add(
    "nasty: counts under a name that nobody knows",
    "# 1 um per count\nt [s],F [N],enc [counts]\n"
    + lines(lambda i: f"{TIME[i]:.4f},{FORCE[i]:.3f},{round(POSITION[i] * 1e4)}", N),
    refused="enc",
    remedy={"channels": {"position": {"column": "enc [counts]", "scale": "0.1 um"}}},
    rtol=1e-3,
)
DIRECTIONS_SENSITIVITIES_AND_ROW_ORDER.add(
    "nasty: a sentence with a unit above headings without",
    "Instrument: stroke channel imperial (in), load channel metric (N), time s\n\nTIME,LOAD,STROKE\n"
    + lines(lambda i: f"{TIME[i]:.4f},{FORCE[i]:.3f},{POSITION[i] / 25.4:.12f}", N),
    refused="TIME.*LOAD.*STROKE.*units",
    remedy={"units": {"time": "s", "force": "N", "position": "in"}},
    rtol=1e-5,
)
DIRECTIONS_SENSITIVITIES_AND_ROW_ORDER.add(
    "ordinary: apostrophes between thousands",
    "Zeit (s);Kraft (N);Weg (\u00b5m)\n" + lines(lambda i: f"{t(i)};1'{f(i).zfill(7)};{u(i, 1000, 1)}"),
    force=FORCE + 1000.0,
)
DIRECTIONS_SENSITIVITIES_AND_ROW_ORDER.add(
    "ordinary: a scope's start and step beside the headings, rows that end in separators",
    "X,CH1,CH2,Start,Increment,\nSequence,N,mm,-2.000000e-01,5.000000e-04\n" + lines(lambda i: f"{i},{f(i)},{u(i)},,"),
)
DIRECTIONS_SENSITIVITIES_AND_ROW_ORDER.add(
    "nasty: what hangs below the cell weighs what the force begins at",
    "Nota;sotto la cella pende l'attrezzo (1,28 kg), il suo peso è compreso nella lettura\n"
    "tempo [s];forza [N];posizione [mm]\n" + lines(lambda i: f"{t(i)};{f(i)};{u(i)}".replace(".", ",")),
    refused="attrezzo",
)
DIRECTIONS_SENSITIVITIES_AND_ROW_ORDER.add(
    "ordinary: remarks and headings behind semicolons above columns of blanks",
    "; ---------------------\n; Fibre drop rig - Department of Textile Machines\n"
    "; Thank you for using RigLog. Support: riglog@example.org\n; ---------------------\n; t/s      F/N      x/mm\n"
    + lines(lambda i: f"  {t(i)}    {f(i)}   {u(i)}"),
)
DIRECTIONS_SENSITIVITIES_AND_ROW_ORDER.add(
    "nasty: the newest sample on top",
    "Ring buffer dump, most recent sample on top, 2000 S/s\nforce N, position mm\n"
    + lines(lambda i: f"{f(N - 1 - i)}, {u(N - 1 - i)}"),
    options={"rate": 2000.0},
    refused="most recent",
)
DIRECTIONS_SENSITIVITIES_AND_ROW_ORDER.add(
    "nasty: three decimals that are not printed",
    "FORMAT I10,I10 WITH 3 IMPLIED DECIMALS, 2000 HZ\n   FORCE N    POS MM\n"
    + lines(lambda i: f"{round(FORCE[i] * 1000):10d}{round(POSITION[i] * 1000):10d}"),
    options={"rate": 2000.0},
    refused="IMPLIED",
    rtol=1e-3,
)
DIRECTIONS_SENSITIVITIES_AND_ROW_ORDER.add(
    "nasty: a note on increments from row to row",
    "# encoder read-and-reset: each row holds the travel since the previous row\ntime_s,force_N,position_mm\n"
    + lines(lambda i: f"{t(i)},{f(i)},{POSITION[i] - (POSITION[i - 1] if i else 0.0):.4f}"),
    refused="encoder read-and-reset",
)
for worded, worth in (
    ("# effort: moyenne glissante sur les 16 derniers échantillons; position non filtrée", 1.0),
    ("OJO: el mando de ganancia estaba en 5 y no en 10; duplicar la fuerza", 2.0),
):
    DIRECTIONS_SENSITIVITIES_AND_ROW_ORDER.add(
        f"nasty: {worded}",
        worded + "\ntime [s],force [N],position [mm]\n" + lines(lambda i, k=worth: f"{t(i)},{f(i, 1 / k, 6)},{u(i)}"),
        refused=worded[:10],
        absent=("force",) if worth == 1.0 else (),
        rtol=1e-5,
    )
