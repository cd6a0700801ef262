"""Heads as forms ask for them, and factors, signs and rates in fields that were meant for something else."""

from __future__ import annotations

from tests.records.exports.base import Kind
from tests.records.exports.heads.heads_and_feet import nasty, ordinary

FORM_FIELDS = Kind()

for language, head in (
    ("en", "Company: Ropes Ltd\nContact: A. Fisher\nPhone: 555 0142\nOrder: 88120"),
    ("en", "Method: drop_10mm.mtd\nOperator: admin\nSample: R17-3\nReport: none"),
    ("en", "Frame: 5 kN\nLoad cell: 500 N, class 0.5\nExtensometer: none"),
    ("en", "Logger SN 20314\nLogger started 2024-05-12 14:22:11\nLogging interval 0.5 ms"),
    ("en", "Drop number: 4\nDrop height (mm): 10\nDropped mass (kg): 2.5\nRope age (months): 6"),
    ("en", "Amplifier: Dewetron DAQP-STG, range 2 mV/V, filter 1 kHz, excitation 5 V"),
    ("en", "Trigger: force > 2 N, pretrigger 20 samples, posttrigger 40 samples"),
    ("en", "Noise: force 0.02 N rms, position 1 um rms"),
    ("en", "Resolution: force 0.001 N, position 0.1 um"),
    ("en", "Ambient: 23 degC / 50 %RH / 981 hPa"),
    ("en", "Humidity [%];45\nTemperature [°C];22.1\nPressure [hPa];981"),
    ("en", "File saved by DAQExpress 5.1 on 12 May 2024"),
    ("en", "--- Recorder K-12 --- Firmware V2.04 --- Channels: 2 ---"),
    ("en", "Elongation at break 38 %\nMelting point 220 degC\nRope mass 62 g/m"),
    ("en", "Stopwatch: 14 s between drops"),
    ("de", "Kunde: Seilerei Huber\nAuftrag: 2024-118\nProbe: R17\nNorm: EN 892"),
    ("de", "Fallmasse 2,5 kg, Fallhöhe 10 mm, Seillänge 2,5 m"),
    ("de", "Kraftaufnehmer HBM U9C, Nennkraft 500 N, Genauigkeitsklasse 0,2"),
    ("it", "Cella di carico: 500 N\nCampionamento: 2000 Hz\nOperatore: Bianchi"),
    ("fr", "Capteur de force : 500 N\nFréquence : 2000 Hz\nEssai : 12"),
):
    ordinary(FORM_FIELDS, head, language)

for language, head, role, worth in (
    ("en", "Sample: R17-3 (readings to be doubled)", "force", 2.0),
    ("en", "Operator: Kim - NB F/2!", "force", 2.0),
    ("en", "Load cell: 500 N (software: 250 N)", "force", 2.0),
    ("en", "Method: drop, force per strand, 2 strands", "force", 2.0),
    ("en", "Remarks: cal not loaded", "force", 2.0),
    ("en", "Load cell no. 2 upside-down", "force", -1.0),
    ("en", "Sensor 1: force (pull -)", "force", -1.0),
    ("en", "Force channel: offset 3 N not nulled, gain 0.5", "force", 2.0),
    ("en", "Weights of 10 N gave 5 N", "force", 2.0),
    ("en", "Static load at rest should be 24.5 N, file says 12.3 N", "force", 2.0),
    ("en", "Position sensor: laser, 50 mm, output 2:1", "position", 0.5),
    ("en", "Lead screw pitch 5 mm, set as 4 mm", "position", 1.25),
    ("en", "Travel +: up", "position", -1.0),
    ("en", "Interval: 0.5 ms (true: 1 ms)", "time", 2.0),
    ("en", "Logging interval 1 ms", "time", 2.0),
    ("en", "Slow-motion export, factor 10", "time", 0.1),
    ("de", "Bemerkung: Kraft halbiert gespeichert", "force", 2.0),
    ("de", "Messverstärker: Bereich falsch (x0,5)", "force", 2.0),
    ("fr", "Remarque : un seul des deux capteurs enregistré", "force", 2.0),
    ("it", "Nota: valori di forza dimezzati", "force", 2.0),
):
    nasty(FORM_FIELDS, head, role, worth, language, below=len(head) % 3 == 0)
