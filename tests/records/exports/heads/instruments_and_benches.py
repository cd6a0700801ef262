"""Heads of instruments and benches in four languages, and notes on what is still to be scaled, turned or stretched."""

from __future__ import annotations

from tests.records.exports.base import Kind
from tests.records.exports.heads.heads_and_feet import nasty, ordinary

INSTRUMENTS_AND_BENCHES = Kind()

for language, head in (
    ("en", "Instrument: Mark-10 M5-500\nSerial: 3876512\nUnits: N\nReading mode: real time"),
    ("en", "Alluris FMI-S30\nMeasurement number: 12\nMax: 15.66 N"),
    ("en", "[Settings]\nLanguage=EN\nDecimals=3\nPretrigger=0\nStorage=SD card"),
    ("en", "DAQ device: USB-6211, channels ai0 and ai1, RSE, range 10 V\nSample clock: internal"),
    ("en", "Test ID,TX-88\nTest type,Dynamic drop\nTechnician,M. Green\nLab,Building 7"),
    ("en", "Mass of sled (kg): 2.50\nLength of rope (m): 1.80\nAngle of rail (deg): 30"),
    ("en", "# generated 2024-05-12 by acquire.m, MATLAB R2023b\n# subject: polyamide cord"),
    ("en", "Shimadzu AGS-X\tTrapezium X\tBatch size: 1\tSpeed: 100 mm/min"),
    ("en", "Filter type: Butterworth, order 4, cutoff 300 Hz"),
    ("en", "Supply voltage 24 V DC; sensor warm-up 30 min"),
    ("en", "Distance between anchors: 3.20 m\nSag: 45 mm"),
    ("en", "Start of recording: 14:22:11, end of recording: 14:22:12"),
    ("en", "Notes: none"),
    ("en", "Data status: complete; missing samples: 0"),
    ("de", "Gerät: Sauter FH 500\nSeriennummer: 1700234\nBetriebsart: Track"),
    ("de", "Prüfstelle: TU Graz\nPrüfer: Moser\nAuftragsnummer: 2024/118"),
    ("de", "Vorspannung: 5 N; Einspannlänge: 200 mm; Prüfgeschwindigkeit: 10 mm/s"),
    ("de", "Messkanal 1: Kraftaufnehmer C9C 500 N\nMesskanal 2: Wegaufnehmer WA 50"),
    ("fr", "Laboratoire : LMGC\nMachine : Instron 5969\nVitesse : 10 mm/min"),
    ("cs", "Laboratoř: FSI VUT\nZkušební stroj: ZDM 5\nRychlost: 10 mm/min"),
):
    ordinary(INSTRUMENTS_AND_BENCHES, head, language, below=len(head) % 4 == 0)

for language, head, role, worth in (
    ("en", "TODO: scale force (x2)", "force", 2.0),
    ("en", "FS entered: 250 N (should read 500 N)", "force", 2.0),
    ("en", "Quarter bridge wired as half bridge", "force", 2.0),
    ("en", "Force readout per cell; two cells in parallel", "force", 2.0),
    ("en", "Bridge excitation was 2.5 V, not 5 V as configured", "force", 2.0),
    ("en", "Rope runs over a second sheave before the sensor, doubling the pull", "force", 0.5),
    ("en", "cell polarity +/- interchanged at the plug", "force", -1.0),
    ("en", "Encoder pulses counted on both edges", "position", 0.5),
    ("en", "Laser 45 degrees inclined, divide by cos", "position", 1.4142135),
    ("en", "Position is that of the pulley block, the mass moves twice as far", "position", 2.0),
    ("en", "Trigger pulses every 1 ms were taken for 0.5 ms", "time", 2.0),
    ("en", "Time axis compressed 10:1", "time", 10.0),
    ("en", "Sampler lost each second scan; stamps are consecutive", "time", 2.0),
    ("de", "Kraftwerte in Dekanewton", "force", 10.0),
    ("de", "Messkette war auf 250 N statt 500 N parametriert", "force", 2.0),
    ("de", "Zug = minus", "force", -1.0),
    ("de", "Zeitachse um Faktor 10 gestreckt", "time", 0.1),
    ("fr", "Voie force : gain réglé à 100 au lieu de 200", "force", 2.0),
    ("cs", "Zesilovač nastaven na polovinu", "force", 2.0),
    ("cs", "Časová osa v desetinách", "time", 0.1),
):
    nasty(INSTRUMENTS_AND_BENCHES, head, role, worth, language, below=len(head) % 3 == 0)
