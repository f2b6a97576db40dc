"""The examples, with numbers and with what describes them."""

from __future__ import annotations

import math
from functools import partial

from symdyn.lab.sympy_models.chains import chaos_pendulum, conical_pendulum, mass_spring_damper, pendulum_on_cart
from symdyn.lab.sympy_models.example import Example
from symdyn.lab.sympy_models.others import astrobee, four_bar, muscle_driven_arm
from symdyn.lab.sympy_models.rolling import bicycle, rattleback, rolling_disc, snakeboard

# Meijaard, Papadopoulos, Ruina and Schwab, Linearized dynamics equations for the balance and steer of a bicycle: a benchmark and
# review, Proc. R. Soc. A 463 (2007), table 1.
BICYCLE = {
    "w": 1.02, "c": 0.08, "lambda_": math.pi / 10, "g": 9.81, "r_R": 0.3, "m_R": 2.0, "I_Rxx": 0.0603, "I_Ryy": 0.12,
    "x_B": 0.3, "z_B": -0.9, "m_B": 85.0, "I_Bxx": 9.2, "I_Bxz": 2.4, "I_Byy": 11.0, "I_Bzz": 2.8,
    "x_H": 0.9, "z_H": -0.7, "m_H": 4.0, "I_Hxx": 0.05892, "I_Hxz": -0.00756, "I_Hyy": 0.06, "I_Hzz": 0.00708,
    "r_F": 0.35, "m_F": 3.0, "I_Fxx": 0.1405, "I_Fyy": 0.28}
# The same, table 2: eigenvalues at 5 m/s, 1/s.
BICYCLE_EIGENVALUES = (-14.07838969279822, -0.77534188219585 - 4.46486771378823j, -0.77534188219585 + 4.46486771378823j,
                       -0.32286642900409)


def _cart(n: int, slow: bool = False) -> Example:
    numbers = {"g": 9.81, **{f"m{k}": 1.0 for k in range(n + 1)}, **{f"l{k}": 1.0 / n for k in range(n)}}
    return Example(f"pendulum_on_cart({n})", partial(pendulum_on_cart, n), numbers, "n-pendulum on a cart, PyDy's and SymPy's "
                                                                                    "example",
                   {f"q{k}": 0.1 * k for k in range(1, n + 1)},
                   {f"q{k}": -math.pi / 2 for k in range(1, n + 1)} if n < 10 else None, slow)


EXAMPLES: tuple[Example, ...] = (
    Example("mass_spring_damper", mass_spring_damper, {"m": 1.0, "c": 0.3, "k": 4.0, "g": 9.81}, "mass with spring and damper, "
                                                                                                 "PyDy",
            {"x": 0.5}, {}),
    _cart(2), _cart(10), _cart(20, True),
    Example("chaos_pendulum", chaos_pendulum,
            {"m_r": 0.1, "m_p": 0.2, "l_r": 0.1, "l_p": 0.15, "g": 9.81, "I_r": 3e-4, "I_x": 1e-4, "I_y": 2e-4, "I_z": 3e-4},
            "Kane and Levinson's chaotic pendulum, PyDy's example", {"theta": 1.5, "phi": 0.01}, {}),
    Example("conical_pendulum(3)", conical_pendulum,
            {"g": 9.81, **{f"{name}{k}": value for name, value in (("m", 0.5), ("l", 0.4), ("I", 1e-2)) for k in (1, 2, 3)}},
            "three link conical pendulum, PyDy's example, with the angular velocities of its orientations",
            {"alpha1": 0.4, "beta2": 0.3}, {}, True),
    Example("four_bar", four_bar, {"l_a": 0.8, "l_b": 2.0, "l_c": 1.0, "l_n": 2.0, "rho": 5.0, "g": 9.81},
            "four-bar linkage with configuration constraints, SymPy's documentation", {"q1": 0.5, "q2": 0.3, "q3": -1.5}),
    Example("snakeboard", snakeboard, {"m": 6.0, "l": 0.2, "J": 0.016, "J_r": 0.072, "J_w": 0.0013},
            "Ostrowski, Lewis, Murray and Burdick, Nonholonomic mechanics and locomotion: the snakeboard example, ICRA 1994",
            {"phi_f": 0.3, "phi_b": -0.2, "w": 0.4}),
    Example("rolling_disc", rolling_disc, {"r": 0.3, "m": 2.0, "g": 9.81}, "a rolling disc with Kane's method, SymPy's "
                                                                           "documentation",
            {"q2": 0.1, "u2": 4.0}, {"u2": 4.0}),
    Example("rattleback", rattleback,
            {"a": 0.2, "b": 0.03, "c": 0.02, "h": 0.01, "m": 1.0, "g": 9.81, "I_x": 2e-4, "I_y": 1.6e-3, "I_z": 1.7e-3,
             "I_xy": -2e-5, "sigma": 0.0},
            "Kane and Levinson, Realistic mathematical modeling of the rattleback, Int. J. Non-Linear Mech. 17 (1982)",
            {"roll": 0.01, "w3": -5.0}, {}),
    Example("astrobee", astrobee, {"m": 14.4, "I_x": 0.1083, "I_y": 0.1083, "I_z": 0.1083},
            "free-flying robot Astrobee, PyDy's example", {"v_x": 0.1, "w_z": 0.2}, {}),
    Example("muscle_driven_arm", muscle_driven_arm,
            {"m": 1.5, "l": 0.3, "I": 0.012, "g": 9.81, "d": 0.04, "h": 0.3, "l_T_slack_biceps": 0.2, "F_M_max_biceps": 500.0,
             "l_M_opt_biceps": 0.1},
            "musculotendon of De Groote, Kinney, Rao and Fregly (2016), SymPy's biomechanics", {"q": 0.6, "a_biceps": 0.1}),
    Example("bicycle", bicycle, BICYCLE, "Meijaard et al., Proc. R. Soc. A 463 (2007)",
            {"u4": -5 / 0.3, "u6": -5 / 0.35}, None, True),
)
