// Parts of the page: elements, symbols, sliders.
function element(parent, kind, name = "", text = "") {
    const made = document.createElement(kind);
    if (name) made.className = name;
    if (text) made.textContent = text;
    parent.append(made);
    return made;
}

const GREEK = { alpha: "α", beta: "β", gamma: "γ", delta: "δ", epsilon: "ε", zeta: "ζ", eta: "η", theta: "θ", lambda: "λ", lamda: "λ", mu: "μ",
    nu: "ν", xi: "ξ", rho: "ρ", sigma: "σ", tau: "τ", phi: "φ", chi: "χ", psi: "ψ", omega: "ω", Delta: "Δ", Theta: "Θ", Phi: "Φ", Psi: "Ψ", Omega: "Ω" };

// A name as it is typeset: theta_1_dot becomes θ with a dot and the index 1, q_free_2 a q with the index free, 2.
function symbol(parent, name) {
    const match = /^([A-Za-z]+?)_?(\d+|(?<=_)(?!d?dot$)[A-Za-z0-9_]+?|)(_d?dot|)$/.exec(name);
    if (!match || !(match[1] in GREEK || match[1].length === 1)) return element(parent, "span", "symbol", name);
    const made = element(parent, "span", "symbol"), dots = match[3] === "_dot" ? "\u0307" : match[3] ? "\u0308" : "";
    element(made, "var", "", (GREEK[match[1]] || match[1]) + dots);
    if (match[2]) element(made, "sub", "", match[2].replace(/^_/, "").replaceAll("_", ", "));
    return made;
}

let numbered = 0;

function slider(parent, { name, unit, least, most, value, step }, change) {
    const row = element(parent, "div", "slider"), label = element(row, "label"), input = element(row, "input"), output = element(row, "output");
    symbol(label, name);
    if (unit) element(label, "small", "", ` [${unit}]`);
    input.type = "range";
    input.id = label.htmlFor = `slider-${++numbered}`;
    input.dataset.name = name;
    [input.min, input.max, input.step] = [least, most, step || (most - least) / 1000 || 1e-3];
    const range = most - least || 1, digits = Math.max(0, Math.min(12, 3 - Math.floor(Math.log10(range))));
    // A value that is small against the range, such as that of the start, is not shown as zero; what is rounding is.
    const text = v => String(+(Math.abs(v) > 1e-6 * range && Math.abs(v) < 1e-3 * range ? v.toPrecision(2) : v.toFixed(digits)));
    // quick: without the number, which costs a layout of the page.
    const show = (v, quick = false) => {
        input.value = v;
        if (!quick) output.textContent = text(v);
    };
    show(value);
    input.addEventListener("input", () => change(Number(input.value), show));
    return { input, show };
}

// color: of what the box shows and hides, three numbers; or none.
function check(parent, text, on, change, color) {
    const label = element(parent, "label", "check"), input = element(label, "input");
    input.type = "checkbox";
    input.checked = on;
    if (color) element(label, "i").style.setProperty("--color", `rgb(${color.map(c => Math.round(255 * c)).join(" ")})`);
    label.append(text);
    input.addEventListener("change", () => change(input.checked));
    return input;
}

function button(parent, text, title, act) {
    const made = element(parent, "button", "", text);
    made.type = "button";
    made.title = title;
    made.setAttribute("aria-label", title);
    made.addEventListener("click", act);
    return made;
}

function choice(parent, text, options, change) {
    const label = element(parent, "label", "choice", text), select = element(label, "select");
    for (const [value, shown] of options) {
        const option = element(select, "option", "", shown);
        option.value = value;
    }
    select.addEventListener("change", () => change(Number(select.value)));
    return select;
}
const PALETTE = ["#0072B2", "#C77C00", "#008560", "#B8568F", "#2B8CC4", "#C24E00"];
