"""Part of the unit cube under water; see Cube in symdyn.model.elements.cube."""

# Gauss points of the unit interval: (1 -+ 1/sqrt(3))/2.
SYMDYN_SHARES = 0.21132486540518713, 0.7886751345948129


def symdyn_cut_corner(a, b, s, h, one, shares):
    """Part of the square |x|, |y| <= 1/2 where a (x + 1/2) + b (y + 1/2) < s, for a >= b >= 0: the integrals of 1, x, y,
    x^2, x y, y^2; half the height of the part of the line that is inside; (1, x, y, h) at the two Gauss points of that part."""
    zero = one - one
    # Counted from a corner, it is as wide as the square below y0; then its width falls from w0 to w1 at y1.
    y0, y1, w0, w1 = one, one, one, one
    if s <= 0:
        y0 = y1 = zero
    elif s < a + b:
        y0, w0 = ((s - a) / b, one) if s > a else (zero, s / a)
        y1, w1 = (s / b, zero) if s < b else (one, (s - b) / a)
    dy = (y1 - y0) / 2
    m = [y0, zero, y0 / 2 * (y0 - 1), y0 / 12, zero, y0 * (3 + y0 * (4 * y0 - 6)) / 12]
    ends = []
    for share in shares:
        w, y = w0 + (w1 - w0) * share, y0 + (y1 - y0) * share - one / 2
        first = w / 2 * (w - 1)
        parts = dy * w, dy * first, dy * w * y, dy * w * (3 + w * (4 * w - 6)) / 12, dy * first * y, dy * w * y * y
        m = [p + q for p, q in zip(m, parts)]
        ends.append((one, w - one / 2, y, h))
    return m, dy, ends


def symdyn_cut_cube(order, e, one, shares):
    """Integrals over the wet part of the unit cube |x|, |y|, |z| <= 1/2, where the depth of a point r = (1, x, y, z) below the
    water is e.r. Results, for i <= j <= k in lexical order: order 0: of r_i where e.r > 0; order 1: of r_i r_j over the cut
    e.r = 0, by the length of (e1, e2, e3), which are the derivatives of the former by e_j; order 2: the derivatives of the
    latter by e_k. None where the depth is constant or no number.

    The cut is the graph z = h(x, y) over a part P of the square, z being the axis along which the depth changes most, and P
    what the lines h = -1/2 and h = 1/2 leave of the square.
    one, shares   1 and (1 -+ 1/sqrt(3))/2 in the arithmetic of e
    """
    z, x, y = sorted((1, 2, 3), key=lambda k: -abs(e[k]))
    A, B, C = abs(e[x]), abs(e[y]), abs(e[z])
    reach = (A + B + C) / 2
    if not C > 0 or e[0] + reach != e[0] + reach:
        return None
    if abs(e[0]) > reach:
        return [one if k == order == 0 and e[0] > 0 else one - one for k in range((4, 10, 20)[order])]

    # P: the square without what is below the line h = -1/2, and without the top, where h > 1/2.
    a, b, c = A / C, B / C, e[0] / C
    s = c + (a + b) / 2
    m, top, edges = [one, one - one, one - one, one / 12, one - one, one / 12], [one - one] * 6, []
    if s + one / 2 < a + b:
        m, dy, ends = symdyn_cut_corner(a, b, s + one / 2, -one / 2, one, shares)
        edges += [(dy / A, end) for end in ends if dy > 0]
    if s - one / 2 > 0:
        top, dy, ends = symdyn_cut_corner(a, b, s - one / 2, one / 2, one, shares)
        edges += [(-dy / A, end) for end in ends if dy > 0]
    m = [p - q for p, q in zip(m, top)]

    # Q: integrals of r_i r_j over P with r = (1, x, y, h). Axes are turned so that the depth falls along each.
    Q = [[m[0], m[1], m[2]], [m[1], m[3], m[4]], [m[2], m[4], m[5]]]
    Q.append([c * Q[0][k] - a * Q[1][k] - b * Q[2][k] for k in range(3)])
    for k in range(3):
        Q[k].append(Q[3][k])
    Q[3].append(c * Q[0][3] - a * Q[1][3] - b * Q[2][3])
    sign = [1, *(-1 if v > 0 else 1 for v in e[1:])]
    index = [(0, x, y, z).index(k) for k in range(4)]
    if order == 0:
        # Under P the cube is wet from -1/2 to h, under the top altogether.
        local = [*(Q[k][3] + Q[0][k] / 2 + top[k] for k in range(3)), Q[3][3] / 2 - Q[0][0] / 8]
        return [sign[i] * local[index[i]] for i in range(4)]
    out = []
    for i in range(4):
        for j in range(i, 4):
            p, q, factor = index[i], index[j], sign[i] * sign[j] / C
            if order == 1:
                out.append(factor * Q[p][q])
                continue
            for k in range(j, 4):
                # As the water rises, so does the cut, by 1/C, and its edges move along x by 1/A.
                r = index[k]
                rising = ((Q[q][r] if p == 3 else 0) + (Q[p][r] if q == 3 else 0) + (Q[p][q] if r == 3 else 0)) / C
                for rate, end in edges:
                    rising += end[p] * end[q] * end[r] * rate
                out.append(factor * sign[k] * rising)
    return out
