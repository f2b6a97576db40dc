"""Checks the symbols of a description: what is a coordinate, a speed, a parameter or an input, and where each may be used."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import sympy as sp

from symdyn.counting import counted
from symdyn.model.closures import Constraint
from symdyn.model.faults import NAME, Faults
from symdyn.model.joints import Joint
from symdyn.model.loop_check import constraint_faults
from symdyn.model.quantity import Quantity, of_speeds
from symdyn.model.record import joint_speeds
from symdyn.model.symbols import Acceleration, Coordinate, GivenMotion, Input, Rate, described, symbols_of, time, with_rates
from symdyn.model.uses import Scope, Use
from symdyn.shown import shown

if TYPE_CHECKING:
    from symdyn.model.system import System

Symbols = tuple[sp.Symbol, ...]


def check_coordinates(s: System, joints: Sequence[Joint], faults: Faults) -> tuple[Symbols, Symbols]:
    """Coordinates and speeds of a system, in order; what is wrong with them is added to the faults."""
    driver: dict[sp.Symbol, Joint] = {}
    coordinates: list[sp.Symbol] = []
    speeds: list[sp.Symbol] = []
    for joint in joints:
        independent = [isinstance(q, Coordinate) for q in joint.coordinates]
        if joint.symbols_only and not all(independent) and not joint.faults:
            faults.append(f"joint {shown(joint.name)}: {joint.symbols_only}")
        for index, q in enumerate(joint.coordinates):
            if not isinstance(q, Coordinate):
                continue
            if q in driver:
                independent[index] = False
                faults.append(
                    f"joints {shown(driver[q].name)} and {shown(joint.name)} both drive the coordinate {q}; give each its own, "
                    f"or write one as an expression (gear: 2*{q}; mimic: sympy.UnevaluatedExpr({q}))")
                continue
            driver[q] = joint
            coordinates.append(q)
        if not joint.symbols_only:
            speeds += [u for u, free in zip(joint_speeds(joint), independent, strict=True) if free]
        else:
            speeds += [u for u in joint_speeds(joint) if u is not None]
    for q in dict.fromkeys(s.extra_coordinates):
        if q in driver:
            faults.append(f"{q} was given to add_coordinate, but joint {shown(driver[q].name)} has it for its own; "
                          "leave out add_coordinate")
        else:
            coordinates.append(q)
            speeds.append(q.dot)
    for u, count in Counter(speeds).items():
        if count > 1:
            faults.append(f"the speed {u} belongs to {count} joints; give each a name of its own")
    distinct = tuple(dict.fromkeys(coordinates)), tuple(dict.fromkeys(speeds))
    states = [z.symbol for z in s.states]
    for symbol, count in Counter([*distinct[0], *distinct[1], *dict.fromkeys(states)]).items():
        if count > 1:
            roles = [role for role, members in (("a coordinate", distinct[0]), ("a speed", distinct[1]),
                                                ("a state", states)) if symbol in members]
            faults.append(f"{symbol} is {' and '.join(roles)} at once; give each a symbol of its own")
    if s.bodies and s.joints and not coordinates and not states and not any(j.faults for j in s.joints):
        faults.append("no joint has a coordinate of its own, so nothing can move; give one a coordinate: "
                      "sd.coordinates('q')")
    return distinct


def chosen_speeds(s: System, coordinates: Symbols, own: Symbols, faults: Faults) -> tuple[Symbols, tuple[Constraint, ...]]:
    """The speeds that are chosen in place of the joints' own, and the velocity constraints that they fulfil."""
    chosen = tuple(s.chosen_speeds)
    taken = {*coordinates, *[z.symbol for z in s.states]}
    faults += [f"set_speeds was given {u}, which is {'a coordinate' if u in coordinates else 'a state'} already; make another "
               f"symbol with sd.speeds" for u in chosen if u in taken]
    faults += [f"set_speeds was given {u}, which is the speed of a joint already; make another symbol with sd.speeds"
               for u in chosen if u in own]
    moving = {*own, *[q.dot for q in coordinates]}
    of_motion = tuple(c for c in s.constraints if any(a in moving or of_speeds(a) for a in symbols_of(c.expression)))
    if len(chosen) == len(own):
        return chosen, ()
    if len(chosen) + len(of_motion) != len(own):
        faults.append(f"set_speeds was given {counted(len(chosen), 'speed')}, the joints have {len(own)}; pass as many"
                      + (f", or {len(own) - len(of_motion)}, which fulfil the velocity constraints "
                         f"{', '.join(c.name for c in of_motion)}" if of_motion else ""))
        return chosen, ()
    return chosen, of_motion


def check_symbols(s: System, joints: Sequence[Joint], used: Iterable[Use], coordinates: Symbols, speeds: Symbols,
                  faults: Faults) -> tuple[Symbols, Symbols]:
    """Parameters and inputs in order of their use, see `uses`; symbols that stand where they must not are added to the faults."""
    moving = {time, *coordinates, *[q.dot for q in coordinates], *speeds, *s.chosen_speeds, *[z.symbol for z in s.states]}
    named = {symbol.name: symbol for symbol in [*moving, *(s.declared or ())]}
    parameters: dict[sp.Symbol, None] = dict.fromkeys(s.declared or ())
    inputs: dict[sp.Symbol, None] = {}
    for where, expressions, scope in used:
        constant = scope == Scope.PARAMETERS
        for symbol in symbols_in(expressions):
            if isinstance(symbol, Quantity):
                faults += _quantity_faults(symbol, where, scope, s.planar)
            elif isinstance(symbol, Acceleration):
                faults.append(f"{where} uses the acceleration {symbol}; loads and rates may use coordinates, "
                              "speeds, states, inputs and t")
            elif symbol.name == "t" and symbol != time:
                faults.append(f"{where} uses a symbol t with assumptions, which is not the time; use symdyn.t")
            elif constant and (symbol in moving or isinstance(symbol, (Coordinate, Rate, Input))):
                moved = ", and a joint of its own for what moves, such as a Prismatic" if where.startswith("joint ") else ""
                faults.append(f"{where} depends on {symbol}, but must be constant; use parameters and numbers{moved}")
            elif symbol in moving:
                continue
            elif isinstance(symbol, (Coordinate, Rate)) and symbol.name in named:
                faults.append(f"{where} uses {symbol}, {described(symbol)}, but {symbol} of the system is "
                              f"{described(named[symbol.name])}; use the same symbol in both (SymPy's q(t) stands for a "
                              "coordinate without assumptions)")
            elif isinstance(symbol, (Coordinate, Rate)):
                result = ", ".join(map(str, coordinates)) or "none"
                faults.append(f"{where} uses {symbol}, which no joint and no state drives; coordinates: {result}; "
                              f"give {symbol} a joint, or system.add_coordinate({symbol}) where it stands in expressions of "
                              "joints alone, or use a parameter or input in its place")
            elif isinstance(symbol, Input):
                inputs[symbol] = None
            elif s.declared is not None and symbol not in s.declared:
                declared = ", ".join(map(str, s.declared)) or "none"
                faults.append(f"{where} uses the symbol {symbol}, not declared in the model; declared: {declared}; "
                              f"add {symbol} to the parameters or remove it")
            else:
                parameters[symbol] = None
    states = {z.symbol for z in s.states}
    faults += constraint_faults(s.constraints, moving - states - {time}, states, speeds)
    for joint in joints:
        for q in joint.coordinates:
            rates = [] if isinstance(q, Coordinate) else [
                a for a in symbols_in([q]) if a in speeds or a in states or isinstance(a, Rate) or _no_position(a)]
            if rates:
                faults.append(f"joint {shown(joint.name)}: its coordinate {q} uses {', '.join(map(str, rates))}; "
                              "a dependent coordinate may use coordinates, motions, t and parameters")
    if s.ground_motion is not None:
        free = [a for a in symbols_in(s.ground_motion.coordinates) if a in moving - {time} or _no_position(a)]
        if free:
            faults.append(f"move_ground uses {', '.join(map(str, free))}; pass given functions of t, motions and parameters")
    given = with_rates(inputs)
    everything = dict.fromkeys([*coordinates, *speeds, *s.chosen_speeds, *[z.symbol for z in s.states], *parameters, *given])
    names = Counter(a.name for a in everything)
    for name, count in names.items():
        if count > 1:
            result = " and ".join(described(a) for a in everything if a.name == name)
            plain = any(type(a) is sp.Symbol for a in everything if a.name == name)
            moves = plain and any(isinstance(a, Coordinate) for a in everything if a.name == name)
            once = f", by sd.coordinates({name!r}) where it moves," if moves else ","
            faults.append(f"{count} different symbols are named {shown(name)} (by kind or assumptions), {result}; "
                          f"make each symbol once{once} or give them different names")
    if "t" in names:
        faults.append("a coordinate, speed or state is named 't', which is the time; give it another name")
    for u in speeds:
        if f"{u.name}_dot" in names:
            faults.append(f"the name {shown(u.name + '_dot')} stands for the derivative of the speed {u}; "
                          "give the other symbol of this name another one")
    spelling(faults, "the symbols", names)
    return tuple(parameters), given


def _no_position(symbol: sp.Symbol) -> bool:
    """Whether a symbol is an input that a position cannot follow, because its rate is not known: any but a motion."""
    return isinstance(symbol, Input) and not isinstance(symbol, GivenMotion)


def _quantity_faults(quantity: Quantity, where: str, scope: Scope, planar: bool) -> list[str]:
    """Fault of a quantity in an expression of some scope."""
    measure, faults = quantity.measure, []
    if scope == Scope.PARAMETERS:
        faults.append(f"{where} depends on {quantity}, but must be constant; use parameters and numbers")
    elif scope == Scope.COORDINATES:
        faults.append(f"{where} uses {quantity}; it may use coordinates, t and parameters: pass what is to hold to "
                      "add_constraint")
    elif quantity.level == 2 and scope < Scope.FORCES:
        faults.append(f"{where} uses {quantity}, which follows from the forces; accelerations of points, multipliers and "
                      "reactions may stand in forces, torques, joint forces, rates of states, events, resets and outputs")
    if planar:
        axes = {"position": (0, 1), "angular_velocity": (2,), "reaction": (0, 1, 5)}.get(measure.kind)
        if axes is not None and measure.index[0] not in axes:
            faults.append(f"{where} uses {quantity}, which is zero in a planar system; components there are "
                          f"{', '.join(f'[{k}]' for k in axes)}")
    return faults


def spelling(faults: Faults, what: str, names: Iterable[Any]) -> None:
    """Names must be text that can stand in the comments of generated code."""
    for name in names:
        if not isinstance(name, str) or not NAME.fullmatch(name):
            faults.append(f"one of {what} is named {shown(name)}; pass text on one line of letters, digits, spaces and "
                          "_ . , : + - * / ^ ' # % and brackets")


def symbols_in(expressions: Iterable[sp.Expr]) -> list[sp.Symbol]:
    """Free symbols in order of the expressions, by name within one expression."""
    result: dict[sp.Symbol, None] = {}
    for e in expressions:
        for symbol in sorted(symbols_of(e), key=lambda a: a.name):
            result[symbol] = None
    return list(result)
