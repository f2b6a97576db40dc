"""Numbers of the NREL 5-MW turbine on the ITI Energy barge: each with its source, or with what is assumed.

Sources
  [1] J. Jonkman, S. Butterfield, W. Musial, G. Scott: Definition of a 5-MW Reference Wind Turbine for Offshore System
      Development, NREL/TP-500-38060, 2009
  [2] J. Jonkman: Dynamics Modeling and Loads Analysis of an Offshore Floating Wind Turbine, NREL/TP-500-41958, 2007
  [3] OpenFAST regression tests, 5MW_ITIBarge_DLL_WTurb_WavesIrr: input files of ElastoDyn, ServoDyn and HydroDyn, and the summary
      that ElastoDyn writes of the masses
  [4] DNV-RP-C205: Environmental Conditions and Environmental Loads, appendix D
Values without a source are marked "assumed". Undocumented moments of inertia are zero, as in [3].
"""

from __future__ import annotations

import math
from typing import NamedTuple

# -- surroundings

GRAVITY = 9.80665  # m/s^2 [3]
WATER_DENSITY = 1025.0  # kg/m^3 [3]
AIR_DENSITY = 1.225  # kg/m^3 [3]

# -- platform [2, 3]: its origin O is in the still water plane when it is not displaced

PLATFORM_MASS = 5_452_000.0  # kg
PLATFORM_COM = -0.281768  # m, height of its centre of mass above O
PLATFORM_INERTIA = (726.9e6, 726.9e6, 1453.9e6)  # kg m^2 about the centre of mass: roll, pitch, yaw
# The hull is 40 m x 40 m x 10 m with a moonpool of 10 m x 10 m through it, and 4 m deep [2]. In [3] stand its depth of 4 m, the
# 6000 m^3 that it then displaces, (1600 - 100) m^2 times 4 m, and a drag plate of the area of 1600 m^2.
HULL = (40.0, 40.0, 10.0)
MOONPOOL = (10.0, 10.0, 10.0)
BALLAST_WAY = 30.0  # m, assumed: between the middles of tanks at opposite sides of the hull
HULL_CENTER = 1.0  # m, height of the hull's middle above O: from -4 m to 6 m

# -- tower: the land-based one of [1], 87.6 m high, on the barge. Its foot is at O, in the water plane [3: TowerBsHt = 0], so that
# the hub is 90 m above the water. The masses show that it is this tower: 5,452,000 + 347,460.232 + 350,000.245 is the total of
# 6,149,460.477 kg in [3].

TOWER_HEIGHT = 87.6  # m
TOWER_MASS = 347_460.232  # kg
# The mass per length of the table of [1] is linear between its stations; its moments, by exact integration:
TOWER_COM = 38.1781960402285  # m, above the foot
TOWER_INERTIA = 213_410_657.851  # kg m^2 about the centre of mass, across the tower; about its axis zero

# -- nacelle [1, 3]: its origin is on the tower's top, on the yaw axis

NACELLE_MASS = 240_000.0  # kg
NACELLE_COM = (1.9, 1.75)  # m, x downwind and z upward
NACELLE_YAW_INERTIA = 2_607_890.0 - NACELLE_MASS * 1.9**2  # kg m^2; published about the yaw axis, here about the centre of mass
YAW_STIFFNESS = 9_028.32e6  # N m/rad, of the yaw drive
YAW_DAMPING = 19.16e6  # N m s/rad

# -- rotor [1, 3]

SHAFT_HEIGHT = 1.96256  # m, of the shaft above the tower's top, on the yaw axis
OVERHANG = -5.0191  # m, from the yaw axis along the shaft to the rotor's apex; negative: upwind
TILT = math.radians(-5.0)  # of the shaft; negative: the upwind end is higher
CONE = math.radians(-2.5)  # of the blades; negative: the tips are upwind
HUB_MASS = 56_780.0  # kg; its centre of mass is at the apex [3: HubCM = 0]
HUB_INERTIA = 115_926.0  # kg m^2 about the shaft
HUB_RADIUS = 1.5  # m, from the apex to the blades' roots
ROTOR_RADIUS = 63.0  # m, from the apex to the tips
BLADE_MASS = 17_740.082  # kg, as ElastoDyn sums it in [3]
BLADE_FIRST_MOMENT = 363_231.325  # kg m, from the root
BLADE_SECOND_MOMENT = 11_776_046.297  # kg m^2, from the root, across the blade; about its axis zero
BLADE_COM = BLADE_FIRST_MOMENT / BLADE_MASS
BLADE_INERTIA = BLADE_SECOND_MOMENT - BLADE_FIRST_MOMENT**2 / BLADE_MASS
GENERATOR_INERTIA = 534.116  # kg m^2, about the fast shaft
GEAR_RATIO = 97.0
RATED_SPEED = 12.1 * math.pi / 30  # rad/s, of the rotor
RATED_WIND = 11.4  # m/s [1]

# -- wind: coefficients on given areas

THRUST_COEFFICIENT = 0.75  # assumed: about that of a rotor at its best; below the rated wind only
# Drag: coefficient (assumed), area in m^2, height in m of the area's middle above the body's origin.
_DECK, _BOTTOM, _TOP = 6.0, 5.854, 3.87  # m: the deck's height, and the tower's diameter there and at its top [1]
TOWER_DRAG = (1.0, (_BOTTOM + _TOP) / 2 * (TOWER_HEIGHT - _DECK),
              _DECK + (TOWER_HEIGHT - _DECK) / 3 * (_BOTTOM + 2 * _TOP) / (_BOTTOM + _TOP))
NACELLE_DRAG = (1.0, 36.0, 1.75)  # assumed: a box 6 m wide and high

# -- mooring: eight catenary lines, see symdyn/systems/barge_mooring.py; here their force and stiffness at O of the undisplaced
# platform, in the order x, y, z, phi, theta, psi (N, N m; N/m, N, N m). The matrix of a prestressed mooring about a fixed point
# is not symmetric in the angles.

MOORING_FORCE = (0.0, 0.0, -2_059_383.205, 0.0, 0.0, 4780.130)
MOORING_STIFFNESS = (
    (15_933.4016, 0.0, 0.0, 51.1, 208_395.692, 0.0),
    (0.0, 15_933.4016, 0.0, -208_395.692, 51.1, 0.0),
    (0.0, 0.0, 24_957.276, 0.0, 0.0, -102.2),
    (51.1, -208_463.386, 0.0, 26_263_843.691, -2390.2, 0.0),
    (208_463.386, 51.1, 0.0, 2390.2, 26_263_843.691, 0.0),
    (0.0, 0.0, -102.2, 0.0, 0.0, 24_751_525.960),
)

# -- pictures only, assumed; with the tower's diameters of [1] and chords (m) as of its blade

TOWER_RADII = (3.0, 3.87 / 2)
NACELLE_SIZE, NACELLE_MIDDLE = (14.0, 5.0, 4.5), (3.0, 0.0, 2.0)
CHORDS = (3.5, 3.9, 4.6, 4.2, 3.7, 3.3, 2.9, 2.5, 2.1, 1.4)

# -- water: added mass and damping of the barge


class Coefficients(NamedTuple):
    """Coefficients of the six motions surge, sway, heave, roll, pitch, yaw about O, in body axes: the diagonals of 6 x 6
    matrices."""

    surge: float
    sway: float
    heave: float
    roll: float
    pitch: float
    yaw: float


def added_mass(side: float = HULL[0], draft: float = 4.0, density: float = WATER_DENSITY) -> Coefficients:
    """Assumed added mass (kg, kg m^2) of a square barge, from formulas of plates; no published check is at hand.

    heave         half of that of a thin square plate deep in water, 0.579 pi/4 density side^3 [4]: water is below only
    roll, pitch   as if that of heave were spread evenly over the bottom: side^2/12 times it
    surge, sway   a section as deep as the draft moves half of what a plate of twice the draft does: pi/2 density draft^2 side
    yaw           as if those of surge and sway were spread evenly along the sides
    Couplings between motions, the moonpool, and what depends on the frequency of waves are left out.
    """
    heave = 0.5 * 0.579 * math.pi / 4 * density * side**3
    surge = 0.5 * math.pi * density * draft**2 * side
    across = heave * side**2 / 12
    return Coefficients(surge, surge, heave, across, across, 2 * surge * side**2 / 12)


# Assumed linear damping (N s/m, N m s/rad): about 10 % of the critical one in heave, 5 % in the other motions.
DAMPING = Coefficients(3.4e4, 3.4e4, 3.6e6, 3.0e8, 3.0e8, 2.0e7)


WAVE_FREQUENCY = 2 * math.pi / 10.0  # rad/s
WAVE_AMPLITUDE = 1.0  # m
WAVE_LENGTH = 2 * math.pi * GRAVITY / WAVE_FREQUENCY**2  # m, in deep water
SEA = (160, 160)  # m, of which pictures show the surface


def wave_excitation(amplitude: float = WAVE_AMPLITUDE, frequency: float = WAVE_FREQUENCY,
                    draft: float = 4.0) -> tuple[Coefficients, Coefficients]:
    """Amplitudes (N, N m) and phases (rad) of the force about O of a regular wave along x, amplitude cos(frequency t) at O.

    amplitude   of the wave, m; frequency: rad/s
    Assumed: the pressure of the undisturbed wave in deep water on the hull without its moonpool (Froude and Krylov); what the
    hull does to the wave is left out.
    """
    side = HULL[0]
    k = frequency**2 / GRAVITY
    pressure = WATER_DENSITY * GRAVITY * amplitude * side
    fading = math.exp(-k * draft)
    ends = 2 * math.sin(k * side / 2)
    heave = pressure * fading * ends / k
    surge = pressure * ends * (1 - fading) / k
    bottom = fading * (ends / k**2 - side * math.cos(k * side / 2) / k)
    sides = ends * (fading * (draft / k + 1 / k**2) - 1 / k**2)
    return (Coefficients(surge, 0.0, heave, 0.0, pressure * (bottom + sides), 0.0),
            Coefficients(math.pi / 2, 0.0, 0.0, 0.0, math.pi / 2, 0.0))
