"""Towers of the NREL 5-MW turbine: distributed properties and mode shapes.

Sources: J. Jonkman, S. Butterfield, W. Musial, G. Scott, Definition of a 5-MW Reference Wind Turbine for Offshore System
Development, NREL/TP-500-38060, 2009, and J. Jonkman, Definition of the Floating System for Phase IV of OC3,
NREL/TP-500-47535, 2010, as in the tower files of OpenFAST's ElastoDyn (github.com/ebranlard/welib, commit 6c8f155c;
of the OC3 tower data/NREL5MW/data/NREL5MW_ED_Tower_Offshore.dat, commit 41011229). The second side-to-side shape of the
onshore tower is from a public copy of these coefficients, not from the file itself.
"""

from __future__ import annotations

from dataclasses import dataclass

Row = tuple[float, ...]


@dataclass(frozen=True)
class TowerData:
    """A tower with bending stiffness alike in both directions.

    length           of the flexible part, m; stations are fractions of it
    mass_per_length  kg/m; stiffness, N m^2
    fore_aft, side_to_side   two polynomials each, coefficients of xi^2 ... xi^6, which are 1 at the top in all but rounding
    damping_ratio    of each mode
    """

    length: float
    stations: Row
    mass_per_length: Row
    stiffness: Row
    fore_aft: tuple[Row, Row]
    side_to_side: tuple[Row, Row]
    damping_ratio: float = 0.01


_TENTHS = (0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0)

ONSHORE = TowerData(
    length=87.6,
    stations=_TENTHS,
    mass_per_length=(5590.87, 5232.43, 4885.76, 4550.87, 4227.75, 3916.41, 3616.83, 3329.03, 3053.01, 2788.75, 2536.27),
    stiffness=(614.343e9, 534.821e9, 463.267e9, 399.131e9, 341.881e9, 291.011e9, 246.027e9, 206.457e9, 171.851e9, 141.776e9,
               115.82e9),
    fore_aft=((0.7004, 2.1963, -5.6202, 6.2275, -2.504), (-70.5319, -63.7623, 289.737, -176.513, 22.0706)),
    side_to_side=((1.385, -1.7684, 3.0871, -2.2395, 0.5357), (-121.21, 184.415, -224.904, 298.536, -135.838)),
)

# The spar's tower, from 10 m (OC3) or from 20 m above the still water level (as here) to 87.6 m.
OC3 = TowerData(
    length=67.6,
    stations=_TENTHS,
    mass_per_length=(4667.0, 4345.28, 4034.76, 3735.44, 3447.32, 3170.4, 2904.69, 2650.18, 2406.88, 2174.77, 1953.87),
    stiffness=(603.903e9, 517.644e9, 440.925e9, 373.022e9, 313.236e9, 260.897e9, 215.365e9, 176.028e9, 142.301e9, 113.63e9,
               89.488e9),
    fore_aft=((0.8689, 0.2205, -0.0908, 0.1167, -0.1154), (42.5859, -18.6419, -20.357, -23.2686, 20.6816)),
    side_to_side=((0.834, 0.2216, -0.0571, 0.0934, -0.0918), (60.2285, -27.5868, -30.3887, -33.6738, 32.4208)),
)
