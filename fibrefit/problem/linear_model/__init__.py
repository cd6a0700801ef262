"""One linear model for fits, candidates of a search, evidence and error bars: the arrowhead normal equations.

Unknowns (`unknowns`)
---------------------
Records share the coordinates ``z``, ``(n_shared,)``, with the prior ``z ~ N(mean, P^-1)``, P the `precision`. Record r
has for itself ``own_r = (nu_r, eta_r)``: values ``nu_r`` of which nothing is known, and deviations
``eta_r ~ N(0, diag sigma^2)``, which are added to those of the shared coordinates that may differ (`scattering`). A
coordinate is the logarithm of a value over its reference, or its distance from there in units of its scale.

Residuals (`view`)
------------------
``e_r`` are the residuals of record r in units of the noise, whitened: their innovations. Where inputs were measured
with errors, ``e_r = e_r0 + W_r c_r`` with coefficients ``c_r ~ N(0, 1)`` and W_r the `InputSensitivities`; the best
``c_r = -(1 + W_r'W_r)^-1 W_r'e_r0`` is put in, which leaves ``|e_r|^2 + |c_r|^2 = e_r0' (1 + W_r W_r')^-1 e_r0``. With
``J_r`` the slopes of ``e_r0`` all that follows needs of a record is its Gram matrix (`Gram`)

    G_r = [J_r e_r0]' (1 + W_r W_r')^-1 [J_r e_r0] .

Normal equations (`normal_equations`)
-------------------------------------
Minimised is ``Q = sum_r (|e_r|^2 + |c_r|^2) + sum_r |eta_r / sigma|^2 + (z - mean)' P (z - mean)``. With
``G_r = [[A_r, B_r, a_r], [B_r', D_r, d_r], [a_r', d_r', q_r]]`` in the order shared, own, residuals (a shared
coordinate and its deviation have the same slopes: `Unknowns.own` names the columns twice), half the gradient of Q and
half its curvature are, to first order in the residuals,

    shared = sum_r A_r + P             pull   = sum_r a_r + P (z - mean)
    cross_r = B_r                      pulls_r = d_r + (0, eta_r / sigma^2)
    blocks_r = D_r + diag(0, sigma^-2)

(`Arrowhead`, with `with_priors`). A step ``(dz, down_r)`` solves ``shared dz + sum_r cross_r down_r = -pull`` and
``cross_r' dz + blocks_r down_r = -pulls_r``. The second gives ``down_r = -blocks_r^-1 (pulls_r + cross_r' dz)``; put
into the first, the records' own unknowns are eliminated (Schur complement, `eliminated`):

    (shared - sum_r cross_r blocks_r^-1 cross_r') dz = -(pull - sum_r cross_r blocks_r^-1 pulls_r) .

The inverse of that matrix is the covariance of z; its determinant times those of the blocks is that of all unknowns,
which Laplace's evidence needs. A further direction x with products ``G_xx``, ``G_xz`` and ``G_xr`` goes the same way:
what the unknowns can imitate of it is eliminated, which leaves its score and information (`score_test`).
"""
