// Where bodies and points are: evaluated from sliders, or read from a motion.
const bytes = text => Uint8Array.from(atob(text), c => c.charCodeAt(0)).buffer;

// Columns of an array as it comes in the page.
function columnsOf(array) {
    const { rows, columns } = array;
    const raw = array.single !== undefined ? new Float32Array(bytes(array.single)) : new Uint16Array(bytes(array.data));
    return Array.from({ length: columns }, (_, c) => {
        const part = raw.subarray(c * rows, (c + 1) * rows);
        return array.single !== undefined ? part : Float64Array.from(part, v => array.low[c] + array.step[c] * v);
    });
}

class Source {
    constructor(data) {
        this.bodies = data.bodies.length;
        this.origins = new Float64Array(3 * this.bodies);
        this.turns = new Float64Array(9 * this.bodies);
        this.points = new Float64Array(3 * data.n_points);
        this.axes = new Float64Array(3 * data.joints.length);
        this.eta = {};
    }

    // The point (x, y, z) of a body, or its direction.
    world(body, x, y, z, direction = false) {
        if (body < 0) return [x, y, z];
        const R = this.turns, o = this.origins, r = 9 * body, k = 3 * body, s = direction ? 0 : 1;
        return [s * o[k] + R[r] * x + R[r + 1] * y + R[r + 2] * z, s * o[k + 1] + R[r + 3] * x + R[r + 4] * y + R[r + 5] * z,
            s * o[k + 2] + R[r + 6] * x + R[r + 7] * y + R[r + 8] * z];
    }

    axis(j) { return [this.axes[3 * j], this.axes[3 * j + 1], this.axes[3 * j + 2]]; }

    // A point by what refers to it.
    at(ref) {
        if (typeof ref === "number") return [this.points[3 * ref], this.points[3 * ref + 1], this.points[3 * ref + 2]];
        if (ref[0] === "off") return add(this.at(ref[1]), this.axis(ref[2]), ref[3]);
        if (ref[0] === "foot") {
            const a = this.at(ref[1]), n = this.axis(ref[3]);
            return add(a, n, inner(minus(this.at(ref[2]), a), n));
        }
        return this.world(ref[0], ref[1], ref[2], ref[3]);
    }
}

class Live extends Source {
    constructor(data, functions) {
        super(data);
        this.functions = functions;
        this.data = data;
        this.values = { q: [], p: [], inputs: [], t: [], u: [], z: [], ud: [] };
        for (const s of data.sliders) this.values[s.group][s.k] = s.value;
        this.owned = new Set(data.unit_groups.flat());
        if (data.closes) this.closes(-1, this.values.q.slice());
        this.update();
    }

    get time() { return this.values.t[0] || 0; }

    state(q = this.values.q) {
        const v = this.values, at = { q, p: v.p, inputs: v.inputs, t: v.t[0], u: v.u, z: v.z, ud: v.ud };
        at.c = this.functions.prologue(at);
        return at;
    }

    update() {
        const at = this.state(), f = this.functions, frames = f.frames(at);
        for (let k = 0; k < this.bodies; k++) {
            for (let i = 0; i < 3; i++) this.origins[3 * k + i] = frames[12 * k + i];
            for (let i = 0; i < 9; i++) this.turns[9 * k + i] = frames[12 * k + 3 + i];
        }
        const n = this.data.functions;
        const parts = [n.includes("joint_points") ? f.joint_points(at) : [], f.positions(at), this.origins,
            n.includes("spring_points") ? f.spring_points(at) : []];
        let k = 0;
        for (const part of parts) for (const v of part) this.points[k++] = v;
        if (n.includes("joint_axes")) this.axes.set(f.joint_axes(at));
        for (const s of this.data.sliders) if (s.group === "q") this.eta[s.name] = this.values.q[s.k];
    }

    // Set a slider; returns whether the mechanism follows: where loops cannot close, all stays.
    set(slider, value) {
        const old = this.values[slider.group].slice(), q = this.values.q.slice();
        try {
            if (slider.group === "q" && this.data.closes) {
                const from = q[slider.k], pieces = Math.min(40, Math.max(1, Math.ceil(Math.abs(value - from) / 0.15)));
                for (let k = 1; k <= pieces; k++) {
                    const moved = this.values.q.slice();
                    moved[slider.k] = from + (value - from) * k / pieces;
                    this.keepUnit(moved, slider.k);
                    if (!this.closes(slider.k, moved)) throw new RangeError("loops");
                }
            } else {
                this.values[slider.group][slider.k] = value;
                if (slider.group === "q") this.keepUnit(this.values.q, slider.k);
                if (this.data.closes && !this.closes(-1, this.values.q.slice())) throw new RangeError("loops");
            }
            this.update();
            if (this.origins.some(v => !Number.isFinite(v))) throw new RangeError("not finite");
            return true;
        } catch (error) {
            if (!(error instanceof RangeError)) throw error;
            this.values[slider.group] = old;
            this.values.q = q;
            this.update();
            return false;
        }
    }

    // Euler parameters keep unit length: the others of the group make room.
    keepUnit(q, k) {
        const group = this.data.unit_groups.find(g => g.includes(k));
        if (!group) return;
        q[k] = Math.max(-1, Math.min(1, q[k]));
        const others = group.filter(i => i !== k), left = Math.sqrt(Math.max(0, 1 - q[k] * q[k]));
        const norm = Math.sqrt(others.reduce((s, i) => s + q[i] * q[i], 0));
        others.forEach((i, n) => { q[i] = norm > 1e-12 ? q[i] * left / norm : n ? 0 : left; });
    }

    // Newton's method with the smallest change of the coordinates that leaves number `kept` alone (-1: none).
    closes(kept, q) {
        const rows = this.data.holonomic.flatMap((h, k) => h ? [k] : []), n = q.length;
        const reach = this.data.length;
        for (let round = 0; round < 30; round++) {
            const at = this.state(q), C = this.functions.C(at);
            if (rows.every(r => Math.abs(C[r]) < 1e-10 * reach)) {
                this.values.q = q;
                return true;
            }
            const J = this.functions.C_r(at), N = this.functions.N(at), m = J.length / C.length;
            // Rows of the constraints by the coordinates' speeds; a speed that is the kept coordinate's rate stays zero.
            const free = j => !(n === m && kept === j);
            const A = rows.map(r => rows.map(s => {
                let sum = r === s ? 1e-12 : 0;
                for (let j = 0; j < m; j++) if (free(j)) sum += J[r * m + j] * J[s * m + j];
                return sum;
            }));
            const lam = solve(A, rows.map(r => -C[r])), step = new Array(m).fill(0);
            for (let j = 0; j < m; j++) if (free(j)) rows.forEach((r, k) => { step[j] += J[r * m + j] * lam[k]; });
            const big = Math.max(...step.map(Math.abs)), damped = big > 0.5 ? 0.5 / big : 1;
            for (let i = 0; i < n; i++) for (let j = 0; j < m; j++) q[i] += damped * N[i * m + j] * step[j];
            for (const group of this.data.unit_groups) {
                const norm = Math.sqrt(group.reduce((s, i) => s + q[i] * q[i], 0));
                for (const i of group) q[i] /= norm;
            }
            if (q.some(v => !Number.isFinite(v))) return false;
        }
        return false;
    }
}

class Recorded extends Source {
    constructor(data) {
        super(data);
        this.data = data;
        [this.t] = columnsOf(data.t);
        this.o = columnsOf(data.origins);
        this.quaternions = columnsOf(data.turns);
        this.etas = data.eta ? columnsOf(data.eta.values) : [];
        // Forces and torques: at points of the mechanism their vectors, else positions and vectors in turn.
        this.arrows = data.arrows.map(arrows => ({ ...arrows, color: colorOf(arrows.color), columns: columnsOf(arrows.values), now: [] }));
        this.seek(this.t[0]);
    }

    // The place in the rows, and the share of the way to the next one.
    row(time) {
        const t = this.t;
        let a = 0, b = t.length - 1;
        while (b - a > 1) {
            const c = (a + b) >> 1;
            if (t[c] <= time) a = c; else b = c;
        }
        const span = t[b] - t[a];
        return [a, b, span > 0 ? Math.max(0, Math.min(1, (time - t[a]) / span)) : 0];
    }

    seek(time) {
        const [a, b, w] = this.row(time), between = column => column[a] + (column[b] - column[a]) * w;
        this.time = time;
        for (let k = 0; k < 3 * this.bodies; k++) this.origins[k] = between(this.o[k]);
        for (let k = 0; k < this.bodies; k++) {
            const c = [0, 1, 2, 3].map(i => this.quaternions[4 * k + i]);
            const sign = c.reduce((s, column) => s + column[a] * column[b], 0) < 0 ? -1 : 1;
            let q = c.map(column => column[a] * (1 - w) + sign * column[b] * w);
            const norm = Math.hypot(...q) || 1;
            const [e, x, y, z] = q.map(v => v / norm);
            this.turns.set([1 - 2 * (y * y + z * z), 2 * (x * y - e * z), 2 * (x * z + e * y), 2 * (x * y + e * z),
                1 - 2 * (x * x + z * z), 2 * (y * z - e * x), 2 * (x * z - e * y), 2 * (y * z + e * x),
                1 - 2 * (x * x + y * y)], 9 * k);
        }
        this.data.points.forEach((p, k) => this.points.set(this.world(...p), 3 * k));
        this.data.axes.forEach((p, k) => this.axes.set(this.world(...p, true), 3 * k));
        this.etas.forEach((column, k) => { this.eta[this.data.eta.names[k]] = between(column); });
        // Contacts open and close: between two times the nearer one holds.
        const near = column => column[w < 0.5 ? a : b];
        for (const arrows of this.arrows) arrows.columns.forEach((column, k) => { arrows.now[k] = (arrows.layer === "contacts" ? near : between)(column); });
    }
}
