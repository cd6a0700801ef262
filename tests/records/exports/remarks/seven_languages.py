"""Remarks in seven languages: people, ropes and weather, and doubled, halved and reversed channels."""

from __future__ import annotations

from tests.records.exports.base import Kind
from tests.records.exports.heads.heads_and_feet import nasty, ordinary

SEVEN_LANGUAGES = Kind()

for head in (
    "Bench 4, building C, floor 2\nWeather: rain",
    "Climber: dummy, 80 kg\nBelay device: fixed point\nQuickdraws: 3",
    "Rope conditioned for 24 h at 20 degC and 65 % relative humidity",
    "User name=svoboda\nComputer=LAB-PC7\nMeasurement duration=0.03 s\nNumber of samples=60",
    "Trial no. 14; slack 12 mm; new knot",
    "Data recorded with LabVIEW 2019 on 3 March 2023 by K. Havel",
    "Drop weight released by electromagnet at t = 0",
):
    ordinary(SEVEN_LANGUAGES, head)
ordinary(
    SEVEN_LANGUAGES,
    "Sensor\tS/N\tRange\nHBM U2B\t80312\t1 kN\nWayCon LZW\t221\t100 mm",
    refused="WayCon",  # a name that is not known, beside a length
    remedy={"channels": {"position": {"column": "position [mm]", "scale": "1"}}},
)
for language, head in (
    ("de", "Bearbeiter: Dr. Huber\nRaumtemperatur: 21,4 °C\nLuftfeuchte: 48 %"),
    ("de", "Seil: Polyamid, 10 mm, Länge 2,5 m\nFallhöhe: 30 mm\nMasse: 2,5 kg"),
    ("de", "Messung gestartet am 12.05.2024 um 14:22:11"),
    ("fr", "Opérateur : Martin\nDate : 12/05/2024\nTempérature : 21 °C"),
    ("fr", "Corde neuve, longueur 2,5 m, diamètre 10 mm"),
    ("es", "Operador: López\nMasa: 2,5 kg\nAltura de caída: 30 mm"),
    ("it", "Operatore: Rossi\nProva n. 7\nMassa: 2,5 kg\nLunghezza corda: 2,5 m"),
    ("it", "Data: 12/05/2024\nTemperatura ambiente: 21 °C"),
    ("cs", "Obsluha: Novák\nDatum: 12. 5. 2024\nHmotnost: 2,5 kg\nTeplota: 21 °C"),
    ("cs", "Zkouška č. 7, lano PA 10 mm, délka 2,5 m"),
    ("pl", "Operator: Kowalski\nData: 12.05.2024\nMasa: 2,5 kg"),
    ("pl", "Próba nr 7, lina 10 mm, długość 2,5 m"),
):
    ordinary(SEVEN_LANGUAGES, head, language)

nasty(SEVEN_LANGUAGES, "The amplifier was on the 1 kN range but the software assumed 500 N")
nasty(SEVEN_LANGUAGES, "Forces below are those of the left leg; the right leg carried the same")
nasty(SEVEN_LANGUAGES, "I forgot to change the cell in the software (100 N instead of 200 N)")
nasty(SEVEN_LANGUAGES, "Everything here is upside down", worth=-1.0, below=True)
nasty(SEVEN_LANGUAGES, "positions come from the winch, whose drum has half the diameter entered", "position", 0.5)
nasty(SEVEN_LANGUAGES, "Recorder ran at 1/10 speed during replay", "time", 0.1)
nasty(SEVEN_LANGUAGES, "Kraft wurde mit halber Empfindlichkeit aufgenommen", language="de")
nasty(SEVEN_LANGUAGES, "Achtung: Werte noch mit 2 malnehmen!", language="de")
nasty(SEVEN_LANGUAGES, "Zugkraft zählt negativ", worth=-1.0, language="de", below=True)
nasty(SEVEN_LANGUAGES, "Weg am Hebelende gemessen (Übersetzung 2)", "position", 0.5, "de")
nasty(SEVEN_LANGUAGES, "Les efforts sont à multiplier par deux", language="fr")
nasty(SEVEN_LANGUAGES, "Capteur monté à l'envers", worth=-1.0, language="fr")
nasty(SEVEN_LANGUAGES, "Course mesurée sur un brin mouflé", "position", 0.5, "fr")
nasty(SEVEN_LANGUAGES, "La fuerza real es el doble de la registrada", language="es")
nasty(SEVEN_LANGUAGES, "Signo cambiado en el canal de fuerza", worth=-1.0, language="es", below=True)
nasty(SEVEN_LANGUAGES, "Forza misurata su uno dei due rami", language="it")
nasty(SEVEN_LANGUAGES, "Attenzione: segno della forza invertito", worth=-1.0, language="it")
nasty(SEVEN_LANGUAGES, "Sílu nutno násobit dvěma", language="cs")
nasty(SEVEN_LANGUAGES, "Snímač síly byl zapojen obráceně", worth=-1.0, language="cs", below=True)
nasty(SEVEN_LANGUAGES, "Siłę należy pomnożyć przez 2", language="pl")
