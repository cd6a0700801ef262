"""Numbers that something is compared with and no verdict rests on, each with the reason why it stands where it is used.

Whatever else is compared with is a threshold: it stands in the `thresholds.py` of its floor and has a `Bracket`.
`tests/test_house.py` reads the code and refuses a number that is in neither place, and a name here that is gone.
"""

from __future__ import annotations

ENDS = "an iteration ends there, far below what any statement is rounded to"
ROUNDING = "rounding of the arithmetic, and divisions by nothing"
WORK = "how much is done at once, tried or kept: it costs time, and results are the same or are refused as such"
START = "where a search begins, and not what it comes to: the estimate is judged by itself"
STEP = "how a search goes on, and not what it comes to: its end is judged by itself"
FORMULA = "follows from mathematics"
FORM = "the form of a file, of a name or of a unit of time"
HINT = "which words are near enough to be offered: none is taken for another"
PAGE = "what has room on a page or in a line; the whole stands in the result"

REASONS: dict[str, dict[str, str]] = {
    "core.errors": {"MOST_TOLD": PAGE, "LONGEST": PAGE, "LIKE": HINT, "_BEGINNING": HINT},
    "core.paths": {"_LONGEST": PAGE, "_LONGEST_END": FORM},
    "core.programs": {
        "MOST_PROGRAMS": WORK,
        "MOST_ON_DISK": WORK,
        "SETTLED_SECONDS": WORK,
        "MOST_IN_MEMORY": WORK,
        "DEEPEST": WORK,
    },
    "core.formatting": {"100.0": PAGE, "10.0": PAGE, "0.0001": PAGE, "10000000.0": PAGE, "1e-12": ROUNDING},
    "discovery.engine.candidates": {"MANY": STEP, "RETIMED": STEP},
    "discovery.laws.relaxation": {"UNSEEN": ROUNDING},
    "discovery.engine.refit": {"ARRIVED": ENDS, "0.0001": ENDS, "1000000.0": ENDS},
    "discovery.residuals.eigenvalues": {"EXACT": WORK},
    "fitting.gls": {"ROUNDS": STEP},
    "fitting.search.starts": {"STARTS_AT_ONCE": WORK, "FAR_ABOVE": STEP},
    "fitting.uncertainty": {"1e-12": ROUNDING, "1e-300": ROUNDING},
    "laws.families": {"MOST_DIGITS": FORM},
    "laws.pushes": {"SHORT": ROUNDING},
    "laws.template": {"WIDTH": FORM},
    "problem.estimate.evidence": {
        "MOST_POINTS": WORK,
        "MANY": WORK,
        "WEIGHS": ROUNDING,
        "WEIGHTLESS": ROUNDING,
    },
    "problem.estimate.gauss_newton": {
        "NOTICEABLE_FALL": STEP,
        "MODE_TOLERANCE": ENDS,
        "FAR_BELOW": START,
        "0.75": STEP,
        "0.25": STEP,
        "ON_RADIUS": STEP,
        "0.001": STEP,
    },
    "problem.inputs.sensitivities": {"NEGLIGIBLE": WORK, "10000000.0": WORK},
    "problem.inputs.smoothing": {"3.0": WORK, "MOST_CORNERS": WORK, "0.01": ENDS},
    "problem.noise.readings": {"5.0": FORMULA},
    "problem.noise.rounding": {"12.0": FORMULA, "CHANGED": ENDS},
    "core.spectra": {"1000000000.0": ENDS, "1e-09": ENDS},
    "problem.noise.whittle": {"LINES": WORK, "0.9": FORMULA, "LOUDEST_LOADED": FORMULA, "1e-300": ROUNDING},
    "problem.statement.observations": {"NEAR": ROUNDING},
    "records.build": {"1e-09": ROUNDING},
    "records.stamps": {"1000000.0": FORM},
    "records.clock.timebase": {"0.05": START},
    "records.files.arrays.values": {"_DAY": FORM},
    "records.clock.wall_clock": {"_HOUR": FORM, "_DAY": FORM, "0.001": FORM},
    "records.columns.damage": {"1e-300": ROUNDING},
    "records.files.block": {"_LONG": WORK},
    "records.files.matlab_sizes": {"DEEPEST": WORK, "_PART": WORK},
    "records.grammar.digits": {"EMPTY_WHOLE": FORM, "EXPONENT": FORM, "1000.0": FORM},
    "records.grammar.phrases": {"_NAMED": PAGE},
    "records.layouts.usual": {"_ENDS": WORK},
    "report.sentences.fit": {"MOST_SHARE": PAGE},
    "report.sentences.minima": {"1.005": PAGE, "MOST_MINIMA": PAGE},
    "report.checks": {"MOST_NOTES": PAGE},
    "report.batch": {"LONGEST_NAME": PAGE, "MOST_ERRORS": PAGE, "MOST_NAMED": PAGE},
    "report.discovery": {"MOST_NAMED": PAGE},
    "report.page.batch": {"MOST_PRINTED": PAGE},
    "report.page.moments": {"SHORTEST_PHASE": PAGE},
    "report.sentences.discovery": {"0.005": PAGE},
    "report.sentences.posterior": {"VALUES_NAMED": PAGE},
    "report.sweep": {"NO_MORE": PAGE},
    "report.text": {"LONGEST_NAME": PAGE},
    "rigs.effects": {"STEP": PAGE},
    "rigs.fibre_mass": {"0.1": START, "SMOOTHED_DROP": START},
    "rigs.guided_mass": {"SLOW": START},
    "rigs.inverted_pendulum": {"SURELY_TAUT": START},
    "rigs.parts.fibre": {"NEWTON_STEPS": ENDS, "CONVERGED": ENDS},
    "rigs.pendulum": {"SLOW": START},
    "rigs.pulley_drive": {"SLIDES": START, "0.15": START},
    "rigs.signals.rates": {"MANY": WORK, "1.5": START, "4.0": START},
    "sampling.chains": {"20.0": WORK},
    "sampling.latent": {"1e-06": WORK},
    "sampling.evidence": {"1e-10": ENDS},
    "sampling.mode": {"1e-06": ENDS, "1e-05": STEP, "1000000.0": ENDS, "BLIND": ROUNDING, "0.01": ROUNDING},
    "series.sweep": {
        "1e-08": ENDS,
        "0.1": STEP,
        "0.0001": ENDS,
        "0.001": STEP,
        "MOST_PERIODS": WORK,
    },
    "series.meta_analysis": {"CLOSE": ENDS},
    "simulation.sensitivity": {"1e-12": ROUNDING, "MANY": WORK},
    "simulation.sensing": {"ARCS": WORK},
    "simulation.switched": {
        "ARCS": WORK,
        "SWITCHES_A_STEP": WORK,
        "USUAL_TRIES": STEP,
        "MOST_CALMED": STEP,
        "MOST_TRIES": WORK,
    },
    "simulation.windows": {"LEAST": ROUNDING},
    "study.load": {"_LONGEST_NAME": FORM},
    "study.quantity": {"LONGEST_SHOWN": PAGE},
    "study.rigs": {"MOST": WORK},
    "workflow.batches.item": {"FEW": STEP, "MOST_READ": WORK},
    "workflow.batches.shards": {"DIGITS": WORK},
    "workflow.compare": {"FEWEST_BLOCKS": FORMULA},
    "workflow.design.doubts": {"MOST_LISTED": PAGE},
    "workflow.prediction.files": {"Z_95": FORMULA},
    "workflow.sampling.progress": {"90.0": PAGE, "5400.0": PAGE},
    "workflow.sweep": {"1e-09": ROUNDING},
    "workflow.sweep_summary": {"1e-09": ROUNDING},
    "workflow.together.files": {"1e-09": ROUNDING},
    "workflow.together.pooled": {"NOTHING_OWN": ROUNDING},
}
