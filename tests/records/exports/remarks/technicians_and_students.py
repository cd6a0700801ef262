"""What a technician, a student and an amateur leave above a table: equipment, places and slips of gain, sign and clock."""

from __future__ import annotations

from tests.records.exports.base import Kind
from tests.records.exports.heads.heads_and_feet import nasty, ordinary

TECHNICIANS_AND_STUDENTS = Kind()

for head in (
    "Zwick Z010, testXpert II\nHead speed: 500 mm/min\nGrip separation: 200 mm",
    "Export from data logger GL840, firmware 1.20\nInput range CH1: 10 V",
    "Teensy 4.1 + HX711 @ 80 SPS disabled, ADS1256 used",
    "Rope test rig, Alpine club section Graz",
    "Falling mass hits the stopper 0.35 m below the clamp",
    "Photo: IMG_2231.jpg, video: drop14.mp4 (240 fps)",
    "Rope: Beal Booster 9.7 mm, 1st fall, kept 5 min between falls",
    "SW build 1123; license until 2025-01-31; user: lab2",
    "Battery 3.92 V, RSSI -61 dBm",
    "GPS: 47.07 N, 15.44 E, altitude 353 m",
    "Device ID 0xA3F1, uptime 00:12:44",
    "Elapsed since last test: 6 min",
    "Inspector: J. Weiss; result: passed",
    "Bungee cord 8 mm x 1.2 m, knot: bowline",
    "Strain rate 0.5 1/s, crosshead at 50 mm",
    "Damper oil: ISO VG 46, refilled in April 2024",
    "Cart mass 0.505 kg, track level to 0.1 deg",
    "Analog inputs: AI0 force, AI1 position; range +/-10 V; differential",
    "IEPE supply 4 mA, cable 10 m RG58",
    "Dropped from hand height, third attempt",
):
    ordinary(TECHNICIANS_AND_STUDENTS, head)

for head, role, worth in (
    ("Tension shared equally with the neighbour rope, which had no cell", "force", 2.0),
    ("Scaling block in the VI had the old mV/V", "force", 2.0),
    ("x1000 button pressed", "position", 1e-3),
    ("HX711 set to 64 although the sketch says 128", "force", 2.0),
    ("Please note that the gauge is hung on a block and tackle", "force", 2.0),
    ("Calibration sheet: 100.0 N applied, logger 50.0 N", "force", 2.0),
    ("We pulled, so minus", "force", -1.0),
    ("Laser points at the counterweight", "position", -1.0),
    ("Laser points at the counterweight, so up is down", "position", -1.0),
    ("Position from the potentiometer, 0.5 turn wiper", "position", 0.5),
    ("Values of force in lbf", "force", 4.4482216152605),
    ("F: multiply by g", "force", 9.80665),
    ("Numbers are grams-force in column 2", "force", 0.00980665),
    ("Timestamps derived from wrong baud, all 20 % short", "time", 1.25),
    ("time is in units of the sample clock (2 samples)", "time", 0.5),
    ("Crystal was 8 MHz but firmware built for 16 MHz", "time", 2.0),
    ("TTL divider, take x2 for forces", "force", 2.0),
    ("Correction to be made: F*1.05", "force", 1.05),
    ("Old cal. (2019) used, new cal. 4 % higher", "force", 1.04),
    ("half the newtons you would expect", "force", 2.0),
):
    nasty(TECHNICIANS_AND_STUDENTS, head, role, worth, below=len(head) % 3 == 0)
