"""IPOPT through CasADi, fed with the functions of a program: values go from NumPy's arrays into CasADi's buffers as they are.

Source: Wachter and Biegler, Mathematical Programming 106 (2006), IPOPT; Andersson, Gillis, Horn, Rawlings and Diehl, Mathematical
Programming Computation 11 (2019), CasADi.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from symdyn.errors import ArgumentError, MissingExtra
from symdyn.optimal.program import Scaled

# Status that IPOPT returns at a solution.
SOLVED = ("Solve_Succeeded", "Solved_To_Acceptable_Level")


@dataclass(frozen=True)
class Found:
    """Solution of a solver: z (n,), cost, multipliers of g (m,) and of the bounds of z (n,): those of f + multipliers^T g.

    solved, message   whether it ended at a minimum, and why it ended
    """

    z: np.ndarray
    cost: float
    multipliers: np.ndarray
    of_bounds: np.ndarray
    iterations: int
    solved: bool
    message: str


def casadi() -> Any:
    """CasADi. Raises MissingExtra."""
    try:
        import casadi as ca
    except ImportError:
        raise MissingExtra("optimize solves by IPOPT, which comes with CasADi: pip install 'symdyn[opt]'; or pass "
                           "method=\"slsqp\" or method=\"trust-constr\", which SciPy has") from None
    return ca


def solve(program: Scaled, z: np.ndarray, accuracy: float, max_iterations: int, options: Mapping[str, Any],
          verbose: bool = False) -> Found:
    """A local minimum near z. Raises MissingExtra where CasADi is not installed, and what the functions of the program raise."""
    ca = casadi()
    calls = _callbacks(ca, program)
    given = {"ipopt.tol": accuracy, "ipopt.max_iter": max_iterations, "ipopt.print_level": 5 if verbose else 0, "ipopt.sb": "yes",
             "print_time": False, "show_eval_warnings": False, "calc_lam_p": False, "no_nlp_grad": True,
             "calc_multipliers": False,
             "ipopt.check_derivatives_for_naninf": "no", "error_on_fail": False,
             **{f"ipopt.{name}": value for name, value in options.items()}}
    functions = {name: calls[name] for name in ("grad_f", "jac_g", "hess_lag")}
    try:
        solver = ca.nlpsol("optimize", "ipopt", calls["nlp"], {**given, **functions})
    except (RuntimeError, NotImplementedError) as error:
        if not options:
            raise
        raise ArgumentError(f"optimize: IPOPT does not take options {dict(options)}: "
                            f"{str(error).strip().splitlines()[-1]}") from None
    raised: list[Exception] = calls["raised"]
    result = solver(x0=z, lbx=program.z_least, ubx=program.z_most, lbg=program.g_least, ubg=program.g_most)
    if raised:
        raise raised[0]
    stats = solver.stats()
    return Found(np.array(result["x"]).ravel(), float(result["f"]), np.array(result["lam_g"]).ravel(),
                 np.array(result["lam_x"]).ravel(), int(stats["iter_count"]), stats["return_status"] in SOLVED,
                 stats["return_status"].replace("_", " "))


def _callbacks(ca: Any, program: Scaled) -> dict[str, Any]:
    """Functions as CasADi calls them: of x, p and, of the Hessian, the multipliers of f and g; "raised": what they raised."""
    n, m = program.n, program.m
    dense = ca.Sparsity.dense
    jacobian = ca.Sparsity.triplet(m, n, program.jacobian_rows.tolist(), program.jacobian_columns.tolist())
    hessian = ca.Sparsity.triplet(n, n, program.hessian_rows.tolist(), program.hessian_columns.tolist())
    raised = list[Exception]()  # exceptions do not pass CasADi
    two, four = [dense(n, 1), dense(0, 0)], [dense(n, 1), dense(0, 0), dense(1, 1), dense(m, 1)]

    class Compiled(ca.Callback):  # type: ignore[misc]
        def __init__(self, name: str, takes: list[Any], gives: list[Any], names: tuple[list[str], list[str]],
                     function: Callable[..., tuple[Any, ...]]) -> None:
            ca.Callback.__init__(self)
            self.takes, self.gives, self.called, self.names = takes, gives, function, names
            self.construct(name, {})

        def get_n_in(self) -> int:
            return len(self.takes)

        def get_n_out(self) -> int:
            return len(self.gives)

        def get_sparsity_in(self, k: int) -> Any:
            return self.takes[k]

        def get_sparsity_out(self, k: int) -> Any:
            return self.gives[k]

        def get_name_in(self, k: int) -> str:
            return self.names[0][k]

        def get_name_out(self, k: int) -> str:
            return self.names[1][k]

        def has_eval_buffer(self) -> bool:
            return True

        def eval_buffer(self, arg: Any, res: Any) -> int:
            given = [np.frombuffer(a, dtype=float) if a is not None else np.zeros(0) for a in arg]
            for buffer, value in zip(res, self.called(*given), strict=True):
                if buffer is not None:
                    np.frombuffer(buffer, dtype=float)[:] = self.evaluated(value)
            return 0

        def evaluated(self, value: Callable[[], Any]) -> Any:
            """Not a number from the first exception on."""
            if raised:
                return np.nan
            try:
                return value()
            except Exception as error:  # raised again after the solver
                raised.append(error)
                return np.nan

    def of(*functions: Callable[[np.ndarray], Any]) -> Callable[..., tuple[Any, ...]]:
        return lambda x, p: tuple((lambda f=f: f(x)) for f in functions)  # type: ignore[misc]

    xp, lagrangian = ["x", "p"], ["x", "p", "lam_f", "lam_g"]
    return {
        "raised": raised,
        "nlp": Compiled("nlp", two, [dense(1, 1), dense(m, 1)], (xp, ["f", "g"]), of(program.f, program.g)),
        "grad_f": Compiled("nlp_grad_f", two, [dense(1, 1), dense(n, 1)], (xp, ["f", "grad_f_x"]),
                           of(program.f, program.gradient)),
        "jac_g": Compiled("nlp_jac_g", two, [dense(m, 1), jacobian], (xp, ["g", "jac_g_x"]), of(program.g, program.jacobian)),
        "hess_lag": Compiled("nlp_hess_l", four, [hessian], (lagrangian, ["triu_hess_gamma_x_x"]),
                             lambda x, p, cost, lam: (lambda: program.hessian(x, float(cost[0]), lam),)),
    }
