"""The catalogue: mechanisms with numbers, ready to derive and run.

Each name is a function that returns a System with `.defaults` (a number in SI units for every parameter), `.initial`
(a start state) and `.duration` (s). `names()` lists them without loading any; `get(name, **options)` builds one.
"""

from __future__ import annotations

import difflib
import importlib
from typing import TYPE_CHECKING, Any

from symdyn.errors import SymdynError
from symdyn.shown import name_of, shown

if TYPE_CHECKING:
    from symdyn.model.system import System

# name -> module:function; text only, so that listing the names imports no SymPy. No module may bear the name of a
# function: loading it would put the module in the function's place.
_TREES = {
    "pendulum": "pendulums:pendulum",
    "double_pendulum": "pendulums:double_pendulum",
    "n_link_pendulum": "pendulums:n_link_pendulum",
    "cart_pole": "carts:cart_pole",
    "vehicle_on_track": "tracks:vehicle_on_track",
    "vehicle_on_rotating_track": "tracks:vehicle_on_rotating_track",
    "prismatic_chain": "chains:prismatic_chain",
    "spatial_chain": "chains:spatial_chain",
    "two_link_arm": "arms:two_link_arm",
    "three_link_arm": "arms:three_link_arm",
    "puma560": "puma:puma560",
    "flyball_governor": "governors:flyball_governor",
}
_CONSTRAINED = {
    "pendulum_absolute": "absolute:pendulum_absolute",
    "vehicle_on_track_absolute": "absolute:vehicle_on_track_absolute",
    "vehicle_on_rotating_track_absolute": "absolute:vehicle_on_rotating_track_absolute",
    "particle_on_moving_slope": "absolute:particle_on_moving_slope",
    "four_bar": "linkages:four_bar",
    "slider_crank": "linkages:slider_crank",
    "n_four_bar": "linkages:n_four_bar",
    "andrews_squeezer": "squeezers:andrews_squeezer",
    "car_axis": "axles:car_axis",
    "bricard": "spatial_loops:bricard",
    "spatial_slider_crank": "spatial_loops:spatial_slider_crank",
    "double_wishbone": "suspensions:double_wishbone",
    "rolling_disc": "rolling:rolling_disc",
    "skate": "rolling:skate",
    "sleigh": "rolling:sleigh",
    "bicycle": "bicycles:bicycle",
    "stewart_platform": "platforms:stewart_platform",
}
_FLOATING = {
    "floating_wind_turbine": "turbines:floating_wind_turbine",
    "land_wind_turbine": "turbines:land_wind_turbine",
    "floating_crane": "cranes:floating_crane",
}
_TOUCHING = {
    "simplest_walker": "touching:simplest_walker",
    "rocking_block": "touching:rocking_block",
    "woodpecker_toy": "touching:woodpecker_toy",
}
_CATALOGUE = {**_TREES, **_CONSTRAINED, **_FLOATING, **_TOUCHING}

__all__ = [*_CATALOGUE, "get", "names"]


def names(constrained: bool | None = None) -> list[str]:
    """The names of the catalogue.

    constrained   True: of mechanisms with loops or constraints only; False: of trees only; those that float, with the loads
                  of water and wind, and those that touch are in neither

    >>> sd.systems.names(constrained=False)[:3]
    ['pendulum', 'double_pendulum', 'n_link_pendulum']
    """
    return list(_CATALOGUE if constrained is None else _CONSTRAINED if constrained else _TREES)


def get(name: str, **options: object) -> System:
    """The system of this name, with the options of its function.

    Raises SymdynError for a name that the catalogue does not have.

    >>> sd.systems.get("n_link_pendulum", n=3).name
    'n_link_pendulum_3'
    """
    if not isinstance(name, str) or name not in _CATALOGUE:
        near = difflib.get_close_matches(name_of(name), _CATALOGUE, n=3, cutoff=0.5)
        hint = f"did you mean {' or '.join(near)}? It has" if near else "it has"
        raise SymdynError(f"the catalogue has no system {shown(name)}; {hint} {', '.join(_CATALOGUE)}")
    return _function(name)(**options)


def _function(name: str) -> Any:
    module, function = _CATALOGUE[name].split(":")
    return getattr(importlib.import_module(f"symdyn.systems.{module}"), function)


def __getattr__(name: str) -> Any:
    if name in _CATALOGUE:
        return _function(name)
    raise AttributeError(f"symdyn.systems has no {name!r}; it has {', '.join(sorted(__all__))}")


def __dir__() -> list[str]:
    return sorted(__all__)
