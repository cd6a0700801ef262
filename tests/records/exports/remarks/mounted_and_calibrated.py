"""How sensors were mounted, cleaned and calibrated; excitations, averages of two cells and films that change the numbers."""

from __future__ import annotations

from tests.records.exports.base import Kind
from tests.records.exports.heads.heads_and_feet import nasty, ordinary

MOUNTED_AND_CALIBRATED = Kind()

for language, head in (
    ("en", "TestWorks 4\nMethod Name: Cord pull\nSample I.D.: 17\nSpecimen Number: 3\nCrosshead: stationary"),
    ("en", "LabJack T7, firmware 1.0292\nStream started 09:12:44\nSettling 10 us\nResolution index 0"),
    ("en", "recorded by night shift, supervisor M. Okafor, building 7"),
    ("en", "Belay device: none\nAnchor: steel eye bolt M12\nHarness: dummy only\nDrop mass: 2.5 kg"),
    ("en", "Force sensor calibrated last month by the metrology department"),
    ("en", "Laser head cleaned before the session; window fogged up twice in the morning"),
    ("en", "Acquisition PC clock synchronised by NTP"),
    ("en", "Channel 1: load cell on the beam\nChannel 2: laser below the mass"),
    ("en", "[Header]\nSchema=2\nExporter=DropView 1.8\nLocale=en_GB\n[Operator]\nName=R. Silva"),
    ("en", "Rope: 9.2 mm dry treated, 48 kN sling certified EN 566\nAge: 14 months"),
    ("en", "nominal drop height 150 mm, actual height measured with a ruler 151 mm"),
    ("en", "Position sensor range 50 mm, resolution 2 um\nForce sensor range 500 N, resolution 0.1 N"),
    ("en", "Some oscillation after the second bounce, see photo IMG_2231.jpg"),
    ("de", "Messung abgebrochen nach 30 ms\nSpeicherort: D:/Daten/2024\nNetzteil: 24 V"),
    ("de", "Kraftmessdose neu eingebaut am Montag, Laser unverändert"),
    ("fr", "Essai réalisé au laboratoire de Grenoble\nCapteur étalonné en mars\nCorde de 9 mm"),
    ("es", "Célula instalada en la viga\nEnsayo repetido por petición del cliente\nHumedad 40 %"),
    ("it", "Cella fissata alla trave\nProva ripetuta su richiesta del cliente\nUmidità 40 %"),
    ("cs", "Snímač upevněn na nosníku\nZkouška opakována na přání zákazníka"),
    ("pl", "Czujnik zamocowany na belce\nPróba powtórzona na życzenie klienta"),
):
    ordinary(MOUNTED_AND_CALIBRATED, head, language)

for language, head, role, worth in (
    ("en", "Sensor excitation 5 V; table made at 10 V", "force", 2.0),
    ("en", "Bridge completion wrong: signal halved", "force", 2.0),
    ("en", "Values are the average of both cells, they share the load", "force", 2.0),
    ("en", "tons on the display, newtons only in the heading", "force", 9806.65),
    ("en", "Load: F = reading / 0.25", "force", 4.0),
    ("en", "Anchor force is double what is listed", "force", 2.0),
    ("en", "load cell cable crossed, tension comes out below zero", "force", -1.0),
    ("en", "raw force, still to be scaled by 1.02", "force", 1.02),
    ("en", "column 2 holds the upward force on the mass with the sign of the drawing (down positive)", "force", -1.0),
    ("en", "position taken at the crank, ratio 3 to 1", "position", 3.0),
    ("en", "distance sensor: larger numbers mean higher", "position", -1.0),
    ("en", "mm read off a film at 1:2", "position", 2.0),
    ("en", "Video slowed four times before tracking", "time", 0.25),
    ("en", "sampled at 1000 Hz (header template says 2000)", "time", 2.0),
    ("en", "half the samples were removed to save space, stamps recomputed", "time", 2.0),
    ("de", "Verstärkung versehentlich auf 2 belassen", "force", 0.5),
    ("de", "Laser misst gegen die Fallrichtung", "position", -1.0),
    ("fr", "Les forces affichées sont divisées par dix", "force", 10.0),
    ("es", "El desplazamiento está en pulgadas", "position", 25.4),
    ("pl", "Kierunek przemieszczenia odwrotny", "position", -1.0),
):
    nasty(MOUNTED_AND_CALIBRATED, head, role, worth, language, below=len(head) % 3 == 0)
