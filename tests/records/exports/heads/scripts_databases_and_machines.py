"""Heads of scripts, databases, message brokers and controllers of industry; pending scales, signs and cycle times."""

from __future__ import annotations

from tests.records.exports.base import Kind
from tests.records.exports.heads.heads_and_feet import nasty, ordinary

SCRIPTS_DATABASES_AND_MACHINES = Kind()

for language, head in (
    ("en", "# pandas 2.2.1 to_csv\n# index=False\n# source: drop_0017.parquet\n# rows: 60"),
    ("en", "# sha256 1f0c9a7e\n# licence: CC-BY-4.0\n# contact: ropes@example.org\n# doi: 10.5281/zenodo.123456"),
    ("en", "PLC: S7-1500\nDB: DB41\nCycle time: 0.5 ms\nRecipe: Drop_B\nBatch: 0417"),
    ("en", "station=3\ncavity=1\ntool=T-88\npart=2211-04\nresult=OK\nshift=B"),
    ("en", "LabArchives entry 2231\nExperiment: E-17\nVisibility: group\nVersion: 3"),
    ("en", "ROS bag: drop_2024-03-14.bag\nTopic: /force /position\nMessages: 120\nStorage: sqlite3"),
    ("en", "mqtt broker 10.0.0.4:1883\nqos 1\nclient esp32-07\nrssi -61 dBm"),
    ("en", "Sensor 1: S2M/500N, bolted to the ceiling\nSensor 2: ILD1420-100, on the floor"),
    ("en", "Force: ch 0, differential, +/-10 V\nPosition: ch 1, single-ended, 0-10 V"),
    ("en", "force: mean 12.6 N, n = 60\nposition: n = 60"),
    ("en", "Rig: drop tower no. 2\nFall mass: 2.500 kg\nFree rope: 2.40 m\nAngle of guide: 90 deg"),
    ("en", "Anti-alias: 8th order, 800 Hz\nADC: 24 bit sigma-delta\nInput range: 10 V\nCoupling: DC"),
    ("en", "Calibration certificate DKD 2024-118 valid to 03/2026\nTraceable: yes"),
    ("en", "Header length: 6\nColumns separated by commas\nDecimal point\nTime relative to trigger"),
    ("de", "Prüfstand: PS4\nSPS: Beckhoff CX5140\nTwinCAT Scope\nZykluszeit: 0,5 ms\nAufnahmebeginn: 09:12:44"),
    ("de", "Kraftsensor: HBM S2M, 500 N, Nr. 224410\nWegsensor: Micro-Epsilon ILD1420-100"),
    ("fr", "Capteur de force : HBM S2M, 500 N\nCapteur laser : ILD1420-100\nFréquence : 2000 Hz"),
    ("es", "Célula de carga: HBM S2M, 500 N\nLáser: ILD1420-100\nFrecuencia: 2000 Hz"),
    ("it", "Cella di carico: HBM S2M, 500 N\nLaser: ILD1420-100\nFrequenza: 2000 Hz"),
    ("cs", "Snímač síly: HBM S2M, 500 N\nLaser: ILD1420-100\nFrekvence: 2000 Hz"),
):
    ordinary(SCRIPTS_DATABASES_AND_MACHINES, head, language)

for language, head, role, worth in (
    ("en", "# force /= 2  (undo before use)", "force", 2.0),
    ("en", "scale_pending=true\nforce_k=2.0", "force", 2.0),
    ("en", "Sensor 1: S2M/500N, configured S2M/1kN", "force", 0.5),
    ("en", "Force: ch 0, wired with + and - interchanged", "force", -1.0),
    ("en", "unit_force: kgf", "force", 9.80665),
    ("en", "# dtype int16 scaled 1/100 -> export forgot: /1000", "force", 10.0),
    ("en", "DB41.force := load * 0.5", "force", 2.0),
    ("en", "Quantity: force per metre of drum circumference (0.5 m)", "force", 0.5),
    ("en", "force_sign: compression_positive", "force", -1.0),
    ("en", "Known issue #12: load reported at 25 %", "force", 4.0),
    ("en", "position_dir: -1", "position", -1.0),
    ("en", "Topic: /position (negated in TF)", "position", -1.0),
    ("en", "position = encoder * 1.0  # 2.0 since new wheel", "position", 2.0),
    ("en", "x: [in 0.5 mm ticks]", "position", 0.5),
    ("en", "# use_sim_time: real-time factor 0.5", "time", 0.5),
    ("en", "rows resampled 2:1 but stamps kept", "time", 2.0),
    ("de", "Skalierfaktor Kraft 2,0 (nicht aktiv)", "force", 2.0),
    ("de", "Zykluszeit: 1 ms, eingetragen 0,5 ms", "time", 2.0),
    ("fr", "Échelle de force : 2 N par unité", "force", 2.0),
    ("pl", "Siłę należy pomnożyć przez dwa", "force", 2.0),
):
    nasty(SCRIPTS_DATABASES_AND_MACHINES, head, role, worth, language, below=len(head) % 3 == 0)
