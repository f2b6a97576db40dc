// Vectors as arrays of three numbers; matrices of four by four by columns, as WebGL takes them.
const add = (a, b, s = 1) => [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]];
const minus = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const times = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
const inner = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const size = a => Math.sqrt(inner(a, a));
const unit = a => times(a, 1 / (size(a) || 1));

// Two directions across a unit vector.
function across(z) {
    const x = unit(cross(Math.abs(z[2]) < 0.9 ? [0, 0, 1] : [1, 0, 0], z));
    return [x, cross(z, x)];
}

// Columns x, y, z, stretched, at an origin.
const placed = (x, y, z, o, s) => new Float32Array([x[0] * s[0], x[1] * s[0], x[2] * s[0], 0, y[0] * s[1], y[1] * s[1], y[2] * s[1],
    0, z[0] * s[2], z[1] * s[2], z[2] * s[2], 0, o[0], o[1], o[2], 1]);

function product(a, b) {
    const c = new Float32Array(16);
    for (let j = 0; j < 4; j++) for (let i = 0; i < 4; i++)
        c[4 * j + i] = a[i] * b[4 * j] + a[4 + i] * b[4 * j + 1] + a[8 + i] * b[4 * j + 2] + a[12 + i] * b[4 * j + 3];
    return c;
}

// The solution of A x = b by elimination with pivots; A is changed.
function solve(A, b) {
    const n = b.length;
    for (let k = 0; k < n; k++) {
        let best = k;
        for (let i = k + 1; i < n; i++) if (Math.abs(A[i][k]) > Math.abs(A[best][k])) best = i;
        [A[k], A[best]] = [A[best], A[k]];
        [b[k], b[best]] = [b[best], b[k]];
        for (let i = k + 1; i < n; i++) {
            const f = A[i][k] / A[k][k];
            if (!f) continue;
            for (let j = k; j < n; j++) A[i][j] -= f * A[k][j];
            b[i] -= f * b[k];
        }
    }
    for (let k = n - 1; k >= 0; k--) {
        for (let j = k + 1; j < n; j++) b[k] -= A[k][j] * b[j];
        b[k] /= A[k][k];
    }
    return b;
}

// Points along a rope from a to b, evenly by its length: straight while it is taut, else a catenary against `up`.
function ropeOf(a, b, length, up) {
    const way = minus(b, a), v = inner(way, up), level = add(way, up, -v), h = size(level), count = 24;
    if (size(way) >= length * (1 - 1e-5)) return [a, b];
    const at = (share, height) => add(add(a, level, share), up, height), shares = Array.from({ length: count + 1 }, (_, k) => k / count);
    const low = (length - v) / 2;
    if (h < 1e-6 * length) return shares.map(s => at(s, s * length < low ? -s * length : s * length - 2 * low));
    // sinh(w) / w = ratio: by Newton, of a convex function.
    const ratio = Math.sqrt(length * length - v * v) / h;
    let w = ratio < 3 ? Math.sqrt(6 * (ratio - 1)) : Math.log(2 * ratio) + Math.log(Math.log(2 * ratio));
    for (let k = 0; k < 60; k++) w -= (Math.sinh(w) - ratio * w) / (Math.cosh(w) - ratio);
    const c = h / (2 * w), lowest = h / 2 - c * Math.atanh(v / length);
    return shares.map(s => {
        const x = lowest + c * Math.asinh((s * length + c * Math.sinh(-lowest / c)) / c);
        return at(x / h, c * (Math.cosh((x - lowest) / c) - Math.cosh(lowest / c)));
    });
}
