// The few meshes that all solids are made of, of unit size.
function surface(rows, columns, point) {
    const vertices = [], triangles = [];
    for (let i = 0; i <= rows; i++) for (let j = 0; j <= columns; j++) vertices.push(...point(i / rows, j / columns));
    for (let i = 0; i < rows; i++) for (let j = 0; j < columns; j++) {
        const a = i * (columns + 1) + j, b = a + columns + 1;
        triangles.push(a, a + 1, b + 1, a, b + 1, b);
    }
    return [new Float32Array(vertices), new Uint16Array(triangles)];
}

function joined(...meshes) {
    const vertices = [], triangles = [];
    for (const [v, t] of meshes) {
        const first = vertices.length / 6;
        vertices.push(...v);
        triangles.push(...Array.from(t, k => k + first));
    }
    return [new Float32Array(vertices), new Uint16Array(triangles)];
}

const TURN = 2 * Math.PI;
const disc = (z, n, corners) => surface(1, corners, (u, v) => [u * Math.cos(v * TURN), u * Math.sin(v * TURN), z, 0, 0, n]);
const tube = corners => surface(1, corners, (u, v) => [Math.cos(v * TURN), Math.sin(v * TURN), u, Math.cos(v * TURN), Math.sin(v * TURN), 0]);
const round = corners => joined(tube(corners), disc(0, -1, corners), disc(1, 1, corners));
const ball = (rows, columns) => surface(rows, columns, (u, v) => {
    const s = Math.sin(u * Math.PI), p = [s * Math.cos(v * TURN), s * Math.sin(v * TURN), Math.cos(u * Math.PI)];
    return [...p, ...p];
});
const MESHES = {
    // From z = 0 to 1 with radius 1.
    rod: round(24),
    wheel: round(64),
    // Thread that is too thin for its ends to be seen.
    thread: tube(6),
    ball: ball(14, 22),
    globe: ball(28, 56),
    // From -1 to 1 along each axis.
    box: joined(...[0, 1, 2].flatMap(k => [-1, 1].map(s => surface(1, 1, (u, v) => {
        const p = [0, 0, 0], n = [0, 0, 0];
        p[k] = n[k] = s;
        p[(k + 1) % 3] = 2 * u - 1;
        p[(k + 2) % 3] = 2 * v - 1;
        return [...p, ...n];
    })))),
    // A wire from z = 0 to 1, coils of radius 1.
    spring: (() => {
        const turns = 9, wire = 0.16;
        return surface(turns * 16, 6, (u, v) => {
            const inside = u > 0.06 && u < 0.94, a = turns * TURN * u, r = inside ? 1 : 0;
            const e = [Math.cos(a), Math.sin(a)], c = Math.cos(v * TURN), s = Math.sin(v * TURN);
            const n = inside ? [e[0] * c, e[1] * c, s * 0.25] : [c, s, 0];
            return [e[0] * r + wire * n[0], e[1] * r + wire * n[1], u + (inside ? 0.012 * s : 0), ...n];
        });
    })(),
};

function colorOf(text) {
    const n = parseInt(text.slice(1), 16);
    return [(n >> 16 & 255) / 255, (n >> 8 & 255) / 255, (n & 255) / 255];
}
