"""Lines of people in a hurry, in seven languages: what went well, and what is doubled, in pounds, or the other way up."""

from __future__ import annotations

from tests.records.exports.base import Kind
from tests.records.exports.heads.heads_and_feet import nasty, ordinary

PEOPLE_IN_A_HURRY = Kind()

for language, head in (
    ("en", "the good one"),
    ("en", "drop from 15 cm, mass 2.5 kg, rope 2.4 m, guide freshly oiled"),
    ("en", "Fifth attempt. Magnet stuck at first. Rope looks fine."),
    ("en", "Amplifier on since 8 am, laser on a tripod, force sensor on top"),
    ("en", "cell between beam and rope; laser under the weight, pointing up"),
    ("en", "Student exercise 4b, group C, Tuesday"),
    ("en", "We used the long cable today"),
    ("en", "sensor: borrowed from the bridge group, s/n 1187, range 1 kN"),
    ("en", "see also run16.csv and run18.csv, same settings"),
    ("en", "rope rested 24 h since the last drop, humidity high"),
    ("en", "The force channel is noisy because of the pump next door"),
    ("en", "Position starts about at zero, taut rope"),
    ("en", "Trigger on force > 5 N, pretrigger 10 samples"),
    ("en", "Data checked by Ines, plots in the shared drive"),
    ("de", "Kraftsensor oben, Laser unten, alles fest verschraubt"),
    ("de", "Dritter Versuch heute, Seil etwas feucht, Führung geölt"),
    ("fr", "Capteur en haut, laser sous la masse, guide huilé"),
    ("es", "Sensor arriba, láser debajo de la masa, guía engrasada"),
    ("it", "Cella in alto, laser sotto la massa, guida oliata"),
    ("pl", "Czujnik u góry, laser pod masą, prowadnica nasmarowana"),
):
    ordinary(PEOPLE_IN_A_HURRY, head, language)

for language, head, role, worth in (
    ("en", "oops: amp at 1000 not 500, all forces too small", "force", 2.0),
    ("en", "force shown is for one of the ropes, there are two", "force", 2.0),
    ("en", "somebody left the indicator in pounds", "force", 4.4482216152605),
    ("en", "the sensor was loaded through a 1:1.5 lever", "force", 1.5),
    ("en", "I keep forgetting: Jo's cell needs doubling", "force", 2.0),
    ("en", "pull shows up as minus", "force", -1.0),
    ("en", "Multiply by 9.81 first!", "force", 9.81),
    ("en", "laser was on the counterweight, so it goes the other way", "position", -1.0),
    ("en", "the tape moves two mm for every mm of the weight", "position", 0.5),
    ("en", "Down is up in this file", "position", -1.0),
    ("en", "camera was at 120 fps and the script assumes 240", "time", 2.0),
    ("en", "the clock on this board runs at half pace", "time", 2.0),
    ("en", "x column scaled for the old encoder (new one: 2000 lines, old: 1000)", "position", 0.5),
    ("de", "Kraft bitte verdoppeln, nur ein Strang gemessen", "force", 2.0),
    ("de", "Vorzeichen vom Weg stimmt nicht", "position", -1.0),
    ("fr", "Attention, la force est en kgf", "force", 9.80665),
    ("fr", "Signe du déplacement inversé par erreur", "position", -1.0),
    ("es", "La fuerza hay que dividirla entre dos", "force", 0.5),
    ("it", "Tempo contato due volte", "time", 0.5),
    ("cs", "Síla je jen z jednoho pramene ze dvou", "force", 2.0),
):
    nasty(PEOPLE_IN_A_HURRY, head, role, worth, language, below=len(head) % 3 == 0)
