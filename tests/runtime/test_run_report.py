"""The report of one run: all numbers are those of the run, one file holds everything, and it opens in a browser as it is."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from html import unescape
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import symdyn as sd
from symdyn.backend.metadata import ValidityRange
from symdyn.cli import main
from symdyn.cli.summary import summarize
from symdyn.errors import ArgumentError, SimulationWarning
from symdyn.runtime.module import Module
from symdyn.runtime.solutions import report as run_report
from symdyn.runtime.solutions import tables as run_tables
from symdyn.runtime.solutions.solution import Solution

pytest.importorskip("matplotlib")

from symdyn.pictures import embedded
from symdyn.pictures.panels import Panel


@pytest.fixture(scope="module", autouse=True)
def folder(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SYMDYN_CACHE_DIR", str(tmp_path_factory.mktemp("cache")))
        yield


@pytest.fixture(scope="module")
def module() -> Module:
    """A cart with a shape, a pole with an output on it, and a force that is an input."""
    system = sd.systems.cart_pole()
    system.draw("cart", sd.shapes.Box([0.5, 0.25, 0.3]))
    system.add_output("tip", sd.position(system.bodies[1], [1, 0]))
    system.add_output("pull", sd.acceleration(system.bodies[1], [1, 0]))
    return system.embedding().compile("numpy")


@pytest.fixture(scope="module")
def solution(module: Module) -> Solution:
    name = module.metadata.parameters[0]
    return module.simulate((0.0, 2.0), params={name: 1.75}, inputs={"F": lambda t, x: 2 * np.sin(t)}, rtol=1e-7, work=True)


@pytest.fixture(scope="module")
def report(solution: Solution, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return solution.report(tmp_path_factory.mktemp("report") / "new" / "run.html")


@pytest.fixture
def no_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Reports of text alone, which take less time."""
    for name in ("mechanism", "curves", "balance"):
        monkeypatch.setattr(embedded, name, lambda *arguments: ())


def rows(text: str, section: str) -> list[list[str]]:
    """Cells of the tables of a section."""
    part = text[text.index(f'<section id="{section}">'):]
    part = part[:part.index("</section>")]
    return [[unescape(re.sub("<[^>]*>", "", cell)) for cell in re.findall(r"<td[^>]*>(.*?)</td>", row)]
            for row in re.findall(r"<tr[^>]*>(.*?)</tr>", part, re.DOTALL) if "<td" in row]


def value(text: str) -> float:
    return float(text.replace("\N{MINUS SIGN}", "-"))


def test_one_file_holds_everything(report: Path, solution: Solution) -> None:
    text = report.read_text(encoding="utf-8")
    sources = re.findall(r'(?:src|href)="([^"]*)"', text)
    assert len(sources) > 9 and all(s.startswith("data:") for s in sources)
    assert "url(" not in text and "<script" not in text and "@import" not in text
    assert len(text) < 2_000_000
    for told in ("<h1>cart_pole", "Reached the end", "DOP853 on NumPy", "relative 1e-07, absolute 1e-07", "embedding",
                 f"{solution.n_steps}, and {solution.n_rejected} rejected", "t = 0 s to 2 s, 1001 times", "1 input,",
                 str(solution.module.report()).splitlines()[-1].strip()):
        assert told in unescape(text), told


def test_extremes_are_those_of_the_motion(report: Path, solution: Solution) -> None:
    found = {row[0]: row for row in rows(report.read_text(encoding="utf-8"), "extremes")}
    assert list(found) == ["q1", "q2", "q1_dot", "q2_dot", "F", "tip x", "tip y", "pull x", "pull y"]
    assert [found[name][2] for name in found] == ["m", "rad", "m/s", "rad/s", "N", "m", "m", "m/s²", "m/s²"]
    columns = {"q1": solution["q1"], "q2_dot": solution["q2_dot"], "F": 2 * np.sin(solution.t), "tip y": solution["tip"][:, 1]}
    for name, curve in columns.items():
        least, at_least, most, at_most, mean, deviation = map(value, found[name][3:])
        assert least == pytest.approx(curve.min(), rel=1e-5, abs=1e-12) and most == pytest.approx(curve.max(), rel=1e-5)
        assert at_least == pytest.approx(solution.t[curve.argmin()], abs=1e-6)
        assert at_most == pytest.approx(solution.t[curve.argmax()], abs=1e-6)
        # Equal steps in time: the mean is nearly that of the numbers.
        assert mean == pytest.approx(curve.mean(), abs=2e-3 * np.abs(curve).max())
        assert deviation == pytest.approx(curve.std(), rel=5e-3)


def test_means_do_not_depend_on_where_the_steps_are(module: Module) -> None:
    """F = 2 sin t over its period has the mean 0 and the deviation sqrt 2, however the times lie."""
    t = 2 * np.pi * np.linspace(0, 1, 4001)**3
    solution = module.simulate(t, inputs={"F": lambda t, x: 2 * np.sin(t)}, rtol=1e-3)
    (row,) = [r for r in run_tables.extremes(solution) if r.name == "F"]
    assert abs(value(row.mean)) < 1e-5 and value(row.deviation) == pytest.approx(np.sqrt(2), abs=1e-5)


def test_changed_parameters_are_marked(report: Path, solution: Solution) -> None:
    text = report.read_text(encoding="utf-8")
    metadata = solution.module.metadata
    given = {row[0]: row for row in rows(text, "given") if len(row) == 4}
    assert tuple(given) == metadata.parameters
    assert [value(given[n][1]) for n in given] == pytest.approx(solution.params)
    assert [value(given[n][3]) for n in given] == pytest.approx(metadata.defaults)
    assert re.findall(r'<tr class="changed"><td>(\w+)</td>', text) == [metadata.parameters[0]]
    starts = {row[0]: value(row[1]) for row in rows(text, "given") if len(row) == 3}
    assert starts == pytest.approx(dict(zip(metadata.x, solution.x[0], strict=True)))


def test_energy_balance_is_reported_where_it_is_known(report: Path, solution: Solution, module: Module,
                                                      capsys: pytest.CaptureFixture[str]) -> None:
    balance = run_tables.energy(solution)
    assert balance is not None and abs(balance.work) > 0.1 and not balance.doubtful
    assert balance.work == solution.work[-1] and balance.change == solution.energy[-1] - solution.energy[0]
    assert balance.relative == solution.energy_error()
    assert f"closes to {solution.energy_error():.2g}" in report.read_text(encoding="utf-8")
    without = module.simulate((0.0, 0.1), inputs={"F": 1.0})
    assert run_tables.energy(without) is None
    rest = sd.systems.pendulum().embedding().compile("numpy").simulate((0.0, 1.0), q=[1e-14], u=[0.0])
    still = run_tables.energy(rest)
    assert still is not None and still.rests and not still.doubtful and still.relative < 1e-14 and not balance.rests
    summarize(rest)
    said = re.search(r"energy is kept to (\S+) of its potential energy: it rests", capsys.readouterr().out)
    assert said is not None and float(said[1]) == pytest.approx(still.relative, rel=0.1)
    wrong = module.simulate((0.0, 0.5), inputs={"F": 1.0}, rtol=1e-3, work=True)
    wrong._work = wrong._work + np.linspace(0, 1e-3, len(wrong.t))  # type: ignore[operator]
    told = run_tables.energy(wrong)
    assert told is not None and told.doubtful and told.difference == pytest.approx(1e-3, rel=0.2)


@pytest.mark.usefixtures("no_pictures")
def test_a_run_that_stopped_early_is_reported_and_text_is_escaped(module: Module, tmp_path: Path) -> None:
    with pytest.warns(SimulationWarning):
        stopped = module.simulate((0.0, 1.0), max_steps=2)
    stopped.message = "stopped <early> & told"
    text = stopped.report(tmp_path / "run.htm").read_text(encoding="utf-8")
    assert '<p class="message bad">Stopped &lt;early&gt; &amp; told</p>' in text
    assert "simulate with work=True for the balance" in text
    stopped.t, stopped.x = stopped.t[:0], stopped.x[:0]
    for cached in ("energies", "energy", "inputs", "outputs", "frames"):
        stopped.__dict__.pop(cached, None)
    assert "<h1>cart_pole" in stopped.report(tmp_path / "empty.html").read_text(encoding="utf-8")


def test_without_anything_to_show_there_are_no_pictures(module: Module) -> None:
    empty = module.simulate((0.0, 0.01), rtol=1e-2)
    empty.t, empty.x = empty.t[:0], empty.x[:0]
    assert embedded.mechanism(empty, []) == embedded.curves(empty) == ()


def test_the_mechanism_is_shown_where_it_is_farthest_from_the_start() -> None:
    """A pendulum that is let go: after half a period it is as far as it gets, after a whole one back."""
    module = sd.systems.pendulum().embedding().compile("numpy")
    solution = module.simulate((0.0, 8.0), q=[1.0], u=[0.0])
    shown = run_report._times(solution)
    assert [title for title, _ in shown] == ["start", "farthest from the start", "end"]
    q = solution["q1"][np.searchsorted(solution.t, shown[1][1])]
    assert q == pytest.approx(-1, abs=1e-3) and solution["q1"][-1] > -0.9


@pytest.mark.usefixtures("no_pictures")
def test_equations_by_hand_and_constraints_have_reports(tmp_path: Path) -> None:
    x, y = sd.coordinates("x y")
    m, g = sd.parameters("m g")
    by_hand = sd.embedding([x], [x], [m], [-m * g], defaults={m: 1}).compile("numpy").simulate((0, 1), params={g: 9.81})
    text = by_hand.report(tmp_path / "hand.html").read_text(encoding="utf-8")
    assert "do not define the energy" in text
    assert [row for row in rows(text, "given") if len(row) == 4][-1] == ["g", "9.81", "", "none"]
    system = sd.System("bead", gravity=[0, -9.81])
    body = system.add_body("bead", mass=1)
    system.add_joint(sd.Planar("plane", system.ground, body, [x, y, sd.coordinates("a")]))
    system.add_body("disk", mass=1, inertia=1)
    system.add_joint(sd.Fixed("glue", body, "disk"))
    system.add_constraint(y - x**2 / 2, name="way")
    solution = system.augmented().compile("numpy").simulate((0.0, 1.0), q={"x": 1.0, "y": 0.5})
    (row,) = rows(solution.report(tmp_path / "bead.html").read_text(encoding="utf-8"), "constraints")
    assert row[0] == "way" and 0 <= float(row[1]) < 1e-9
    assert float(row[1]) == pytest.approx(np.abs(solution.constraint_violation).max(), rel=0.1)


def test_validity_checks_are_listed() -> None:
    ranges = [ValidityRange("draft", 1.0, 9.0, "the box leaves the water at a draft of {value} m"),
                 ValidityRange("tilt", -np.inf, 0.3, "too steep: {value}"),
                 ValidityRange("creep", -np.inf, 4.0, "it creeps {value} m", True)]
    values = np.column_stack([np.linspace(0.5, 4, 11), np.linspace(-1, 0.2, 11), np.full(11, 0.5)])
    module = SimpleNamespace(metadata=SimpleNamespace(validity_checks=ranges), functions=("validity_checks",))
    run: Any = SimpleNamespace(t=np.arange(11.0), rows=lambda name: values, module=module)
    draft, tilt, creep = run_tables.validity_checks(run)
    assert draft.outside and draft.message == "the box leaves the water at a draft of 0.5 m"
    assert (draft.least, draft.most, draft.limits) == ("0.5", "4", "from 1 to 9")
    assert not tilt.outside and not tilt.message and tilt.limits == "to 0.3"
    assert creep.outside and creep.message == "it creeps 5 m" and creep.least == creep.most == "5"


def test_curves_that_would_flatten_others_have_axes_of_their_own() -> None:
    t = np.linspace(0, 1, 5)[:, None]
    names = ["a", "rotor", "b", "none"]
    panel = Panel("coordinates", "rad", names, t * [0.1, 70.0, 0.4, 0.0], names)
    assert [list(p.names) for p in embedded._apart(panel)] == [["a", "b", "none"], ["rotor"]]
    assert embedded._apart(Panel("x", "m", ["a", "b"], t * [1.0, 9.0], ["a", "b"]))[0].names == ["a", "b"]
    assert len(embedded._apart(Panel("energy", "J", ["a", "b"], t * [1.0, 900.0], ["a", "b"], "energy"))) == 1


def test_files_that_cannot_be_written_are_rejected(solution: Solution, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(ArgumentError, match=r"cannot write the report to run.pdf: the ending must be \.html"):
        solution.report(tmp_path / "run.pdf")
    monkeypatch.setattr("symdyn.runtime.solutions.report.page", lambda solution: "")
    (tmp_path / "taken").write_text("")
    with pytest.raises(ArgumentError, match="the report cannot be written to"):
        solution.report(tmp_path / "taken" / "run.html")


@pytest.mark.usefixtures("no_pictures")
def test_the_command_line_writes_a_report(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    target = tmp_path / "run.html"
    arguments = ["simulate", "pendulum", "--t", "1", "--backend", "numpy", "--no-picture", "--output", str(tmp_path)]
    assert main([*arguments, "--report", str(target)]) == 0
    assert f"wrote {target}" in capsys.readouterr().out
    assert "<h1>pendulum" in target.read_text(encoding="utf-8")
    assert main([*arguments, "--report", "run.txt"]) == 2
    assert "--report takes a file that ends in .html, found run.txt" in capsys.readouterr().err


@pytest.fixture
def open_page(chromium: Any) -> Iterator[Callable[[Path, int], Any]]:
    opened = []

    def show(path: Path, width: int) -> Any:
        page = chromium.new_page(viewport={"width": width, "height": 900})
        opened.append(page)
        page.requests, page.complaints = [], []
        page.on("request", lambda r: page.requests.append(r.url))
        page.on("console", lambda m: page.complaints.append(m.text) if m.type in ("error", "warning") else None)
        page.goto(path.as_uri())
        page.wait_for_load_state("networkidle")
        return page

    yield show
    for page in opened:
        page.close()


def test_the_report_opens_in_a_browser_without_network_or_errors(open_page: Callable[[Path, int], Any], report: Path) -> None:
    for width in (1300, 420):
        page = open_page(report, width)
        assert [r for r in page.requests if not r.startswith(("file:", "data:"))] == [] and page.complaints == []
        assert page.evaluate("document.documentElement.scrollWidth <= window.innerWidth")
        sizes = page.evaluate("[...document.images].map(i => [i.naturalWidth, i.naturalHeight, i.alt.length])")
        assert len(sizes) > 8 and all(w > 50 and h > 30 and alt > 0 for w, h, alt in sizes)
