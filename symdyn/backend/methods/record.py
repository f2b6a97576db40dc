"""The record of a method of integration, for its template."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from symdyn.backend.gathered import Gathered

Row = Mapping[int, float]


@dataclass(frozen=True)
class Tableau:
    """Coefficients of an embedded explicit Runge-Kutta pair, by [stage: coefficient of k[j]]; zeros are left out.

    The step: k[0] is the derivative at its start, k[j] that at t + c[j] h and x + h a[j] k, for j = 1 ... n_stages - 1;
    x + h b k is its end, where the derivative counts as k[n_stages]. Further stages are those of the dense output.

    e       difference to the embedded solution, or a multiple of it. If it has an entry for k[n_stages], the derivative at the
            end is evaluated before a step is judged, else after
    second  b + second: the solution of a second estimate e2; then the error is |h| e^2 / sqrt(e^2 + 0.01 e2^2). None if, and only
            if, e has an entry for k[n_stages]
    d       dense output at t + theta h, r = 1 - theta: x + theta (dx + r ((h k[0] - dx) + theta ((2 dx - h k[0] - h k[n]) +
            r (h d[0] k + theta (h d[1] k + ...))))), dx the change over the step
    """

    c: Row
    a: Mapping[int, Row]
    b: Row
    e: Row
    d: tuple[Row, ...] = ()
    second: Row | None = None

    @property
    def n_stages(self) -> int:
        """Stages of a step, without that at its end."""
        return min(set(range(1, len(self.a) + 2)) - set(self.a))

    @property
    def dense_stages(self) -> tuple[int, ...]:
        """Stages that the dense output adds."""
        return tuple(j for j in self.a if j > self.n_stages)

    @property
    def n_slopes(self) -> int:
        """All k, also that at the end."""
        return max(self.n_stages, *self.a) + 1

    @property
    def slope_at_end(self) -> bool:
        """Whether the error needs the derivative at the end."""
        return self.n_stages in self.e


@dataclass(frozen=True)
class Method:
    """A method of integration.

    name       in C and for `simulate`, an identifier; title: for the generated file, a line
    order      the error of a step goes with h^order: what the step control takes the root by
    template   c/methods/TEMPLATE.c.jinja, with its coefficients; source: where the method is from
    needs      functions of the module besides rhs that are generated with it, of the right-hand side that is integrated
    own_step   it proposes the length of its steps itself
    gather     what its template gets of its own, from the content, the program, the dialect and the indices of leaves that
               `render` has
    gives_slope   without a tableau: a step leaves the derivative at its end
    crosses    it can tell the error of a step after projection, and so step across positions where constraints lose rank
    """

    name: str
    title: str
    order: int
    template: str
    source: tuple[str, ...]
    tableau: Tableau | None = None
    needs: tuple[str, ...] = ()
    own_step: bool = False
    gather: Callable[[Any, Any, Any, Any], Gathered] | None = None
    crosses: bool = False
    gives_slope: bool = False

    @property
    def slope_at_end(self) -> bool:
        """Whether a step leaves the derivative at its end."""
        return self.gives_slope or (self.tableau is not None and self.tableau.slope_at_end)
