"""CasADi's C code for Pinocchio's articulated-body algorithm."""

from __future__ import annotations

from typing import Any

from symdyn.bench.pinocchio_casadi import Generator
from symdyn.bench.toolchain import c_compiler
from symdyn.lab.peers.casadi_loop import Form, casadi_program, hoisted, operations
from symdyn.lab.peers.description import Description
from symdyn.lab.peers.program import Program, State


class CasadiPeer:
    """The generator. Raises MissingExtra, CompilerNotFound or CompileError, whose messages tell what to install."""

    def __init__(self) -> None:
        self.compiler = c_compiler()
        self.generator = Generator()
        import casadi

        self.casadi = casadi

    def forms(self, description: Description) -> list[Form]:
        """baked: parameters are numbers; runtime: arguments; hoisted: what depends on them alone is computed before."""
        ca = self.casadi
        baked, runtime = self._function(description, False), self._function(description, True)
        return [Form("casadi baked", baked, None, operations(ca, baked)),
                Form("casadi runtime", runtime, None, operations(ca, runtime)), hoisted(ca, "casadi hoisted", runtime)]

    def _function(self, description: Description, runtime: bool) -> Any:
        function = self.generator.function(description.text, description.values, runtime)
        # What CasADi offers to make code shorter is used.
        q, u, _, p = function.sx_in()
        return self.casadi.Function("accelerations", [q, u, p], [function(q, u, [], p)], {"cse": True})

    def program(self, form: Form, description: Description, state: State) -> Program:
        """The C code of a form, compiled, at a state."""
        return casadi_program(self.casadi, self.compiler, form, state, description.values, description.q_order,
                                 description.u_order)
