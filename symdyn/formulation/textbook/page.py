"""Quantities of the lecture's pages, link by link, as quantities that equations can print."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np

from symdyn.errors import SymdynError
from symdyn.formulation.algebra import accelerations_of
from symdyn.formulation.loads.recorded import Applied, Loads
from symdyn.formulation.names import OfLink
from symdyn.formulation.textbook.bias import gravity_load
from symdyn.formulation.textbook.center_frame import AtCenter, at_center
from symdyn.formulation.textbook.coriolis import Coriolis, coriolis, given_motions
from symdyn.formulation.textbook.forward_dynamics import ForwardDynamics, forward_dynamics
from symdyn.formulation.textbook.inverse_dynamics import InverseDynamics, inverse_dynamics
from symdyn.formulation.textbook.momentum import Momentum, momentum
from symdyn.formulation.textbook.own_speeds import own_speeds
from symdyn.formulation.textbook.velocities import generalized, joint_accelerations
from symdyn.formulation.trees.tree import Tree
from symdyn.spatial.vectors import vector


class Page:
    """The recursions of a tree, each recorded once, when one of its quantities is first requested.

    Quantities of link k = 1, 2, ... (in the order of tree.links; bodies on fixed joints belong to the link before them), in space
    also for planar systems:

    X_k, X_star_k   (6, 6) from the parent's frame to the link's (motions), from the link's to the parent's (forces)
    S_k, S_ring_k   (6, n) motion subspace and its apparent rate of change; I_k (6, 6)
    v_k, c_k, p_k   (6,) velocity, velocity products of acceleration and force
    a_k, f_k        (6,) for given u_dot: acceleration with a_0 = [0; -g], which stands for the weights; force through the joint
    I_A_k, p_A_k    (6, 6), (6,) articulated inertia and bias force, for the forces that the loads exert along the joints
    v_G_k, a_G_k, f_G_k   (6,) in the frame at the centre of mass; f_G the resultant on the link, weight counted as in a

    Quantities of the whole tree: coriolis (n_u, n_u), gravity_load (n_u,), momentum and momentum_G (6,), center_of_mass (3,); see
    their modules. page_inverse_dynamics and page_accelerations (n_u,): what these recursions give for inverse_dynamics and
    accelerations, which code is made from; they are compared in symdyn.verification.
    `notes` says what the mechanism does not have, and why.
    """

    def __init__(self, tree: Tree, loads: Loads) -> None:
        self.tree, self.loads = tree, loads
        self.u_dot = vector(*accelerations_of(tree.model.speeds, tree.algebra.recorder, tree.algebra.leaves))
        self.notes: list[str] = []
        try:
            own_speeds(tree)
            self.propagates = True
        except SymdynError as error:
            self.propagates = False
            self.notes.append(f"no I_A, p_A: {error}")
        self.given = given_motions(tree)
        if self.given:
            self.notes.append(f"no Coriolis matrix: joints {', '.join(self.given)} follow given functions of time")

    # -- the recursions

    @cached_property
    def applied(self) -> Applied:
        return self.loads.applied()

    @cached_property
    def inverse(self) -> InverseDynamics:
        return inverse_dynamics(self.tree, joint_accelerations(self.tree, self.u_dot), wrenches=self.applied.wrenches)

    @cached_property
    def forward(self) -> ForwardDynamics:
        return forward_dynamics(self.tree, self.applied.joint, self.applied.wrenches)

    @cached_property
    def centers(self) -> list[AtCenter]:
        i = self.inverse
        return [at_center(link.inertia, *vectors)
                for link, *vectors in zip(self.tree.links, i.velocities.v, i.a, i.f_B, strict=True)]

    @cached_property
    def momenta(self) -> Momentum:
        return momentum(self.tree)

    @cached_property
    def of_coriolis(self) -> Coriolis:
        return coriolis(self.tree)

    # -- by name

    def quantities(self) -> dict[str, Callable[[], Any]]:
        """name -> function that records it."""
        named: dict[str, Callable[[], Any]] = {}
        for k in range(len(self.tree.links)):
            named |= {OfLink(name, k + 1).name: record for name, record in self._of_link(k).items()}
        own: dict[str, Callable[[], Any]] = {
            "gravity_load": lambda: gravity_load(self.tree).load, "momentum": lambda: self.momenta.h_0,
            "momentum_G": lambda: self.momenta.h_G, "center_of_mass": lambda: self.momenta.center}
        if not self.loads.implicit:
            own["page_inverse_dynamics"] = lambda: generalized(self.tree, self.inverse.tau - self.applied.joint)
            if self.propagates:
                own["page_accelerations"] = lambda: self.forward.u_dot
        if not self.given:
            own["coriolis"] = lambda: self.of_coriolis.C
        return {**named, **own}

    def _of_link(self, k: int) -> dict[str, Callable[[], np.ndarray]]:
        own: dict[str, Callable[[], np.ndarray]] = {
            letter: lambda letter=letter: getattr(self.inverse.velocities, letter)[k]  # type: ignore[misc]
            for letter in ("X", "X_star", "S", "S_ring", "I", "v", "c", "p")}
        own |= {"a": lambda: self.inverse.a[k], "f": lambda: self.inverse.f[k]}
        if self.propagates:
            own |= {"I_A": lambda: self.forward.I_A[k], "p_A": lambda: self.forward.p_A[k]}
        return own | {"v_G": lambda: self.centers[k].v_G, "a_G": lambda: self.centers[k].a_G, "f_G": lambda: self.centers[k].f_G}
