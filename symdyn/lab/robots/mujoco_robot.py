"""A model in MuJoCo, read from the same file, and what it computes in symdyn's order: without contacts, limits and friction, and
with equality constraints that hold exactly."""

from __future__ import annotations

import re
from typing import Any

import numpy as np

from symdyn.errors import SymdynError
from symdyn.mjcf.compiled import Compiled, rotation
from symdyn.mjcf.parts import Numbers, scalars_of
from symdyn.model.record import Model, joint_speeds

# Tolerance, m or rad, and largest number of steps of Newton's method for states that fulfil the constraints.
_CLOSED, _STEPS = 1e-14, 60
# Singular values of rows below the first part of the largest are those of rows that depend on others everywhere; at states with
# some below the second part, constraints nearly depend on each other.
_DEPENDENT, _NEARLY = 1e-10, 1e-5


class MujocoRobot:
    """MuJoCo's model and data, with all that symdyn leaves out switched off.

    compiled   of the file; model: the checked model that symdyn made of it, no joint held
    """

    def __init__(self, compiled: Compiled, model: Model) -> None:
        self.c, self.mj, self.m = compiled, compiled.mujoco, compiled.m
        self.source = model
        bits = self.mj.mjtDisableBit
        self.m.opt.disableflags |= int(bits.mjDSBL_CONTACT | bits.mjDSBL_LIMIT | bits.mjDSBL_FRICTIONLOSS | bits.mjDSBL_CLAMPCTRL)
        self.m.actuator_forcelimited[:] = 0
        self.m.actuator_actlimited[:] = 0
        self.m.jnt_actfrclimited[:] = 0
        self.m.tendon_actfrclimited[:] = 0
        self.d = self.mj.MjData(self.m)
        self.q_at, self.u_at = self._addresses()

    def _addresses(self) -> tuple[np.ndarray, np.ndarray]:
        """Where symdyn's coordinates and speeds are among MuJoCo's, by the names of the joints."""
        numbers, at = Numbers(self.source, []), {self.c.name("joint", j): self.c.joint(j)[1:] for j in range(self.m.njnt)}
        q_at, u_at = dict.fromkeys(self.source.coordinates, -1), dict.fromkeys(self.source.speeds, -1)
        for joint in self.source.joints:
            result = [(s.name, [s.coordinate], [s.speed]) for s in scalars_of(joint, numbers)]
            for name, own, speeds in result or [(joint.name, list(joint.coordinates), list(joint_speeds(joint)))]:
                if name in at:
                    for n, q in enumerate(own):
                        q_at[q] = at[name][0] + n
                    for n, u in enumerate(speeds):
                        u_at[u] = at[name][1] + n
        missing = [str(s) for taken in (q_at, u_at) for s, k in taken.items() if k < 0]
        if missing or len(u_at) != self.m.nv:
            raise SymdynError(f"MuJoCo has {self.m.nv} speeds, symdyn {len(u_at)}, of which {', '.join(missing) or 'none'} are "
                              "missing "
                              "there")
        return np.array(list(q_at.values()), dtype=int), np.array(list(u_at.values()), dtype=int)

    def weights(self) -> float:
        """Largest difference of the bodies' masses, centres of mass and inertias, relative to the largest there is."""
        m, worst = self.m, 0.0
        bodies = {b.name: b for b in self.source.bodies}
        for k in range(1, m.nbody):
            body, flat = bodies[self.c.name("body", k)], np.zeros(9)
            self.mj.mju_quat2Mat(flat, m.body_iquat[k])
            R = flat.reshape(3, 3)
            wanted = [np.array([m.body_mass[k]]), m.body_ipos[k], R @ np.diag(m.body_inertia[k]) @ R.T]
            result = [np.array([float(body.mass)]), np.array(body.com, dtype=float).ravel(), np.array(body.inertia, dtype=float)]
            for a, b in zip(result, wanted, strict=True):
                size = float(np.abs(b).max())
                worst = max(worst, float(np.abs(a - b).max()) / (size or 1.0))
        return worst

    def random(self, rng: np.random.Generator) -> None:
        """Any angles and attitudes, lengths up to 0.5 m from where the file has them, speeds and commands up to 1."""
        m, d = self.m, self.d
        self.mj.mj_resetData(m, d)
        d.qpos[:] += rng.uniform(-0.5, 0.5, m.nq)
        for j in range(m.njnt):
            kind, at, _ = self.c.joint(j)
            if kind == "hinge":
                d.qpos[at] = rng.uniform(-np.pi, np.pi)
            elif kind in ("free", "ball"):
                at += 3 * (kind == "free")
                e = rng.normal(size=4)
                d.qpos[at:at + 4] = e / np.linalg.norm(e)
        self._moving(rng)

    def near_start(self, rng: np.random.Generator) -> None:
        """Positions up to 0.1 from those of the first keyframe, or from where the file has them; speeds and commands up to 1."""
        m, d = self.m, self.d
        self.mj.mj_resetData(m, d)
        if m.nkey:
            d.qpos[:] = m.key_qpos[0]
        self.mj.mj_integratePos(m, d.qpos, rng.uniform(-0.1, 0.1, m.nv), 1.0)
        self._moving(rng)

    def _moving(self, rng: np.random.Generator) -> None:
        m, d = self.m, self.d
        d.qvel[:] = rng.uniform(-1, 1, m.nv)
        d.ctrl[:] = rng.uniform(-1, 1, m.nu)
        d.act[:] = rng.uniform(-1, 1, m.na)

    def state(self) -> np.ndarray:
        """x = [q, u, states of actuators], in symdyn's order."""
        return np.concatenate([self.d.qpos[self.q_at], self.d.qvel[self.u_at], self.d.act])

    def commands(self) -> dict[str, float]:
        """Values of the inputs, by the names of the actuators."""
        known = {i.name for i in self.source.inputs}
        values = {re.sub(r"\W+", "_", self.c.name("actuator", i)).strip("_"): float(self.d.ctrl[int(self.m.actuator_ctrladr[i])])
                  for i in range(self.m.nu)}
        return {name: value for name, value in values.items() if name in known}

    def free(self) -> np.ndarray:
        """(n_v,) accelerations without equality constraints; their rates of actuators' states after them."""
        self.mj.mj_forward(self.m, self.d)
        return np.array(self.d.qacc_smooth)

    def mass_matrix(self) -> np.ndarray:
        """(n_v, n_v), the armature included."""
        M = np.zeros((self.m.nv, self.m.nv))
        self.mj.mj_fullM(self.m, self.d, M)
        return M

    # -- equality constraints

    def constraints(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Residuals (n_c,), their Jacobian (n_c, n_v), and J_dot v (n_c,), of the active equality constraints."""
        m = self.m
        rows: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []
        kinds = self.mj.mjtEq
        for e in range(m.neq):
            if not m.eq_active0[e]:
                continue
            if int(m.eq_type[e]) in (int(kinds.mjEQ_CONNECT), int(kinds.mjEQ_WELD)):
                rows.append(self._bodies(e, int(m.eq_type[e]) == int(kinds.mjEQ_WELD)))
            else:
                rows.append(self._coupling(e, int(m.eq_type[e]) == int(kinds.mjEQ_TENDON)))
        residual, J, rest = (np.concatenate([np.atleast_1d(row[k]) for row in rows]) if k != 1 else np.vstack([row[1] for row
                                                                                                               in rows])
                             for k in range(3))
        return residual, J, rest

    def _bodies(self, e: int, weld: bool) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        m, d, mj = self.m, self.d, self.mj
        ends, data = [int(m.eq_obj1id[e]), int(m.eq_obj2id[e])], m.eq_data[e]
        if int(m.eq_objtype[e]) == int(mj.mjtObj.mjOBJ_SITE):
            points, turns = [m.site_pos[s] for s in ends], [rotation(m.site_quat[s]) for s in ends]
            ends = [int(m.site_bodyid[s]) for s in ends]
        else:
            points = [data[3:6], data[:3]] if weld else [data[:3], data[3:6]]
            turns = [rotation(data[6:10]) if weld else np.eye(3), np.eye(3)]
        result: list[Any] = []
        for body, point in zip(ends, points, strict=True):
            R = d.xmat[body].reshape(3, 3)
            at = d.xpos[body] + R @ point
            jacobians = [np.zeros((3, m.nv)) for _ in range(4)]
            mj.mj_jac(m, d, jacobians[0], jacobians[1], at, body)
            mj.mj_jacDot(m, d, jacobians[2], jacobians[3], at, body)
            result.append((at, R, *jacobians))
        residual, J, rest = (result[0][0] - result[1][0], result[0][2] - result[1][2], (result[0][4] - result[1][4]) @ d.qvel)
        if weld:
            A, B = (f[1] @ turn for f, turn in zip(result, turns, strict=True))
            error = A @ B.T
            off = np.array([error[2, 1] - error[1, 2], error[0, 2] - error[2, 0], error[1, 0] - error[0, 1]]) / 2
            off = off if np.trace(error) > 0 else off + 1.0
            residual = np.concatenate([residual, off])
            J = np.vstack([J, result[0][3] - result[1][3]])
            rest = np.concatenate([rest, (result[0][5] - result[1][5]) @ d.qvel])
        return residual, J, rest

    def _coupling(self, e: int, tendon: bool) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        m, d = self.m, self.d
        values = []
        for number in (int(m.eq_obj1id[e]), int(m.eq_obj2id[e])):
            row = np.zeros(m.nv)
            if number < 0:
                values.append((0.0, row))
            elif tendon:
                for w in range(int(m.tendon_adr[number]), int(m.tendon_adr[number]) + int(m.tendon_num[number])):
                    row[int(m.jnt_dofadr[int(m.wrap_objid[w])])] += m.wrap_prm[w]
                values.append((float(d.ten_length[number] - m.tendon_length0[number]), row))
            else:
                _, at, dof = self.c.joint(number)
                row[dof] = 1.0
                values.append((float(d.qpos[at] - m.qpos0[at]), row))
        (y, row_y), (x, row_x) = values
        p = np.polynomial.Polynomial(m.eq_data[e, :5])
        rate = float(row_x @ d.qvel)
        return np.array([y - p(x)]), (row_y - p.deriv()(x) * row_x)[None], np.array([-p.deriv(2)(x) * rate**2])

    def close(self) -> float:
        """Move to a state that fulfils the constraints, from the state there is; returns the residual, m or rad."""
        size = np.inf
        for _ in range(_STEPS):
            self.mj.mj_fwdPosition(self.m, self.d)
            self.mj.mj_comVel(self.m, self.d)
            residual, J, _ = self.constraints()
            size = float(np.abs(residual).max())
            if size < _CLOSED:
                break
            step = -np.linalg.lstsq(J, residual, rcond=1e-9)[0]
            self.mj.mj_integratePos(self.m, self.d.qpos, step / max(1.0, 2 * float(np.abs(step).max())), 1.0)
        self.d.qvel[:] -= np.linalg.lstsq(J, J @ self.d.qvel, rcond=1e-9)[0]
        return size

    def singular(self) -> bool:
        """Whether constraints depend on each other here that do not everywhere: accelerations are hardly determined then."""
        sizes = np.linalg.svd(self.constraints()[1], compute_uv=False)
        return bool(((sizes > _DEPENDENT * sizes[0]) & (sizes < _NEARLY * sizes[0])).any())

    def constrained(self) -> np.ndarray:
        """(n_v,) accelerations by M a + J^T lambda = M a_free, J a = -J_dot v."""
        free, M = self.free(), self.mass_matrix()
        _, J, rest = self.constraints()
        lifted = np.linalg.solve(M, J.T)
        force = np.linalg.lstsq(J @ lifted, J @ free + rest, rcond=1e-11)[0]
        return np.asarray(free - lifted @ force)
