// Puts the page together.
// Milliseconds between numbers next to the curves while a motion plays, and between places of cursors and bar: the picture alone
// moves at every frame.
const BETWEEN_NUMBERS = 120, BETWEEN_CURSORS = 30;
function start() {
    const page = JSON.parse(document.getElementById("data").textContent);
    const find = id => document.getElementById(id);
    const canvas = find("canvas"), note = find("note"), live = page.kind === "live";
    const scenes = live ? [{ data: page, source: new Live(page, kinematics) }] : page.motions.map(data => ({ data, source: new Recorded(data) }));
    let stage;
    try {
        stage = new Stage(canvas, scenes);
    } catch (error) {
        note.textContent = `Nothing can be drawn: ${error.message}.`;
        return;
    }
    const say = text => { note.textContent = text; };
    pointer(canvas, stage);
    stage.fit();
    toolbar(find("tools"), stage, live);
    if (live) liveControls(find("sliders"), stage, scenes[0], say);
    else playControls(find("player"), find("plots"), stage, scenes, say);
    names(find("names"), stage);
    stage.reset();
    window.symdyn = { stage, scenes };
}

function pointer(canvas, stage) {
    const tip = document.getElementById("tip"), pointers = new Map();
    const point = event => { const box = canvas.getBoundingClientRect(); return [event.clientX - box.left, event.clientY - box.top]; };
    canvas.addEventListener("pointerdown", event => { canvas.setPointerCapture(event.pointerId); pointers.set(event.pointerId, point(event)); tip.hidden = true; });
    for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, event => pointers.delete(event.pointerId));
    canvas.addEventListener("pointermove", event => {
        const now = point(event), before = pointers.get(event.pointerId);
        if (!before) return hover(...now);
        const [dx, dy] = [now[0] - before[0], now[1] - before[1]];
        if (pointers.size === 2) {
            const other = [...pointers].find(([id]) => id !== event.pointerId)[1];
            stage.zoom(Math.hypot(before[0] - other[0], before[1] - other[1]) / (Math.hypot(now[0] - other[0], now[1] - other[1]) || 1));
            stage.pan(dx / 2, dy / 2);
        } else if (event.shiftKey || event.buttons === 2) stage.pan(dx, dy);
        else stage.turn(dx * 0.008, dy * 0.008);
        pointers.set(event.pointerId, now);
    });
    canvas.addEventListener("pointerleave", () => { tip.hidden = true; });
    canvas.addEventListener("contextmenu", event => event.preventDefault());
    canvas.addEventListener("wheel", event => { event.preventDefault(); stage.zoom(Math.exp(event.deltaY * 0.001)); }, { passive: false });
    canvas.addEventListener("keydown", event => {
        const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
        if (step) event.shiftKey ? stage.pan(-20 * step[0], 20 * step[1]) : stage.turn(0.08 * step[0], 0.08 * step[1]);
        else if (event.key === "+" || event.key === "=") stage.zoom(0.9);
        else if (event.key === "-") stage.zoom(1 / 0.9);
        else if (event.key === "Home") stage.reset();
        else return;
        event.preventDefault();
    });
    function hover(x, y) {
        const name = stage.pick(x, y);
        tip.hidden = !name;
        if (!name) return;
        tip.textContent = name;
        tip.style.left = `${Math.max(0, Math.min(x + 12, canvas.clientWidth - tip.offsetWidth - 4))}px`;
        tip.style.top = `${Math.max(0, y - tip.offsetHeight - 6)}px`;
    }
}

function toolbar(parent, stage, live) {
    button(parent, "⟲", "Look at everything, or at what is followed", () => stage.reset());
    button(parent, "+", "Nearer", () => stage.zoom(0.85));
    button(parent, "−", "Farther", () => stage.zoom(1 / 0.85));
    const layer = (name, text, color) =>
        check(parent, text, stage.layers[name], on => { stage.layers[name] = on; stage.invalidate(); }, color);
    layer("names", "names");
    layer("frames", "frames");
    layer("centres", "centres of mass");
    if (stage.scenes.some(s => s.items.some(i => i.layer === "inertia"))) layer("inertia", "inertia");
    const bodies = stage.scenes[0].data.bodies.map((name, k) => [k, name]);
    choice(parent, "follow ", [[-1, "nothing"], ...bodies], k => stage.setFollow(k)).value = stage.follow;
    if (live) return;
    choice(parent, "trail ", [[-2, "none"], [-1, "all"], ...bodies], k => { stage.trail = k; stage.invalidate(); });
    const kinds = new Map(stage.scenes.flatMap(s => s.source.arrows.map(({ layer, title, color }) => [layer, { title, color }])));
    if (!kinds.size) return;
    for (const [name, { title, color }] of kinds) {
        stage.layers[name] = true;
        layer(name, title, color);
    }
    slider(parent, { name: "length of arrows", least: 0.1, most: 10, value: 1 }, (v, show) => { stage.forceScale = v; show(v); stage.invalidate(); });
}

function liveControls(parent, stage, scene, say) {
    const { source, data } = scene, shown = [];
    const titles = { q: "Coordinates", p: "Parameters", inputs: "Inputs", t: "Time" };
    if (data.missing.length) say(`No value is known of ${data.missing.join(", ")}: 1 is shown.`);
    for (const [group, title] of Object.entries(titles)) {
        const own = data.sliders.filter(s => s.group === group && s.moves);
        if (!own.length) continue;
        const box = element(parent, "details"), head = element(box, "summary", "", title);
        box.open = group !== "p" || own.length <= 8;
        head.dataset.group = group;
        for (const s of own) shown.push([s, slider(box, s, value => {
            const follows = source.set(s, value);
            say(follows ? "" : s.group === "q" || data.closes ? "The mechanism cannot be closed there." : "The mechanism is not defined there.");
            refresh();
        })]);
    }
    function refresh() {
        for (const [s, control] of shown) control.show(source.values[s.group][s.k]);
        stage.invalidate();
    }
    button(parent, "Reset", "Back to the start", () => {
        for (const s of data.sliders) source.values[s.group][s.k] = s.value;
        if (data.closes) source.closes(-1, source.values.q.slice());
        source.update();
        say("");
        refresh();
    });
    refresh();
}

function playControls(parent, below, stage, scenes, say) {
    const first = Math.min(...scenes.map(s => s.source.t[0])), last = Math.max(...scenes.map(s => s.source.t[s.source.t.length - 1]));
    let now = first, playing = false, speed = 1, before = 0, written = 0, moved = 0, loop = true;
    const plots = [];
    scenes.forEach((scene, k) => {
        const box = element(below, "section");
        if (scenes.length > 1) element(box, "h2", "", `${k ? "right" : "left"}: ${scene.data.name}`);
        for (const panel of scene.data.panels) plots.push(new Plot(panel, box, time => { pause(); seek(time); }, scene.data.marks));
        if (!scene.data.success) say(`The motion stopped early: ${scene.data.message}`);
    });
    const play = button(parent, "▶", "Play", () => playing ? pause() : go());
    play.classList.add("play");
    const bar = slider(parent, { name: "t", unit: "s", least: first, most: last, value: first, step: (last - first) / 2000 || 1 }, value => { pause(); seek(value); });
    bar.input.setAttribute("aria-label", "Time, s");
    const rates = [0.1, 0.25, 0.5, 1, 2, 5, 10, 30];
    const rate = choice(parent, "speed ", rates.map(v => [v, `${v} ×`]), v => { speed = v; });
    rate.value = "1";
    check(parent, "repeat", loop, on => { loop = on; });
    function seek(time) {
        place(time);
        bar.show(time);
        for (const plot of plots) plot.seek(time);
    }
    function place(time) {
        now = time;
        for (const { source } of scenes) source.seek(Math.max(source.t[0], Math.min(source.t[source.t.length - 1], time)));
        stage.invalidate();
    }
    function pause() {
        const was = playing;
        playing = false;
        play.textContent = "▶";
        play.setAttribute("aria-label", play.title = "Play");
        if (was) seek(now);
    }
    function go() {
        if (now >= last) now = first;
        playing = true;
        before = 0;
        play.textContent = "▮▮";
        play.setAttribute("aria-label", play.title = "Pause");
        requestAnimationFrame(step);
    }
    function step(clock) {
        if (!playing) return;
        if (before) {
            let time = now + (clock - before) / 1000 * speed;
            if (time > last) {
                if (!loop) pause();
                time = loop ? first + (time - last) % (last - first || 1) : last;
            }
            const quick = playing && clock - written < BETWEEN_NUMBERS;
            place(time);
            if (!quick || clock - moved >= BETWEEN_CURSORS) {
                bar.show(time, quick);
                for (const plot of plots) plot.seek(time, quick);
                moved = clock;
            }
            if (!quick) written = clock;
        }
        before = clock;
        if (playing) requestAnimationFrame(step);
    }
    document.addEventListener("keydown", event => {
        if (event.key === " " && (event.target === document.body || event.target.id === "canvas")) {
            event.preventDefault();
            playing ? pause() : go();
        }
    });
    seek(first);
    // A page that embeds this one may ask for a picture that moves at once.
    if (location.hash === "#play" && !matchMedia("(prefers-reduced-motion: reduce)").matches) go();
}

// Names of bodies and joints over the picture.
function names(layer, stage) {
    const entries = stage.scenes.flatMap(({ data, source }, which) => [
        ...data.bodies.map((name, k) => ({ name, which, source, ref: 2 * data.joints.length + k, kind: "body" })),
        ...data.joints.map(([name], k) => ({ name, which, source, ref: 2 * k + 1, kind: "joint" }))]);
    for (const entry of entries) entry.label = element(layer, "span", entry.kind, entry.name);
    // Steps by which a name gives way to one that is nearer to the eye, in lines; where there is no room it is left out.
    const steps = [0, 1, -1, 2, -2, 3];
    stage.after = () => {
        layer.hidden = !stage.layers.names;
        if (layer.hidden) return;
        const { clientWidth: wide, clientHeight: high } = stage.canvas, placed = [];
        for (const entry of entries) {
            entry.at = stage.project(entry.source.at(entry.ref), entry.which);
            entry.label.hidden = false;
            entry.size ||= [entry.label.offsetWidth, entry.label.offsetHeight];
        }
        for (const { label, at, size: [w, h] } of [...entries].sort((a, b) => (a.at ? a.at[2] : Infinity) - (b.at ? b.at[2] : Infinity))) {
            const room = at && at[0] >= 0 && at[0] <= wide - 10 && steps.map(step => at[1] + step * h).find(y => y >= 0 && y <= high - 10
                && !placed.some(([x, v, n, m]) => at[0] < x + n && x < at[0] + w && y < v + m && v < y + h));
            label.hidden = !Number.isFinite(room);
            if (label.hidden) continue;
            placed.push([at[0], room, w, h]);
            label.style.transform = `translate(${at[0]}px, ${room}px)`;
        }
    };
}

start();
