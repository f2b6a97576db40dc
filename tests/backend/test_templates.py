"""Templates of the user's own: another language, one file replaced, and what is said when one is broken."""

from __future__ import annotations

import dataclasses
import json
import re
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from symdyn.backend.context import Algorithms, Calls, Context, Integrator, Manifold, Model, Needs, Options
from symdyn.backend.dialect import identifier
from symdyn.backend.function import Function
from symdyn.backend.program import Program
from symdyn.backend.reference import Reference
from symdyn.backend.source import backends, template_folders
from symdyn.cli import main
from symdyn.errors import CompilerWarning, SymdynError
from symdyn.functions.table import FUNCTIONS
from symdyn.functions.tapes import has_function
from symdyn.named_records import NamedRecords
from symdyn.pipeline import emit, write_source
from symdyn.targets import fmu
from symdyn.targets.cmake import Package, PackageContext, Stack
from symdyn.targets.fmu_context import Code, Description, Fmu, FmuContext
from symdyn.targets.modelica_context import Declared, ModelicaContext, ModelicaEquations, ModelicaModel
from tests.helpers import records_in, swept

HERE = Path(__file__).parent
SHIPPED = template_folders()[0]
NODE = pytest.mark.skipif(shutil.which("node") is None, reason="no node here")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A template folder of the user's with a backend of its own: JavaScript under another name."""
    shutil.copytree(SHIPPED / "javascript", tmp_path / "templates" / "ecmascript")
    return tmp_path / "templates"


def node(path: Path, program: str) -> str:
    done = subprocess.run(["node", "-e", f"const m = require({json.dumps(str(path))});\n{program}"], capture_output=True,
                          text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


# -- another language


def test_example_is_small() -> None:
    lines = [line for path in (SHIPPED / "javascript").iterdir() for line in path.read_text().splitlines()]
    assert len(lines) <= 61


@NODE
@pytest.mark.parametrize("name", ["pendulum", *swept(["three_link_arm", "prismatic_chain"]), "awkward_names"])
def test_javascript_checks_itself(name: str, derived: Callable[..., Any], folder: Path, tmp_path: Path) -> None:
    equations = derived(name)
    functions = [f for f in FUNCTIONS if has_function(equations, f)]
    (path,) = write_source(emit(equations, "ecmascript", functions, folder), tmp_path)
    assert path.name == f"{equations.name}.js"
    done = subprocess.run(["node", path], capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (0, "all results agree\n"), done.stdout + done.stderr
    path.write_text(path.read_text().replace("out[0] = ", "out[0] = 0.001 + "))
    assert subprocess.run(["node", path], capture_output=True, text=True).returncode == 1


@NODE
def test_javascript_gives_the_numbers_of_the_module(derived: Callable[..., Any], compiled: Callable[..., Any], folder: Path,
                                                    tmp_path: Path) -> None:
    (path,) = write_source(emit(derived("double_pendulum"), "ecmascript", templates=folder), tmp_path)
    module = compiled("double_pendulum", "numpy")
    q, u, p = [0.3, -0.8], [1.5, 0.4], module.parameters().tolist()
    printed = node(path, f"const p = {p}, q = {q}, u = {u}, c = m.prologue({{ p }});\n"
                         "console.log(JSON.stringify([m.rhs({ q, u, p, c }), m.mass_matrix({ q, p, c })]));")
    rhs, mass_matrix = json.loads(printed)
    np.testing.assert_allclose(rhs, module.rhs(0.0, [*q, *u]), rtol=1e-13)
    np.testing.assert_allclose(np.reshape(mass_matrix, (2, 2)), module.mass_matrix(q), rtol=1e-13)


@NODE
def test_javascript_rejects_a_singular_mass_matrix(derived: Callable[..., Any], folder: Path, tmp_path: Path) -> None:
    (path,) = write_source(emit(derived("pendulum"), "ecmascript", templates=folder), tmp_path)
    printed = node(path, "try { m.prologue({ p: [9.81, 1, 0] }); } catch (e) { console.log(e.name, e.message); }")
    assert printed == "RangeError the mass matrix is not positive definite at q1_dot\n"


def test_arrays_that_start_at_one(derived: Callable[..., Any], folder: Path) -> None:
    dialect = folder / "ecmascript" / "dialect.toml"
    dialect.write_text("first = 1\n" + dialect.read_text())
    text = emit(derived("double_pendulum"), "ecmascript", templates=folder).files["double_pendulum.js"]
    assert "q[1]" in text and "q[2]" in text and "q[0]" not in text and "out[4] = " in text and "out[0]" not in text


def test_literals_of_another_kind(derived: Callable[..., Any], folder: Path) -> None:
    dialect = folder / "ecmascript" / "dialect.toml"
    dialect.write_text('literal = "{value!r}_real"\n' + dialect.read_text())
    text = emit(derived("pendulum"), "ecmascript", ["energy"], folder).files["pendulum.js"]
    assert "0.5_real*" in text


@NODE
def test_command_line(folder: Path, tmp_path: Path) -> None:
    assert main(["generate", "pendulum", "--templates", str(folder), "--backend", "ecmascript",
                 "--output", str(tmp_path / "out")]) == 0
    assert subprocess.run(["node", tmp_path / "out" / "pendulum.js"]).returncode == 0


# -- one file replaced


def test_one_file_of_a_shipped_backend(derived: Callable[..., Any], tmp_path: Path) -> None:
    (tmp_path / "c").mkdir()
    (tmp_path / "c" / "main.c.jinja").write_text(
        "// {{ model.name }} has {{ model.n_q }} coordinates\nint main(void) { return 0; }\n")
    mine, usual = (emit(derived("pendulum"), "c", templates=t).files for t in (tmp_path, None))
    assert mine["main.c"] == "// pendulum has 1 coordinates\nint main(void) { return 0; }\n"
    assert {n: t for n, t in mine.items() if n != "main.c"} == {n: t for n, t in usual.items() if n != "main.c"}
    assert backends(tmp_path) == ["c", "firmware", "fortran", "javascript", "julia", "matlab", "numpy", "python", "rust"]


def test_an_included_file(derived: Callable[..., Any], tmp_path: Path) -> None:
    """Includes of a shipped template are looked for in the user's folder first, too."""
    (tmp_path / "c").mkdir()
    (tmp_path / "c" / "simulate.c.jinja").write_text("// no integrator for {{ model.name }}\n")
    text = emit(derived("pendulum"), "c", templates=tmp_path).files["pendulum.c"]
    assert "// no integrator for pendulum\n" in text and "dop853" not in text


def test_a_part_of_the_runtime(derived: Callable[..., Any], tmp_path: Path) -> None:
    """Parts in C are looked for in the user's folder first, as templates are."""
    (tmp_path / "c" / "runtime").mkdir(parents=True)
    part = (SHIPPED / "c" / "runtime" / "steps.h").read_text()
    (tmp_path / "c" / "runtime" / "steps.h").write_text(part.replace("// Control of the steps", "// My control of the steps"))
    text = emit(derived("pendulum"), "c", templates=tmp_path).files["pendulum.c"]
    assert "// My control of the steps" in text and text.count("static void symdyn_judge(") == 1


def test_a_module_from_own_templates(derived: Callable[..., Any], tmp_path: Path) -> None:
    (tmp_path / "numpy").mkdir()
    text = (SHIPPED / "numpy" / "model.py.jinja").read_text()
    (tmp_path / "numpy" / "model.py.jinja").write_text(text + "\nMINE = True\n")
    module = derived("pendulum").compile(backend="numpy", templates=tmp_path)
    assert module.library("rhs").module.MINE and module.rhs(0.0, [0.0, 1.0]).tolist() == [1.0, 0.0]


# -- what is said when something is wrong


def failure(equations: Any, backend: str, templates: Any) -> str:
    with pytest.raises(SymdynError) as caught:
        emit(equations, backend, templates=templates)
    return str(caught.value)


def test_missing_folder_dialect_or_backend(derived: Callable[..., Any], folder: Path) -> None:
    equations = derived("pendulum")
    assert "/no/such/folder does not exist" in failure(equations, "c", "/no/such/folder")
    known = "firmware, fortran, javascript, julia, matlab, numpy, python, rust"
    assert f"no backend 'ada'; there are c, ecmascript, {known}; a folder with a dialect" in failure(equations, "ada", folder)
    (folder / "ecmascript" / "dialect.toml").unlink()
    assert f"no backend 'ecmascript'; there are c, {known}" in failure(equations, "ecmascript", folder)


@pytest.mark.parametrize(("line", "broken", "message"), [
    (2, "{% for line in model.header %}\n{{ lin }}\n{% endfor %}\n", "'lin' is undefined"),
    (3, "a\nb\n{% for line in model.header %}\n", "Unexpected end of template"),
    (2, "a\n{{ model.name | upcase }}\n", "No filter named 'upcase'"),
    (2, "a\n{{ program.functoins }}\n", "no attribute 'functoins'"),
    (3, "a\n\n{{ 1 + model.name }}\n", "unsupported operand"),
    (1, "{{ calls.signature() }}\n", "missing 1 required positional argument"),
])
def test_broken_template(line: int, broken: str, message: str, derived: Callable[..., Any], folder: Path) -> None:
    path = folder / "ecmascript" / "model.js.jinja"
    path.write_text(broken)
    said = failure(derived("pendulum"), "ecmascript", folder)
    assert said.startswith(f"template {path}, line {line}: ") and message in said


def test_fault_in_an_included_file(derived: Callable[..., Any], tmp_path: Path) -> None:
    (tmp_path / "c" / "methods").mkdir(parents=True)
    path = tmp_path / "c" / "methods" / "explicit.c.jinja"
    path.write_text("\n\n\n{{ nothing }}")
    assert failure(derived("pendulum"), "c", tmp_path) == f"template {path}, line 4: 'nothing' is undefined"
    path.write_text("{% include 'c/absent.jinja' %}")
    assert "needs c/absent.jinja, which is in none of the template folders" in failure(derived("pendulum"), "c", tmp_path)


def test_file_that_the_dialect_names_is_missing(derived: Callable[..., Any], folder: Path) -> None:
    (folder / "ecmascript" / "model.js.jinja").unlink()
    assert "ecmascript/model.js.jinja" in failure(derived("pendulum"), "ecmascript", folder)


@pytest.mark.parametrize(("old", "new", "message"), [
    ('and = "', 'sinus = "', "unknown operations: sinus"),
    ("assign = ", "asign = ", "missing: assign"),
    ("[files]", "[fils]", "missing: files"),
    ("store = ", "store ", "not valid TOML"),
    ('z = "z[{k}]", ', "", "load.z is missing"),
    ('q = "q[{k}]"', 'q = "q[{n}]"', "load.q = 'q[{n}]' cannot be filled in ('n'); it may use {k}"),
    ("{name} = {value};", "{name} = {values};", "assign = 'const {name} = {values};' cannot be filled in"),
    ("store = ", "zeros = 'out[{k}]'\nstore = ", "zeros = 'out[{k}]' cannot be filled in ('k'); it may use {n}"),
    ("({0} && {1})", "({0} && {3})", "operations.and = '({0} && {3})' cannot be filled in"),
    ("({0} && {1})", "{ {0} && {1} }", "braces are doubled"),
    ("[operations]", "[sincos]\nleast = 2\ntake = ''\nsine = ''\ncos = ''\n[operations]",
     "sincos.sin is missing; sincos.sine is not known"),
    ("[operations]", "[sincos]\nleast = 2\ntake = '{angle}'\nsin = ''\ncos = ''\n[operations]",
     "sincos.take = '{angle}' cannot be filled in ('angle'); it may use {n}, {angles}"),
    ("[operations]", "[loops]\nindex = 'i'\nbegin = 'for {m}'\nend = ''\ncount = 1\n[operations]",
     "loops takes parts, which are missing; loops.carried is missing"),
    ("[operations]", "[loops]\nindex = 'i'\nbegin = 'for {m}'\nend = ''\ncount = 1\n[operations]",
     "loops.count is not known; loops.begin = 'for {m}' cannot be filled in ('m'); it may use {n}"),
])
def test_broken_dialect(old: str, new: str, message: str, derived: Callable[..., Any], folder: Path) -> None:
    path = folder / "ecmascript" / "dialect.toml"
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))
    said = failure(derived("pendulum"), "ecmascript", folder)
    assert str(path) in said and message in said


# -- what the README says


def members(record: type) -> set[str]:
    """Names that templates may read: fields, properties and methods."""
    own = {name for name, value in vars(record).items() if isinstance(value, property) or callable(value)}
    return {name for name in own | {f.name for f in dataclasses.fields(record)} if not name.startswith("_")}


@pytest.mark.parametrize(("heading", "record"), [
    ("model", Model), ("options", Options), ("calls", Calls), ("needs", Needs), ("algorithms", Algorithms),
    ("manifold", Manifold), ("integrator", Integrator), ("program", Program), ("functions", Function),
    ("reference", Reference), ("fmu", Fmu), ("description", Description), ("code", Code),
    ("model in Modelica", ModelicaModel), ("declared", Declared), ("equations", ModelicaEquations), ("package", Package),
    ("stack", Stack)])
def test_readme_lists_what_a_record_has(heading: str, record: type) -> None:
    """Every name in the table of a record is there, and every name that is there is in the table."""
    assert listed(f"### {heading}\n") == members(record)


@pytest.fixture(scope="module")
def contexts(derived: Callable[..., Any], tmp_path_factory: pytest.TempPathFactory) -> dict[type, NamedRecords]:
    """Records that the templates of a module in C, an FMU, a Modelica model and the page of a firmware package get."""
    seen: dict[type, NamedRecords] = {}
    folder = tmp_path_factory.mktemp("contexts")

    def spy(self: NamedRecords) -> dict[str, Any]:
        seen.setdefault(type(self), self)
        return names(self)

    names = NamedRecords.names
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(NamedRecords, "names", spy)
        patch.setattr(fmu, "find_compiler", lambda: None)
        emit(derived("pendulum"), "c")
        with pytest.warns(CompilerWarning, match="sources and no binary"):
            derived("pendulum").compile(backend="numpy").to_fmu(folder / "pendulum.fmu")
        derived("pendulum").compile(backend="numpy").to_modelica(folder / "modelica")
        derived("pendulum").to_cmake(folder / "firmware")
    return seen


@pytest.mark.parametrize(("heading", "record"), [
    ("Context of a template", Context), ("Context of the templates of an FMU", FmuContext),
    ("Context of the templates of a Modelica model", ModelicaContext),
    ("Context of the page of a firmware package", PackageContext)])
def test_readme_lists_what_templates_get(heading: str, record: type, contexts: dict[type, NamedRecords]) -> None:
    assert listed(f"## {heading}\n") == set(contexts[record].names())


def test_records_of_templates_are_frozen(contexts: dict[type, NamedRecords]) -> None:
    context = contexts[Context]
    assert isinstance(context, Context)
    records = [context, *[r for r in context.names().values() if dataclasses.is_dataclass(r)], context.program.prologue]
    assert len(records) == 11
    targets = [*records_in(contexts[FmuContext]), *records_in(contexts[ModelicaContext]), *records_in(contexts[PackageContext])]
    for record in [*records, *targets]:
        with pytest.raises(dataclasses.FrozenInstanceError):
            setattr(record, dataclasses.fields(record)[0].name, None)


def listed(heading: str) -> set[str]:
    """The names in the first table after a heading of the README."""
    text = (SHIPPED / "README.md").read_text(encoding="utf-8").split(f"\n{heading}")[1].split("\n#")[0]
    rows = [line.split("|")[1] for line in text.splitlines() if line.startswith("| `")]
    return set(re.findall(r"`(\w+)(?:\([^)]*\))?`", "\n".join(rows)))


def test_identifiers() -> None:
    taken: set[str] = set()
    names = ["q1", "q1", "lambda", "θ", "2x", "_m", "m 1", "x", "let", "main", "q1_2"]
    written = [identifier(name, taken) for name in names]
    assert written[0] == "q1" and len(set(written)) == len(names)
    assert all(re.fullmatch(r"[A-Za-z]\w*", name, re.ASCII) for name in written)
    assert not {"lambda", "x", "let", "main"} & set(written)
    assert [identifier("k", taken) for _ in range(5)] == ["k", "k_", "k_2", "k_3", "k_4"]
    assert [identifier("while", taken) for _ in range(3)] == ["while_", "while_2", "while_3"]
