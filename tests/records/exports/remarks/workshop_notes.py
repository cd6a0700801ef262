"""Notes of a workshop: screws, brakes and rooms; failed shunts, gauge factors, columns to negate and units that differ."""

from __future__ import annotations

from tests.records.exports.base import Kind
from tests.records.exports.heads.heads_and_feet import nasty, ordinary

WORKSHOP_NOTES = Kind()

for language, head in (
    ("en", "Unit under test: sling type 3, S/N 20231188\nOperator initials: TK\nCabinet: 4C"),
    ("en", "#INFO\n#vendor=Interface\n#model=9840C\n#port=COM5\n#parity=even"),
    ("en", "Ramp-up time: 12 s\nSoak: 2 min\nPeak hold: off"),
    ("en", "Thursday session, after lunch, fan on"),
    ("en", "Sampled by Teensy, sent over USB, written by PuTTY"),
    ("en", "Photo 12 shows the setup; the tape measure is in cm"),
    ("en", "Stroke limit 120 mm; emergency stop tested; brake pads 4 mm"),
    ("en", "Sheet metal screw 4.8 x 19; washer 12 mm; torque 3 N m"),
    ("en", "Altitude 480 m, gravity 9.807 m/s^2"),
    ("en", "Project budget code 77-1203; cost centre 4410"),
    ("en", "Load cell warmed up 20 min before the test"),
    ("en", "Columns: time, force, position\nRows: 60\nMissing: 0"),
    ("en", "Channel list: 1 force, 2 position"),
    ("de", "Kostenstelle: 4410\nPrüfraum: 2.14\nKlima: 23/50"),
    ("de", "Dritter Sturz, Seil neu eingebunden, Knoten festgezogen"),
    ("fr", "Troisième chute, nœud resserré\nTension secteur : 230 V"),
    ("es", "Tercera caída, nudo apretado\nRed: 230 V, 50 Hz"),
    ("it", "Terza caduta, nodo stretto\nRete: 230 V, 50 Hz"),
    ("cs", "Třetí pád, uzel dotažen\nSíť: 230 V"),
    ("pl", "Trzeci spadek, węzeł dociągnięty\nSieć: 230 V"),
):
    ordinary(WORKSHOP_NOTES, head, language)

for language, head, role, worth in (
    ("en", "Only every second value of F made it into the gain table, so F is half", "force", 2.0),
    ("en", "Anchor carries 2 T, cell reads T", "force", 2.0),
    ("en", "force_N column actually holds daN", "force", 10.0),
    ("en", "k_cal = 2.0 N/N (pending)", "force", 2.0),
    ("en", "Shunt cal. failed: output 50 % of nominal", "force", 2.0),
    ("en", "Conversion: 1 display unit = 5 N", "force", 5.0),
    ("en", "Strain gauge factor 2 entered, true 1", "force", 2.0),
    ("en", "the cell was bolted in the other way round", "force", -1.0),
    ("en", "F counts negative when the rope pulls", "force", -1.0),
    ("en", "Negate column 3", "position", -1.0),
    ("en", "Position: rack and pinion, 2 mm per step, 1 assumed", "position", 2.0),
    ("en", "laser in high-range mode: 1 mm shown is 2 mm", "position", 2.0),
    ("en", "x is stored in cm/10... no, in cm", "position", 10.0),
    ("en", "Replay at half speed", "time", 2.0),
    ("en", "dt in header was for one channel, two were scanned", "time", 2.0),
    ("en", "seconds are really half seconds", "time", 0.5),
    ("de", "Werte mit Faktor zwei beaufschlagen", "force", 2.0),
    ("de", "Zelle misst nur einen von zwei Strängen", "force", 2.0),
    ("es", "Fuerza en kilogramos, no en newtons", "force", 9.80665),
    ("cs", "Poloha v opačném směru", "position", -1.0),
):
    nasty(WORKSHOP_NOTES, head, role, worth, language, below=len(head) % 3 == 0)
