"""The mechanisms of `symdyn bench --all`, and how a name becomes what is measured."""

from __future__ import annotations

import difflib
import inspect
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from symdyn import systems
from symdyn.bench.work import closed_forms
from symdyn.bench.work.bodies import free_body, heavy_top, lagrange_top
from symdyn.bench.work.system_under_test import SystemUnderTest
from symdyn.errors import ArgumentError
from symdyn.formulation.equations import Equations
from symdyn.model.system import System
from symdyn.options import wrong_option

_ORIENTATION = "orientation"
_ORIENTATIONS = ("angles", "parameters")
# m/s, of the turbine.
_WIND = 8.0


class Unknown(ArgumentError):
    """A name that stands for no mechanism."""


@dataclass(frozen=True)
class Case:
    """One mechanism of the list.

    make     gives the system, or its name in the catalogue; options: of it
    end      s (default: the system's duration)
    closed   closed form of the motion in the coordinates of the first formulation, with its source
    """

    make: str | Callable[..., System]
    options: Mapping[str, Any] = field(default_factory=dict)
    end: float | None = None
    closed: Callable[[Sequence[float]], Any] | None = None
    source: str = ""

    def maker(self) -> Callable[..., System]:
        """The function that gives the system."""
        return getattr(systems, self.make) if isinstance(self.make, str) else self.make  # type: ignore[no-any-return]


def turbine_in_wind(orientation: str = "angles") -> System:
    """The catalogue's floating turbine in a steady wind that begins at once."""
    system = systems.get("floating_wind_turbine", orientation=orientation)
    system.initial = {**system.initial, "v_w": _WIND}
    return system


CASES: dict[str, Case] = {
    "pendulum": Case("pendulum", closed=closed_forms.pendulum, source="Jacobi's elliptic functions at 25 digits"),
    "double_pendulum": Case("double_pendulum"),
    "n_link_pendulum(5)": Case("n_link_pendulum", {"n": 5}),
    "spatial_chain(6)": Case("spatial_chain", {"n": 6}, end=3.0),
    "puma560": Case("puma560"),
    "four_bar": Case("four_bar"),
    "slider_crank": Case("slider_crank"),
    "andrews_squeezer": Case("andrews_squeezer"),
    "car_axis": Case("car_axis"),
    "bricard": Case("bricard"),
    "n_four_bar(2)": Case("n_four_bar", {"n": 2}, end=10.0),
    "flyball_governor": Case("flyball_governor", end=1.0),
    "lagrange_top": Case(lagrange_top, closed=closed_forms.lagrange_top,
                         source="elliptic functions, precession and spin by quadrature at 25 digits"),
    "heavy_top": Case(heavy_top),
    "torque_free_body": Case(free_body, closed=closed_forms.free_body,
                             source="elliptic functions, precession by quadrature at 25 digits"),
    "floating_wind_turbine": Case(turbine_in_wind, end=30.0),
}


def known() -> list[str]:
    """Every name that can be measured, besides options in parentheses."""
    return list(dict.fromkeys([*CASES, *systems.names()]))


def named(name: str, options: Mapping[str, Any] | None = None) -> Case:
    """The mechanism of a name of the list, of the catalogue, or of the catalogue with its first option in parentheses, such as
    n_link_pendulum(7).

    options   besides, such as {"n": 7}
    Raises Unknown for a name that there is not, ArgumentError for options that it does not take.
    """
    case, options = CASES.get(name), dict(options or {})
    if case is None:
        result = re.fullmatch(r"(\w+)(?:\((\w+)\))?", name)
        if result is None or result[1] not in systems.names():
            near = difflib.get_close_matches(name, known(), 3)
            hint = f"did you mean {' or '.join(near)}? There are" if near else "there are"
            raise Unknown(f"there is no mechanism {name!r}; {hint} {', '.join(known())}")
        case = Case(result[1])
        if result[2]:
            first = next(iter(inspect.signature(case.maker()).parameters), None)
            if first is None:
                raise ArgumentError(f"{result[1]} takes no option, found {name!r}")
            if first in options:
                raise ArgumentError(f"the option {first} is given twice: {name} and {first}={options[first]}")
            options[first] = int(result[2]) if result[2].isdigit() else {"True": True, "False": False}.get(result[2], result[2])
    wrong = wrong_option(name.partition("(")[0], case.maker(), options)
    if wrong:
        raise ArgumentError(wrong)
    # The known motion is that with the usual options.
    return replace(case, options={**case.options, **options}, closed=None, source="") if options else case


def title(name: str, options: Mapping[str, Any] | None = None) -> str:
    """Title by which files of a mechanism with these options are named."""
    return file_name("_".join((name, *(f"{key}_{value}" for key, value in (options or {}).items()))))


def named_case(name: str, end: float | None = None, options: Mapping[str, Any] | None = None) -> SystemUnderTest:
    """System measured under a name; name, options and errors as of `named`."""
    case = named(name, options)
    made = from_maker(title(name, options), case.maker(), case.end if end is None else end, case.options)
    return replace(made, closed=case.closed, source=case.source)


def taken(system: Any, end: float | None = None) -> SystemUnderTest:
    """System measured for a system, for equations or under a name.

    Raises ArgumentError for anything else.
    """
    if isinstance(system, str):
        if system.endswith(".py"):
            raise ArgumentError(f"{system} is the name of a file; pass the System that its function system() returns")
        return named_case(system, end)
    if isinstance(system, System):
        return of_system(system, end)
    if isinstance(system, Equations):
        return of_equations(system, end)
    raise ArgumentError(f"the bench takes a System, equations or a name of the catalogue, found {system!r}")


def from_maker(name: str, make: Callable[..., System], end: float | None = None,
               options: Mapping[str, Any] | None = None) -> SystemUnderTest:
    """System measured for a function that makes it: if it has an option `orientation`, with Euler angles and with
    Euler parameters."""
    options = dict(options or {})
    takes = {p.name: p.default for p in inspect.signature(make).parameters.values()}
    both = _ORIENTATION in takes and takes[_ORIENTATION] in _ORIENTATIONS and _ORIENTATION not in options
    variants = {v: make(**options, **({_ORIENTATION: v} if both else {})) for v in (_ORIENTATIONS if both else ("",))}
    return SystemUnderTest(name, variants, float(next(iter(variants.values())).duration if end is None else end))


def of_system(system: System, end: float | None = None) -> SystemUnderTest:
    """System under test for one system."""
    return SystemUnderTest(file_name(system.name), {"": system}, float(system.duration if end is None else end))


def of_equations(equations: Equations, end: float | None = None) -> SystemUnderTest:
    """System under test for equations, such as those of sd.embedding."""
    return SystemUnderTest(file_name(equations.name), {}, float(equations.symbols.duration if end is None else end),
                           given=equations)


def file_name(name: str) -> str:
    """A name without parentheses, for files."""
    return re.sub(r"\W+", "_", name).strip("_")
