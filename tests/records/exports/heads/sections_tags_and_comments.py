"""Heads in sections, tags, comments and quotes as programs print them; tackles, gains and clocks that were not applied."""

from __future__ import annotations

from tests.records.exports.base import Kind
from tests.records.exports.heads.heads_and_feet import nasty, ordinary

SECTIONS_TAGS_AND_COMMENTS = Kind()

for language, head in (
    ("en", "[Session]\nGUID=7f3a-22\nOwner=mkr\nWorkstation=LAB-PC-07\n[Comment]\nText=second attempt"),
    ("en", "<meta operator='Ivy' lab='B12' shift='night'/>"),
    ("en", "% created by save_run.m, 14-Mar-2024\n% rig revision D"),
    ("en", "Probe ID\tKX-88\nBay\t4\nTorque wrench\t25 N m\nAmbient\t22.4 degC"),
    ("en", '"Customer","Hochseil AG"\n"Article","4711-9"\n"Colour","orange"\n"Length","12.5 m"'),
    ("en", "# git: 4be1c2a (dirty)\n# host: raspberrypi\n# config: drop.yaml"),
    ("en", "Drop Test Report;v3\nSpecimen: L-204;Thickness: 10.2 mm;Knots: 2"),
    ("en", "StartTime: 2024-03-14T09:12:44Z\nEndTime: 2024-03-14T09:12:45Z\nTimezone: Europe/Vienna"),
    ("en", "Warm-up 30 min, door shut, crane parked"),
    ("en", "Magnet voltage 24 V, release by relay K3"),
    ("en", "Cell S/N 224410, cal. due 2025-06\nLaser S/N 9981"),
    ("en", "Anvil: steel\nCushion: none\nImpact head: 60 mm dia"),
    ("en", "Pre-load cycles: 5\nDwell: 30 s\nUnload rate: 50 mm/min"),
    ("en", "Battery: 87%\nMemory: 14%\nFirmware: 2.11b"),
    ("de", "Kunde: Bergbahn Süd\nLos: 77\nFarbe: blau\nHaken: Stahl, 12 mm"),
    ("de", "Versuchsleiter: Dr. Haas\nWetter: bewölkt\nBemerkung: keine"),
    ("fr", "Responsable : M. Garnier\nBanc : n° 3\nMousqueton : acier 12 mm"),
    ("es", "Responsable: Lucía\nTaller: nave 2\nClima: seco"),
    ("it", "Responsabile: Bianchi\nReparto: prove\nMoschettone: alluminio"),
    ("cs", "Vedoucí: Ing. Malý\nHala: 3\nPočasí: jasno"),
):
    ordinary(SECTIONS_TAGS_AND_COMMENTS, head, language)

for language, head, role, worth in (
    ("en", "The hoist has four falls of rope, cell on one", "force", 4.0),
    ("en", "Force channel was wired to the x10 output", "force", 0.1),
    ("en", "PGA: 64 (scaling assumes 128)", "force", 2.0),
    ("en", "[force]\nm=0.5\nc=0\nstate=not applied", "force", 0.5),
    ("en", "deadband of indicator: shows every second newton", "force", 2.0),
    ("en", "Cell mounted upside-down this week", "force", -1.0),
    ("en", "Sign convention: compression +", "force", -1.0),
    ("en", "ROSCO string pot: 2 pulses counted per edge", "position", 0.5),
    ("en", "Scale bar 50 mm entered as 100 mm", "position", 0.5),
    ("en", "Displacement is of the pulley block, rope travels double", "position", 2.0),
    ("en", "Encoder direction parameter P12 = reversed", "position", -1.0),
    ("en", "displacement units set to 1/10 mm", "position", 0.1),
    ("en", "Exported every 2nd point, time column regenerated at full rate", "time", 2.0),
    ("en", "Sampling clock ran from the 500 Hz source instead of 1 kHz", "time", 2.0),
    ("en", "time stamps in half milliseconds: no, already s/2", "time", 2.0),
    ("de", "Umlenkrolle verdoppelt die Kraft am Aufnehmer", "force", 0.5),
    ("de", "Messbereich am Verstärker stand auf 200 statt 100", "force", 2.0),
    ("fr", "Force à multiplier par deux (mouflage)", "force", 2.0),
    ("es", "La célula mide solo la mitad de la carga", "force", 2.0),
    ("it", "Segno della forza invertito", "force", -1.0),
):
    nasty(SECTIONS_TAGS_AND_COMMENTS, head, role, worth, language, below=len(head) % 3 == 0)
