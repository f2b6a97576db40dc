"""Long chains, and chaos: how errors grow in a double pendulum."""

from __future__ import annotations

import math
import time as clock
from collections.abc import Iterator

import numpy as np

from symdyn.stress.finding import first_order_row, judged
from symdyn.stress.flow import flow, path
from symdyn.stress.motion import energy_gradient
from symdyn.stress.record import FAIL, NotApplicable, Row, within
from symdyn.stress.rounding import Measured, states
from symdyn.stress.statements import emitted
from symdyn.stress.system_under_test import EPS, SystemUnderTest
from symdyn.systems import get


def long_chains(short: bool) -> Iterator[Row]:
    """Chains of a hundred links in the plane, fifty in space: accelerations against 30 digits, energy of a motion."""
    for name, n in (("n_link_pendulum", 12),) if short else (("n_link_pendulum", 100), ("spatial_chain", 50)):
        begun = clock.perf_counter()
        tested = SystemUnderTest(get(name, n=n).recursive())
        tested.everything = ("rhs", "mass_matrix", "energy")
        where = states(tested, 4 if short else 8)
        measured = Measured(tested, "rhs", where, None, emitted(tested, tested.everything)["rhs"])
        values = tested.evaluate("rhs", where.t, where.x, None, where.inputs, where.ud)
        result = measured.compared(values, tested.backend)
        finite = measured.condition[np.isfinite(measured.condition)]
        yield judged("long chains", f"{name}({n})", f"{tested.equations.tape('rhs').operations} operations, accelerations at "
                     f"{len(where.x)} states, condition of the mass matrix up to {finite.max(initial=1.0):.2g}, "
                     f"{result.rejected} rejected", [result])
        yield from first_order_row(tested, f"accelerations at {len(where.x)} states", [result])
        rtol, end = 1e-8, 0.2 if short else 0.5
        try:
            motion = path(tested, end, rtol)
        except NotApplicable as reason:
            yield Row("long chains", f"{name}({n})", f"motion of {end:g} s", None, None, "", FAIL, str(reason))
            continue
        sol, (size, _) = motion.sol, motion.sol.energy_scale
        rounded = 8 * EPS * tested.equations.tape("rhs").longest_chain()
        bound = sol.n_steps * (motion.step_error + rounded) * energy_gradient(tested, sol, motion.scales) / size
        yield within("long chains", f"{name}({n})", f"motion of {end:g} s in {sol.n_steps} steps at rtol {rtol:g}, "
                     f"{clock.perf_counter() - begun:.0f} s with derivation and compilation: energy error", sol.energy_error(),
                     bound, "steps times the error one may have times the gradient of the energy, over the energy",
                     "energy is kept in a long chain", "energy is lost or gained in a long chain")


def chaos(short: bool) -> Iterator[Row]:
    """Errors of a chaotic motion against the growth that the variational equations give: as they must, and not faster."""
    tested = SystemUnderTest("double_pendulum")
    end = 4.0 if short else 10.0
    motion = path(tested, end, 1e-12, resolved=True)
    sol = motion.sol
    phi = flow(tested, motion)
    grown = np.linalg.norm(phi, 2, axis=(1, 2))
    exponent = math.log(grown[-1]) / float(sol.t[-1])
    label = f"double pendulum, {sol.t[-1]:.3g} s, magnification {grown[-1]:.3g} (Lyapunov estimate {exponent:.2g} 1/s)"
    inverse = np.linalg.pinv(phi[::10])
    for rtol in (1e-6, 1e-8, 1e-10):
        run = tested.run(sol.t, rtol=rtol, atol=rtol * motion.scales)
        error = np.linalg.norm((run.x - sol.x) / motion.scales, axis=1)[::2]
        local = 2 * math.sqrt(len(motion.scales)) * rtol
        # The largest magnification from any earlier time to each.
        most = np.array([max(np.linalg.norm(phi[10 * k] @ inverse[j], 2) for j in range(0, k + 1, max(1, k // 20)))
                         for k in range(len(inverse))])
        steps = run.n_steps * np.arange(1, len(error) + 1)[::10] / len(error)
        share = float((error[::10] / (steps * local * most + 1e-300)).max())
        yield within("chaos", tested.name, f"{label}, run at rtol {rtol:g}, {run.n_steps} steps: largest error over what may "
                     "have grown from errors of steps", share, 1.0, "errors the step control allows, summed over steps and "
                     "magnified as the exact Jacobian predicts", "errors grow no faster than they must",
                     "errors grow faster than the motion magnifies")
        # And as fast: once they exist they are magnified.
        k = 10 * (len(error) // 40)
        rate = math.log(max(error[-1], 1e-300) / max(error[k], 1e-300)) / float(sol.t[-1] - sol.t[2 * k])
        wanted = math.log(np.linalg.norm(phi[-1] @ inverse[k // 10], 2)) / float(sol.t[-1] - sol.t[2 * k])
        slack = math.log(run.n_steps) / float(sol.t[-1] - sol.t[2 * k])
        yield within("chaos", tested.name, f"{label}, run at rtol {rtol:g}: rate of growth {rate:.2g} 1/s over the last three "
                     f"quarters, of the variational equations {wanted:.2g}: difference", abs(rate - wanted), slack,
                     "logarithm of the number of steps, whose errors point anywhere, over the time",
                     "errors grow at the rate of the variational equations", "the rate is another")


