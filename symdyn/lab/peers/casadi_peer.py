"""CasADi's C code for Pinocchio's articulated-body algorithm."""

from __future__ import annotations

from typing import Any

from symdyn.bench.pinocchio_casadi import Generator
from symdyn.bench.toolchain import c_compiler
from symdyn.lab.peers.casadi_loop import EVALUATION, Form, casadi_loop, casadi_program, hoisted, operations
from symdyn.lab.peers.description import Description
from symdyn.lab.peers.program import Program, State, unsorted_derivatives


class CasadiPeer:
    """The generator. Raises MissingExtra, CompilerNotFound or CompileError, whose messages name what to install."""

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
        # CasADi's common subexpressions make its code shorter.
        q, u, _, p = function.sx_in()
        return self.casadi.Function(EVALUATION, [q, u, p], [function(q, u, [], p)], {"cse": True})

    def derivatives_form(self, description: Description) -> Form:
        """The derivatives of the accelerations by q and u, parameters as arguments."""
        ca = self.casadi
        function = self._function(description, True)
        q, u, p = function.sx_in()
        by = ca.densify(ca.jacobian(function(q, u, p), ca.vertcat(q, u)))
        made = ca.Function(EVALUATION, [q, u, p], [by], {"cse": True})
        return Form("casadi", made, None, operations(ca, made))

    def derivatives_program(self, form: Form, description: Description, state: State) -> Program:
        """Their C code, compiled, at a state."""
        n, u_order = len(description.u_order), list(description.u_order)
        run, out = casadi_loop(self.casadi, self.compiler, form, state, description.values, description.q_order, u_order,
                               2 * n * n - 1)
        return Program(form.name, run, lambda: unsorted_derivatives(out.reshape(2 * n, n).T, description))

    def program(self, form: Form, description: Description, state: State) -> Program:
        """The C code of a form, compiled, at a state."""
        return casadi_program(self.casadi, self.compiler, form, state, description.values, description.q_order,
                              description.u_order)
