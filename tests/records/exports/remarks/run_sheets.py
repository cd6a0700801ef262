"""One run sheet of test, operator, rope and mass in seven languages; excitations, drums and ticks that were other than assumed."""

from __future__ import annotations

from tests.records.exports.base import Kind
from tests.records.exports.heads.heads_and_feet import nasty, ordinary

RUN_SHEETS = Kind()

for language, head in (
    ("en", "Test: 18\nOperator: R. Stone\nRope: 9 mm, new\nMass: 2.5 kg"),
    ("en", "Instrument: NI USB-6009\nChannels: 2\nSampling rate: 2000 Hz"),
    ("en", "Date: 2024-05-12\nTime: 14:22:11\nPlace: Brno"),
    ("en", "Load cell: HBM S9M 500 N\nAmplifier: HBM ClipX\nFilter: 200 Hz"),
    ("en", "Number of points: 60\nTime step: 0.5 ms"),
    ("en", "Room: 214\nTemperature: 20.9 °C\nPressure: 985 hPa"),
    ("en", "Sample: polyester webbing 15 mm\nBatch: 7\nCycle: 3"),
    ("en", "# Arduino Nano, HX711, 80 Hz\n# started by button"),
    ("en", "Report no. 2024-77\nCustomer: Alpin GmbH\nSpecimen no. 5"),
    ("en", "Software: DAQ 3.2\nUser: student\nFile: drop_18.txt"),
    ("en", "Mass released by hand"),
    ("en", "Peak: 15.66 N\nRest: 12.1 N"),
    ("de", "Prüfung: 18\nPrüfer: Stein\nSeil: 9 mm, neu\nMasse: 2,5 kg"),
    ("de", "Ort: Graz\nRaum: 214\nTemperatur: 20,9 °C"),
    ("de", "Kraftsensor: HBM S9M 500 N\nVerstärker: ClipX\nFilter: 200 Hz"),
    ("fr", "Essai : 18\nOpérateur : Pierre\nCorde : 9 mm\nMasse : 2,5 kg"),
    ("es", "Ensayo: 18\nOperador: Pedro\nCuerda: 9 mm\nMasa: 2,5 kg"),
    ("it", "Prova: 18\nOperatore: Pietra\nCorda: 9 mm\nMassa: 2,5 kg"),
    ("cs", "Zkouška: 18\nObsluha: Kámen\nLano: 9 mm\nHmotnost: 2,5 kg"),
    ("pl", "Próba: 18\nOperator: Kamień\nLina: 9 mm\nMasa: 2,5 kg"),
):
    ordinary(RUN_SHEETS, head, language)

for language, head, role, worth in (
    ("en", "The bridge was fed with 5 V in place of 10 V", "force", 2.0),
    ("en", "Indicator shows one half", "force", 2.0),
    ("en", "Attach factor from page 3", "force", 2.0),
    ("en", "Load path splits before the cell", "force", 2.0),
    ("en", "Scale: 1 V = 100 N, recorded with 1 V = 50 N", "force", 2.0),
    ("en", "Compression shown as plus, we hang things", "force", -1.0),
    ("en", "Amplifier leads reversed since May", "force", -1.0),
    ("en", "Cable drum gives two turns per metre, one assumed", "position", 0.5),
    ("en", "Ruler in the video is 20 cm, typed 10 cm", "position", 2.0),
    ("en", "position: cm", "position", 10.0),
    ("en", "Height above floor, not drop", "position", -1.0),
    ("en", "Every value was stored twice and one removed, times were not", "time", 2.0),
    ("en", "tick = 1 ms", "time", 2.0),
    ("en", "Recording speed 1000 samples per second", "time", 2.0),
    ("de", "Kraft stimmt nicht, zweite Zelle trägt mit", "force", 2.0),
    ("de", "Weg zeigt nach oben positiv", "position", -1.0),
    ("de", "Abtastung war nur 1 kHz", "time", 2.0),
    ("fr", "Force : valeur affichée = moitié", "force", 2.0),
    ("es", "Posición en décimas", "position", 0.1),
    ("cs", "Kladka 2:1 před snímačem", "force", 2.0),
):
    nasty(RUN_SHEETS, head, role, worth, language, below=len(head) % 3 == 0)
