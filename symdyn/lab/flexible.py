"""`symdyn bench flexible`: figures of flexible bodies in whole systems, each compared with what it should be."""

from __future__ import annotations

import time as clock
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

import symdyn as sd
from symdyn.functions.tapes import function_tape
from symdyn.lab import flexible_cases as cases
from symdyn.lab import flexible_crank as crank
from symdyn.lab.figures import Figure, print_figures
from symdyn.systems.turbine_parts import published_tower_beam
from symdyn.timing.loops import compile_time, evaluation_time

# They were fitted to another model.
_PUBLISHED = "published shapes"


def rotating_beam() -> Iterator[Figure]:
    """Seven powers in either direction, against published frequencies."""
    for form, free in [*[(form, False) for form in cases.FORMS], ("embedded", True), ("recursive", True)]:
        module = cases.equations(cases.rotor(7, free), form).compile(backend="numpy")
        ratios = [cases.rotor_frequencies(module, speed) / cases.published(speed) for speed in cases.SPEEDS]
        off = np.abs(np.array(ratios) - 1).max(axis=2)
        what = f"rotating beam, {form}, {'free shaft' if free else 'prescribed angle'}"
        yield f"{what}: flap", float(off[:, 0].max()), "", "< 1e-3"
        yield f"{what}: lag", float(off[:, 1].max()), "", "< 1e-3"


def land_based() -> Iterator[Figure]:
    """First frequencies of the tower under rotor and nacelle."""
    system = sd.systems.land_wind_turbine(rotor="fixed", flexible="tower", wind=False, drives=False)
    head = cases.rotor_and_nacelle(system)
    systems = {"two modes each way (catalogue)": system, _PUBLISHED: cases.tower(published_tower_beam().shapes, *head)}
    for name, shapes in {"8 modes of the bare tower": 8, "20 modes of the bare tower": 20,
                         "4 modes with rotor and nacelle": cases.modes_with_head(4, *head)}.items():
        systems[name] = cases.tower(shapes, *head)
    for name, tower in systems.items():
        for way, f, reference, quoted in zip(("fore-aft", "side"), cases.tower_frequencies(tower), cases.TOWER_REFERENCE,
                                             cases.TOWER_QUOTED, strict=True):
            yield f"tower, {name}: {way}", f, "Hz", ""
            yield f"tower, {name}: {way} off 40 elements", abs(f / reference - 1), "", "" if name == _PUBLISHED else "< 0.002"
            yield f"tower, {name}: {way} off {quoted} Hz", f / quoted - 1, "", ""


def spun_up() -> Iterator[Figure]:
    """Spin-up, against rigid links and without foreshortening."""
    times = np.linspace(0, 20, 401)
    for load in (0.0, 5.0):
        what = f"spin-up, {load:g} kg at the tip" if load else "spin-up"
        chains = {n: cases.deflection(cases.spin_up_chain(n, load), times, n, 1e-7) for n in (10, 20, 40)}
        for n, y in chains.items():
            yield f"{what}: deepest deflection, {n} links", float(y.min()), "m", ""
        for count in (1, 2, 3, 4):
            y = cases.deflection(cases.spin_up(cases.spin_up_beam(count), load), times)
            yield f"{what}: deepest deflection, {count} shapes", float(y.min()), "m", ""
        yield f"{what}: 4 shapes off 40 links, all times", float(np.abs(y - chains[40]).max() / np.abs(y).max()), "", "< 0.03"
        yield f"{what}: largest deflection after 15 s", float(np.abs(y[times > 15]).max()), "m", ""
    lost = cases.deflection(cases.spin_up(cases.unstiffened(cases.spin_up_beam(3))), np.linspace(0, 15, 301))
    yield "spin-up without foreshortening: deflection at 15 s", float(np.abs(lost[-1])), "m", ""


def closed_loop() -> Iterator[Figure]:
    """Slider-crank with a flexible rod, which stretches by 8e-6 m in the reference, and not here."""
    for name, beam in (("kinematics of the source", crank.linear_rod()), ("with foreshortening", crank.rod())):
        result = crank.at_the_end(beam)
        for quantity, reference in crank.REFERENCE.items():
            wanted = "< 1e-3" if name.startswith("kin") else ""
            yield f"slider-crank, {name}: {quantity} off published", abs(result[quantity] / reference - 1), "", wanted


def tumbling() -> Iterator[Figure]:
    """Energy and motion of the thrown turbine."""
    forms = {f"{form}, {orientation}": cases.equations(cases.thrown(orientation), form)
             for orientation in ("angles", "parameters") for form in cases.FORMS[:2]}
    first = None
    for name, form in forms.items():
        module = form.compile()
        solution = cases.throw(module)
        first = first or solution
        yield f"thrown, {name}: energy error", solution.energy_error(), "", "<= 1e-8"
        yield f"thrown, {name}: motion off embedded, angles", cases.apart(first, solution), "", "< 1e-8"
        damped = cases.throw(module, params={"delta": 2.0})
        yield f"thrown, {name}: energy error with damping", damped.energy_error(), "", "<= 1e-8"
    for way in cases.FORMS[:2]:
        module = forms[f"{way}, parameters"].compile()
        result = cases.momenta(module, cases.throw(module, params={"g": 0.0, "delta": 2.0}))
        off = np.abs(result - result[0]).reshape(-1, 2, 3).max(axis=(0, 2)) / np.linalg.norm(result[0].reshape(2, 3), axis=1)
        yield f"thrown without gravity, {way}: change of momentum", float(off[0]), "", "< 1e-9"
        yield f"thrown without gravity, {way}: change of angular momentum", float(off[1]), "", "< 1e-9"
    for name, form in forms.items():
        yield f"thrown, {name}: failed checks", sum(c.passed is False for c in form.verify(states=1).checks), "", "<= 0"


def limits() -> Iterator[Figure]:
    """Closed forms of statics, and the rigid turbine as the limit of the stiff one."""
    for count in (2, 3, 4):
        module = cases.column(cases.powers("x", count), 1e-9, 1.0).embedding().compile(backend="numpy")
        load = cases.buckling_load(module, 1, 4)
        off_load = abs(load / (np.pi**2 / 4) - 1)
        yield f"buckling load, {count} shapes, off pi^2 EI / 4 L^2", off_load, "", "< 1e-3" if count > 2 else ""
    options: dict[str, Any] = {"rotor": "fixed", "wind": False}
    numbers = cases.rigid_numbers()
    rigid = cases.platform_frequencies(sd.systems.floating_wind_turbine(**options).embedding().compile(backend="numpy"), numbers)
    module = sd.systems.floating_wind_turbine(flexible=True, **options).embedding().compile(backend="numpy")
    factors = (1.0, 1e2, 1e4)
    off = [np.abs(cases.platform_frequencies(module, {"s_T": k, "s_B": k}) / rigid - 1).max() for k in factors]
    for k, value in zip(factors, off, strict=True):
        yield f"floating turbine, platform frequencies off rigid, stiffness times {k:g}", float(value), "", ""
    yield "its order in 1 / stiffness, less 1", float(abs(np.log10(off[1] / off[2]) / 2 - 1)), "", "< 1e-3"


def floating() -> Iterator[Figure]:
    """The floating turbine with flexible tower and blades."""
    options: dict[str, Any] = {"flexible": True, "wind": False}
    system = sd.systems.floating_wind_turbine(**options)
    quasi = sd.systems.floating_wind_turbine(orientation="parameters", **options)
    for name, value in cases.agreement(system, quasi, 1000).items():
        yield f"floating turbine, accelerations, {name}", value, "", "< 1e-10" if name != "constraints" else ""
    for form in cases.FORMS:
        begun = clock.perf_counter()
        result = cases.equations(sd.systems.floating_wind_turbine(flexible=True), form)
        tape = function_tape(result, "rhs")
        yield f"floating turbine, {form}: describe and derive", clock.perf_counter() - begun, "s", ""
        yield f"floating turbine, {form}: operations", tape.operations, "", ""
        yield f"floating turbine, {form}: compile with integrator", compile_time(result), "s", ""
        yield f"floating turbine, {form}: one evaluation", evaluation_time(result) * 1e6, "us", ""
        if form == "absolute":
            continue
        module = result.compile()
        runs = [module.simulate(t=(0, 600), q={"theta": 0.05, "z": 0.2, "x": 0.5}, rtol=1e-8) for _ in range(3)]
        yield f"floating turbine, {form}: 600 s, rtol 1e-8", min(run.integrator_seconds or run.seconds for run in runs), "s", ""
        started = module.simulate(t=(0, 60), inputs={"v_w": 8.0, "tau_a": 2e6}, work=True, rtol=1e-9)
        yield f"floating turbine, {form}: energy error of a start-up", started.energy_error(), "", "<= 1e-8"


GROUPS = (rotating_beam, land_based, spun_up, closed_loop, tumbling, limits, floating)


def run(only: Sequence[str] | None = None) -> int:
    """Print the figures, or those of some groups; returns the number of those that miss their bound."""
    return print_figures(GROUPS, only, 79)
