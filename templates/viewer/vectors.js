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

// The horizontal and the vertical force at the fairlead of a mooring line, over its weight; null where none is found. The algorithm is
// that of symdyn/model/algorithms/catenary.py: lengths are over that of the line, e its weight over EA.
function lineForce(x, z, e, friction, seabed) {
    if (seabed && !(z > 0)) return null;
    const hanging = 2 * z / (1 + Math.sqrt(1 + 2 * e * z));
    if (seabed && hanging <= 1 && x <= 1 - hanging + 9e-16) return [0, hanging];
    if (!(x > 1e-9)) return null;
    const d = Math.hypot(x, z), flat = d < 1 ? Math.sqrt(3 * (1 - d * d)) / x : 0.2, f = (1 - x) / z;
    let h = x / 2 / flat, v = (z / Math.tanh(flat) + 1) / 2;
    if (d > 1 && e > 0 && (d - 1) * x > e * h * d) [h, v] = [(d - 1) * x / (e * d), (d - 1) * z / (e * d) + 0.5];
    if (seabed && f > 0 && f < 1) {
        const touching = z * (1 - f) / (f * f * (4.5 - f * (4.2 - 3.6 * f))), lifted = Math.sqrt(z * (z + 2 * touching));
        if (lifted < 1) [h, v] = [touching, lifted];
    }
    for (let round = 0; round < 100; round++) {
        const rests = seabed && v < 1, s = rests ? 1 - v : 0, b = rests ? 0 : v - 1, l = 1 - s;
        const t = Math.hypot(h, v), a = Math.hypot(h, b), tense = friction * s > h ? h / friction : s;
        const top = v > 0 ? t + v : h * h / (t - v), foot = b < 0 ? h * h / (a - b) : a + b;
        const arc = Math.log1p(2 * l * top / (h * h + foot * top)), slope = v / t - b / a;
        const xOff = s + h * arc + e * (h * (l + tense) - friction / 2 * tense * tense) - x, zOff = l * (v + b) * (1 / (t + a) + e / 2) - z;
        const zh = h * (1 / t - 1 / a), xh = arc - slope + e * (l + tense), xv = zh + (rests ? e * friction * tense : 0), zv = slope + e * l;
        const determinant = xh * zv - xv * zh;
        if (!(determinant > 0)) return null;
        const dh = (xv * zOff - zv * xOff) / determinant, dv = (zh * xOff - xh * zOff) / determinant;
        let step = h + dh >= 0.1 * h ? 1 : -0.9 * h / dh;
        if (seabed && v + step * dv < 0.1 * v) step = -0.9 * v / dv;
        h += step * dh;
        v += step * dv;
        if (Math.abs(dh) <= 1e-8 * h && Math.abs(dv) <= 1e-8 * (h + Math.abs(v))) return [h, v];
    }
    return null;
}

// Points along a mooring line from its fairlead to its anchor, evenly by the unstretched length of what hangs: `mooring` of
// symdyn/pictures/ropes.py.
function mooringOf(fairlead, anchor, length, e, friction, seabed) {
    const way = minus(fairlead, anchor), far = Math.hypot(way[0], way[1]), count = 24;
    const x = Math.hypot(far, 2e-9 * length) / length, found = lineForce(x, way[2] / length, e, friction, seabed);
    if (!found) return [fairlead, anchor];
    const [h, v] = found, lies = seabed ? Math.max(1 - v, 0) : 0, b = seabed ? Math.max(v - 1, 0) : v - 1;
    const tense = friction ? Math.min(lies, h / friction) : lies;
    const stretch = u => h * Math.min(u, tense) - friction / 2 * Math.min(u, tense) ** 2;
    return Array.from({ length: count + 1 }, (_, k) => {
        const s = !lies ? 1 - k / count : k < count ? 1 - (1 - lies) * k / (count - 1) : 0, on = Math.min(s, lies), up = Math.max(s - lies, 0), force = b + up;
        let along = on + e * (stretch(lies) - stretch(lies - on));
        if (h > 0) along += h * (Math.asinh(force / h) - Math.asinh(b / h)) + e * h * up;
        else if (lies) along = on * x / lies;
        const height = Math.hypot(h, force) - Math.hypot(h, b) + e * up * (b + up / 2), share = length * along / (far || 1);
        return [anchor[0] + share * way[0], anchor[1] + share * way[1], anchor[2] + length * height];
    });
}
