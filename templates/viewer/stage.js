// The visible scene: a camera that turns, the solids of one mechanism or of several next to each other, names under the pointer.
const FIELD = 0.6;
// Lengths of a mechanism beyond which the camera goes along with a motion.
const FAR = 8;
// Lines of the grid to each side of its middle.
const LINES = 10;
// Facets of a side of the water, where it has waves.
const FACETS = 48;
const AXES = [["x", "#D55E00"], ["y", "#009E73"], ["z", "#0072B2"]];

class Stage {
    constructor(canvas, scenes) {
        this.canvas = canvas;
        this.scenes = scenes;
        this.renderer = new Renderer(canvas);
        this.library = Object.fromEntries(Object.entries(MESHES).map(([name, parts]) => [name, this.renderer.mesh(...parts)]));
        this.planar = scenes[0].data.planar;
        this.up = scenes[0].data.up;
        // A plane is looked at from z; else the camera goes around from the first direction across.
        this.ahead = this.planar ? [0, 0, 1] : Math.abs(this.up[0]) > 0.9 ? [0, 1, 0] : [1, 0, 0];
        this.side = cross(this.up, this.ahead);
        this.length = Math.max(...scenes.map(s => s.data.length));
        this.layers = { names: false, frames: false, centres: false, inertia: false };
        this.forceScale = 1;
        this.follow = -1;
        this.trail = -2;
        this.frames = 0;
        this.after = () => {};
        for (const scene of scenes) this.prepare(scene);
        new ResizeObserver(() => this.invalidate()).observe(canvas);
        document.addEventListener("visibilitychange", () => this.invalidate());
    }

    prepare(scene) {
        scene.meshes = scene.data.meshes.map(mesh => {
            const [x, y, z] = columnsOf(mesh.vertices), n = x.length, vertices = new Float32Array(6 * n);
            for (let k = 0; k < n; k++) vertices.set([x[k], y[k], z[k]], 6 * k);
            const made = this.renderer.mesh(vertices, new Uint16Array(bytes(mesh.triangles)), Boolean(mesh.bend));
            const bend = mesh.bend && { station: new Uint16Array(bytes(mesh.bend.station)), shapes: columnsOf(mesh.bend.shapes),
                second: columnsOf(mesh.bend.second), eta: mesh.bend.eta };
            return { ...mesh, made, own: vertices.slice(), vertices, bend, color: colorOf(mesh.color) };
        });
        scene.items = scene.data.items.map(item => ({ ...item, color: colorOf(item.color) }));
        scene.floor = this.planar ? null : this.grid(scene);
        scene.trails = scene.data.bodies.map(() => null);
    }

    // Points of everything that is drawn now.
    reach(scene) {
        const found = [];
        const { source } = scene;
        for (const item of scene.items) if (!item.layer && !["line", "mooring"].includes(item.kind) && !(item.kind === "rod" && JSON.stringify(item.ends).includes("off")))
            for (const end of item.ends) {
                const p = source.at(end), r = Math.max(...item.size) * (item.ends.length > 1 ? 0.6 : 1);
                for (const e of [[r, r, r], [-r, -r, -r], [r, -r, r], [-r, r, -r]]) found.push(add(p, e));
            }
        for (const mesh of scene.meshes) if (!(mesh.ground && this.planar)) for (let k = 0; k < mesh.own.length; k += 6)
            found.push(source.world(mesh.body, mesh.own[k], mesh.own[k + 1], mesh.own[k + 2]));
        for (let k = 0; k < source.bodies; k++) found.push(source.world(k, 0, 0, 0));
        return found;
    }

    // Tips of the arrows that are shown now.
    tips({ source }) {
        const found = [];
        for (const arrows of source.arrows || []) if (this.layers[arrows.layer] !== false) arrows.names.forEach((_, k) => {
            const [at, f, n, long] = this.arrowOf(source, arrows, k);
            if (n > 0) found.push(add(at, f, long / n));
        });
        return found;
    }

    // Look at all that is drawn, over the whole motion; while a body is followed, at the mechanism as it is now.
    fit() {
        const tips = [];
        let all = this.scenes.map(scene => {
            const { source, data } = scene, now = source.time, found = [];
            const count = data.kind === "recorded" ? 40 : 1;
            for (let k = 0; k < count; k++) {
                if (data.kind === "recorded") source.seek(source.t[Math.round((source.t.length - 1) * k / (count - 1))]);
                found.push(...this.reach(scene));
                tips.push(...this.tips(scene));
            }
            if (data.kind === "recorded") source.seek(now);
            return found;
        }).flat();
        const lowest = all.reduce((m, p) => Math.min(m, inner(p, this.up)), Infinity);
        all = all.concat(tips);
        const low = [0, 1, 2].map(k => all.reduce((m, p) => Math.min(m, p[k]), Infinity));
        const high = [0, 1, 2].map(k => all.reduce((m, p) => Math.max(m, p[k]), -Infinity));
        // The grid lies on level ground, else below all that is drawn.
        const level = this.scenes[0].data.grounds.find(plane => inner(plane, this.up) > 1 - 1e-6);
        this.floor = level ? level[3] : lowest;
        this.radius = Math.max(0.5 * size(minus(high, low)), 0.25 * this.length);
        this.middle = times(add(low, high), 0.5);
        let target = this.middle;
        const [{ data }] = this.scenes, alone = data.kind === "recorded" && this.scenes.length === 1;
        if (!this.home && alone && 2 * this.radius > FAR * this.length) this.follow = this.farthest();
        if (this.follow >= 0) {
            const now = this.reach(this.scenes[0]);
            target = times(now.reduce((sum, p) => add(sum, p)), 1 / now.length);
            const r = Math.max(...now.map(p => size(minus(p, target))));  // it may turn
            all = [[r, 0, 0], [0, r, 0], [0, 0, r]].flatMap(e => [add(target, e), minus(target, e)]);
            this.followed = this.scenes[0].source.world(this.follow, 0, 0, 0);
        }
        this.camera = { target, distance: 1, azimuth: this.planar ? 0 : -0.95, elevation: this.planar ? 0 : 0.34 };
        const aspect = Math.max(0.1, this.canvas.clientWidth / this.scenes.length / (this.canvas.clientHeight || 1));
        const { x, y, z, f } = this.matrix(aspect), margin = 0.07 * this.length;
        this.camera.distance = all.reduce((far, p) => {
            const d = minus(p, this.camera.target);
            return Math.max(far, inner(z, d) + f * Math.max((Math.abs(inner(x, d)) + margin) / aspect, Math.abs(inner(y, d)) + margin));
        }, 0.5 * this.length);
        this.home = { ...this.camera };
    }

    // The first body that comes about as far as any.
    farthest() {
        const { source } = this.scenes[0], now = source.time, bodies = [...Array(source.bodies).keys()];
        const ways = bodies.map(() => 0), starts = bodies.map(k => source.world(k, 0, 0, 0));
        for (const t of source.t) {
            source.seek(t);
            for (const k of bodies) ways[k] = Math.max(ways[k], size(minus(source.world(k, 0, 0, 0), starts[k])));
        }
        source.seek(now);
        return ways.findIndex(way => way > 0.9 * Math.max(...ways));
    }

    // Cell by cell: of a line that goes on behind the camera some browsers draw nothing.
    grid(scene) {
        const step = 1.2 * scene.data.length / LINES, lines = [];
        for (let k = -LINES; k <= LINES; k++) for (let i = -LINES; i < LINES; i++)
            for (const [a, b] of [[[k, i], [k, i + 1]], [[i, k], [i + 1, k]]])
                lines.push(a[0] * step, a[1] * step, 0, 0, 0, 1, b[0] * step, b[1] * step, 0, 0, 0, 1);
        return this.renderer.mesh(new Float32Array(lines), null);
    }

    get eye() {
        const { azimuth: a, elevation: e, distance } = this.camera, c = Math.cos(e);
        const way = add(add(times(this.ahead, c * Math.cos(a)), this.side, c * Math.sin(a)), this.up, Math.sin(e));
        return [add(this.target, way, distance), way];
    }

    get target() {
        const { source } = this.scenes[0];
        return this.follow < 0 ? this.camera.target : add(this.camera.target, minus(source.world(this.follow, 0, 0, 0), this.followed));
    }

    setFollow(body) {
        if (this.follow >= 0) this.camera.target = this.target;
        this.follow = body;
        if (body >= 0) this.followed = this.scenes[0].source.world(body, 0, 0, 0);
        this.invalidate();
    }

    // The matrix of the camera for a picture of some width over height; right, up and way to the eye.
    matrix(aspect) {
        const [eye, z] = this.eye, x = unit(cross(this.up, z)), y = cross(z, x);
        const f = 1 / Math.tan(FIELD / 2), near = this.camera.distance / 50, far = this.camera.distance * 40;
        const view = new Float32Array([x[0], y[0], z[0], 0, x[1], y[1], z[1], 0, x[2], y[2], z[2], 0, -inner(x, eye), -inner(y, eye), -inner(z, eye), 1]);
        const lens = new Float32Array([f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (far + near) / (near - far), -1, 0, 0, 2 * far * near / (near - far), 0]);
        return { all: product(lens, view), x, y, z, f };
    }

    invalidate() {
        if (this.waiting) return;
        this.waiting = requestAnimationFrame(() => {
            this.waiting = 0;
            this.draw(false);
            clearTimeout(this.later);
            if (this.renderer.software) this.later = setTimeout(() => this.draw(true), 250);
        });
    }

    draw(fine) {
        const dark = matchMedia("(prefers-color-scheme: dark)").matches;
        this.renderer.begin(fine, dark ? [0.09, 0.1, 0.12] : [0.985, 0.985, 0.98]);
        const many = this.scenes.length, { canvas } = this, aspect = canvas.width / many / canvas.height;
        this.lens = this.matrix(aspect);
        const light = unit(add(add(this.lens.z, this.lens.x, -0.5), this.lens.y, 0.9));
        this.scenes.forEach((scene, k) => {
            this.renderer.part(k, many, this.lens.all, light);
            this.drawScene(scene, dark);
        });
        this.renderer.flush();
        this.frames++;
        this.after();
    }

    drawScene(scene, dark) {
        const { source, data } = scene, { renderer, library } = this, unitScale = [1, 1, 1];
        scene.picks = [];
        if (scene.floor && !data.water) {
            // As large as the way of the motion; around a body that is followed, with lines that stay where they are.
            const grow = Math.min(Math.max(1, this.radius / (1.2 * data.length)), this.follow < 0 ? Infinity : 4), wide = [grow, grow, 1];
            const step = 1.2 * data.length * grow / LINES;
            const lines = dark ? [0.25, 0.27, 0.3] : [0.86, 0.87, 0.89], planes = data.grounds.length ? data.grounds : [[...this.up, this.floor]];
            for (const [x, y, z, level] of planes) {
                const normal = [x, y, z];
                const side = unit(cross(normal, Math.abs(inner(normal, this.ahead)) < 0.9 ? this.ahead : this.up)), ahead = cross(side, normal);
                let place = add(this.middle, normal, level - inner(this.middle, normal));
                if (this.follow >= 0) for (const axis of [side, ahead])
                    place = add(place, axis, step * Math.round(inner(axis, minus(source.world(this.follow, 0, 0, 0), place)) / step));
                renderer.draw(scene.floor, placed(ahead, side, normal, place, wide), wide, lines, 1, 2);
            }
        }
        if (this.planar) for (const plane of data.grounds) this.drawGround(plane, dark);
        for (const item of scene.items) if (!item.layer || (this.layers[item.layer] && item.kind !== "ellipsoid")) this.drawItem(scene, item);
        for (const mesh of scene.meshes) this.drawMesh(scene, mesh);
        if (this.layers.frames) for (let k = 0; k < source.bodies; k++) AXES.forEach(([name, color], i) => {
            const e = [0, 0, 0];
            e[i] = 0.13 * this.length;
            this.rod(scene, source.world(k, 0, 0, 0), source.world(k, ...e), [0.005 * this.length, 0.005 * this.length], colorOf(color),
                `${name} axis of ${data.bodies[k]}`);
        });
        this.drawTrails(scene);
        if (this.layers.inertia) for (const item of scene.items) if (item.kind === "ellipsoid") this.drawItem(scene, item);
        if (data.water) this.drawWater(scene);
        for (const arrows of source.arrows || []) if (this.layers[arrows.layer] !== false) this.drawArrows(scene, arrows, dark);
    }

    drawWater(scene) {
        const { water: w } = scene.data, r = 4 * this.radius, [x, y] = this.middle;
        const [[x0, y0], [x1, y1]] = w.reach || [[x - r, y - r], [x + r, y + r]];
        const middle = [(x0 + x1) / 2, (y0 + y1) / 2, w.level], half = [(x1 - x0) / 2, (y1 - y0) / 2, 1e-4 * this.length];
        const mesh = w.waves ? this.surfaceOf(scene, w, middle, half) : this.library.box, one = [1, 1, 1];
        this.renderer.draw(mesh, placed([1, 0, 0], [0, 1, 0], [0, 0, 1], middle, w.waves ? one : half), one, colorOf(w.color), 1,
            w.waves ? 0 : 2, w.waves ? 0.55 : 0.4);
    }

    // The water's surface now, about its middle: regular waves along a heading.
    surfaceOf(scene, { waves }, middle, half) {
        const [amplitude, frequency, long, heading, ramp] = waves, { time } = scene.source, k = TURN / long;
        const grown = amplitude * (ramp > 0 ? (1 - Math.cos(Math.PI * Math.max(0, Math.min(1, time / ramp)))) / 2 : 1);
        const way = [Math.cos(heading), Math.sin(heading)];
        const [vertices, triangles] = surface(FACETS, FACETS, (u, v) => {
            const x = (2 * u - 1) * half[0], y = (2 * v - 1) * half[1];
            const phase = frequency * time - k * (way[0] * (middle[0] + x) + way[1] * (middle[1] + y));
            const slope = grown * k * Math.sin(phase);
            return [x, y, grown * Math.cos(phase), -slope * way[0], -slope * way[1], 1];
        });
        if (scene.water) this.renderer.change(scene.water, vertices);
        else scene.water = this.renderer.mesh(vertices, triangles, true);
        return scene.water;
    }

    // flat: as `draw` of the renderer has it.
    rod(scene, a, b, radii, color, name, mesh = "rod", flat = 0) {
        const way = minus(b, a), long = size(way);
        if (!(long > 1e-9 * this.length)) return;
        const z = times(way, 1 / long), [x, y] = across(z), stretch = [radii[0], radii[0], long];
        const solid = mesh === "rod" && radii[0] > long ? "wheel" : mesh;
        this.renderer.draw(this.library[solid], placed(x, y, z, a, stretch), stretch, color, mesh === "rod" ? radii[1] / radii[0] : 1, flat);
        if (name) scene.picks.push({ a, b, radius: Math.max(...radii), name });
    }

    drawItem(scene, item) {
        const before = scene.picks.length;
        this.drawSolid(scene, item);
        for (const pick of scene.picks.slice(before)) pick.joint = item.axis !== undefined && item.kind !== "disc";
    }

    drawSolid(scene, item) {
        const { source } = scene, { kind, size: s, color, name } = item, a = source.at(item.ends[0]);
        const solid = (mesh, x, y, z, stretch, alpha = 1) => {
            this.renderer.draw(this.library[mesh], placed(x, y, z, a, stretch), stretch, color, 1, 0, alpha);
            scene.picks.push({ a, b: a, radius: Math.max(...stretch), name });
        };
        const X = [1, 0, 0], Y = [0, 1, 0], Z = [0, 0, 1];
        if (kind === "ball") solid(s[0] > 0.1 * this.length ? "globe" : "ball", X, Y, Z, [s[0], s[0], s[0]]);
        else if (kind === "pin" || kind === "disc") {
            const n = source.axis(item.axis);
            this.rod(scene, add(a, n, -s[1]), add(a, n, s[1]), [s[0], s[0]], color, name);
        } else if (kind === "block") {
            const n = unit(source.axis(item.axis)), [x, y] = this.planar ? [cross([0, 0, 1], n), [0, 0, 1]] : across(n);
            solid("box", x, y, n, s);
        } else if (kind === "box" || kind === "ellipsoid") {
            const [x, y, z] = [0, 1, 2].map(k => source.world(item.ends[0][0], item.turn[k], item.turn[3 + k], item.turn[6 + k], true));
            solid(kind === "box" ? "box" : "ball", x, y, z, s, kind === "box" ? 1 : 0.35);
        } else if (kind === "stand") {
            const down = times(this.up, -1);
            this.rod(scene, add(a, down, s[1]), a, [s[0], 0.25 * s[0]], color, name);
        } else {
            const b = source.at(item.ends[1]);
            if (kind === "rope" || kind === "mooring") {
                const r = Math.max(s[0], 0.0012 * size(minus(this.eye[0], a)));
                const points = kind === "rope" ? ropeOf(a, b, s[1], this.up) : mooringOf(a, b, ...s.slice(2));
                for (let k = 1; k < points.length; k++) this.rod(scene, points[k - 1], points[k], [r, r], color, name, "thread");
            } else if (kind === "rod") this.rod(scene, a, b, s, color, name);
            else if (kind === "thread" || kind === "line") {
                const [eye] = this.eye, r = Math.max(s[0], 0.0012 * size(minus(eye, a)));
                this.rod(scene, a, b, [r, r], color, name, "thread");
            } else {
                if (kind !== "damper") this.rod(scene, a, b, [s[0], s[0]], color, name, "spring");
                if (kind !== "spring") {
                    const middle = times(add(a, b), 0.5), r = kind === "both" ? 0.5 * s[0] : s[0];
                    this.rod(scene, a, middle, [0.8 * r, 0.8 * r], color, name);
                    this.rod(scene, middle, b, [0.4 * r, 0.4 * r], color, name);
                }
            }
        }
    }

    drawMesh(scene, mesh) {
        const { source } = scene, k = mesh.body;
        if (mesh.bend) this.bend(mesh, source);
        const o = source.world(k, 0, 0, 0), [x, y, z] = [[1, 0, 0], [0, 1, 0], [0, 0, 1]].map(e => source.world(k, ...e, true));
        this.renderer.draw(mesh.made, placed(x, y, z, o, [1, 1, 1]), [1, 1, 1], mesh.color, 1, 1);
        if (mesh.ground) return;
        let far = 0;
        for (let v = 0; v < mesh.own.length; v += 6) {
            const d = Math.abs(mesh.own[v] - mesh.own[0]) + Math.abs(mesh.own[v + 1] - mesh.own[1]) + Math.abs(mesh.own[v + 2] - mesh.own[2]);
            if (d > far) [far, mesh.far] = [d, v];
        }
        const end = v => source.world(k, mesh.own[v], mesh.own[v + 1], mesh.own[v + 2]);
        scene.picks.push({ a: end(0), b: end(mesh.far || 0), radius: 0.01 * this.length, name: mesh.name });
    }

    // Displacements to second order in the elastic coordinates.
    bend(mesh, source) {
        const { station, shapes, second, eta } = mesh.bend, e = eta.map(name => source.eta[name] || 0), m = e.length;
        const n = shapes[0].length, moved = new Float64Array(3 * n);
        for (let s = 0; s < n; s++) for (let i = 0; i < 3; i++) {
            let d = 0;
            for (let a = 0; a < m; a++) {
                d += shapes[i * m + a][s] * e[a];
                for (let b = 0; b < m; b++) d += 0.5 * second[(i * m + a) * m + b][s] * e[a] * e[b];
            }
            moved[3 * s + i] = d;
        }
        station.forEach((s, v) => { for (let i = 0; i < 3; i++) mesh.vertices[6 * v + i] = mesh.own[6 * v + i] + moved[3 * s + i]; });
        this.renderer.change(mesh.made, mesh.vertices);
    }

    // Flat ground of a plane, as deep as what stands on it.
    drawGround([x, y, z, level], dark) {
        const thick = 0.02 * this.length, one = [4 * this.radius, thick, 0.25 * this.length], normal = [x, y, z];
        const middle = add(this.middle, normal, level - thick - inner(this.middle, normal));
        this.renderer.draw(this.library.box, placed(cross(normal, this.ahead), normal, this.ahead, middle, one), one,
            dark ? [0.32, 0.34, 0.38] : [0.72, 0.74, 0.77]);
    }

    // Arrows of one kind at the present time, to their scale; on a dark ground in a lighter colour, as style.css has it for its
    // check box.
    drawArrows(scene, arrows, dark) {
        const { names, color: given, unit } = arrows;
        const color = dark ? given.map(c => 0.2 + 0.8 * c) : given;
        const { source } = scene;
        // Nothing hides a force.
        this.renderer.over(true);
        names.forEach((name, k) => {
            const [at, f, n, long] = this.arrowOf(source, arrows, k);
            if (!(long >= 0.01 * this.length)) return;
            const draw = unit !== "N m" ? this.arrow : this.planar ? this.arc : this.twoHeads;
            draw.call(this, scene, at, times(f, long / n), color, `${name}: ${n.toPrecision(4)} ${unit}`);
        });
        this.renderer.over(false);
    }

    // Where one of them begins, its vector with its size, and how long it is drawn.
    arrowOf(source, { points, scale, longest, now }, k) {
        const wide = points.length ? 3 : 6, at = points.length ? source.at(points[k]) : now.slice(wide * k, wide * k + 3);
        const f = now.slice(wide * k + wide - 3, wide * k + wide), n = size(f);
        return [at, f, n, this.forceScale * Math.min(n * scale, longest ?? Infinity)];
    }

    // Without light and shade: arrows are distinguished by their colours.
    arrow(scene, a, way, color, name, heads = 1) {
        const long = size(way), r = 0.007 * this.length, share = Math.min(5 * r / long, 0.5 / heads), b = add(a, way);
        this.rod(scene, a, add(b, way, -heads * share), [r, r], color, name, "rod", 2);
        for (let k = 0; k < heads; k++) this.rod(scene, add(b, way, -(k + 1) * share), add(b, way, -k * share), [2.4 * r, 0.01 * r], color, undefined, "rod", 2);
    }

    twoHeads(scene, a, way, color, name) { this.arrow(scene, a, way, color, name, 2); }

    // A torque about what a plane is seen along: three quarters of a circle around its point, with a head.
    arc(scene, a, way, color, name) {
        const sense = Math.sign(way[2]) || 1, radius = 0.5 * size(way), corners = 24;
        const at = k => { const p = sense * TURN * (-1 / 8 + 3 / 4 * k / corners); return add(a, [Math.cos(p), Math.sin(p), 0], radius); };
        const r = 0.007 * this.length, last = Math.max(1, corners - Math.ceil(5 * r / (radius * TURN * 3 / 4 / corners)));
        for (let k = 1; k <= last; k++) this.rod(scene, at(k - 1), at(k), [r, r], color, name, "rod", 2);
        this.rod(scene, at(last), at(corners), [2.4 * r, 0.01 * r], color, undefined, "rod", 2);
    }

    drawTrails(scene) {
        const { source, data } = scene;
        for (let k = 0; k < source.bodies; k++) {
            if (this.trail !== -1 && this.trail !== k) continue;
            scene.trails[k] ||= this.trailOf(scene, k);
            const one = [1, 1, 1];
            this.renderer.draw(scene.trails[k], placed([1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 0, 0], one), one,
                colorOf(data.palette[k % data.palette.length]), 1, 2);
        }
    }

    // The way of a centre of mass through the whole motion.
    trailOf(scene, body) {
        const { source, data } = scene, now = source.time, points = [], point = 2 * data.joints.length + body;
        const stride = Math.max(1, Math.ceil(source.t.length / 4000));
        for (let k = 0; k < source.t.length; k += stride) {
            source.seek(source.t[k]);
            points.push(...source.at(point), 0, 0, 1);
        }
        source.seek(now);
        const mesh = this.renderer.mesh(new Float32Array(points), null);
        mesh.strip = true;
        return mesh;
    }

    // Place on the canvas, in its own pixels, and depth; null behind the eye.
    project(p, which = 0) {
        const m = this.lens.all, w = m[3] * p[0] + m[7] * p[1] + m[11] * p[2] + m[15];
        if (w <= 0) return null;
        const x = (m[0] * p[0] + m[4] * p[1] + m[8] * p[2] + m[12]) / w, y = (m[1] * p[0] + m[5] * p[1] + m[9] * p[2] + m[13]) / w;
        const wide = this.canvas.clientWidth / this.scenes.length;
        return [which * wide + (x + 1) / 2 * wide, (1 - y) / 2 * this.canvas.clientHeight, w];
    }

    // Part nearest to the eye under a point of the canvas.
    pick(x, y) {
        const which = Math.min(this.scenes.length - 1, Math.floor(x / this.canvas.clientWidth * this.scenes.length));
        let best = null, depth = Infinity;
        for (const { a, b, radius, name, joint } of this.scenes[which].picks || []) {
            const p = this.project(a, which), q = this.project(b, which);
            if (!p || !q) continue;
            const d = [q[0] - p[0], q[1] - p[1]], long = d[0] * d[0] + d[1] * d[1];
            const s = long > 0 ? Math.max(0, Math.min(1, ((x - p[0]) * d[0] + (y - p[1]) * d[1]) / long)) : 0;
            const w = p[2] + (q[2] - p[2]) * s, wide = radius * this.lens.f / w * this.canvas.clientHeight / 2;
            if (Math.hypot(x - p[0] - s * d[0], y - p[1] - s * d[1]) <= Math.max(wide, 5)) {
                // A joint inside of its links is named before them.
                const behind = joint ? w - 3 * radius : w;
                if (behind < depth) [best, depth] = [name, behind];
            }
        }
        return best;
    }

    turn(dx, dy) {
        this.camera.azimuth -= dx;
        this.camera.elevation = Math.max(-1.5, Math.min(1.5, this.camera.elevation + dy));
        this.invalidate();
    }

    zoom(factor) {
        this.camera.distance = Math.max(0.02 * this.home.distance, Math.min(20 * this.home.distance, this.camera.distance * factor));
        this.invalidate();
    }

    pan(dx, dy) {
        const s = this.camera.distance * Math.tan(FIELD / 2) * 2 / this.canvas.clientHeight;
        this.camera.target = add(add(this.camera.target, this.lens.x, -dx * s), this.lens.y, dy * s);
        this.invalidate();
    }

    reset() {
        this.fit();
        this.invalidate();
    }
}
