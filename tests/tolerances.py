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
    "core.errors": {"LONGEST": PAGE, "LIKE": HINT, "_BEGINNING": HINT},
    "core.paths": {"_LONGEST": PAGE, "_LONGEST_END": FORM},
    "core.programs.bound": {"MOST_PROGRAMS": WORK},
    "core.programs.described": {"DEEPEST": WORK},
    "core.programs.kept": {"MOST_ON_DISK": WORK, "SETTLED_SECONDS": WORK, "MOST_IN_MEMORY": WORK},
    "core.units": {"100.0": PAGE, "10.0": PAGE, "0.0001": PAGE, "10000000.0": PAGE, "1e-12": ROUNDING},
    "discovery.engine.candidates": {"MANY": STEP, "RETIMED": STEP},
    "discovery.laws.relaxation": {"UNSEEN": ROUNDING},
    "discovery.engine.refit": {"ARRIVED": ENDS, "0.0001": ENDS, "1000000.0": ENDS},
    "discovery.residuals.eigenvalues": {"EXACT": WORK},
    "fitting.gls": {"ROUNDS": STEP},
    "fitting.search.around": {"STARTS_AT_ONCE": WORK},
    "fitting.search.multistart": {
        "STARTS_AT_ONCE": WORK,
        "FAR_ABOVE": STEP,
    },
    "fitting.search.starts_from_base_model": {"FEW": START},
    "fitting.search.thinned": {"MISSED_BETWEEN": STEP},
    "fitting.uncertainty": {"1e-12": ROUNDING, "1e-300": ROUNDING},
    "laws.push.hold": {"SHORT": ROUNDING},
    "laws.template": {"WIDTH": FORM},
    "problem.estimate.evidence": {"MANY": WORK},
    "problem.estimate.gauss_newton": {"NOTICED": STEP, "MODE_TOLERANCE": ENDS},
    "problem.estimate.population": {"LIGHT": WORK},
    "problem.estimate.trust_region": {"0.75": STEP, "0.25": STEP, "ON_RADIUS": STEP, "0.001": STEP},
    "problem.formulate.formulate": {"CENTRED": START},
    "problem.inputs.corners": {"MOST": WORK, "SETTLED": ENDS},
    "problem.inputs.sensitivities": {"NEGLIGIBLE": WORK, "PRECISE": WORK},
    "problem.inputs.smoothing": {"3.0": WORK},
    "problem.noise.lags": {"KEPT_SAMPLES": WORK},
    "problem.noise.rounding": {"ROUNDED": FORMULA, "CHANGED": ENDS},
    "problem.noise.spectrum": {"STIFF": ENDS, "SETTLED": ENDS},
    "problem.noise.whittle": {"LINES": WORK, "1e-300": ROUNDING},
    "problem.statement.steps": {"NEAR": ROUNDING},
    "records.build": {"1e-09": ROUNDING},
    "records.clock.timebase": {"0.05": START},
    "records.clock.wall_clock": {"_HOUR": FORM, "_DAY": FORM, "0.001": FORM},
    "records.columns.damage": {"1e-300": ROUNDING},
    "records.files.block": {"_LONG": WORK},
    "records.files.matlab_sizes": {"DEEPEST": WORK, "_PART": WORK},
    "records.grammar.digits": {"EMPTY_WHOLE": FORM, "EXPONENT": FORM, "1000.0": FORM},
    "records.grammar.phrases": {"_NAMED": PAGE},
    "report.batch": {"LONGEST_NAME": PAGE, "MOST_ERRORS": PAGE, "MOST_NAMED": PAGE},
    "report.discovery": {"MOST_NAMED": PAGE},
    "report.page.batch": {"MOST_PRINTED": PAGE},
    "report.page.moments": {"SHORTEST_PHASE": PAGE},
    "report.sentences.discovery": {"0.005": PAGE},
    "report.sentences.posterior": {"VALUES_NAMED": PAGE},
    "report.sweep": {"NO_MORE": PAGE},
    "report.text": {"LONGEST_NAME": PAGE, "MOST_MINIMA": PAGE},
    "rigs.inverted_pendulum": {"SURELY_TAUT": START},
    "rigs.parts.fibre": {"NEWTON_STEPS": ENDS, "CONVERGED": ENDS},
    "rigs.pendulum": {"SLOW": START},
    "rigs.picture": {"STEP": PAGE},
    "rigs.signals.motion": {"4.0": START},
    "rigs.signals.rates": {"MANY": WORK, "1.5": START},
    "rigs.starting.fibre_mass": {"0.05": START, "0.1": START},
    "rigs.starting.force_only": {"SMOOTHED_DROP": START},
    "rigs.starting.guided_mass": {"SLOW": START},
    "rigs.starting.pulley_drive": {"SLIDES": START, "0.15": START},
    "sampling.chains.ensembles": {"20.0": WORK},
    "sampling.deviations": {"LIGHT": WORK},
    "sampling.evidence": {"1e-10": ENDS},
    "sampling.mode.mode": {"SETTLED": ENDS, "1e-05": STEP, "STUCK_AT": ENDS, "BLIND": ROUNDING},
    "sampling.ready": {"ROUNDS": STEP, "MOST_ROUNDS": STEP, "SETTLED": ENDS},
    "sampling.settings": {"MOST_WALKERS": WORK},
    "series.engines": {"AHEAD": WORK},
    "series.periods": {
        "SETTLED": ENDS,
        "FARTHEST": STEP,
        "SAME": ENDS,
        "TRIES": WORK,
        "NEAR": STEP,
        "MOST_PERIODS": WORK,
    },
    "series.trends": {"CLOSE": ENDS},
    "simulation.forward_sensitivity": {"1e-12": ROUNDING, "MANY": WORK},
    "simulation.jumps": {"ARCS": WORK},
    "simulation.pieces": {"ARCS": WORK},
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
    "study.rigs.inverted_pendulum": {"MOST": WORK},
    "workflow.batches.item": {"FEW": STEP, "MOST_READ": WORK},
    "workflow.batches.shards": {"DIGITS": WORK},
    "workflow.design.plan": {"MOST_LISTED": PAGE},
    "workflow.prediction.files": {"Z_95": FORMULA},
    "workflow.sampling.progress": {"90.0": PAGE, "5400.0": PAGE},
    "workflow.sweep": {"1e-09": ROUNDING},
    "workflow.sweep_summary": {"1e-09": ROUNDING},
    "workflow.together.files": {"1e-09": ROUNDING},
    "workflow.together.pooled": {"NOTHING_OWN": ROUNDING},
}
