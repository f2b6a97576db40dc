"""SciPy's SLSQP and trust-constr on the same program, for where IPOPT is not installed. Fixed variables are left out."""

from __future__ import annotations

import warnings

import numpy as np
import scipy.sparse as sp
from scipy.optimize import Bounds, NonlinearConstraint, minimize

from symdyn.optimal.ipopt import Found
from symdyn.optimal.program import Scaled

METHODS = ("slsqp", "trust-constr")
# Violation of constraints at a solution of these methods, relative to the size of their bounds plus 1.
FULFILLED = 1e-6


def solve(program: Scaled, z: np.ndarray, accuracy: float, max_iterations: int, method: str) -> Found:
    """A local minimum near z; see Found."""
    free = program.z_least < program.z_most
    whole = lambda y: _filled(z, free, y)
    n_free = int(free.sum())
    pattern = program.jacobian_rows, program.jacobian_columns
    jacobian = lambda y: sp.csc_matrix((program.jacobian(whole(y)), pattern), (program.m, program.n))[:, free]
    bounds = Bounds(program.z_least[free], program.z_most[free])
    gradient = lambda y: program.gradient(whole(y))[free]

    def hessian(y: np.ndarray, cost: float, multipliers: np.ndarray) -> sp.csc_matrix:
        upper = sp.csc_matrix((program.hessian(whole(y), cost, multipliers), (program.hessian_rows, program.hessian_columns)),
                              (program.n, program.n))
        return (upper + sp.triu(upper, 1).T)[free][:, free]

    equal = program.g_least == program.g_most
    if method == "slsqp":
        sides = [(equal, program.g_least, 1.0), (~equal & np.isfinite(program.g_least), program.g_least, 1.0),
                 (~equal & np.isfinite(program.g_most), program.g_most, -1.0)]
        constraints = [{"type": "eq" if k == 0 else "ineq",
                        "fun": lambda y, r=rows, b=bound, s=sign: s * (program.g(whole(y))[r] - b[r]),
                        "jac": lambda y, r=rows, s=sign: s * jacobian(y)[r].toarray()}
                       for k, (rows, bound, sign) in enumerate(sides) if rows.any()]
        result = minimize(lambda y: program.f(whole(y)), z[free], jac=gradient, bounds=bounds, constraints=constraints,
                          method="SLSQP", options={"maxiter": max_iterations, "ftol": accuracy})
    else:
        constraints = [NonlinearConstraint(lambda y: program.g(whole(y)), program.g_least, program.g_most, jac=jacobian,
                                           hess=lambda y, v: hessian(y, 0.0, v))] if program.m else []
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of dense factorizations, and of quasi-Newton updates that are not made
            result = minimize(lambda y: program.f(whole(y)), z[free], jac=gradient,
                              hess=lambda y: hessian(y, 1.0, np.zeros(program.m)), bounds=bounds, constraints=constraints,
                              method="trust-constr", options={"maxiter": max_iterations, "gtol": accuracy, "xtol": accuracy**1.5})
    at = whole(result.x)
    missing = program.violations(at)
    size = 1 + np.minimum(np.abs(program.g_least), np.abs(program.g_most))
    fulfilled = bool(np.all(missing <= FULFILLED * size))
    ended = result.success if method == "slsqp" else result.status in (1, 2)
    multipliers, of_bounds = np.full(program.m, np.nan), np.full(program.n, np.nan)
    if method == "trust-constr" and program.m:
        multipliers = np.asarray(result.v[0])
        of_bounds[free] = result.v[1] if len(result.v) > 1 else np.zeros(n_free)
    message = str(result.message) if fulfilled else f"{result.message}; constraints are not fulfilled"
    return Found(at, float(result.fun), multipliers, of_bounds, int(result.nit), bool(ended) and fulfilled, message)


def _filled(z: np.ndarray, free: np.ndarray, y: np.ndarray) -> np.ndarray:
    result = z.copy()
    result[free] = y
    return result
