"""Pinocchio's articulated-body algorithm in CasADi's expressions, compiled, under CasADi's CVODES; trees of bodies and joints."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from symdyn.bench.toolchain import build_cpp, include_flags, package_folder, version
from symdyn.bench.work.against import casadi_cvodes
from symdyn.bench.work.against.casadi_cvodes import family
from symdyn.bench.work.against.mechanism import Tree, check_accelerations, tree_of
from symdyn.bench.work.against.peer import Runner, Unfit, fitting
from symdyn.errors import SymdynError

_SOURCE = Path(__file__).with_name("pinocchio_tree.cpp")
_ERROR_SIZE = 1000


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
            package_folder("pinocchio"), package_folder("casadi"), _options()
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


def _options() -> list[str]:
    """How the library is compiled, and where CasADi's is. Raises SymdynError for what is missing."""
    folder = package_folder("casadi")
    roots = (folder, *[p / "lib" for p in folder.parents[:4]])
    library = next((root for root in roots if (root / "libcasadi.so").exists()), None)
    if library is None:
        raise SymdynError(f"the library libcasadi.so was not found next to the package {folder}; install symdyn[peers]")
    return ["-O0", *include_flags("pinocchio", "boost", "eigen", "casadi"), "-Wl,--no-as-needed", f"-L{library}", "-lcasadi",
            f"-Wl,-rpath,{library}"]


def accelerations(ca: Any, tree: Tree) -> Any:
    """CasADi's function (q, u, tau) -> u_dot, link by link."""
    with fitting("Pinocchio"):
        library = build_cpp("pinocchio_tree", _SOURCE.read_text(encoding="utf-8"), _options(), ("pin", "casadi"))
    library.pinocchio_tree.restype = ctypes.c_char_p
    message = ctypes.create_string_buffer(_ERROR_SIZE)
    text = " ".join(map(repr, numbers(tree)))
    function = library.pinocchio_tree(text.encode(), message, ctypes.c_long(_ERROR_SIZE))
    if function is None:
        raise Unfit(f"Pinocchio could not build it: {message.value.decode()}")
    return ca.Function.deserialize(function.decode())


def numbers(tree: Tree) -> list[int | float]:
    """What the library reads: gravity, then link by link; see its source."""
    found: list[int | float] = tree.gravity.tolist()
    for link in tree.links:
        found += [link.parent + 1, int(link.turning), *link.R.ravel().tolist(), *link.p.tolist(), link.mass, *link.com.tolist(),
                  *link.inertia.ravel().tolist()]
    return found


PEERS = (Pinocchio(adams=True), Pinocchio(adams=False))
