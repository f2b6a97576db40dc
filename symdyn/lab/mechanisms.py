"""Random mechanisms, each with a state on its constraints: at rest, in steady motion, or anywhere in a motion.

Every number draws one mechanism, the same for the same seed. Kinds are dealt out in turn, so that each occurs equally often.

topology     what constraints there are: none, loops closed by joints, equations in coordinates, such with time, equations in
             speeds, several of these, more than are independent
motion       rest: u = 0 and u_dot = 0, by constant forces that balance the rest; steady: nothing changes but cyclic coordinates,
             at constant rates; any: everything is drawn
features     what else there is; one is dealt out, others come by chance

A draw whose constraints are nearly dependent (singular values between those of dependent rows and a hundredth of the largest),
whose Euler angles are nearly locked, or whose motion is wild is drawn again; `redraws` counts these.
"""

from __future__ import annotations

import random
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import sympy as sp

import symdyn as sd
from symdyn.errors import ModelWarning
from symdyn.lab.draft import PLANAR, SPATIAL, Draft, Link, renamed
from symdyn.lab.manifold import OffConstraints, consistent_state, ranks
from symdyn.model.joints import Joint

TOPOLOGIES = ("tree", "loop", "holonomic", "rheonomic", "velocity", "mixed", "redundant")
MOTIONS = ("rest", "steady", "any")
FEATURES = ("plain", "extra states", "dependent coordinates", "Euler parameters", "quasi-velocities", "held coordinates",
            "held speeds", "acceleration outputs", "time-dependent forces", "prescribed motion", "absolute coordinates",
            "flexible body")
# Features that come by chance in addition to the one that is dealt out, with their probabilities.
BY_CHANCE = {"extra states": 0.2, "dependent coordinates": 0.15, "Euler parameters": 0.12, "quasi-velocities": 0.12,
             "held coordinates": 0.1, "acceleration outputs": 0.3, "time-dependent forces": 0.12, "prescribed motion": 0.08}
# Number of the mechanisms after which kinds are dealt out in other combinations.
ROUND = 84
# One mechanism in so many is compiled to C.
IN_C = 40
# Smallest singular value of independent constraints, and of q_dot = N u, by the largest.
WELL_CONDITIONED = 0.02
# Largest condition number of the mass matrix along the constraints, and largest acceleration (SI).
HEAVY, WILD = 1e5, 2e3
# Trims must balance to this part of the largest acceleration without them.
BALANCED = 1e-9
# Distance at which ranks of constraints are compared, m or rad.
NEAR = 1e-2
MOST_DRAWS = 200


@dataclass(frozen=True, eq=False)
class Mechanism:
    """A module at a state on its constraints.

    kinds      topology, motion, features, formulation and backend
    module     what is linearized at t, x, params (by name), inputs (n_in,), with what is named in `hold` held
    equations  what `module` was compiled from
    reference  the same mechanism, but with constraints that hold what is held; `module` itself where nothing is
    constant   whether linear equations about the motion are constant along it
    redraws    how many draws were ill-conditioned before
    """

    number: int
    kinds: tuple[str, ...]
    module: Any
    equations: Any
    reference: Any
    t: float
    x: np.ndarray
    params: dict[str, float]
    inputs: np.ndarray
    hold: tuple[str, ...]
    constant: bool
    redraws: int

    @property
    def motion(self) -> str:
        """One of MOTIONS."""
        return self.kinds[1]


class IllConditioned(Exception):
    """A draw that is not used; the message is the reason."""


def kinds_of(number: int) -> tuple[str, str, str]:
    """Topology, motion and the feature that is dealt out to a number."""
    return TOPOLOGIES[number % 7], MOTIONS[number % 3], FEATURES[(number + number // ROUND) % len(FEATURES)]


def draw(number: int, seed: int = 0) -> Mechanism:
    """The mechanism of a number. Raises RuntimeError if no draw is well-conditioned."""
    topology, motion, feature = kinds_of(number)
    for attempt in range(MOST_DRAWS):
        rng = random.Random(f"symdyn {seed} {number} {attempt}")
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", ModelWarning)  # of constraints that cannot hold at t = 0
                return _Composer(rng, number, topology, motion, feature).mechanism(attempt)
        except IllConditioned:
            continue
    raise RuntimeError(f"mechanism {number} of seed {seed}: none of {MOST_DRAWS} draws is well-conditioned")


class _Composer:
    """Describes one mechanism and finds its state."""

    def __init__(self, rng: random.Random, number: int, topology: str, motion: str, feature: str) -> None:
        self.rng, self.number, self.topology, self.motion = rng, number, topology, motion
        self.features = {feature} - {"plain"}
        if feature != "plain":
            self.features |= {name for name, share in BY_CHANCE.items() if rng.random() < share}
        if feature == "absolute coordinates":  # every joint becomes constraints: small ones with few features take long enough
            self.features &= {"absolute coordinates", "extra states", "acceleration outputs", "time-dependent forces"}
        self.timed = False  # whether linear equations depend on time explicitly
        self.trims: list[sp.Symbol] = []
        self.lever: Joint | None = None  # that of an absolute angle
        self.beam: Joint | None = None
        self.root: Joint | None = None  # that along which a steady motion goes on, and the speeds there that are not zero
        self.root_kind = ""
        self.start: dict[sp.Symbol, float] = {}

    def mechanism(self, redraws: int) -> Mechanism:
        """The whole of it. Raises IllConditioned."""
        self.describe()
        draft = self.draft
        system = draft.system
        system.defaults = dict.fromkeys(self.trims, 0.0)
        self.rates = {u: self._speed(u) for u in draft.speeds}
        system.initial = {**draft.values, **self.rates}
        hold = self._held()
        equations, formulation = self._equations()
        backend = "c" if self.number % IN_C == IN_C - 1 else "numpy"
        module = equations.compile(backend=backend)
        x = self._state(module)
        reference = module if not hold else self._holding(module, x, hold).compile(backend=backend)
        inputs = np.array([draft.number(-1, 1) for _ in module.metadata.inputs])
        if self.motion == "any":
            params = {p.name: draft.signed(0.2, 2) for p in self.trims}
        elif formulation == "absolute":  # whose speeds change in steady motion
            relative = self._relative()[0].compile(backend="numpy")
            params = self._trimmed(relative, self._state(relative), inputs)
        else:
            params = self._trimmed(reference, x, inputs)
        self._examine(reference, x, params, inputs)
        features = tuple(sorted(self.features)) or ("plain",)
        constant = self.motion != "any" and not self.timed and not (formulation == "absolute" and self.motion == "steady")
        kinds = (self.topology, self.motion, *features, formulation, backend)
        return Mechanism(self.number, kinds, module, equations, reference, draft.t, x, params, inputs, hold, constant, redraws)

    # -- the description

    def describe(self) -> None:
        """Bodies, joints, constraints, loads and outputs."""
        rng = self.rng
        absolute = "absolute coordinates" in self.features
        spatial = self.features & {"Euler parameters", "quasi-velocities", "flexible body"}
        planar = not spatial and rng.random() < (0.6 if absolute else 0.25)
        self.root_kind = root = self._root_kind(planar)
        t = 0.0 if absolute else round(rng.uniform(0.1, 3), 3)
        gravity = self._gravity(planar, root)
        self.draft = draft = Draft(rng, f"random_{self.number}", planar, gravity, t)
        least = 2 + (self.topology != "tree") + (self.topology in ("loop", "mixed", "redundant")) - absolute
        if root:
            self._root(root)
        there = getattr(self.root, "orientation", None)
        if "Euler parameters" in self.features and not isinstance(there, sd.EulerParameters):
            self._turning(sd.EulerParameters())
        if "quasi-velocities" in self.features and (there is None or there == sd.EulerAngles("ZYX")):
            self._turning(sd.EulerAngles(rng.choice(["ZYX", "ZXZ", "XYZ"]), "body"))
        while len(draft.plain) < 2 or draft.freedoms < least or len(draft.moving) < 2:
            self._any_joint()
        while rng.random() < 0.3 and draft.freedoms < 6 and len(draft.moving) < 5 - 2 * absolute:
            self._any_joint()
        if "dependent coordinates" in self.features:
            self._dependent()
        if "prescribed motion" in self.features:
            self._prescribed(root)
        if "flexible body" in self.features:
            self._flexible()
        self._constrain()
        self._loads()
        self._outputs()

    def _gravity(self, planar: bool, root: str) -> list[float]:
        if planar:
            return [0, 0] if root == "spin" else [0, -9.81]
        if root:
            return [0, 0, 0 if root == "tumble" else -9.81]
        return [round(self.rng.uniform(-6, 6), 2) for _ in range(3)]

    def _root_kind(self, planar: bool) -> str:
        """The joint along which a steady motion goes on; "" for other motions."""
        if self.motion != "steady":
            return ""
        if planar:
            return self.rng.choice(["spin", "roll"])
        kinds = ["spin", "spin", "screw", "yaw", "roll"]
        if "prescribed motion" in self.features:
            kinds = ["spin", "screw", "yaw"]
        elif self.topology != "rheonomic" and self.features & {"Euler parameters", "quasi-velocities"}:
            kinds += ["tumble"] * 6
        elif self.topology != "rheonomic":
            kinds.append("tumble")
        return self.rng.choice(kinds)

    def _root(self, kind: str) -> None:
        """The body that a steady motion moves, and how."""
        draft, ground = self.draft, self.draft.links[0]
        axis: dict[str, Any] = {} if draft.planar else {"axis": [0, 0, 1]}
        if kind == "spin":
            joint = draft.add("Revolute", ground, placed=False, **axis).joint
        elif kind == "screw":
            joint = draft.add("Cylindrical", ground, placed=False, **axis).joint
        elif kind == "yaw":
            joint = draft.add("Spherical", ground, placed=False, orientation=sd.EulerAngles("ZYX")).joint
        elif kind == "roll":
            joint = draft.add("Planar", ground, placed=False).joint
        else:
            orientation = sd.EulerParameters() if "quasi-velocities" not in self.features else sd.EulerAngles("ZYX", "body")
            free: dict[str, Any] = {"velocity": "body"} if self.rng.random() < 0.4 else {}
            joint = draft.add("Free" if free else "Spherical", ground, placed=False, orientation=orientation, **free).joint
            self.features.add("Euler parameters" if isinstance(orientation, sd.EulerParameters) else "quasi-velocities")
        assert joint is not None
        count = {"spin": 1, "screw": 2, "yaw": 1, "roll": 2}.get(kind)
        if count is None:
            draft.cyclic |= {*joint.coordinates, *draft.speeds}
            self.start = {u: draft.signed(0.4, 2) for u in draft.speeds}
        elif kind == "roll":
            angle, speed = draft.values[joint.coordinates[2]], draft.signed(0.5, 2)
            draft.cyclic |= {*joint.coordinates[:2], *draft.speeds[:2]}
            self.start = {draft.speeds[0]: speed * np.cos(angle), draft.speeds[1]: speed * np.sin(angle)}
        else:
            draft.cyclic |= {*joint.coordinates[:count], *draft.speeds[:count]}
            self.start = {u: draft.signed(0.5, 2.5) for u in draft.speeds[:count]}
        self.root = joint

    def _parent(self) -> Link:
        """Link that the next body hangs on; in steady motion not the ground."""
        draft = self.draft
        if self.motion == "steady":
            return self.rng.choice(draft.moving)
        return self.rng.choice(draft.links[-3:])

    def _any_joint(self) -> None:
        draft, rng = self.draft, self.rng
        menu = PLANAR if draft.planar else dict(SPATIAL)
        if self.motion == "steady" or draft.freedoms > 3 or "absolute coordinates" in self.features:
            menu = {k: n for k, n in menu.items() if k not in ("Free",)}
        if draft.freedoms > 5 or "absolute coordinates" in self.features:
            menu = {k: n for k, n in menu.items() if k in ("Revolute", "Prismatic", "Helical")}
        kind = rng.choices(list(menu), list(menu.values()))[0]
        options: dict[str, Any] = {}
        if kind == "Revolute" and "quasi-velocities" in self.features and rng.random() < 0.5:
            options["speed"] = renamed(len(draft.links))
        draft.add(kind, self._parent(), **options)

    def _turning(self, orientation: Any) -> None:
        """A joint with this orientation, whose speeds are an angular velocity."""
        rng = self.rng
        kind, options = "Spherical", {"orientation": orientation}
        if self.motion != "steady" and rng.random() < 0.3:
            kind, options["velocity"] = "Free", rng.choice(["body", "parent"])
        self.draft.add(kind, self._parent(), **options)

    def _dependent(self) -> None:
        """A joint whose coordinate follows others, or one between absolute angles."""
        draft, rng = self.draft, self.rng
        one, other = rng.sample(draft.plain, 2)
        expression = draft.signed(0.4, 1.2) * one + draft.signed(0.3, 0.8) * sp.sin(other)
        if self.motion != "steady" and rng.random() < 0.3:
            expression += draft.number(0.1, 0.4) * self._swing(draft.number(0.5, 2))
            self.timed = True
        kind = rng.choice(["Revolute", "Prismatic"])
        draft.add(kind, self._parent(), coordinate=expression)
        if rng.random() < 0.4:
            phi = sd.coordinates("phi")
            draft.system.add_coordinate(phi)
            draft.values[phi] = draft.signed(0.3, 1.1)
            self.lever = draft.add("Revolute", self._parent(), coordinate=phi - one).joint
            draft.speeds.append(phi.dot)

    def _prescribed(self, root: str) -> None:
        """A prescribed motion: of the ground, or of a joint."""
        draft, rng = self.draft, self.rng
        if root:  # a ground that turns about the axis of the steady motion
            draft.system.move_ground(angles=[draft.signed(0.3, 1.5) * sd.t, 0, 0])
            self.timed |= root not in ("spin", "screw", "yaw")
            return
        self.timed = True
        w, a = draft.number(0.5, 2), draft.number(0.1, 0.4)
        if rng.random() < 0.5:
            zeros = [0] * (1 if draft.planar else 2)
            draft.system.move_ground([a * self._swing(w), *zeros], [a * self._swing(w + 0.3), 0, 0])
        else:
            draft.add("Revolute", self._parent(), coordinate=a * self._swing(w) + w / 3)

    def _swing(self, w: float) -> sp.Expr:
        """A function of time; where the state is at rest its first two derivatives vanish, so that they demand no motion."""
        return sp.sin(w * (sd.t - self.draft.t))**3 if self.motion == "rest" else sp.sin(w * sd.t)

    def _flexible(self) -> None:
        """A beam with two modes and a body at its end."""
        draft = self.draft
        shapes = [sd.Shape("x", coefficients=[0.7, 0.5, -0.2]), sd.Shape("y", coefficients=[1])]
        beam = sd.Beam([0, 0.5, 1], mass_per_length=[0.8, 0.6, 0.5], stiffness=[9, 7, 5], shapes=shapes, damping_ratio=0.02)
        flexible = draft.system.add_flexible_body("beam", beam)
        draft.system.add_joint(sd.Fixed("clamp", self._parent().body, flexible.root, parent_point=draft.point()))
        draft.system.add_joint(sd.Fixed("end", flexible.tip, draft.body()))
        for q in flexible.coordinates:
            draft.values[q] = draft.signed(0.02, 0.08)
            draft.speeds.append(q.dot)
        self.beam = flexible.joint

    # -- constraints

    def _constrain(self) -> None:
        makers: dict[str, Callable[[], None]] = {
            "loop": self._loop, "holonomic": self._holonomic, "rheonomic": self._rheonomic, "velocity": self._velocity,
            "redundant": self._redundant}
        if self.topology == "mixed":
            makers[self.rng.choice(["loop", "holonomic", "holonomic"])]()
            self._velocity()
            if self.rng.random() < 0.3 and self.draft.freedoms > 2:
                self._rheonomic()
        elif self.topology != "tree":
            makers[self.topology]()
            again = self.topology != "redundant" and (self.topology, self.motion) != ("rheonomic", "steady")
            if again and self.rng.random() < 0.25 and self.draft.freedoms > 3:
                makers[self.topology]()

    def _function(self) -> sp.Expr:
        """A function of coordinates that vanishes at the state."""
        draft, rng = self.draft, self.rng
        chosen = rng.sample(draft.relative, min(len(draft.relative), rng.randint(2, 3)))
        terms = []
        for q, r in zip(chosen, [*chosen[1:], chosen[0]], strict=True):
            a, at, other = draft.signed(0.4, 1.5), draft.values[q], draft.values[r]
            terms.append(a * rng.choice([q - at, sp.sin(q) - np.sin(at), (q**2 - at**2) / 2, q * r - at * other]))
        return sp.Add(*terms)

    def _loop(self) -> None:
        draft = self.draft
        result = draft.closures(self.motion == "steady")
        while not result:
            self._any_joint()
            result = draft.closures(self.motion == "steady")
        draft.close(*self.rng.choice(result))

    def _holonomic(self) -> None:
        self.draft.system.add_constraint(self._function())
        self.draft.removed += 1

    def _rheonomic(self) -> None:
        draft, rng = self.draft, self.rng
        w = draft.number(0.5, 2)
        if self.motion == "steady":  # a prescribed rotation, or one that also follows other coordinates
            cyclic = [q for q in draft.values if q in draft.cyclic and q.dot in self.start]
            if not cyclic:  # a body that tumbles
                self._holonomic()
                return
            q = rng.choice(cyclic)
            expression = q - draft.values[q] - self.start[q.dot] * (sd.t - draft.t)
            expression += rng.choice([0, draft.signed(0.3, 1)]) * self._function()
            draft.cyclic -= {q, q.dot}
        elif self.motion == "rest":  # a slot that turns about the point where the state is
            expression = sp.cos(w * sd.t) * self._function() + (1 + sp.sin(w * sd.t) / 3) * self._function()
            self.timed = True
        else:
            expression = self._function() + draft.signed(0.2, 1) * (sp.sin(w * sd.t) - np.sin(w * draft.t))
            if rng.random() < 0.5:
                expression += sp.cos(w * sd.t) * self._function()
            self.timed = True
        draft.system.add_constraint(expression)
        draft.removed += 1

    def _velocity(self) -> None:
        self.draft.system.add_constraint(self._speed_row())
        self.draft.removed += 1

    def _speed_row(self) -> sp.Expr:
        """An expression linear in speeds that vanishes at the state; at rest and in steady motion for no force at all."""
        draft, rng = self.draft, self.rng
        cyclic = [u for u in draft.speeds if u in draft.cyclic]
        if self.root is not None and self.root_kind == "roll" and rng.random() < 0.6 and cyclic:
            x, y, theta = draft.speeds[:3]  # a knife edge
            angle = self.root.coordinates[2]
            return y * sp.cos(angle) - x * sp.sin(angle) + draft.signed(0.05, 0.3) * theta
        free = [u for u in draft.speeds if u not in draft.cyclic]
        chosen = rng.sample(free, min(len(free), rng.randint(2, 3)))
        row = sp.Add(*[(draft.signed(0.4, 1.2) + draft.number(0, 0.6) * sp.sin(rng.choice(draft.relative))) * u for u in chosen])
        if self.motion == "steady" and cyclic and rng.random() < 0.7:
            row += self._function() * rng.choice(cyclic)
        if self.motion == "any" and rng.random() < 0.5:
            row += draft.signed(0.2, 1) + rng.choice([0, 1]) * draft.number(0.2, 0.8) * sp.sin(draft.number(0.5, 2) * sd.t)
            self.timed = True
        return row

    def _redundant(self) -> None:
        draft, rng = self.draft, self.rng
        ways = ["copies", "rate", "speeds"] + ([] if draft.planar else ["loop", "loop"])
        way = rng.choice(ways)
        if way == "loop":  # parallel axes, closed in space: three of five rows depend on the others
            parent = rng.choice(draft.moving if self.motion == "steady" else draft.links)
            links = [draft.add("Revolute", parent, placed=False, axis=[0, 0, 1], parent_point=draft.point())]
            for _ in range(2):
                at = [*draft.point()[:2], 0]
                links.append(draft.add("Revolute", links[-1], placed=False, axis=[0, 0, 1], parent_point=at))
            self._parallel(parent, links[-1])
            draft.removed += 2
            return
        system = draft.system
        if way == "speeds":
            one = self._speed_row()
            system.add_constraint(one)
            system.add_constraint(draft.signed(0.5, 3) * one)
        elif way == "copies" or len(draft.plain) < 2:
            one = self._function()
            system.add_constraint(one)
            system.add_constraint(draft.signed(0.5, 3) * one)
            if draft.freedoms > 3:
                other = self._function()
                system.add_constraint(other)
                system.add_constraint(one - draft.signed(0.5, 2) * other)
                draft.removed += 1
        else:
            a, b = rng.sample(draft.plain, 2)
            one = draft.signed(0.5, 1.5) * (a**2 - draft.values[a]**2) + sp.sin(b) - np.sin(draft.values[b])
            system.add_constraint(one)
            system.add_constraint(one.diff(a) * a.dot + one.diff(b) * b.dot)
        draft.removed += 1

    def _parallel(self, parent: Link, last: Link) -> None:
        """A revolute joint parallel to the axes of the links before, where its bodies are."""
        draft = self.draft
        end = np.array([*draft.point()[:2], 0.0])
        at = parent.R.T @ (last.p + last.R @ end - parent.p)
        draft.system.close_loop(sd.Revolute("parallel", parent.body, last.body, axis=[0, 0, 1], parent_point=at.tolist(),
                                            child_point=end.tolist()))

    # -- loads and outputs

    def _loads(self) -> None:
        draft, rng = self.draft, self.rng
        system = draft.system
        count = rng.choice([0, 1, 1, 2])
        self.inputs = [sd.inputs(f"F{k + 1}") for k in range(count)]
        self.state = sd.coordinates("z1") if "extra states" in self.features else None
        damped = rng.choice([0.0, 1.0, 0.6])
        joints = [link.joint for link in draft.moving if link.joint is not None and link.freedoms]
        for joint in [*joints, *([self.beam] if self.beam is not None else [])]:
            speeds = joint.speeds or joint.default_speeds()
            system.add_joint_force(joint, [self._joint_force(joint, k, u, damped) for k, u in enumerate(speeds)])
        if self.lever is not None:
            system.add_joint_force(self.lever, self._trim())
        chosen = rng.choice(draft.moving).body
        if rng.random() < 0.2:  # a force that turns with its body
            system.add_force(chosen, draft.point(2), point=draft.point(), frame=chosen)
        if rng.random() < 0.4 and len(draft.moving) > 1:
            a, b = rng.sample(draft.moving if self.motion == "steady" else draft.links, 2)
            system.add_spring_damper(a.body, b.body, draft.point(), draft.point(), stiffness=draft.number(5, 40),
                                     damping=damped * draft.number(0.1, 0.5), length=draft.number(0.1, 0.5))
        if len(self.inputs) > 1:
            F = self.inputs[1]
            system.add_force(chosen, [F, F**2 / 2, F / 3][:2 if draft.planar else 3], point=draft.point(), frame=chosen)
        if self.state is not None:
            z = self.state
            draft.values[z] = draft.signed(0.2, 1)
            rate = sp.sin(rng.choice(draft.relative)) + draft.number(0.2, 1) * rng.choice(draft.speeds) - draft.number(0.5, 3) * z
            if self.inputs:
                rate += self.inputs[0] * (1 + z**2 / 3)
            system.add_state(z, rate + self._trim())

    def _joint_force(self, joint: Any, k: int, u: Any, damped: float) -> sp.Expr:
        """Spring, damper, trim, and what else acts along a speed of a joint."""
        draft, rng = self.draft, self.rng
        force = self._trim() - (damped * draft.number(0.3, 1.5) * u if rng.random() < max(damped, 0.1) and damped else 0)
        turned = len(joint.coordinates) - joint.n_speeds  # Euler parameters have one coordinate more
        q = joint.coordinates[k if not turned or k < joint.n_speeds - 3 else k + turned]
        if q not in draft.relative:
            return force
        stiffness = draft.number(10, 100)
        force -= stiffness * q + rng.choice([0, stiffness / 3]) * q**3
        if self.inputs and rng.random() < 0.5:
            force += self.inputs[0] * (1 + q / 2)
        if self.state is not None and rng.random() < 0.6:
            force += draft.signed(0.5, 3) * self.state
        if "time-dependent forces" in self.features:
            self.timed = True
            w = draft.number(0.5, 3)
            still = 1 if self.motion == "any" else q - draft.values[q]  # at rest for ever: stiffness alone depends on time
            force += draft.signed(0.5, 3) * sp.sin(w * sd.t) * still
        return force

    def _trim(self) -> sp.Symbol:
        """A new parameter: a constant force, or rate of an extra state, that makes rest of the state."""
        self.trims.append(sd.parameters(f"f{len(self.trims) + 1}"))
        return self.trims[-1]

    def _outputs(self) -> None:
        draft, rng = self.draft, self.rng
        if rng.random() < 0.1 and "acceleration outputs" not in self.features:
            return
        system, bodies = draft.system, [link.body for link in draft.moving]
        mixed = sp.sin(rng.choice(list(draft.values))) * rng.choice(draft.speeds)
        system.add_output("mixed", [mixed, rng.choice(list(draft.values)) + (self.inputs[0]**2 if self.inputs else 0)])
        system.add_output("place", sd.position(rng.choice(bodies), draft.point()))
        if rng.random() < 0.5:
            system.add_output("speed", sd.velocity(rng.choice(bodies), draft.point()))
        if "acceleration outputs" in self.features:
            system.add_output("sensor", sd.acceleration(rng.choice(bodies), draft.point()))
            if rng.random() < 0.3:
                system.add_output("bias", sd.bias_acceleration(rng.choice(bodies), draft.point()))

    # -- equations and state

    def _equations(self) -> tuple[Any, str]:
        """Equations of motion and the name of their formulation."""
        system = self.draft.system
        if "absolute coordinates" in self.features:
            return system.augmented(coordinates="absolute"), "absolute"
        return self._relative()

    def _relative(self) -> tuple[Any, str]:
        """The same in the coordinates of the joints."""
        system, rng = self.draft.system, self.rng
        if self.topology != "tree":
            return system.augmented(frames=rng.choice(["parallel", "body"])), "augmented"
        formulation = rng.choice(["embedding", "recursive"])
        return getattr(system, formulation)(frames=rng.choice(["body", "parallel"])), formulation

    def _speed(self, u: sp.Symbol) -> float:
        if self.motion == "any":
            return self.draft.signed(0.2, 1.5)
        return self.start.get(u, 0.0)

    def _state(self, module: Any) -> np.ndarray:
        """x on the constraints. Raises IllConditioned."""
        metadata, draft = module.metadata, self.draft
        values = {**{q.name: v for q, v in draft.values.items()}, **{u.name: v for u, v in self.rates.items()}}
        values |= {name: v for name, v in metadata.initial.items() if name not in values}  # of absolute coordinates
        x = np.array([values[name] for name in metadata.x])
        p = module.parameters({})
        N = module.evaluate("N", draft.t, x, p)
        if np.linalg.cond(N) * WELL_CONDITIONED > 1:
            raise IllConditioned("Euler angles are nearly locked")
        if metadata.constraints:
            ranks(module, draft.t, x, p, WELL_CONDITIONED, IllConditioned)
        moved = consistent_state(module, draft.t, x, p)
        change = np.abs(moved - x)[:metadata.sizes.q].max(initial=0.0)
        if change > 1e-9 or (self.motion != "any" and np.abs(moved - x).max() > 1e-9):
            raise RuntimeError(f"{module.name}: the state that was drawn is off its constraints by {np.abs(moved - x).max():.2g}")
        return moved

    def _held(self) -> tuple[str, ...]:
        """Names of what is held."""
        draft, rng = self.draft, self.rng
        if "held speeds" in self.features:
            return (rng.choice(draft.speeds).name,)
        if "held coordinates" in self.features:
            still = draft.cyclic if self.motion == "steady" and self.root_kind == "tumble" else set()  # their rates change
            names = [q.name for q in draft.values if q is not self.state and q not in still]
            return tuple(rng.sample(names, 2 if draft.freedoms > 3 and rng.random() < 0.3 else 1))
        return ()

    def _holding(self, module: Any, x: np.ndarray, hold: tuple[str, ...]) -> Any:
        """Equations of the mechanism with constraints that hold what is named: a coordinate goes on at its rate, a speed that is
        no rate of a coordinate stays."""
        draft, metadata = self.draft, module.metadata
        symbols = {s.name: s for s in (*draft.values, *draft.speeds)}
        rates = module.rhs(draft.t, x, None, np.zeros(len(metadata.inputs)))
        for name in hold:
            coordinate = name if name in metadata.q else name.removesuffix("_dot")
            if coordinate in metadata.q:
                k = metadata.q.index(coordinate)
                expression = symbols[coordinate] - float(x[k]) - float(rates[k]) * (sd.t - draft.t)
            else:
                expression = symbols[name] - float(x[metadata.x.index(name)])
            draft.system.add_constraint(expression, name=f"hold_{name}")
        return draft.system.augmented()

    def _trimmed(self, module: Any, x: np.ndarray, inputs: np.ndarray) -> dict[str, float]:
        """Trims that make the derivatives of speeds and extra states zero; what they leave open is drawn."""
        metadata, t = module.metadata, self.draft.t
        n_q, names = metadata.sizes.q, [p.name for p in self.trims]

        def rates(values: np.ndarray) -> np.ndarray:
            result: np.ndarray = module.rhs(t, x, dict(zip(names, values, strict=True)), inputs)[n_q:]
            return result

        still = rates(np.zeros(len(names)))
        slopes = np.column_stack([rates(e) - still for e in np.eye(len(names))])
        inverse = np.linalg.pinv(slopes, rcond=1e-9)
        drawn = np.array([self.draft.signed(0.2, 2) for _ in names])
        values = drawn - inverse @ (still + slopes @ drawn)
        for _ in range(2):  # to the last digits
            values = values - inverse @ rates(values)
        left = np.abs(rates(values)).max(initial=0.0)
        if left > BALANCED * max(1.0, np.abs(still).max(initial=0.0)):
            raise RuntimeError(f"{module.name}: forces along all joints leave accelerations of {left:.2g}")
        return dict(zip(names, values.tolist(), strict=True))

    def _examine(self, module: Any, x: np.ndarray, params: dict[str, float], inputs: np.ndarray) -> None:
        """Raise IllConditioned for a mechanism whose equations lose digits."""
        t, p = self.draft.t, module.parameters(params)
        M = module.evaluate("mass_matrix", t, x, p)
        if module.metadata.constraints:
            positions, speeds, Z = ranks(module, t, x, p, WELL_CONDITIONED, IllConditioned)
            M = Z.T @ M @ Z
            if any(ranks(module, t, near, p)[:2] != (positions, speeds) for near in self._near(module, x, p)):
                raise IllConditioned("the configuration is singular: constraints have another rank next to it")
        if not len(M):
            raise IllConditioned("nothing is left to move")
        if np.linalg.cond(M) > HEAVY or np.linalg.eigvalsh(M)[0] <= 0:
            raise IllConditioned("the mass matrix is nearly singular")
        rates = module.rhs(t, x, p, inputs)
        if np.abs(rates).max() > WILD or max(map(abs, params.values()), default=0.0) > WILD:
            raise IllConditioned("forces are large")

    def _near(self, module: Any, x: np.ndarray, p: np.ndarray) -> Iterator[np.ndarray]:
        """States on the constraints a little away."""
        n_q, n_u = module.metadata.sizes.q, module.metadata.sizes.u
        N = module.evaluate("N", self.draft.t, x, p)
        for _ in range(2):
            near = x.copy()
            near[:n_q] += N @ np.array([self.rng.uniform(-NEAR, NEAR) for _ in range(n_u)])
            try:
                yield consistent_state(module, self.draft.t, near, p, x)
            except OffConstraints as error:
                raise IllConditioned(str(error)) from None
