"""The force at the upper end of a hanging elastic line; see Catenary in symdyn.model.elements.catenary."""

# A line that hangs freely has no horizontal force if its ends are as near to one vertical as this part of its length.
SYMDYN_NEAREST = 1e-9
# Multiple of the rounding of doubles, and relative change below which the next step of Newton's method is exact.
SYMDYN_TINY, SYMDYN_CLOSE = 9e-16, 1e-8


def symdyn_line_start(math, seabed, x, z, e):
    """Where Newton's method starts: a parabola, or a straight line where the ends are far apart, or a stiff line that touches the
    seabed, for which (1 - x) / z = (sqrt(u (u + 2)) - acosh(1 + u)) / u with u = z / h, solved roughly."""
    d = math.sqrt(x * x + z * z)
    flat = math.sqrt(3 * (1 - d * d)) / x if d < 1 else 0.2
    h, v = x / 2 / flat, (z / math.tanh(flat) + 1) / 2
    if d > 1 and (d - 1) * x > e * h * d and e > 0:
        h, v = (d - 1) * x / (e * d), (d - 1) * z / (e * d) + 0.5
    if seabed and 0 < (1 - x) / z < 1:
        f = (1 - x) / z
        touching = z * (1 - f) / (f * f * (4.5 - f * (4.2 - 3.6 * f)))
        lifted = math.sqrt(z * (z + 2 * touching))
        if lifted < 1:
            h, v = touching, lifted
    return h, v


def symdyn_line_force(math, seabed, values, tiny, close):
    """Horizontal and vertical force at the fairlead of a hanging elastic line at rest, over its weight w L; None where none is.

    values   horizontal and vertical distance from the anchor over its length L; w L / EA; friction with the seabed
    math, tiny, close   functions of their arithmetic, some of its rounding, and a change below which Newton's next step is exact
    Newton's method for what Jonkman, NREL/TP-500-41958 (2007), writes for both cases: part of the line rests on the seabed, or
    none.
    """
    x, z, e, friction = values
    if not (e >= 0 and friction >= 0 and math.sqrt(x * x + z * z) < 1e100) or (seabed and not z > 0):
        return None
    if seabed:
        hanging = 2 * z / (1 + math.sqrt(1 + 2 * e * z))
        if hanging <= 1 and x <= 1 - hanging + tiny:  # slack: it hangs straight down, the rest lies
            return x * 0, hanging
    if not x > SYMDYN_NEAREST:
        return None
    h, v = symdyn_line_start(math, seabed, x, z, e)
    for _ in range(100):
        rests = seabed and v < 1
        s, b = (1 - v, v * 0) if rests else (v * 0, v - 1)  # length that lies; vertical force at the anchor
        l, t, a = 1 - s, math.sqrt(h * h + v * v), math.sqrt(h * h + b * b)  # length that hangs, tensions at its ends
        one_t, one_a = 1 / t, 1 / a
        top, foot = t + v if v > 0 else h * h / (t - v), h * h / (a - b) if b < 0 else a + b  # t + v and a + b
        arc = math.log1p(2 * l * top / (h * h + foot * top))  # asinh(v / h) - asinh(b / h) without cancellation
        tense = h / friction if friction * s > h else s
        x_off = s + h * arc + e * (h * (l + tense) - friction / 2 * tense * tense) - x
        z_off = l * (v + b) * (1 / (t + a) + e / 2) - z
        slope, z_h = v * one_t - b * one_a, h * (one_t - one_a)
        x_h, x_v, z_v = arc - slope + e * (l + tense), z_h + (e * friction * tense if rests else 0), slope + e * l
        determinant = x_h * z_v - x_v * z_h
        if not determinant > 0:
            return None
        dh, dv = (x_v * z_off - z_v * x_off) / determinant, (z_h * x_off - x_h * z_off) / determinant
        step = 1 if h + dh >= 0.1 * h else -0.9 * h / dh
        if seabed and v + step * dv < 0.1 * v:
            step = -0.9 * v / dv
        h, v = h + step * dh, v + step * dv
        if abs(dh) <= close * h + tiny and abs(dv) <= close * (h + abs(v)):
            return h, v
    return None
