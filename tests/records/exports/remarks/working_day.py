"""Logs of a working day, and slips that somebody wrote down: sensitivities, wires, encoders and rates that were wrong."""

from __future__ import annotations

from tests.records.exports.base import Kind
from tests.records.exports.heads.heads_and_feet import nasty, ordinary

WORKING_DAY = Kind()

for language, head in (
    ("en", "Record 7 of 12\nOperator: T. Berg\nRope no. 3\nMass 2.5 kg\nDrop 10 mm"),
    ("en", "Sensor: Futek LCM300, 1000 lb\nSensor: Micro-Epsilon optoNCDT 1420-50"),
    ("en", "Sampling rate: 2000 Hz\nLow-pass filter: 500 Hz\nDuration: 0.03 s"),
    ("en", "Test Name;Drop\nTest Date;2024-05-12\nTest Time;14:22:11\nOperator ID;12"),
    ("en", "Test mass: 2.5 kg\nGuide: linear bearing\nRelease: solenoid"),
    ("en", "Calibration date: 2024-01-15\nCalibration due: 2025-01-15\nCertificate: 2024/0117"),
    ("en", "Load cell capacity: 500 N\nLoad cell sensitivity: 2.0012 mV/V\nLoad cell serial: 11803"),
    ("en", "Room temperature 22.4 C, relative humidity 41 %"),
    ("en", "Zero offset: 0.000 N\nGain: 1.0"),
    ("en", "Channel,Name,Unit,Sensor\n1,force,N,U9C\n2,position,mm,WA50"),
    ("en", "End of data. 60 rows written."),
    ("en", "Peak force 15.66 N at 0.0035 s"),
    ("en", "pandas 2.1; python 3.11; host lab-pc-3"),
    ("en", "Specimen ID: R-17\nWidth: 10 mm\nThickness: 2.1 mm\nGauge length: 100 mm"),
    ("de", "Datum;12.05.2024\nUhrzeit;14:22:11\nPrüfer;Lang\nProbe;R17\nTemperatur;22,4;°C"),
    ("de", "Abtastrate: 2000 Hz\nTiefpass: 500 Hz\nMessdauer: 0,03 s"),
    ("de", "Kraftsensor: 500 N, Wegsensor: 50 mm"),
    ("es", "Ensayo: caída\nProbeta: 7\nVelocidad: 10 mm/min"),
    ("cs", "Snímač síly: U9C 500 N\nSnímač dráhy: WA 50 mm"),
    ("pl", "Czujnik siły: U9C 500 N\nCzujnik drogi: WA 50 mm"),
):
    ordinary(WORKING_DAY, head, language)

for language, head, role, worth in (
    ("en", "Forgot to enter the new sensitivity, so everything is low by a factor of two", "force", 2.0),
    ("en", "Sensor capacity 1000 N, entered 500 N", "force", 2.0),
    ("en", "Load cell sensitivity: 2.0 mV/V (file made with 1.0)", "force", 2.0),
    ("en", "force: span 50 %", "force", 2.0),
    ("en", "One channel of the pair only", "force", 2.0),
    ("en", "Rope doubled over the hook, cell in one branch", "force", 2.0),
    ("en", "red wire and black wire of the cell the wrong way round", "force", -1.0),
    ("en", "Pull registers as negative", "force", -1.0),
    ("en", "Yo-yo rig: sensor travels half of what the mass does", "position", 2.0),
    ("en", "Encoder wheel worn, 48 mm instead of 50 mm", "position", 0.96),
    ("en", "pos is really in tenths", "position", 0.1),
    ("en", "laser reads distance, not drop", "position", -1.0),
    ("en", "DAQ set to 1 kHz, script wrote times for 2 kHz", "time", 2.0),
    ("en", "Stamps from a PC clock that ran at double speed", "time", 0.5),
    ("en", "Time in this file is sample index / 4000, rate was 2000", "time", 2.0),
    ("de", "Sensor an falschem Kanal, Kennwert 2 statt 1 mV/V", "force", 2.0),
    ("de", "Nur eine von zwei Messdosen angeschlossen", "force", 2.0),
    ("de", "Wegsignal kommt vom Umlenkblock", "position", 2.0),
    ("es", "Célula montada al revés", "force", -1.0),
    ("cs", "Údaje nutno ještě přepočítat koeficientem 2", "force", 2.0),
):
    nasty(WORKING_DAY, head, role, worth, language, below=len(head) % 3 == 0)
