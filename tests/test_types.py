"""Types of the public names in editors and type checkers."""

from __future__ import annotations

import ast
import inspect
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest

import symdyn as sd
from symdyn import systems
from symdyn.cli.parser import make_parser
from symdyn.ensembles import Ensemble
from symdyn.facade import EquationsFacade, MotionFacade, SystemFacade
from symdyn.formulation.equations import Equations
from symdyn.formulation.printed.augmented import AugmentedEquations
from symdyn.formulation.printed.independent_speeds import MotionEquations
from symdyn.runtime.batches.solution import BatchSolution
from symdyn.runtime.integrating.ode_solver import CompiledSolver
from symdyn.runtime.integrating.simulate import RTOL
from symdyn.runtime.module import Module
from symdyn.runtime.solutions.solution import Solution
from symdyn.statics.actuation import Actuation
from symdyn.statics.campbell import Campbell
from symdyn.statics.equilibria import Equilibria
from symdyn.statics.equilibrium import Equilibrium
from symdyn.statics.linearize import Linearization
from symdyn.statics.modes import Mode, Modes
from symdyn.statics.regulator import Regulator
from symdyn.statics.stability import Stability

STUB = Path(sd.__file__).with_name("__init__.pyi")
USER = """
import symdyn as sd

x, theta = sd.coordinates("x theta")
m, l, g = sd.parameters("m l g")
F = sd.inputs("F")
system = sd.System("crane", gravity=[0, -g])
cart = system.add_body("cart", mass=m)
load = system.add_body("load", mass=m, com=[0, -l])
system.add_joint(sd.Prismatic("rail", system.ground, cart, x, axis=[1, 0]))
system.add_joint(sd.Revolute("hook", cart, "load", theta))
system.add_force(cart, [F - 2 * x.dot, 0])
system.add_event("passes", theta, stop=True)
system.defaults = {m: 1.0, l: 2.0, g: 9.81}
equations = system.embedding()
module = equations.compile(backend="numpy")
solution = module.simulate((0, 1), q={"x": 0.1}, inputs={"F": 1.0})
linear = module.linearize(module.equilibrium(), hold=None)
"""
# Only NumPy's types, of all that symdyn can work with, are in the revealed ones.
SETTINGS = """[mypy]
follow_imports = skip
ignore_missing_imports = True
[mypy-symdyn.*,numpy.*]
follow_imports = silent
"""
# Expression -> the class that is revealed.
REVEALED = {
    "system": "System", "cart": "Body", "system.check()": "Model", "equations": "EmbeddedEquations",
    "system.augmented()": "AugmentedEquations", "system.recursive()": "RecursiveEquations", "module": "Module",
    "system.compile()": "Module", "solution": "Solution", "solution.t": "ndarray", "solution.energy": "ndarray",
    "module.rhs(0.0, [0.0, 0.0, 0.0, 0.0])": "ndarray", "module.jacobian(0.0, [0.0, 0.0, 0.0, 0.0]).x": "ndarray",
    "module.adjoint(0.0, [0.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]).params": "ndarray",
    "module.equilibrium()": "Equilibrium", "linear": "Linearization",
    'linear.lqr({"x": 1}, {"F": 1})': "Regulator", "module.stability()": "Stability", "equations.verify()": "Verification",
    "equations.base_parameters()": "BaseParameters", "sd.Table([0, 1], [0, 1])": "Table",
    'module.simulate_batch({"x": [0.1, 0.2]})': "BatchSolution", "module.actuation(0, [0, 0], [0, 0], [0, 0])": "Actuation",
    "x": "Coordinate", 'sd.coordinates("z").dot': "Rate", 'sd.motions("z").dot': "GivenRate", "sd.systems.pendulum()": "System",
    "sd.systems.four_bar().compile().simulate((0, 1))": "Solution", "sd.systems.names()": "list", "sd.bench(system)": "Benchmark",
    "sd.stress(system)": "StressReport"}


def test_the_stub_has_the_public_names_and_where_they_are() -> None:
    tree = ast.parse(STUB.read_text(encoding="utf-8"))
    listed = {(node.module, alias.name) for node in tree.body if isinstance(node, ast.ImportFrom) for alias in node.names}
    for module, names in sd._HOME.items():
        assert {name for home, name in listed if home == module} >= set(names), module
    public = {alias.asname for node in tree.body if isinstance(node, ast.ImportFrom) for alias in node.names if alias.asname}
    assert public | {"t"} == set(sd.__all__)


def test_mypy_in_strict_mode_reveals_the_classes(tmp_path: Path, pytestconfig: pytest.Config) -> None:
    """mypy keeps what it has read, so that it reads only files that have changed since the last run."""
    file = tmp_path / "user.py"
    file.write_text(USER + "".join(f"reveal_type({expression})\n" for expression in REVEALED), encoding="utf-8")
    settings = tmp_path / "mypy.ini"
    settings.write_text(SETTINGS, encoding="utf-8")
    kept = getattr(pytestconfig, "cache", None)  # None without the plugin of pytest that keeps it
    cache = kept.mkdir("mypy") if kept else os.devnull
    command = [sys.executable, "-m", "mypy", "--strict", "--config-file", str(settings), "--cache-dir", str(cache), str(file)]
    found = subprocess.run(command, capture_output=True, text=True, cwd=STUB.parent.parent, check=False)
    assert found.returncode == 0, found.stdout
    revealed = [re.search(r"(\w+)(?:\[.*)?\"$", line)[1] for line in found.stdout.splitlines() if "Revealed type" in line]
    assert dict(zip(REVEALED, revealed, strict=True)) == REVEALED


def test_the_stub_of_the_catalogue_has_its_mechanisms() -> None:
    text = Path(sd.systems.__file__).with_suffix(".pyi").read_text(encoding="utf-8")
    listed = dict(re.findall(r"^from symdyn\.systems\.(\w+ import \w+) as (\w+)$", text, re.MULTILINE))
    assert {name: home.replace(" import ", ":") for home, name in listed.items()} == systems._CATALOGUE


@pytest.fixture(scope="module")
def jedi(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ModuleType]:
    """Jedi with a cache of this process: processes that share one read files that another has half written."""
    package: ModuleType = pytest.importorskip("jedi", reason="no language server; run: pip install jedi")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(package.settings, "cache_directory", str(tmp_path_factory.mktemp("jedi")))
        yield package


@pytest.mark.parametrize(("after", "names"), [
    ("sd.systems.", {"pendulum", "four_bar", "names"}), ("sd.systems.pendulum().", {"embedding", "compile"}),
    ("sd.coordinates('y').", {"dot", "ddot"}), ("sd.", {"System", "Revolute", "coordinates", "motions", "Table", "compare"}),
    ("system.", {"add_body", "add_joint", "add_force", "embedding", "augmented", "defaults"}),
    ("equations.", {"M_tilde", "compile", "verify", "write", "latex"}),
    ("module.", {"simulate", "rhs", "linearize", "equilibrium", "stability"}),
    ("solution.", {"t", "x", "plot", "energy", "reactions"})])
def test_an_editor_completes_names(jedi: ModuleType, after: str, names: set[str]) -> None:
    text = USER + after
    lines = text.split("\n")
    offered = {c.name for c in jedi.Script(text).complete(len(lines), len(lines[-1]))}
    assert names <= offered, names - offered


def test_an_editor_offers_public_names_and_folders_of_the_package_alone(jedi: ModuleType) -> None:
    """Files and folders of a package are offered by editors in any case."""
    offered = {c.name for c in jedi.Script("import symdyn as sd\nsd.").complete(2, 3) if not c.name.startswith("_")}
    inside = {path.name.removesuffix(".py") for path in STUB.parent.iterdir()}
    assert set(sd.__all__) <= offered and offered - inside <= set(sd.__all__)


def test_an_editor_shows_signatures_with_defaults(jedi: ModuleType) -> None:
    text = USER + "module.simulate("
    lines = text.split("\n")
    [signature] = jedi.Script(text).get_signatures(len(lines), len(lines[-1]))
    assert {"t", "q", "u", "params", "inputs", "rtol", "method", "events"} <= {p.name for p in signature.params}


def test_public_signatures_show_the_relative_tolerance_as_a_number() -> None:
    """The site shows a signature as it is written, so each has the number, not the name that it has elsewhere."""
    functions = [Module.simulate, Module.gradient, Module.simulate_batch, CompiledSolver.__init__, sd.fit]
    assert [inspect.signature(f).parameters["rtol"].default for f in functions] == [RTOL] * len(functions)
    assert all("rtol: float = 1e-8," in inspect.getsource(f) for f in functions)
    assert make_parser().parse_args(["simulate", "pendulum"]).rtol == RTOL


RETURNED = (Module, Solution, BatchSolution, Equations, MotionEquations, AugmentedEquations, Equilibrium, Equilibria,
            Linearization, Modes, Mode, Stability, Campbell, Regulator, Actuation, Ensemble, SystemFacade, EquationsFacade,
            MotionFacade)
# Where no type says it: entries of SymPy or of nested lists; a comparison or several of them, by the text; what a scalar of a
# derivation may be; a client of dask, mpi4py or concurrent.futures.
UNTYPED = {"Case", "Formula", "compare", "rate", "motion", "rates", "ensemble"}


def _signatures() -> Iterator[tuple[str, inspect.Signature]]:
    owners = [thing for name in sd.__all__ if inspect.isclass(thing := getattr(sd, name)) and not issubclass(thing, Exception)]
    for name in sd.__all__:
        if inspect.isfunction(getattr(sd, name)):
            yield name, inspect.signature(getattr(sd, name))
    for owner in owners:
        yield owner.__name__, inspect.signature(owner.__init__)
    for owner in [*owners, *RETURNED]:
        for name, thing in vars(owner).items():
            function = thing.fget if isinstance(thing, property) else getattr(thing, "func", thing)
            if inspect.isfunction(function) and not name.startswith("_"):
                yield f"{owner.__name__}.{name}", inspect.signature(function)


def test_public_signatures_have_types_and_none_of_them_is_any() -> None:
    untyped = {}
    for name, signature in _signatures():
        annotations = {p.name: p.annotation for p in signature.parameters.values() if p.name not in ("self", "cls")}
        annotations["return"] = signature.return_annotation
        wrong = [key for key, value in annotations.items()
                 if re.search(r"\bAny\b", str(value)) or (value is inspect.Parameter.empty and name != "System")]
        if wrong and name.rsplit(".")[-1] not in UNTYPED and name.split(".")[0] not in UNTYPED:
            untyped[name] = wrong
    assert not untyped
