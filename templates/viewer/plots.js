// Curves over time with a cursor, and marks where something happens.
const number = v => Number.isFinite(v) ? (Math.abs(v) >= 1e5 || (v && Math.abs(v) < 1e-3) ? v.toExponential(2) : String(+v.toPrecision(4))) : "";

// Round numbers within a range, about as many as asked for.
function ticks(low, high, count) {
    const raw = (high - low) / count, power = 10 ** Math.floor(Math.log10(raw)), step = [1, 2, 5, 10].map(f => f * power).find(s => s >= raw);
    const found = [];
    for (let v = Math.ceil(low / step) * step; v <= high + 1e-9 * step; v += step) found.push(Math.abs(v) < 1e-9 * step ? 0 : v);
    return found;
}

// Pixels from a mark within which the pointer shows its names; of those that are next to each other there all.
const REACH = 5, SAME = 1;
// Dashes of marks by their kind: events, and changes of the modes of contacts.
const DASHES = { events: [5, 4], modes: [1, 3] };

class Plot {
    // marks: by kind times with names; none in pages that were stored without.
    constructor(panel, parent, seek, marks = {}) {
        this.panel = panel;
        this.marks = Object.keys(DASHES).flatMap(kind => (marks[kind] || []).map(([t, name]) => ({ kind, t, name })));
        [this.t] = columnsOf(panel.t);
        this.columns = columnsOf(panel.values);
        const figure = element(parent, "figure", "plot");
        const caption = element(figure, "figcaption");
        element(caption, "b", "", `${panel.title || panel.names[0]}${panel.unit ? ` [${panel.unit}]` : ""}`);
        this.digits = this.columns.map(column => {
            const range = column.reduce((m, v) => Math.max(m, v), -Infinity) - column.reduce((m, v) => Math.min(m, v), Infinity);
            return range > 0 ? Math.max(0, Math.min(12, 3 - Math.floor(Math.log10(range)))) : 12;
        });
        this.values = panel.names.map((name, k) => {
            const entry = element(caption, "span", "entry"), made = button(entry, "", name, () => this.toggle(k));
            element(made, "i", this.dashed(k) ? "dashed" : "").style.color = this.color(k);
            symbol(made, name);
            made.title = "Hide or show this curve";
            made.setAttribute("aria-pressed", "true");
            return element(entry, "output");
        });
        this.entries = [...caption.querySelectorAll("button")];
        this.box = element(figure, "div", "curves");
        this.canvas = element(this.box, "canvas");
        this.canvas.setAttribute("role", "img");
        this.canvas.setAttribute("aria-label", `${panel.title}: ${panel.names.join(", ")} over time`);
        this.cursor = element(this.box, "div", "cursor");
        this.tip = element(this.box, "div", "tip");
        this.tip.hidden = true;
        const place = event => event.clientX - this.canvas.getBoundingClientRect().left;
        const at = event => { seek(this.time(place(event))); this.hover(place(event)); };
        this.canvas.addEventListener("pointerdown", event => { this.canvas.setPointerCapture(event.pointerId); at(event); });
        this.canvas.addEventListener("pointermove", event => event.buttons ? at(event) : this.hover(place(event)));
        this.canvas.addEventListener("pointerleave", () => { this.tip.hidden = true; });
        if (this.marks.length) this.reachable(seek);
        new ResizeObserver(() => this.draw()).observe(this.box);
        matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.draw());
    }

    // The keyboard goes from mark to mark, and their names are read out.
    reachable(seek) {
        this.box.tabIndex = 0;
        this.box.setAttribute("role", "group");
        this.box.setAttribute("aria-label", `${this.panel.title || this.panel.names[0]}: arrow keys go to events and changes of modes`);
        this.tip.setAttribute("role", "status");
        const times = [...new Set(this.marks.map(({ t }) => t))].sort((a, b) => a - b);
        this.box.addEventListener("keydown", event => {
            const { now } = this, to = { ArrowLeft: times.findLast(t => t < now), ArrowRight: times.find(t => t > now),
                Home: times[0], End: times[times.length - 1] };
            if (!(event.key in to)) return;
            event.preventDefault();
            if (to[event.key] === undefined) return;
            seek(to[event.key]);
            this.hover(this.x(to[event.key]));
        });
        this.box.addEventListener("blur", () => { this.tip.hidden = true; });
    }

    color(k) { return PALETTE[k % PALETTE.length]; }

    dashed(k) { return k >= PALETTE.length; }

    shown(k) { return this.entries[k].getAttribute("aria-pressed") === "true"; }

    toggle(k) {
        this.entries[k].setAttribute("aria-pressed", String(!this.shown(k)));
        this.draw();
    }

    // The names of what happens next to a place.
    hover(x) {
        const away = t => Math.abs(this.x(t) - x), nearest = this.marks.reduce((best, mark) => !best || away(mark.t) < away(best.t) ? mark : best, null);
        this.tip.hidden = !nearest || away(nearest.t) > REACH;
        if (this.tip.hidden) return;
        const names = this.marks.filter(({ t }) => Math.abs(this.x(t) - this.x(nearest.t)) < SAME).map(({ name }) => name);
        this.tip.textContent = `${[...new Set(names)].join(", ")} at ${number(nearest.t)} s`;
        this.tip.style.left = `${Math.max(0, Math.min(this.x(nearest.t) + 6, this.wide - this.tip.offsetWidth - 4))}px`;
    }

    get span() { return this.t[this.t.length - 1] - this.t[0] || 1; }

    x(t) { return this.left + (t - this.t[0]) / this.span * (this.wide - this.left - 16); }

    time(x) { return Math.max(this.t[0], Math.min(this.t[0] + this.span, this.t[0] + (x - this.left) / (this.wide - this.left - 16) * this.span)); }

    draw() {
        const { canvas } = this, ratio = window.devicePixelRatio || 1, style = getComputedStyle(document.body);
        this.wide = canvas.clientWidth;
        this.left = 54;
        const high = canvas.clientHeight;
        [canvas.width, canvas.height] = [this.wide * ratio, high * ratio];
        // An opaque canvas is cheaper to put together with the page.
        const g = canvas.getContext("2d", { alpha: false });
        g.scale(ratio, ratio);
        g.fillStyle = style.getPropertyValue("--paper");
        g.fillRect(0, 0, this.wide, high);
        g.font = "11px system-ui, sans-serif";
        let low = Infinity, top = -Infinity;
        const visible = this.columns.filter((_, k) => this.shown(k));
        for (const column of visible.length ? visible : this.columns) for (const v of column) { low = Math.min(low, v); top = Math.max(top, v); }
        if (!(top > low)) [low, top] = [low - 1, top + 1];
        const y = v => 6 + (top - v) / (top - low) * (high - 28);
        g.textBaseline = "middle";
        for (const v of ticks(low, top, 4)) {
            g.strokeStyle = style.getPropertyValue("--line");
            g.beginPath(); g.moveTo(this.left, y(v)); g.lineTo(this.wide - 16, y(v)); g.stroke();
            g.fillStyle = style.getPropertyValue("--quiet");
            g.textAlign = "right";
            g.fillText(number(v), this.left - 5, y(v));
        }
        g.textAlign = "center";
        for (const v of ticks(this.t[0], this.t[0] + this.span, Math.max(2, this.wide / 110))) g.fillText(number(v), this.x(v), high - 8);
        g.strokeStyle = style.getPropertyValue("--quiet");
        for (const { kind, t } of this.marks) {
            g.setLineDash(DASHES[kind]);
            g.beginPath(); g.moveTo(this.x(t), 6); g.lineTo(this.x(t), high - 22); g.stroke();
        }
        this.columns.forEach((column, k) => {
            if (!this.shown(k)) return;
            g.strokeStyle = this.color(k);
            g.lineWidth = 1.5;
            g.setLineDash(this.dashed(k) ? [5, 3] : []);
            g.beginPath();
            column.forEach((v, i) => g[i ? "lineTo" : "moveTo"](this.x(this.t[i]), y(v)));
            g.stroke();
        });
        this.seek(this.now ?? this.t[0]);
    }

    // quick: the cursor alone; numbers that change with every picture cannot be read, and cost a quarter of the pictures.
    seek(time, quick = false) {
        this.now = time;
        if (this.wide) this.cursor.style.transform = `translateX(${this.x(Math.max(this.t[0], Math.min(this.t[0] + this.span, time)))}px)`;
        if (quick) return;
        let a = 0, b = this.t.length - 1;
        while (b - a > 1) { const c = (a + b) >> 1; if (this.t[c] <= time) a = c; else b = c; }
        const k = time - this.t[a] < this.t[b] - time ? a : b;
        this.values.forEach((output, i) => { output.textContent = number(+this.columns[i][k].toFixed(this.digits[i])); });
    }
}
