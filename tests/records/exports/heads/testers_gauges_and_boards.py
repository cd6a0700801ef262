"""Heads as testing software, gauges and amateurs' boards print them; reeving, cells configured for another range, swapped ends."""

from __future__ import annotations

from tests.records.exports.base import Kind
from tests.records.exports.heads.heads_and_feet import nasty, ordinary

TESTERS_GAUGES_AND_BOARDS = Kind()

for language, head in (
    ("en", "Bluehill Universal\nMethod: rope_dyn.is_tens\nSample: 17\nGeometry: Circular\nGauge length,250.00,mm"),
    ("en", "PASCO Capstone\nRun #3\nSmart Cart (red) 803-123"),
    ("en", "Logger Pro 3.16\nLatest\nUser: period 4 physics"),
    ("en", "Mark-10 M5-500, S/N 3771204\nMode: RT (real time)\nLow battery: no"),
    ("en", "LineScale 3 - 30 kN\nLog speed: 1280 Hz\nBluetooth on\nUnit: N\nZero: absolute"),
    ("en", "millis since boot at start: 88123\nloop() 500 us\nfree heap 21344"),
    ("en", "Tester,J. Ortiz\nShift,2\nLine,4\nPart no.,AX-5501\nGood parts,14\nScrap,0"),
    ("en", "Crash pad: 40 mm EVA\nHelmet: none\nDummy: sandbag 2.5 kg\nKnot: figure eight"),
    ("en", "xml version 1.0\nencoding UTF-8\nschema 7"),
    ("en", "Tower leg: NE\nWind: 2 m/s\nSky: overcast\nGround: 7 C"),
    ("en", "Ticket: RIG-118\nBranch: main\nReviewed-by: Ann"),
    ("en", "Trigger source: digital line PFI0, rising\nPosttrigger: 0.03 s"),
    ("de", "Anlage: Fallturm 2\nBediener: Ott\nProgramm: Fall_10mm\nLuftdruck: 962 hPa\nTaupunkt: 8 °C"),
    ("de", "Dateiname: drop17.csv\nErstellt: 14.03.2024 09:12\nDateigröße: 14 kB"),
    ("de", "Gehäuse: IP65\nSpannungsversorgung: 24 V\nSchnittstelle: RS232"),
    ("fr", "Atelier : Lyon\nMéthode : chute libre\nMasse tombante : 2,5 kg\nNœud : huit"),
    ("es", "Proyecto: cuerda dinámica\nNudo: ocho\nOperario: Sáez\nTemperatura ambiente: 22 °C"),
    ("it", "Progetto: corda dinamica\nNodo: otto\nBanco: 3\nUmidità: 44 %"),
    ("cs", "Projekt: lano\nUzel: osmička\nMístnost: B 214\nTlak: 985 hPa"),
    ("pl", "Projekt: lina\nWęzeł: ósemka\nSala: 12\nPogoda: deszcz"),
):
    ordinary(TESTERS_GAUGES_AND_BOARDS, head, language)

for language, head, role, worth in (
    ("en", "Rope reeved 1:2 through the block, cell at the becket", "force", 2.0),
    ("en", "Channel gain: x2 pending", "force", 2.0),
    ("en", "Units of column 2: tens of grams-force", "force", 0.0980665),
    ("en", "load cell rated 500 N, configured as 250 N", "force", 2.0),
    ("en", "F_true = F / 0.5", "force", 2.0),
    ("en", "Force is measured on one of two parallel slings", "force", 2.0),
    ("en", "Summing box disconnected, only cell A of A+B recorded", "force", 2.0),
    ("en", "mV/V entered: 2.0, plate says: 1.0", "force", 2.0),
    ("en", "Pull on the cell gives a falling number", "force", -1.0),
    ("en", "Hook on the wrong side: load inverted", "force", -1.0),
    ("en", "Position channel in inch/10, despite heading", "position", 2.54),
    ("en", "laser averaging window: every reading is half of the stroke", "position", 2.0),
    ("en", "Potentiometer ends swapped", "position", -1.0),
    ("en", "position of the far end; rope runs back over a pulley, twice the stroke", "position", 0.5),
    ("en", "Logged at 1 kHz, time column assumes 2 kHz", "time", 2.0),
    ("en", "clock ratio 2:1", "time", 2.0),
    ("en", "Averaged in pairs before saving, time not adjusted", "time", 2.0),
    ("de", "Signal liegt an 2-facher Verstärkung, Skalierung für 1-fach", "force", 0.5),
    ("fr", "Capteur sur un brin, deux brins au total", "force", 2.0),
    ("pl", "Znak siły odwrócony", "force", -1.0),
):
    nasty(TESTERS_GAUGES_AND_BOARDS, head, role, worth, language, below=len(head) % 3 == 0)
