"""Layouts of logger files with the known truth beside each, by what they hold: the key of a set is the path of its module.

`heads` holds what stands around a table, `numbers` how units, rates, clocks, counts and rows are written, `programs` whole files of
programs and devices, `remarks` what people say beside their numbers. Each set was written whole, with its truth, before
the reader had seen any of it. New ones go to the end: which files `test_damaged_exports` damages depends on the order.
"""

from __future__ import annotations

from tests.records.exports.base import Export
from tests.records.exports.benches import BENCHES
from tests.records.exports.boxes import BOXES
from tests.records.exports.cells import CELLS
from tests.records.exports.channels import CHANNELS
from tests.records.exports.clocks import CLOCKS
from tests.records.exports.containers import CONTAINERS
from tests.records.exports.desks import DESKS
from tests.records.exports.heads.accuracies_ranges_and_calibrations import ACCURACIES_RANGES_AND_CALIBRATIONS
from tests.records.exports.heads.data_loggers import DATA_LOGGERS
from tests.records.exports.heads.english_and_german import ENGLISH_AND_GERMAN
from tests.records.exports.heads.factors_levers_and_zeros import FACTORS_LEVERS_AND_ZEROS
from tests.records.exports.heads.form_fields import FORM_FIELDS
from tests.records.exports.heads.instruments_and_benches import INSTRUMENTS_AND_BENCHES
from tests.records.exports.heads.keys_and_values import KEYS_AND_VALUES
from tests.records.exports.heads.makers_programs import MAKERS_PROGRAMS
from tests.records.exports.heads.many_languages_and_unit_rows import MANY_LANGUAGES_AND_UNIT_ROWS
from tests.records.exports.heads.one_claim_in_six_places import ONE_CLAIM_IN_SIX_PLACES
from tests.records.exports.heads.other_units_and_channel_tables import OTHER_UNITS_AND_CHANNEL_TABLES
from tests.records.exports.heads.ropes_weights_and_footnotes import ROPES_WEIGHTS_AND_FOOTNOTES
from tests.records.exports.heads.scripts_databases_and_machines import SCRIPTS_DATABASES_AND_MACHINES
from tests.records.exports.heads.sections_tags_and_comments import SECTIONS_TAGS_AND_COMMENTS
from tests.records.exports.heads.testers_gauges_and_boards import TESTERS_GAUGES_AND_BOARDS
from tests.records.exports.laboratory import LABORATORY
from tests.records.exports.numbers.changes_and_overflows import CHANGES_AND_OVERFLOWS
from tests.records.exports.numbers.clocks_counts_and_headings import CLOCKS_COUNTS_AND_HEADINGS
from tests.records.exports.numbers.factors_in_headings import FACTORS_IN_HEADINGS
from tests.records.exports.numbers.factors_states_and_foreign_formats import FACTORS_STATES_AND_FOREIGN_FORMATS
from tests.records.exports.numbers.rates_dates_and_brackets import RATES_DATES_AND_BRACKETS
from tests.records.exports.numbers.rates_lost_bytes_and_bits import RATES_LOST_BYTES_AND_BITS
from tests.records.exports.numbers.row_order_counters_and_clocks import ROW_ORDER_COUNTERS_AND_CLOCKS
from tests.records.exports.numbers.spellings_of_units import SPELLINGS_OF_UNITS
from tests.records.exports.numbers.symbols_stamps_and_second_runs import SYMBOLS_STAMPS_AND_SECOND_RUNS
from tests.records.exports.numbers.units_digits_and_clocks import UNITS_DIGITS_AND_CLOCKS
from tests.records.exports.programs.acquisition_scopes_and_testers import ACQUISITION_SCOPES_AND_TESTERS
from tests.records.exports.programs.channel_blocks import CHANNEL_BLOCKS
from tests.records.exports.programs.databases_and_notebooks import DATABASES_AND_NOTEBOOKS
from tests.records.exports.programs.instruments_and_markup import INSTRUMENTS_AND_MARKUP
from tests.records.exports.programs.laboratories_and_classrooms import LABORATORIES_AND_CLASSROOMS
from tests.records.exports.programs.motion_capture_and_controllers import MOTION_CAPTURE_AND_CONTROLLERS
from tests.records.exports.programs.recorders_and_serial_monitors import RECORDERS_AND_SERIAL_MONITORS
from tests.records.exports.programs.recorders_scripts_and_archives import RECORDERS_SCRIPTS_AND_ARCHIVES
from tests.records.exports.programs.scopes_companions_and_boards import SCOPES_COMPANIONS_AND_BOARDS
from tests.records.exports.programs.scopes_testers_and_serial_monitors import (
    QUANTITIES_BESIDE_FORCE,
    SCOPES_TESTERS_AND_SERIAL_MONITORS,
)
from tests.records.exports.programs.segments_and_testing_machines import SEGMENTS_AND_TESTING_MACHINES
from tests.records.exports.programs.servers_boards_and_recorders import SERVERS_BOARDS_AND_RECORDERS
from tests.records.exports.programs.waveforms_archives_and_structures import WAVEFORMS_ARCHIVES_AND_STRUCTURES
from tests.records.exports.programs.workbooks_and_binary_files import WORKBOOKS_AND_BINARY_FILES
from tests.records.exports.remarks.directions_sensitivities_and_row_order import DIRECTIONS_SENSITIVITIES_AND_ROW_ORDER
from tests.records.exports.remarks.forms_tickets_and_chat import FORMS_TICKETS_AND_CHAT
from tests.records.exports.remarks.log_books_and_printouts import LOG_BOOKS_AND_PRINTOUTS
from tests.records.exports.remarks.mounted_and_calibrated import MOUNTED_AND_CALIBRATED
from tests.records.exports.remarks.people_in_a_hurry import PEOPLE_IN_A_HURRY
from tests.records.exports.remarks.run_sheets import RUN_SHEETS
from tests.records.exports.remarks.seven_languages import SEVEN_LANGUAGES
from tests.records.exports.remarks.technicians_and_students import TECHNICIANS_AND_STUDENTS
from tests.records.exports.remarks.working_day import WORKING_DAY
from tests.records.exports.remarks.workshop_notes import WORKSHOP_NOTES
from tests.records.exports.scopes import SCOPES
from tests.records.exports.text import TEXT

KINDS: dict[str, list[Export]] = {
    "text": TEXT,
    "clocks": CLOCKS,
    "laboratory": LABORATORY,
    "scopes": SCOPES,
    "channels": CHANNELS,
    "containers": CONTAINERS,
    "heads/many_languages_and_unit_rows": MANY_LANGUAGES_AND_UNIT_ROWS,
    "programs/scopes_testers_and_serial_monitors": SCOPES_TESTERS_AND_SERIAL_MONITORS,
    "numbers/spellings_of_units": SPELLINGS_OF_UNITS,
    "benches": BENCHES,
    "desks": DESKS,
    "cells": CELLS,
    "numbers/factors_in_headings": FACTORS_IN_HEADINGS,
    "programs/quantities_beside_force": QUANTITIES_BESIDE_FORCE,
    "boxes": BOXES,
    "programs/laboratories_and_classrooms": LABORATORIES_AND_CLASSROOMS,
    "numbers/units_digits_and_clocks": UNITS_DIGITS_AND_CLOCKS,
    "programs/workbooks_and_binary_files": WORKBOOKS_AND_BINARY_FILES,
    "numbers/factors_states_and_foreign_formats": FACTORS_STATES_AND_FOREIGN_FORMATS,
    "programs/segments_and_testing_machines": SEGMENTS_AND_TESTING_MACHINES,
    "programs/instruments_and_markup": INSTRUMENTS_AND_MARKUP,
    "numbers/clocks_counts_and_headings": CLOCKS_COUNTS_AND_HEADINGS,
    "numbers/rates_lost_bytes_and_bits": RATES_LOST_BYTES_AND_BITS,
    "numbers/rates_dates_and_brackets": RATES_DATES_AND_BRACKETS,
    "heads/factors_levers_and_zeros": FACTORS_LEVERS_AND_ZEROS,
    "heads/ropes_weights_and_footnotes": ROPES_WEIGHTS_AND_FOOTNOTES,
    "heads/other_units_and_channel_tables": OTHER_UNITS_AND_CHANNEL_TABLES,
    "heads/one_claim_in_six_places": ONE_CLAIM_IN_SIX_PLACES,
    "programs/channel_blocks": CHANNEL_BLOCKS,
    "heads/accuracies_ranges_and_calibrations": ACCURACIES_RANGES_AND_CALIBRATIONS,
    "heads/english_and_german": ENGLISH_AND_GERMAN,
    "remarks/seven_languages": SEVEN_LANGUAGES,
    "heads/keys_and_values": KEYS_AND_VALUES,
    "remarks/technicians_and_students": TECHNICIANS_AND_STUDENTS,
    "heads/instruments_and_benches": INSTRUMENTS_AND_BENCHES,
    "remarks/working_day": WORKING_DAY,
    "heads/form_fields": FORM_FIELDS,
    "heads/data_loggers": DATA_LOGGERS,
    "remarks/run_sheets": RUN_SHEETS,
    "heads/sections_tags_and_comments": SECTIONS_TAGS_AND_COMMENTS,
    "heads/testers_gauges_and_boards": TESTERS_GAUGES_AND_BOARDS,
    "remarks/forms_tickets_and_chat": FORMS_TICKETS_AND_CHAT,
    "remarks/log_books_and_printouts": LOG_BOOKS_AND_PRINTOUTS,
    "remarks/workshop_notes": WORKSHOP_NOTES,
    "heads/makers_programs": MAKERS_PROGRAMS,
    "remarks/people_in_a_hurry": PEOPLE_IN_A_HURRY,
    "heads/scripts_databases_and_machines": SCRIPTS_DATABASES_AND_MACHINES,
    "remarks/mounted_and_calibrated": MOUNTED_AND_CALIBRATED,
    "remarks/directions_sensitivities_and_row_order": DIRECTIONS_SENSITIVITIES_AND_ROW_ORDER,
    "programs/motion_capture_and_controllers": MOTION_CAPTURE_AND_CONTROLLERS,
    "programs/acquisition_scopes_and_testers": ACQUISITION_SCOPES_AND_TESTERS,
    "programs/recorders_scripts_and_archives": RECORDERS_SCRIPTS_AND_ARCHIVES,
    "numbers/row_order_counters_and_clocks": ROW_ORDER_COUNTERS_AND_CLOCKS,
    "programs/recorders_and_serial_monitors": RECORDERS_AND_SERIAL_MONITORS,
    "programs/waveforms_archives_and_structures": WAVEFORMS_ARCHIVES_AND_STRUCTURES,
    "programs/scopes_companions_and_boards": SCOPES_COMPANIONS_AND_BOARDS,
    "numbers/changes_and_overflows": CHANGES_AND_OVERFLOWS,
    "numbers/symbols_stamps_and_second_runs": SYMBOLS_STAMPS_AND_SECOND_RUNS,
    "programs/databases_and_notebooks": DATABASES_AND_NOTEBOOKS,
    "programs/servers_boards_and_recorders": SERVERS_BOARDS_AND_RECORDERS,
}

NOT_MET = frozenset(
    (
        "nasty: deadband of indicator: shows every second newton",
        "nasty: Anchor carries 2 T, cell reads T",
        "nasty: Attach factor from page 3",
        "nasty: two sensors plugged the other way round halfway, in two columns of names",
    )
)
"""Layouts that are still read wrongly, or asked about without need: no rule of form tells them from others."""
