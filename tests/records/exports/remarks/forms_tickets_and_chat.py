"""Forms, tickets, chat lines and sheets around a table; what one of them says of a leg, a range, a sign or a step."""

from __future__ import annotations

from tests.records.exports.base import Kind
from tests.records.exports.heads.heads_and_feet import nasty, ordinary

FORMS_TICKETS_AND_CHAT = Kind()

for language, head in (
    ("en", "Form QF-22 rev 4\nJob 5521 / item 3\nWitnessed by: P. Lund"),
    ("en", "Cable drum 7, reel end B\nCut from 200 m reel\nAge 3 years"),
    ("en", "Kit list: tripod, 2 slings, 4 carabiners, laptop"),
    ("en", "Drop no 6 of 10, interval between drops 2 min"),
    ("en", "Ref: doi:10.1234/abcd.567\nDataset v1.2.0"),
    ("en", "Mast height 6.0 m; hook height 5.2 m; floor: concrete"),
    ("en", "IP 192.168.1.20, port 5020, Modbus unit 3"),
    ("en", "Supply 12.1 V\nCurrent draw 0.35 A\nBoard temp 41 C"),
    ("en", "Room lights off, laser class 2, goggles on"),
    ("en", "Creep test follows at 14:00; see folder B"),
    ("en", "Mass block: 2.500 kg (incl. eye bolt 0.112 kg)"),
    ("en", "Resin: epoxy L285; cure 24 h at 23 C; fibre volume 55 %"),
    ("en", "Saved from scope screen, memory depth 1 Mpts, autosave slot 3"),
    ("de", "Formblatt 12, Seite 1 von 2\nKennzeichen: B-77\nFreigabe: ja"),
    ("de", "Seilalter: 3 Jahre\nLagerung: trocken\nVorbehandlung: keine"),
    ("fr", "Fiche n° 12, page 1/2\nCorde neuve, lot 45\nOpératrice : Mme Roy"),
    ("es", "Hoja 3 de 5\nLote 45\nCuerda seca, 3 años"),
    ("it", "Scheda 12, pagina 1 di 2\nLotto 45\nCorda asciutta"),
    ("cs", "List 3 z 5\nŠarže 45\nLano suché, stáří 3 roky"),
    ("pl", "Karta 12, strona 1 z 2\nPartia 45\nLina sucha"),
):
    ordinary(FORMS_TICKETS_AND_CHAT, head, language)

for language, head, role, worth in (
    ("en", "Displayed load is per leg of the bridle (2 legs)", "force", 2.0),
    ("en", "The amp was left on range 2; the table is for range 1", "force", 2.0),
    ("en", "Load: subtract nothing, multiply by two", "force", 2.0),
    ("en", "counts/2 were written to save space (force only)", "force", 2.0),
    ("en", "We forgot the factor of the lever: 3:1", "force", 3.0),
    ("en", "cell output seen at 5 V instead of 10 V full scale", "force", 2.0),
    ("en", "force in N*2", "force", 0.5),
    ("en", "N.B. F is in kgf!", "force", 9.80665),
    ("en", "red and black of the bridge exchanged", "force", -1.0),
    ("en", "plus is compression here", "force", -1.0),
    ("en", "down is minus for the laser", "position", -1.0),
    ("en", "travel: 1 unit = 0.5 mm", "position", 0.5),
    ("en", "Position measured on the drum, half the rope travel", "position", 2.0),
    ("en", "mm on paper, quarter scale", "position", 4.0),
    ("en", "true rate turned out as 1000/s", "time", 2.0),
    ("en", "time axis compressed 2x in export", "time", 2.0),
    ("en", "one row in two was dropped by the radio, times renumbered", "time", 2.0),
    ("de", "Achtung: Kraft wurde halbiert abgelegt", "force", 2.0),
    ("es", "Signo de la posición cambiado", "position", -1.0),
    ("cs", "Síla v kilopondech", "force", 9.80665),
):
    nasty(FORMS_TICKETS_AND_CHAT, head, role, worth, language, below=len(head) % 3 == 0)
