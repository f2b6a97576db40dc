"""The full report: every part is on the page, figures are those of independent routes, failures are reported and lose nothing."""

from __future__ import annotations

import re
import sys
from html import unescape
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import symdyn as sd
from symdyn.bench.work.benchmark import Benchmark
from symdyn.bench.work.methods import SCIPY
from symdyn.bench.work.record import Reference, Row, Skipped
from symdyn.cli import main
from symdyn.errors import ArgumentError, SymdynError
from symdyn.functions.tapes import function_tape
from symdyn.overview import condition as full_condition
from symdyn.overview import equations as full_equations
from symdyn.overview import page as full
from symdyn.overview import pictures as full_pictures
from symdyn.overview import work as full_work
from symdyn.overview.context import OfCondition, OfWork
from symdyn.overview.page import full_report
from symdyn.report.notation import entry_latex, name_latex
from symdyn.runtime.integrating.charts import distances
from symdyn.stress.record import Row as StressRow
from symdyn.stress.record import StressReport
from symdyn.stress.run import stress
from symdyn.stress.system_under_test import SystemUnderTest

pytest.importorskip("matplotlib")

from symdyn.pictures import embedded

PLATE = """
import symdyn as sd

def system():
    q = sd.coordinates("psi theta phi")
    l, g = sd.parameters("l g")
    plate = sd.System("plate", gravity=[0, 0, -g])
    body = plate.add_body("body", mass=1, inertia=[0.2, 0.3, 0.45], com=[l, 0, 0])
    plate.add_joint(sd.Spherical("ball", plate.ground, body, q, orientation=sd.EulerAngles("ZYX")))
    plate.defaults = {l: 0.5, g: 9.81}
    plate.initial = {q[1]: 0.3, q[2]: 0.001, q[1].dot: 1.5, q[0].dot: 0.02}
    plate.duration = 0.6
    return plate
"""
PARTS = ("equations", "generated", "condition", "work", "stress", "proof")


def section(text: str, name: str) -> str:
    part = text[text.index(f'<section id="{name}">'):]
    return part[:part.index("</section>")]


def rows(text: str, name: str) -> list[list[str]]:
    """Cells of the tables of a section."""
    return [[unescape(re.sub("<[^>]*>", "", cell)) for cell in re.findall(r"<td[^>]*>(.*?)</td>", row)]
            for row in re.findall(r"<tr[^>]*>(.*?)</tr>", section(text, name), re.DOTALL) if "<td" in row]


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[str]]:
    """The page of a pendulum, with few runs and checks, and what was printed on the way."""
    told: list[str] = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(full_work, "TOLERANCES", (1e-5, 1e-9))
        patch.setattr(full_work, "METHODS", (("dop853",),))
        patch.setattr(full_work, "REPEATS", 1)
        patch.setattr(full_condition, "STATES", 201)
        patch.setattr(full_pictures, "mechanism", lambda sol: embedded.mechanism(sol, [("start", 0.0)])[:1])
        patch.setattr(full, "stress", lambda tested, short: stress(tested, short, checks=["condition", "energy", "inputs"]))
        path = full_report("pendulum", tmp_path_factory.mktemp("full") / "new" / "page.html", budget=60, log=told.append)
    return path, told


@pytest.fixture(scope="module")
def text(written: tuple[Path, list[str]]) -> str:
    return written[0].read_text(encoding="utf-8")


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pages of text alone."""
    monkeypatch.setattr(full, "stress", lambda tested, short: StressReport())
    monkeypatch.setattr(full, "_condition", lambda tested, notes: OfCondition(0, "0", False, (), (), (), "", (), ()))
    monkeypatch.setattr(full_work, "measure", lambda *arguments: [])
    monkeypatch.setattr(full_work, "shown", lambda benchmarks, notes: OfWork((), "a table"))


def test_every_part_is_there(text: str, written: tuple[Path, list[str]]) -> None:
    assert "could not be made" not in text and "not made" not in text
    assert all(f'<section id="{name}">' in text and f'<a href="#{name}">' in text for name in PARTS)
    assert [t for t in written[1] if "s left" not in t] == ["equations", "equations of motion", "generated code",
                                                           "condition along the motion", "work against error",
                                                           "stability under stress", "proof by identities"]


def test_equations_are_typeset(text: str) -> None:
    part = section(text, "equations")
    assert part.count("<math") > 6 and "\\tilde" not in re.sub("<annotation.*?</annotation>", "", part)
    symbols = sd.systems.get("pendulum").equations().symbols
    groups = (symbols.coordinates, symbols.speeds, symbols.inputs, symbols.parameters)
    table = rows(text, "equations")
    assert [row[1] for row in table] == [x.name for group in groups for x in group]
    told = {row[1]: float(row[2].replace("−", "-")) for row in table}
    assert all(told[p.name] == pytest.approx(float(symbols.defaults[p]), rel=1e-5) for p in symbols.parameters)


def test_operations_choice_and_what_was_skipped(text: str) -> None:
    equations = sd.systems.get("pendulum").equations()
    report = equations.compile().report()
    found = rows(text, "generated")
    rhs = next(row for row in found if row[0] == "rhs")
    tape = function_tape(equations, "rhs")
    assert int(rhs[1]) == tape.operations == sum(map(int, rhs[2:7])) and int(rhs[8]) == tape.longest_chain()
    chosen = [row for row in found if row[-1] == "chosen"]
    assert len(chosen) == 1 and chosen[0][0] == equations.formulation and len(found) == len(report.rows) + len(report.candidates)
    assert all(f"<li>{note}</li>" in unescape(section(text, "generated")) for note in report.skipped)


def test_work_and_stress_are_shown(text: str) -> None:
    work = rows(text, "work")
    runs = [row for row in work if len(row) == 12]
    assert {(row[0], row[2]) for row in runs} >= {(sd.systems.get("pendulum").equations().formulation, "1e-05")}
    assert len({row[0] for row in runs}) > 1  # other formulations, too
    assert "closed form" in section(text, "work") and "data:image/svg+xml;base64," in section(text, "work")
    checks = rows(text, "stress")
    assert [row[0] for row in checks] == ["pass"] * len(checks) and {row[1] for row in checks} == {"condition", "energy"}
    assert '<td class="verdict pass">' in text and "inputs, pendulum" in section(text, "stress")
    assert {row[0] for row in rows(text, "proof")} <= {"pass", "–"}


def test_verdicts_are_in_order_and_colour(quick: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made = [StressRow("a check", "pendulum", f"done {v}", 1.0, 2.0, "reason", v, f"why {v}") for v in ("pass", "degrade", "fail")]
    monkeypatch.setattr(full, "stress", lambda tested, short: StressReport(made))
    page = full_report("pendulum", tmp_path / "page.html", verify=False).read_text(encoding="utf-8")
    assert [row[0] for row in rows(page, "stress")] == ["fail", "degrade", "pass"]
    assert all(f'<td class="verdict {v}">{v}</td>' in page and f"why {v}" in page for v in ("pass", "degrade", "fail"))
    assert '<dd class="bad">3 rows: 1 pass, 1 degrade, 1 fail' in page and '<section id="proof">' not in page


# -- condition along the motion


def test_the_condition_is_that_of_the_mass_matrix() -> None:
    equations = sd.systems.get("double_pendulum").embedding()
    found = full_condition.along(SystemUnderTest(equations))
    # For a matrix of two rows with ones on its diagonal it is (1 + |r|) / (1 - |r|), r the other entry.
    M = sd.systems.get("double_pendulum").embedding().lambdify("M_tilde")
    sol = found.solution
    matrices = np.array([M(q, u, sol.params) for q, u in zip(sol.q, sol.u, strict=True)])
    r = np.abs(matrices[:, 0, 1]) / np.sqrt(matrices[:, 0, 0] * matrices[:, 1, 1])
    at = np.searchsorted(found.t, sol.t)
    assert np.array_equal(found.t[at], sol.t) and len(found.t) > len(sol.t)
    assert np.allclose(found.curves["mass matrix, scaled"][at], (1 + r) / (1 - r), rtol=1e-10)
    assert np.allclose(found.curves["mass matrix, in its units"][at], np.linalg.cond(matrices), rtol=1e-10)
    assert len(found.passages) == 1 and not found.near
    assert f"largest condition {found.curves['mass matrix, scaled'].max():.3g}" in found.passages[0].text
    assert "q1_ddot" in found.passages[0].text and "q2_ddot" in found.passages[0].text


def test_gimbal_lock_is_named(tmp_path: Path) -> None:
    path = tmp_path / "plate.py"
    path.write_text(PLATE)
    from symdyn.cli.userfile import from_file

    tested = SystemUnderTest(from_file(path, {}).embedding())
    found = full_condition.along(tested)
    locks = [place for place in found.passages if "gimbal lock" in place.text]
    assert len(locks) == 1 and locks[0].near and found.near and "the ZYX angles of joint ball" in locks[0].text
    dense = tested.run(np.linspace(locks[0].t - 2e-4, locks[0].t + 2e-4, 401), tested.run((0.0, locks[0].t - 2e-4)).x[-1])
    least = float(np.arcsin(distances(tested.module, dense.x).min()))
    assert f"within {least:.2g} rad" in locks[0].text
    # The rates' mass matrix loses rank there as 1/distance^2: I_xx and the moment about the vertical share their direction.
    worst = found.curves["mass matrix, scaled"].max()
    assert 0.5 < worst * least**2 < 3 and "psi_ddot, phi_ddot" in "".join(p.text for p in found.passages)


def test_constraints_count(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(full_condition, "STATES", 101)
    monkeypatch.setattr(full_condition, "NEAR", 20.0)
    found = full_condition.along(SystemUnderTest(sd.systems.get("four_bar").augmented()))
    assert list(found.curves)[-1] == "mass matrix with constraints, scaled" and found.near
    assert 1 < len(found.passages) <= full_condition.PEAKS and "multiplier of hinge4" in "".join(p.text for p in found.passages)
    assert [p.t for p in found.passages] == sorted(p.t for p in found.passages)
    labels = full_condition._labels(found)
    assert ", ".join(label for _, label, _ in labels) == ", ".join(str(k + 1) for k in range(len(found.passages)))


# -- long equations


def test_long_quantities_are_shown_by_steps_or_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    equations = sd.systems.get("four_bar").augmented()
    count, shared = full_equations.written_out(equations, "M_tilde"), equations.tape("M_tilde").operations
    assert count > shared
    monkeypatch.setattr(full_equations, "WHOLE", 50)
    steps = full_equations.quantities(equations)[0]
    assert steps.name == "M_tilde" and steps.steps > 3 and f"{count} operations written out, {shared} in steps" in steps.note
    assert all("<math" in line.math for line in steps.lines) and steps.shown == len(steps.lines)
    monkeypatch.setattr(full_equations, "MANY", 2)
    assert full_equations.quantities(equations)[0].shown == steps.steps + 1
    monkeypatch.setattr(full_equations, "BY_STEPS", 10)
    long = full_equations.quantities(equations)[0]
    assert not long.lines and "3 × 3" in long.note and "too long to be read" in long.note and "--quantity M_tilde" in long.note


def test_numbers_are_rounded() -> None:
    typeset = full_equations.typesetter()
    assert typeset("x = 0.09999999999999998 y") == typeset("x = 0.1 y") and typeset("x = 0.125 y") != typeset("x = 0.1 y")


def test_names_with_indices_get_no_second_one() -> None:
    assert entry_latex("C_r", (0, 1)) == "C_{r,12}" and entry_latex("M_tilde", (0, 11)) == r"\tilde{M}_{1,12}"
    assert entry_latex("F_d", (2,)) == "F^{d}_{3}" and name_latex("nR_b2_b") == r"{}^{n}\mathbf{R}_{b_{2 b}}"
    typeset = full_equations.typesetter()
    assert "<math" in typeset(entry_latex("C_r", (0, 1))) and typeset("C_{r}_{12} < 1") == "<code>C_{r}_{12} &lt; 1</code>"


# -- what fails


def test_a_part_that_fails_is_reported_and_loses_nothing(quick: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def named(*arguments: Any) -> None:
        raise SymdynError("nothing can be measured <here>")

    def crash(*arguments: Any, **options: Any) -> None:
        raise ZeroDivisionError("by zero")

    monkeypatch.setattr(full_work, "measure", named)
    monkeypatch.setattr(full, "stress", crash)
    monkeypatch.setattr(full, "_condition", crash)
    told: list[str] = []
    page = full_report("pendulum", tmp_path / "page.html", log=told.append).read_text(encoding="utf-8")
    assert "This part could not be made: nothing can be measured &lt;here&gt;" in section(page, "work")
    for name in ("stress", "condition"):
        assert re.search(r"could not be made: ZeroDivisionError in test_full_report\.py:\d+: by zero", section(page, name))
    assert page.count("(not made)</a>") == 3 and "<math" in section(page, "equations") and rows(page, "proof")
    assert sum("not made: " in line for line in told) == 3


def test_without_extras(quick: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "latex2mathml.converter", None)
    monkeypatch.setitem(sys.modules, "symdyn.pictures.figure", None)
    page = full_report("pendulum", tmp_path / "page.html", verify=False).read_text(encoding="utf-8")
    part = section(page, "equations")
    assert "latex2mathml; install it with" in unescape(part) and "<math" not in part and r"<code>\tilde{\mathbf{M}}" in part
    with pytest.raises(sd.MissingExtra, match="pictures need matplotlib"):
        full_condition.picture(SimpleNamespace())


def test_equations_without_numbers_are_no_failure_of_theirs(tmp_path: Path) -> None:
    q, m, k = sd.coordinates("q"), *sd.parameters("m k")
    equations = sd.embedding(coordinates=[q], position=[q], mass=[m], force=[-k * q])
    page = full_report(equations, tmp_path / "page.html", verify=False).read_text(encoding="utf-8")
    assert page.count("system: parameters: no value for m, k, which have no default") == 3
    assert "Nothing was compared" in page and 'class="verdict fail"' not in page


def measured(*rows: Row, kind: str = "extended", unfinished: str = "", operations: dict[str, int] | None = None) -> Benchmark:
    return Benchmark("m", 1.0, list(rows), [Skipped("a", "", "why")], Reference(kind, (1.0,), [[0.0]], 9.0, "how"),
                     operations=operations or {}, unfinished=unfinished)


@pytest.fixture
def benches(monkeypatch: pytest.MonkeyPatch) -> SimpleNamespace:
    """Benches of four seconds each: what was asked for, the time, the kind of reference, and what they are called with."""
    found = SimpleNamespace(asked=[], now=0.0, kind="extended", names=("a", "b"))

    def bench(tested: Any, formulations: Any, methods: Any, budget: float, **options: Any) -> Benchmark:
        found.asked.append((formulations, methods))
        assert budget == 10 - found.now
        found.now += 4.0
        rows = [Row(f, m, 1e-3) for f in formulations or found.names for m in methods]
        return measured(*rows, kind=found.kind, unfinished="some" if found.now > 4 else "")

    monkeypatch.setattr("symdyn.bench.work.bench", bench, raising=False)
    monkeypatch.setattr(full_work, "find_compiler", lambda: "a compiler")
    monkeypatch.setattr(full_work, "clock", SimpleNamespace(perf_counter=lambda: found.now))
    return found


def quiet(text: str) -> None:
    """Says nothing."""


def test_the_budget_is_shared(benches: SimpleNamespace) -> None:
    methods, formulations = full_work.measure("m", "a", 10, quiet)
    assert benches.asked == [(("a",), full_work.METHODS[0]), (("a",), full_work.METHODS[1]), (None, full_work.OTHERS)]
    assert methods.unfinished == "10 s were not enough for some runs of gauss, radau; some runs of other formulations"
    assert len(methods.rows) == 5 and [r.formulation for r in formulations.rows] == ["a", "b"] and not formulations.unfinished
    benches.now, benches.names = 0.0, ("a",)  # one formulation is nothing to compare
    assert len(full_work.measure("m", "a", 10, quiet)) == 1


def test_a_reference_that_is_not_kept_is_not_made_too_often(benches: SimpleNamespace, monkeypatch: pytest.MonkeyPatch) -> None:
    benches.kind = "agreement"
    found = full_work.measure("m", "a", 10, quiet)
    assert [f.unfinished for f in found] == ["10 s were not enough for some runs of gauss, radau; other formulations"]
    benches.now = 0.0
    monkeypatch.setattr(full_work, "_AGAIN", 0.7)
    assert full_work.measure("m", "", 10, quiet)[0].unfinished == "10 s were not enough for gauss, radau"


def test_nothing_measured_is_reported(benches: SimpleNamespace, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("symdyn.bench.work.bench", lambda *arguments, **options: measured(unfinished="all"))
    with pytest.raises(SymdynError, match=r"no run was made within 10 s.*give more time with --budget"):
        full_work.measure("m", "a", 10, quiet)
    monkeypatch.setattr("symdyn.bench.work.bench", lambda *arguments, **options: measured())
    with pytest.raises(SymdynError, match="no method fits:\n  - a: why"):
        full_work.measure("m", "a", 10, quiet)


def test_without_a_compiler_it_is_scipys_methods(benches: SimpleNamespace, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(full_work, "find_compiler", lambda: None)
    found = full_work.measure("m", "a", 10, quiet)
    assert {row.method for b in found for row in b.rows} == {m for _, ms in benches.asked for m in ms} <= set(SCIPY)


def test_rows_are_merged_once() -> None:
    first = measured(Row("a", "x", 1e-3, seconds=1.0), operations={"a": 1})
    second = measured(Row("a", "x", 1e-3, seconds=2.0), Row("b", "x", 1e-3), operations={"a": 9, "b": 2})
    both = full_work.merged(first, second)
    assert [(r.formulation, r.seconds == 1.0) for r in both.rows] == [("a", True), ("b", False)]
    assert both.operations == {"a": 1, "b": 2} and both.skipped == first.skipped


def test_bad_arguments_are_rejected_before_anything_is_done(tmp_path: Path) -> None:
    told: list[str] = []
    (tmp_path / "taken").write_text("")
    for call, message in (
            (lambda: full_report("pendulum", tmp_path / "page.pdf"), r"cannot write the report to page\.pdf: the ending must be"),
            (lambda: full_report("pendulum", tmp_path / "taken" / "page.html"), "the report cannot be written to"),
            (lambda: full_report("pendulum", tmp_path / "page.html", budget=0), "the budget 0 must be a positive number"),
            (lambda: full_report("pendulum", tmp_path / "page.html", budget=float("nan")), "the budget nan must be"),
            (lambda: full_report(3, tmp_path / "page.html"), "takes a System, equations or a name of the catalogue, found 3")):
        with pytest.raises(ArgumentError, match=message):
            call()
    assert not (tmp_path / "page.html").exists() and told == []


# -- the command


def test_the_command(quick: None, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "mine.py"
    path.write_text(PLATE)
    assert main(["report", str(path), "--full", "--no-verify", "--output", str(tmp_path / "out")]) == 0
    said = capsys.readouterr()
    assert said.out == f"wrote {tmp_path / 'out' / 'report.html'}\n" and "symdyn: work against error\n" in said.err
    assert "<h1>plate" in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")


@pytest.mark.parametrize(("arguments", "message"), [
    (["pendulum", "--budget", "5"], "--budget goes with --full"),
    (["pendulum", "--output", "x"], "--output goes with --full"),
    (["pendulun", "--full"], "pendulun"),
    (["EMPTY", "--full"], "defines no function system()"),
    (["pendulum", "--full", "--budget", "-1"], "the budget -1.0 must be a positive number of seconds"),
    (["pendulum", "--full", "--output", "EMPTY"], "the report cannot be written to")])
def test_wrong_commands(arguments: list[str], message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
                        capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "empty.py").write_text("")
    assert main(["report", *[str(tmp_path / "empty.py") if a == "EMPTY" else a for a in arguments]]) == 2
    said = capsys.readouterr().err
    assert message in said and "Traceback" not in said


def test_the_page_opens_in_a_browser_without_network_or_errors(written: tuple[Path, list[str]], chromium: Any) -> None:
    page = chromium.new_page(viewport={"width": 1300, "height": 900})
    requests: list[str] = []
    complaints: list[str] = []
    page.on("request", lambda r: requests.append(r.url))
    page.on("console", lambda m: complaints.append(m.text))
    page.goto(written[0].as_uri())
    for width in (1300, 420):
        page.set_viewport_size({"width": width, "height": 900})
        assert page.evaluate("document.documentElement.scrollWidth <= window.innerWidth")
    assert [r for r in requests if not r.startswith(("file:", "data:"))] == [] and complaints == []
    sizes = page.evaluate("[...document.images].map(i => [i.naturalWidth, i.naturalHeight, i.alt.length])")
    assert len(sizes) == 4 and all(w > 50 and h > 30 and alt > 0 for w, h, alt in sizes)
    page.close()
