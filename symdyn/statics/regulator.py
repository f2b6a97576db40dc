"""The linear-quadratic regulator about a state: in' = -K x' with the least integral of x'^T Q x' + in'^T R in'.

The gain is K = R^-1 B^T S with the stabilizing solution of A^T S + S A - S B R^-1 B^T S + Q = 0. There is one where all modes
that do not decay can be moved by an input (stabilizable), and none that neither decays nor grows is without weight in Q.
Source: Anderson and Moore, Optimal Control: Linear Quadratic Methods, 1990, chapters 2 and 3; Van Dooren, The generalized
eigenstructure problem in linear system theory, IEEE Trans. Automatic Control 26 (1981): the parts that inputs do not reach.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
import scipy.linalg

from symdyn.arguments import take
from symdyn.errors import ArgumentError
from symdyn.runtime.inputs.following import motion_inputs
from symdyn.runtime.labelled import Labelled
from symdyn.shown import name_of, shown

if TYPE_CHECKING:
    from symdyn.given import Key, Matrix, Numbers, Row
    from symdyn.statics.linearize import Linearization

    # A matrix, its diagonal, or numbers of some by name or symbol.
    Weights: TypeAlias = Matrix | Row | Numbers

# Parts of vectors below this part of the largest are rounding: what an input does not reach, entries that differ in symmetry.
NOTHING = 1e-9
# Eigenvalues within this part of the size of A neither decay nor grow: a double one is known to the root of rounding only.
NEUTRAL = 1e-7
# Largest residual of a solution of Riccati's equation, as a part of its terms.
SOLVED = 1e-6
# States that a message names: those with this share of the square of a mode.
SHARE = 0.05


@dataclass(frozen=True, eq=False)
class Regulator:
    """The gain of least cost about a linearization, and the function of (t, x) that applies it.

    K            (k, m): in' = -K x' of the k inputs that have weights, indexed by the names of inputs and states, too
    S            (m, m): the least cost from x' on is x'^T S x'
    eigenvalues  (m,) of A - B K, 1/s, all with negative real parts
    Q, R         the weights (m, m), (k, k)
    driven       names of the inputs that have weights

    `regulator(t, x)` are the inputs (n_in,) at a state x = [q; u; z] of the mechanism: those of the linearization - K x', others
    as they are there. Pass it to `simulate` as inputs=regulator, or inputs=sd.Sampled(regulator, period=0.01). `regulator[F]` is
    the function of (t, x) of one input, `regulator[F, M]` that of several, to be passed with what others have:
    inputs={F: regulator[F], road: table}, or inputs={(F, M): sd.Sampled(regulator[F, M], period=0.01), road: table}.

    >>> module = sd.systems.cart_pole().compile(backend="numpy")
    >>> regulator = module.linearize({"q2": np.pi}).lqr(Q=[1, 1, 0, 0], R=[0.1])
    >>> regulator.K.shape, bool(regulator.eigenvalues.real.max() < 0)
    ((1, 4), True)
    >>> np.round(regulator(0.0, {"q1": 0.0, "q2": np.pi}), 9) + 0.0
    array([0.])
    """

    linear: Linearization
    K: Labelled
    S: np.ndarray
    eigenvalues: np.ndarray
    Q: np.ndarray
    R: np.ndarray
    driven: tuple[str, ...]

    def __call__(self, t: float, x: Sequence[float] | np.ndarray) -> np.ndarray:
        result: np.ndarray = self.linear.inputs.copy()
        names = self.linear.module.metadata.inputs
        result[[names.index(n) for n in self.driven]] -= np.asarray(self.K) @ self.linear.deviation(t, x)
        return result

    def __getitem__(self, inputs: Key | tuple[Key, ...]) -> Callable[[float, np.ndarray], float | np.ndarray]:
        """The function of (t, x) of one input, which returns a number, or of a tuple of them. Raises ArgumentError for inputs
        that have no weights."""
        wanted = [name_of(i) for i in (inputs if isinstance(inputs, tuple) else (inputs,))]
        wrong = [n for n in wanted if n not in self.driven]
        if wrong:
            raise ArgumentError(f"{self.linear.module.name}: the regulator does not drive {', '.join(map(shown, wrong))}; it "
                                f"drives {', '.join(self.driven)}")
        indices = [self.linear.module.metadata.inputs.index(n) for n in wanted]
        index: Any = indices if isinstance(inputs, tuple) else indices[0]
        return lambda t, x: self(t, x)[index]

    def describe(self) -> str:
        """The gain with names and units, and the eigenvalues of the closed loop.

        >>> regulator = sd.systems.cart_pole().compile(backend="numpy").linearize({"q2": np.pi}).lqr(Q=[1, 1, 0, 0], R=[0.1])
        >>> print(regulator.describe())
        cart_pole: linear-quadratic regulator, in' = -K x'; K in the unit of the input by that of the state
                    q1 [m]     q2 [rad]  q1_dot [m/s]  q2_dot [rad/s]
        F [N]       3.1623      -2.0012        2.8718        -0.45531
        closed loop: -1.1621 - 1.1925i, -1.1621 + 1.1925i, -0.57196 - 4.0059i, -0.57196 + 4.0059i 1/s
        """
        values = ", ".join(f"{v.real:.5g}" + (f" {'+' if v.imag > 0 else '-'} {abs(v.imag):.5g}i" if v.imag else "")
                           for v in self.eigenvalues)
        return (f"{self.linear.module.name}: linear-quadratic regulator, in' = -K x'; K in the unit of the input by that of the "
                f"state\n{self.K!r}\nclosed loop: {values} 1/s")

    def __repr__(self) -> str:
        return self.describe()


def lqr(linear: Linearization, Q: Any, R: Any) -> Regulator:
    """See Linearization.lqr."""
    module = linear.module
    owner, inputs = module.name, tuple(module.metadata.inputs)
    if not inputs:
        raise ArgumentError(f"{owner}: a regulator was requested, but the system has no inputs; add loads with sd.inputs(...)")
    free = tuple(n for n in inputs if n not in motion_inputs(module.metadata))
    if isinstance(R, Mapping):
        weighted = {name_of(key) for key in R}
        driven = tuple(n for n in inputs if n in weighted)
        follow = [n for n in driven if n not in free]
        if follow:
            raise ArgumentError(f"{owner}: R has weights of {', '.join(follow)}, which belong to a motion: what inputs follow, a "
                                "regulator does not drive; leave them out")
        take(R, inputs, "R", dict.fromkeys(inputs, 0.0), owner)  # names that there are not
    else:
        driven = free
    if not driven:
        raise ArgumentError(f"{owner}: R has no weights, so there is nothing to drive; give weights of inputs: {', '.join(free)}")
    state_weights = weights_of(Q, linear.states, "Q", owner, dict.fromkeys(linear.states, 0.0))
    input_weights = weights_of(R, driven, "R", owner, {})
    demand_definite(state_weights, linear.states, "Q", owner, strictly=False)
    demand_definite(input_weights, driven, "R", owner, strictly=True)
    A, B = linear.A, linear.B[:, [inputs.index(n) for n in driven]]
    for value, shares in _out_of_reach(A, B):
        if value.real > -NEUTRAL * np.linalg.norm(A):
            raise ArgumentError(f"{owner}: the linear equations are not stabilizable: the mode {_mode_of(shares, linear.states)} "
                                f"with the eigenvalue {_number(value)} 1/s does not decay, and no input ({', '.join(driven)}) "
                                "reaches it; add an input, or hold what it moves (hold=[...] of linearize)")
    root = _root(state_weights)
    for value, shares in _out_of_reach(A.T, root):
        if abs(value.real) <= NEUTRAL * np.linalg.norm(A):
            raise ArgumentError(f"{owner}: Q gives no weight to the mode {_mode_of(shares, linear.states)} with the eigenvalue "
                                f"{_number(value)} 1/s, which neither decays nor grows, so that no gain of least cost brings it "
                                "back; give it a weight in Q")
    try:
        S = scipy.linalg.solve_continuous_are(A, B, state_weights, input_weights)
    except np.linalg.LinAlgError as error:
        raise ArgumentError(f"{owner}: Riccati's equation has no stabilizing solution to working precision ({error}); change the "
                            "weights by less extreme ratios") from None
    K = np.linalg.solve(input_weights, B.T @ S)
    terms = [A.T @ S, S @ A, -S @ B @ K, state_weights]
    left, size = np.linalg.norm(np.sum(terms, axis=0)), max(np.linalg.norm(term) for term in terms)
    closed = np.linalg.eigvals(A - B @ K)
    if not left <= SOLVED * size or not (closed.real < 0).all():
        raise ArgumentError(f"{owner}: Riccati's equation is solved to {left / size:.2g} of its terms only, the largest real "
                            f"part of the closed loop is {closed.real.max():.3g} 1/s; change the weights by less extreme ratios")
    order = np.lexsort((closed.imag, np.abs(closed)))
    gain = Labelled(K, driven, linear.states, units=linear.units)
    return Regulator(linear, gain, S, closed[order], state_weights, input_weights, driven)


def weights_of(values: Any, names: Sequence[str], what: str, owner: str, left_out: Mapping[str, float]) -> np.ndarray:
    """A symmetric matrix from one, from a diagonal, or from weights by name or symbol."""
    if isinstance(values, Mapping):
        return np.diag(take(values, names, what, left_out, owner))
    try:
        matrix = np.array(values, dtype=float)
    except (TypeError, ValueError):
        raise ArgumentError(f"{owner}: {what} must be numbers, found {values!r}") from None
    if matrix.ndim == 0 and len(names) == 1:
        matrix = matrix.reshape(1, 1)
    if matrix.shape == (len(names),):
        matrix = np.diag(matrix)
    if matrix.shape != (len(names), len(names)):
        raise ArgumentError(f"{owner}: {what} has the shape {matrix.shape}; needed are {len(names)} numbers, a matrix "
                            f"({len(names)}, {len(names)}), or weights by name: {', '.join(names)}")
    if not np.isfinite(matrix).all():
        raise ArgumentError(f"{owner}: {what} must be finite")
    gap = np.abs(matrix - matrix.T)
    if (gap > NOTHING * np.abs(matrix).max(initial=0.0)).any():
        i, j = divmod(int(gap.argmax()), len(names))
        raise ArgumentError(f"{owner}: {what} is not symmetric: its entry of {names[i]} by {names[j]} is {matrix[i, j]:.6g}, the "
                            f"other way {matrix[j, i]:.6g}")
    return (matrix + matrix.T) / 2


def demand_definite(matrix: np.ndarray, names: Sequence[str], what: str, owner: str, strictly: bool) -> None:
    """Raises ArgumentError for a matrix that is not positive semidefinite, or strictly: not positive definite."""
    size = np.sqrt(np.abs(np.diag(matrix)))
    scale = 1 / np.where(size > 0, size, 1.0)
    values, vectors = np.linalg.eigh(matrix * np.outer(scale, scale))  # definiteness does not depend on units
    level = NOTHING * max(1.0, float(np.abs(values).max(initial=0.0)))
    if len(values) and (values[0] < -level or (strictly and values[0] <= level)):
        wanted = "positive definite" if strictly else "positive semidefinite"
        direction = vectors[:, 0] * scale
        worst = float(direction @ matrix @ direction / (direction @ direction))
        raise ArgumentError(f"{owner}: {what} is not {wanted}: along {_mode_of(np.abs(direction), names)} it is {worst:.6g}; "
                            f"give it {'more than 0' if strictly else '0 or more'} there")


def _out_of_reach(A: np.ndarray, B: np.ndarray) -> list[tuple[complex, np.ndarray]]:
    """Eigenvalues of the part of A that no column of B reaches, with the shares (n,) of the states in what is out of reach.

    In the units of the states or in those that balance A, whichever leaves less: units that are far apart hide what is reached
    in the first, and errors of rounding that balancing takes for couplings in the second.
    """
    n = len(A)
    if not n:
        return []
    balanced, (factors, _) = scipy.linalg.matrix_balance(A, permute=False, separate=True)
    scaled = [(A, B, np.ones(n)), (balanced, B / factors[:, None], factors)]
    matrix, rest, units = min(((a, _complement(a, b), f) for a, b, f in scaled), key=lambda result: result[1].shape[1])
    if not rest.shape[1]:
        return []
    values, vectors = np.linalg.eig(rest.T @ matrix.T @ rest)
    return [(complex(value), np.abs(rest @ vector) / units) for value, vector in zip(values, vectors.T, strict=True)]


def _complement(A: np.ndarray, B: np.ndarray) -> np.ndarray:
    """Orthonormal directions (n, k) that neither B nor any A^i B has a part along."""
    n = len(A)
    lengths = np.linalg.norm(B, axis=0)
    newest = B[:, lengths > 0] / lengths[lengths > 0]
    size = max(float(np.linalg.norm(A, 2)), 1e-300)
    basis = np.zeros((n, 0))
    while newest.shape[1] and basis.shape[1] < n:
        for _ in range(2):  # once more for what rounding left
            newest = newest - basis @ (basis.T @ newest)
        U, values, _ = np.linalg.svd(newest, full_matrices=False)
        fresh = U[:, values > NOTHING]
        basis = np.hstack([basis, fresh])
        newest = A @ fresh / size
    return np.linalg.svd(basis, full_matrices=True)[0][:, basis.shape[1]:] if basis.shape[1] else np.eye(n)


def _root(Q: np.ndarray) -> np.ndarray:
    """G with G G^T = Q, for a positive semidefinite matrix."""
    values, vectors = np.linalg.eigh(Q)
    result: np.ndarray = vectors * np.sqrt(np.maximum(values, 0.0))
    return result


def _mode_of(shares: np.ndarray, names: Sequence[str]) -> str:
    """States by their shares of the square, the largest first."""
    squares = shares**2 / max(float(shares @ shares), 1e-300)
    order = [k for k in np.argsort(-squares, kind="stable") if squares[k] >= SHARE]
    return ", ".join(f"{names[k]} ({squares[k]:.2f})" for k in order)


def _number(value: complex) -> str:
    return f"{value.real:.4g}" + (f" {'+' if value.imag > 0 else '-'} {abs(value.imag):.4g}i" if abs(value.imag) > 1e-12 else "")
