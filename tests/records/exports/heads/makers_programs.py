"""Whole heads that makers' programs print around a table; loaded calibrations, conversions and clocks that do not fit them."""

from __future__ import annotations

from tests.records.exports.base import Kind
from tests.records.exports.heads.heads_and_feet import nasty, ordinary

MAKERS_PROGRAMS = Kind()

for language, head in (
    (
        "en",
        "MTS793|MPT|ENU|1|2|.|/|:|1|0|0|A\nData Acquisition: Timed Data\n"
        "Station Name: Rope_01.cfg\nTest File Name: Specimen17.tst",
    ),
    (
        "en",
        "Vendor,GRAPHTEC Corporation\nModel,GL980\nVersion,Ver1.01\nSampling interval,500us\n"
        "Total data points,60\nLogic/Pulse,Off\nPulse mode,Revolutions",
    ),
    (
        "en",
        "Plot Title: drop 7\nLGR S/N: 1077\nHousekeeping: off\nButton Up/Button Down, Host Connected, Stopped, End Of File",
    ),
    (
        "en",
        "HIOKI MEMORY HiCORDER MR8847\nComment: rope test\nTrigger Time: 24-03-14 09:12:44\n"
        "Timebase: 5 ms/div\nPre-Trig: 10 %\nLogic: none",
    ),
    (
        "en",
        "File name: drop17.dxd\nStart time: 14.03.2024 09:12:44.218\nNumber of channels: 2\n"
        "Sample rate: 2000 Hz\nStore type: fast on trigger\nPost time: 30 ms",
    ),
    (
        "en",
        "FUTEK SENSIT Test and Measurement\nModel: USB220\nSensor S/N: 588211\nSampling Rate: 2000\nLogging Mode: Tracking",
    ),
    (
        "en",
        "DAQami V4.2.1\nDevice: USB-1608FS-Plus\nTotal number of samples: 60\nAcquisition mode: finite\nBurst mode: off",
    ),
    ("en", "# HX711 ready after 412 ms\n# free RAM 1204\n# loop start\n# sd card 7.4 GB, FAT32"),
    (
        "en",
        "Root Name,Title,Author,Date/Time,Groups,Description\ndrop_0017,,labuser,03/14/2024 09:12:44 AM,1,FlexLogger",
    ),
    (
        "en",
        "Instrument: Tinius Olsen H5KS\nTest routine: FR2\nExtensometer: none fitted\nApproach: manual\nReturn: auto",
    ),
    (
        "de",
        "WinTest; Version 6.2\nPrüfling;Reepschnur 6 mm\nPrüfnorm;EN 564\nAuftraggeber;DAV\nPrüfgeschwindigkeit;500 mm/min\nTemperatur;23 °C",
    ),
    (
        "de",
        "NEXTVIEW 4\nGerät: bmcm USB-AD16f\nAufzeichnungsdauer: 0,03 s\nScanbeginn: 09:12:44\nPufferung: Ringpuffer",
    ),
    ("de", "imc FAMOS ASCII-Export\nKommentar: Sturz 17\nTriggerzeit: 14.03.2024 09:12:44\nTrennzeichen: Semikolon"),
    ("fr", "Dewetron Oxygen 5.3\nNom du projet : corde\nVoies : 2\nDébut : 14/03/2024 09:12\nDéclenchement : manuel"),
    (
        "es",
        "Ibertest WinTest32\nNorma: EN 892\nCliente: Cuerdas del Norte S.L.\nLongitud útil: 2500 mm\nVelocidad de ensayo: 10 mm/min",
    ),
    (
        "it",
        "Galdabini Graphwork 6\nProva: strappo\nCommittente: Alpe S.r.l.\nLunghezza iniziale: 300 mm\nSezione: 78,5 mm²",
    ),
    ("cs", "Dewesoft X3\nZakázka: 24-117\nZkušebna: Brno\nVzorek: smyčka 120 cm\nVlhkost: 44 %\nZapsal: Novotný"),
    ("pl", "Kistler MARS\nZlecenie: 24/117\nPróbka: taśma 16 mm\nTemperatura: 21 °C\nWykonał: Wójcik"),
    ("en", "Zeroed before test\nUnits: SI\nOperator confirmed setup: yes\nResult: PASS\nBreak: no"),
    ("en", "Data exported with interpolation off, all 60 points, 2 channels, ASCII tab delimited"),
):
    ordinary(MAKERS_PROGRAMS, head, language)

for language, head, role, worth in (
    ("en", "Model: USB220\nLoaded cal file: LSB205 (cell is LSB201, half the sensitivity)", "force", 2.0),
    ("en", "Amp settings: span 0-500 N displayed, 0-1000 N fitted", "force", 2.0),
    ("en", "Vendor,GRAPHTEC\nEU conversion CH1,off\nEU ratio,2.5", "force", 2.5),
    ("en", "Test mode: compression\nPolarity not switched for this tensile run", "force", -1.0),
    ("en", "Sensor table: TEDS read failed, default 1 mV/V used, cell has 2 mV/V", "force", 0.5),
    ("en", "Reading is gross/2", "force", 2.0),
    ("en", "Export unit: pound, header unit fixed to N", "force", 4.4482216152605),
    ("en", "Number format: F x 10^-1", "force", 0.1),
    ("en", "Two-cell average shown, total wanted", "force", 2.0),
    ("en", "Filter settings: none\nForce axis flipped in software 5.2 and later", "force", -1.0),
    ("en", "Encoder: 4X mode set, 2X mode in reality", "position", 2.0),
    ("en", "Draw-wire sensor pulled backwards (cable runs in when the mass falls)", "position", -1.0),
    ("en", "Ext. displacement: gear 1/2 between drum and encoder", "position", 2.0),
    ("en", "Data reduction: 2 -> 1, time base of the raw data", "time", 2.0),
    ("en", "External clock 1000 Hz, software set for 2000 Hz", "time", 2.0),
    ("de", "Messverstärker: Eingang 2 mV/V, Aufnehmer 1 mV/V", "force", 0.5),
    ("de", "Wegaufnehmer zählt rückwärts", "position", -1.0),
    ("fr", "Unité affichée : daN", "force", 10.0),
    ("es", "Fuerza registrada en un solo ramal de dos", "force", 2.0),
    ("it", "Guadagno amplificatore 200, impostato 100", "force", 0.5),
):
    nasty(MAKERS_PROGRAMS, head, role, worth, language, below=len(head) % 3 == 0)
