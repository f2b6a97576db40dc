"""Pinocchio's articulated-body algorithm in CasADi's expressions, compiled, under CasADi's CVODES; trees of bodies and joints."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from symdyn.bench.pinocchio_casadi import Generator, options
from symdyn.bench.toolchain import package_folder, version
from symdyn.bench.work.against import casadi_cvodes
from symdyn.bench.work.against.casadi_cvodes import family
from symdyn.bench.work.against.mechanism import Tree, check_accelerations, tree_of
from symdyn.bench.work.against.peer import Runner, fitting
from symdyn.errors import SymdynError


@dataclass(frozen=True)
class Pinocchio:
    """One family of methods: adams or not."""

    adams: bool
    bodies = True

    @property
    def name(self) -> str:
        return f"pinocchio {family(self.adams)}"

    @property
    def title(self) -> str:
        return f"Pinocchio {version('pin')} ABA as C code of CasADi {version('casadi')}, CVODES {family(self.adams)}"

    def available(self) -> bool | str:
        try:
            package_folder("pinocchio"), options()
        except SymdynError as error:
            return str(error)
        return casadi_cvodes.installed()

    def prepare(self, equations: Any, params: np.ndarray, x0: np.ndarray, end: float, system: Any = None) -> Runner:
        tree = tree_of(system, equations, params)
        import casadi as ca

        n = len(tree.links)
        x = ca.SX.sym("x", 2 * n)
        places = [int(k) for k in tree.order]
        q, u = x[places], x[[n + k for k in places]]
        forces = ca.vertcat(*[link.force - link.stiffness * q[k] - link.damping * u[k] for k, link in enumerate(tree.links)])
        u_dot = accelerations(ca, tree)(q, u, forces)
        back = [int(k) for k in np.argsort(tree.order)]
        ode = ca.cse(ca.vertcat(x[n:], u_dot[back]))
        value = ca.Function("accelerations", [x], [ode])
        check_accelerations(tree, lambda q, u: tree.split(np.array(value(tree.join(q, u))).ravel())[1], equations, params,
                            "Pinocchio")
        return casadi_cvodes.runner(ca, {"x": x, "ode": ode}, x0, end, self.adams)


def accelerations(ca: Any, tree: Tree) -> Any:
    """CasADi's function (q, u, tau) -> u_dot, link by link."""
    with fitting("Pinocchio"):
        function = Generator().function(description(tree), driven=True)
    q, u, tau, _ = function.sx_in()
    return ca.Function("accelerations", [q, u, tau], [function(q, u, tau, [])])


def description(tree: Tree) -> str:
    """The tree as model.hpp reads it, every joint along or about the z axis of its own frame."""
    lines = [("gravity", *tree.gravity)]
    for k, link in enumerate(tree.links):
        I = link.inertia
        lines += [("turned", link.parent + 1, "RZ" if link.turning else "PZ", 0, 0, 1, *link.R.ravel(), *link.p),
                  ("body", k + 1, link.mass, *link.com, I[0, 0], I[0, 1], I[0, 2], I[1, 1], I[1, 2], I[2, 2])]
    return "\n".join(" ".join(word if isinstance(word, str) else repr(float(word)) if isinstance(word, float) else str(word)
                              for word in line) for line in lines)


PEERS = (Pinocchio(adams=True), Pinocchio(adams=False))
