"""What stands on printouts, in log books and in scripts: how sensors hang, and what is still to be multiplied."""

from __future__ import annotations

from tests.records.exports.base import Kind
from tests.records.exports.heads.heads_and_feet import nasty, ordinary

LOG_BOOKS_AND_PRINTOUTS = Kind()

for language, head in (
    ("en", "Log book page 41, entry 7\nSame rope as entry 6\nDry day"),
    ("en", "Load cell hangs from the I-beam, laser looks up from the floor"),
    ("en", "Sensor: S-beam, 500 N\nIndicator: Laumas TLB\nCable: 3 m shielded"),
    ("en", "data = np.loadtxt(...)  # see notebook drop_17.ipynb\nauthor = kim"),
    ("en", "Vessel: none\nDeck: lab floor\nSea state: n/a"),
    ("en", "Test block 4, rope sample C, third drop, 15 min rest"),
    ("en", "Mass is a steel disc stack, 5 discs of 0.5 kg"),
    ("en", "Thermocouple K: 21.3 C\nBarometer: 1009 mbar\nHygrometer: 38 %"),
    ("en", "Force and position logged at 2 kHz"),
    ("en", "Time zero is the release"),
    ("en", "Position is that of the mass"),
    ("en", "mode,single shot\npretrig,10 %\nslot,A\ncoupling,DC"),
    ("en", "Grip: Amsler wedge\nJaw faces: rubber\nAlignment: checked"),
    ("de", "Laborbuch Seite 41, Eintrag 7\nGleiches Seil wie Eintrag 6"),
    ("de", "Kraftaufnehmer am Träger, Laser am Boden\nAufhängung: Schäkel 8 mm"),
    ("fr", "Cahier page 41, ligne 7\nMême corde que l'essai 6"),
    ("es", "Cuaderno página 41, línea 7\nMisma cuerda que el ensayo 6"),
    ("it", "Quaderno pagina 41, riga 7\nStessa corda della prova 6"),
    ("cs", "Deník strana 41, zápis 7\nStejné lano jako při zkoušce 6"),
    ("pl", "Dziennik strona 41, wpis 7\nTa sama lina co w próbie 6"),
):
    ordinary(LOG_BOOKS_AND_PRINTOUTS, head, language)

for language, head, role, worth in (
    ("en", "df['force'] *= 2  # run this first", "force", 2.0),
    ("en", "Two cells in parallel, the file has one of them", "force", 2.0),
    ("en", "Load in lbf: see operator, heading is from the template", "force", 4.4482216152605),
    ("en", "Cell certificate 2.0 mV/V, typed 4.0 mV/V", "force", 2.0),
    ("en", "Readings to be taken times g", "force", 9.80665),
    ("en", "shackle pin cell senses half of the rope tension", "force", 2.0),
    ("en", "decimal point of the indicator one place too far left", "force", 10.0),
    ("en", "Force: tension negative", "force", -1.0),
    ("en", "white and green swapped at the amplifier", "force", -1.0),
    ("en", "position = -laser", "position", -1.0),
    ("en", "Laser set to 0-10 V for 50 mm, logger for 25 mm", "position", 2.0),
    ("en", "Encoder 1000 lines, x4 decoding not in the scale", "position", 0.25),
    ("en", "position in half millimetres", "position", 0.5),
    ("en", "time in units of 2 s", "time", 2.0),
    ("en", "logger clock 25 % fast", "time", 0.8),
    ("en", "Frames at 1000 fps, stamped for 2000 fps", "time", 2.0),
    ("de", "Wegsignal zählt nach oben", "position", -1.0),
    ("de", "Anzeige in kp", "force", 9.80665),
    ("fr", "Temps en demi-secondes", "time", 0.5),
    ("it", "Cella a valle di un paranco 2:1", "force", 2.0),
):
    nasty(LOG_BOOKS_AND_PRINTOUTS, head, role, worth, language, below=len(head) % 3 == 0)
