"""Keys and values of programs, each in one of six places; some scale a channel, turn its sign or stretch the clock."""

from __future__ import annotations

from tests.records.exports.base import FORCE, POSITION, TIME, Kind
from tests.records.exports.heads.heads_and_feet import nasty, ordinary
from tests.records.exports.heads.one_claim_in_six_places import PLACES

KEYS_AND_VALUES = Kind()
SHOWN = tuple(PLACES)

# What programs and people write, each in one of six places in turn.
HARMLESS = (
    ("project_code", "FX-2024-11"),
    ("ambient_temp_C", "21.7"),
    ("strain_gauge_type", "full bridge 350 ohm"),
    ("excitation_voltage", "10 V"),
    ("camera_fps", "500"),
    ("battery_level", "87 %"),
    ("knot", "figure eight"),
    ("drop_mass_kg", "2.5"),
    ("free_fall", "0.25 m"),
    ("rope_diameter_mm", "9.8"),
    ("operator_initials", "JK"),
    ("trigger_channel", "2"),
    ("bandwidth", "500 Hz"),
    ("n_samples", "60"),
    ("start_time", "2024-05-12T14:22:11Z"),
    ("force_sensor_serial", "80312"),
    ("position_sensor_model", "ILD1420-50"),
    ("file_format_version", "3"),
    ("test_standard", "EN 564"),
    ("comment", "second try after retying the knot"),
)
for i, (key, value) in enumerate(HARMLESS):
    write, suffix, _ = PLACES[SHOWN[i % 6]]
    KEYS_AND_VALUES.add(
        f"ordinary, {SHOWN[i % 6]}: {key} {value}",
        write(key, value, (TIME, FORCE, POSITION)),
        suffix=suffix,
        rtol=1e-6,
    )

# What bears on the numbers, in the same places.
BEARING = (
    ("mech_advantage", "2", "force", 2.0),
    ("strands_loaded", "2 (force shown for one)", "force", 2.0),
    ("fsr_mismatch", "range entered 250 N, cell is 500 N", "force", 2.0),
    ("comment", "load is what one hand felt, we were two", "force", 2.0),
    ("orientation", "sensor turned by 180 deg", "force", -1.0),
    ("sign_convention", "compression +", "force", -1.0),
    ("post", "divide force by 1.5", "force", 1 / 1.5),
    ("todo", "apply sensitivity of new cell, 2.0 vs 1.0 mV/V", "force", 2.0),
    ("lbs_or_newton", "kgf", "force", 9.80665),
    ("pot_turns", "wrong: 5 instead of 10", "position", 2.0),
    ("scan", "every other row deleted, clock column renumbered", "time", 2.0),
    ("clock_error", "runs 5 % fast", "time", 0.95),
)
for i, (key, value, role, worth) in enumerate(BEARING):
    write, suffix, headings = PLACES[SHOWN[i % 6]]
    column = headings[("time", "force", "position").index(role)]
    numbers = [
        v / (worth if r == role else 1.0)
        for r, v in zip(("time", "force", "position"), (TIME, FORCE, POSITION), strict=True)
    ]
    KEYS_AND_VALUES.add(
        f"nasty, {SHOWN[i % 6]}: {key} {value}",
        write(key, value, tuple(numbers)),
        suffix=suffix,
        refused=key.replace("_", "[_ ]"),
        remedy={"channels": {role: {"column": column, "scale": f"{worth:.10g}"}}},
        rtol=1e-6,
        atol_time=1e-7,
    )
nasty(KEYS_AND_VALUES, "# Hdr v2\n# scl_f=2", below=False)
nasty(KEYS_AND_VALUES, "[Channel2]\nName=force\nMult=2\nAdd=0")
nasty(KEYS_AND_VALUES, "CH2 KF 2.0")
nasty(KEYS_AND_VALUES, "Ch2: N/div 5, probe 1:2")
nasty(KEYS_AND_VALUES, "Displacement sensor spans 50 mm but software was told 100 mm", "position", 0.5)
nasty(KEYS_AND_VALUES, "Load = left + right; only left recorded", below=True)
nasty(KEYS_AND_VALUES, "Reading 0.5 means 1 N")
nasty(KEYS_AND_VALUES, "Filter delays force; numbers uncompensated and inverted", worth=-1.0)
ordinary(KEYS_AND_VALUES, "Session ended normally", below=True)
