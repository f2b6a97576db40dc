// Draws meshes and lines by WebGL 2. Without a graphics card smooth edges cost half of the frames: still pictures are then drawn
// finer, moving ones are not.
const VERTEX = `#version 300 es
in vec3 place; in vec3 normal;
in vec4 x, y, z, o; in vec4 stretch; in vec4 color; in float flat_;
uniform mat4 camera;
out vec3 direction, world;
flat out vec4 own; flat out float kind;
void main() {
    mat4 model = mat4(x, y, z, o);
    vec3 p = place;
    p.xy *= mix(1.0, stretch.w, clamp(p.z, 0.0, 1.0));
    vec4 w = model * vec4(p, 1.0);
    world = w.xyz;
    direction = mat3(model) * (normal / (stretch.xyz * stretch.xyz));
    own = color;
    kind = flat_;
    gl_Position = camera * w;
}`;
const FRAGMENT = `#version 300 es
precision highp float;
in vec3 direction, world;
flat in vec4 own; flat in float kind;
uniform vec3 light;
out vec4 shown;
void main() {
    vec3 n = kind > 0.5 ? normalize(cross(dFdx(world), dFdy(world))) : normalize(direction);
    float d = 0.5 + 0.5 * dot(n, light);
    shown = vec4(own.rgb * (kind > 1.5 ? 1.0 : 0.42 + 0.62 * d), own.a);
}`;
// Numbers of an instance of a mesh, and its attributes with their sizes: the columns of its matrix, stretches with the taper, ...
const INSTANCE = [["x", 4], ["y", 4], ["z", 4], ["o", 4], ["stretch", 4], ["color", 4], ["flat_", 1]], NUMBERS = 25;

// Chromium names the graphics card by an extension alone, which Firefox warns of.
function softwareOnly() {
    const canvas = document.createElement("canvas");
    [canvas.width, canvas.height] = [1, 1];
    const gl = canvas.getContext("webgl2");
    if (!gl) return true;
    let name = gl.getParameter(gl.RENDERER);
    const about = name === "WebKit WebGL" && gl.getExtension("WEBGL_debug_renderer_info");
    if (about) name = gl.getParameter(about.UNMASKED_RENDERER_WEBGL);
    return /swiftshader|llvmpipe|software|basic render/i.test(name);
}

class Renderer {
    constructor(canvas) {
        this.canvas = canvas;
        this.software = softwareOnly();
        const gl = this.gl = canvas.getContext("webgl2", { antialias: !this.software, alpha: false });
        if (!gl) throw new Error("this browser offers no WebGL 2");
        const program = this.program = gl.createProgram();
        for (const [kind, text] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
            const shader = gl.createShader(kind);
            gl.shaderSource(shader, text);
            gl.compileShader(shader);
            gl.attachShader(program, shader);
        }
        ["place", "normal", ...INSTANCE.map(([name]) => name)].forEach((name, k) => gl.bindAttribLocation(program, k, name));
        gl.linkProgram(program);
        if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
        gl.useProgram(program);
        this.at = Object.fromEntries(["camera", "light"].map(
            name => [name, gl.getUniformLocation(program, name)]));
        this.waiting = new Set();
        gl.enable(gl.DEPTH_TEST);
        gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    }

    // vertices: places and normals in turn, six numbers each; triangles: indices, or null for a line through all vertices.
    mesh(vertices, triangles, moving = false) {
        const gl = this.gl, array = gl.createVertexArray(), buffer = gl.createBuffer();
        gl.bindVertexArray(array);
        gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
        gl.bufferData(gl.ARRAY_BUFFER, vertices, moving ? gl.DYNAMIC_DRAW : gl.STATIC_DRAW);
        for (const k of [0, 1]) {
            gl.enableVertexAttribArray(k);
            gl.vertexAttribPointer(k, 3, gl.FLOAT, false, 24, 12 * k);
        }
        const own = gl.createBuffer();
        gl.bindBuffer(gl.ARRAY_BUFFER, own);
        let first = 0;
        INSTANCE.forEach(([, count], k) => {
            gl.enableVertexAttribArray(2 + k);
            gl.vertexAttribPointer(2 + k, count, gl.FLOAT, false, 4 * NUMBERS, 4 * first);
            gl.vertexAttribDivisor(2 + k, 1);
            first += count;
        });
        if (triangles) {
            gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
            gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, triangles, gl.STATIC_DRAW);
        }
        gl.bindVertexArray(null);
        return { array, buffer, count: triangles ? triangles.length : vertices.length / 6, lines: !triangles, own, instances: 0,
            numbers: new Float32Array(8 * NUMBERS) };
    }

    change(mesh, vertices) {
        this.gl.bindBuffer(this.gl.ARRAY_BUFFER, mesh.buffer);
        this.gl.bufferData(this.gl.ARRAY_BUFFER, vertices, this.gl.DYNAMIC_DRAW);
        if (mesh.lines) mesh.count = vertices.length / 6;
    }

    // Sizes of the canvas, finer by a factor where the graphics card is slow and nothing moves.
    begin(fine, background) {
        const gl = this.gl, canvas = this.canvas;
        const ratio = this.software ? (fine ? 2 : 1) : Math.min(window.devicePixelRatio || 1, 2);
        const width = Math.max(1, Math.round(canvas.clientWidth * ratio)), height = Math.max(1, Math.round(canvas.clientHeight * ratio));
        if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
        gl.viewport(0, 0, width, height);
        gl.disable(gl.SCISSOR_TEST);
        gl.clearColor(...background, 1);
        gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    }

    // Part `which` of `many` next to each other.
    part(which, many, camera, light) {
        const gl = this.gl, width = this.canvas.width / many;
        this.flush();
        gl.viewport(which * width, 0, width, this.canvas.height);
        gl.uniformMatrix4fv(this.at.camera, false, camera);
        gl.uniform3fv(this.at.light, light);
    }

    // Whether what follows is drawn over all that is there.
    over(on) {
        this.flush();
        on ? this.gl.disable(this.gl.DEPTH_TEST) : this.gl.enable(this.gl.DEPTH_TEST);
    }

    // flat: 0 by normals, 1 by faces, 2 without light. Opaque meshes wait: equal ones are drawn at once.
    draw(mesh, model, stretch, color, taper = 1, flat = 0, alpha = 1) {
        if (alpha < 1) this.flush();
        if (NUMBERS * (mesh.instances + 1) > mesh.numbers.length) {
            const more = new Float32Array(2 * mesh.numbers.length);
            more.set(mesh.numbers);
            mesh.numbers = more;
        }
        const n = mesh.numbers, k = NUMBERS * mesh.instances++;
        n.set(model, k);
        [n[k + 16], n[k + 17], n[k + 18], n[k + 19], n[k + 20], n[k + 21], n[k + 22], n[k + 23], n[k + 24]] = [
            stretch[0], stretch[1], stretch[2], taper, color[0], color[1], color[2], alpha, flat];
        this.waiting.add(mesh);
        if (alpha < 1) {
            this.gl.enable(this.gl.BLEND);
            this.flush();
            this.gl.disable(this.gl.BLEND);
        }
    }

    // Draw what waits. Each draw has a cost of its own where there is no graphics card.
    flush() {
        const gl = this.gl;
        for (const mesh of this.waiting) {
            gl.bindVertexArray(mesh.array);
            gl.bindBuffer(gl.ARRAY_BUFFER, mesh.own);
            gl.bufferData(gl.ARRAY_BUFFER, mesh.numbers.subarray(0, NUMBERS * mesh.instances), gl.STREAM_DRAW);
            if (mesh.lines) gl.drawArraysInstanced(mesh.strip ? gl.LINE_STRIP : gl.LINES, 0, mesh.count, mesh.instances);
            else gl.drawElementsInstanced(gl.TRIANGLES, mesh.count, gl.UNSIGNED_SHORT, 0, mesh.instances);
            mesh.instances = 0;
        }
        this.waiting.clear();
    }
}
