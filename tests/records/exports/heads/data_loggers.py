"""Plain heads of data loggers in seven languages, and afterthoughts about scale, sign and clock above or below the numbers."""

from __future__ import annotations

from tests.records.exports.base import Kind
from tests.records.exports.heads.heads_and_feet import nasty, ordinary

DATA_LOGGERS = Kind()

for language, head in (
    ("en", "Data Logger: DT9857\nAcquired: 12.05.2024 14:22:11\nChannels acquired: 2"),
    ("en", "Test no.,31\nTest date,12/05/2024\nMachine,Galdabini Quasar 5\nOperator,LP"),
    ("en", "Rig: drop tower B\nRope: 8 mm cord\nMass: 2.5 kg\nDrop: 10 mm"),
    ("en", "Load cell: Interface SMT1-500N\nAmplifier: ICPDAS\nADC: 24 bit\nRate: 2 kHz"),
    ("en", "ID: 44\nComment: -\nTags: drop, cord, dry"),
    ("en", "Max force = 15.66 N\nMin force = 9.35 N\nMean force = 12.6 N"),
    ("en", "Sample length: 2.50 m\nSample diameter: 8.0 mm\nSample colour: blue"),
    ("en", "Export settings: delimiter comma, decimals 4, header on"),
    ("en", "Location: hall 3, bench 2\nOperator: MB\nWitness: PK"),
    ("en", "Session 4 / run 11"),
    ("en", "Sample rate (Hz): 2000\nRecord length (s): 0.03\nFilter (Hz): 500"),
    ("en", "Temperature: 21.5 C\nHumidity: 44 %\nTime of day: morning"),
    ("en", "Sensor list: U9C (force), ILD1420 (position)"),
    ("de", "Prüfer: K. Baumann\nDatum: 12.05.2024\nPrüfmasse: 2,5 kg\nFallweg: 10 mm"),
    ("de", "Messgerät: QuantumX MX840B\nMessrate: 2000 Hz\nFilter: Bessel 200 Hz"),
    ("de", "Versuchsnummer: 12\nSeiltyp: Reepschnur 6 mm\nWiederholung: 3"),
    ("fr", "Date : 12/05/2024\nOpérateur : Dubois\nMasse : 2,5 kg\nHauteur : 10 mm"),
    ("es", "Fecha: 12/05/2024\nOperador: Ruiz\nMasa: 2,5 kg\nCuerda: 8 mm"),
    ("cs", "Datum: 12.05.2024\nObsluha: Dvořák\nLano: 8 mm\nHmotnost: 2,5 kg"),
    ("pl", "Data: 12.05.2024\nOperator: Nowak\nLina: 8 mm\nMasa: 2,5 kg"),
):
    ordinary(DATA_LOGGERS, head, language)

for language, head, role, worth in (
    ("en", "Later we saw that the indicator had been in lb mode", "force", 4.4482216152605),
    ("en", "Range switch at 2, should be at 1", "force", 2.0),
    ("en", "Full bridge, one arm dead", "force", 2.0),
    ("en", "force column: see conversion sheet", "force", 2.0),
    ("en", "raw ADC times 1e-3 was written, correct is 2e-3", "force", 2.0),
    ("en", "Cell at 60 deg to the rope", "force", 2.0),
    ("en", "force sign as seen by the anchor", "force", -1.0),
    ("en", "Connector rewired on Monday, signals now mirror image", "force", -1.0),
    ("en", "Wire sensor looped once around the mass, reads double", "position", 0.5),
    ("en", "mm should be um", "position", 1e-3),
    ("en", "Position from video, 1 px = 0.5 mm, not yet converted", "position", 0.5),
    ("en", "Distance to laser, grows as mass rises", "position", -1.0),
    ("en", "recorded at half the nominal clock", "time", 2.0),
    ("en", "time base set 0.1 s/div by mistake for 0.2 s/div", "time", 2.0),
    ("en", "Actual sampling was 1 kHz", "time", 2.0),
    ("de", "Kraft nur auf einer Seite gemessen, Seil läuft doppelt", "force", 2.0),
    ("de", "Kalibrierwert fehlt noch", "force", 2.0),
    ("fr", "Course en dixièmes", "position", 0.1),
    ("it", "Tempo da raddoppiare", "time", 2.0),
    ("pl", "Siłomierz pokazuje połowę", "force", 2.0),
):
    nasty(DATA_LOGGERS, head, role, worth, language, below=len(head) % 2 == 0)
