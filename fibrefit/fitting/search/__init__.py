"""The search for the least squares: starts, solver, second opinion."""
