"""The catalogue and its types, for editors and type checkers; see __init__.py, which imports each mechanism when it is used."""

from symdyn.model.system import System
from symdyn.systems.absolute import particle_on_moving_slope as particle_on_moving_slope
from symdyn.systems.absolute import pendulum_absolute as pendulum_absolute
from symdyn.systems.absolute import vehicle_on_rotating_track_absolute as vehicle_on_rotating_track_absolute
from symdyn.systems.absolute import vehicle_on_track_absolute as vehicle_on_track_absolute
from symdyn.systems.arms import three_link_arm as three_link_arm
from symdyn.systems.arms import two_link_arm as two_link_arm
from symdyn.systems.axles import car_axis as car_axis
from symdyn.systems.bicycles import bicycle as bicycle
from symdyn.systems.carts import cart_pole as cart_pole
from symdyn.systems.chains import prismatic_chain as prismatic_chain
from symdyn.systems.chains import spatial_chain as spatial_chain
from symdyn.systems.cranes import floating_crane as floating_crane
from symdyn.systems.governors import flyball_governor as flyball_governor
from symdyn.systems.linkages import four_bar as four_bar
from symdyn.systems.linkages import n_four_bar as n_four_bar
from symdyn.systems.linkages import slider_crank as slider_crank
from symdyn.systems.pendulums import double_pendulum as double_pendulum
from symdyn.systems.pendulums import n_link_pendulum as n_link_pendulum
from symdyn.systems.pendulums import pendulum as pendulum
from symdyn.systems.platforms import stewart_platform as stewart_platform
from symdyn.systems.puma import puma560 as puma560
from symdyn.systems.rolling import rolling_disc as rolling_disc
from symdyn.systems.rolling import skate as skate
from symdyn.systems.rolling import sleigh as sleigh
from symdyn.systems.spatial_loops import bricard as bricard
from symdyn.systems.spatial_loops import spatial_slider_crank as spatial_slider_crank
from symdyn.systems.squeezers import andrews_squeezer as andrews_squeezer
from symdyn.systems.suspensions import double_wishbone as double_wishbone
from symdyn.systems.touching import rocking_block as rocking_block
from symdyn.systems.touching import simplest_walker as simplest_walker
from symdyn.systems.touching import woodpecker_toy as woodpecker_toy
from symdyn.systems.tracks import vehicle_on_rotating_track as vehicle_on_rotating_track
from symdyn.systems.tracks import vehicle_on_track as vehicle_on_track
from symdyn.systems.turbines import floating_wind_turbine as floating_wind_turbine
from symdyn.systems.turbines import land_wind_turbine as land_wind_turbine

def names(constrained: bool | None = None) -> list[str]: ...
def get(name: str, **options: object) -> System: ...
