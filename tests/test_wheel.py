"""The wheel, installed where there is no checkout: finds its templates, generates, compiles, simulates."""

from __future__ import annotations

import importlib.metadata
import importlib.util
import os
import shutil
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest
from packaging.requirements import Requirement

ROOT = Path(__file__).parents[1]
pytestmark = pytest.mark.slow

PROGRAM = """
import sys
from pathlib import Path
import symdyn as sd
assert not Path(sd.__file__).is_relative_to(sys.argv[1]), sd.__file__
from symdyn.backend.source import backends, template_folders
assert template_folders() == [Path(sd.__file__).parent / "templates"]
assert backends() == ["c", "firmware", "fortran", "javascript", "julia", "matlab", "numpy", "python", "rust"]
assert (template_folders()[0] / "README.md").is_file()
equations = sd.systems.pendulum().embedding()
for backend in sys.argv[2:]:
    module = equations.compile(backend=backend)
    solution = module.simulate((0, 2), rtol=1e-10)
    assert solution.success and solution.energy_error() < 1e-8, solution
    print(*[path.name for path in module.write(Path("out") / backend)])
"""


def run(*command: object, cwd: Path, seconds: float = 300) -> str:
    environment = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "PYTHONHOME", "VIRTUAL_ENV", "SYMDYN_CC")}
    environment["SYMDYN_CACHE_DIR"] = str(cwd / "cache")
    done = subprocess.run([str(c) for c in command], cwd=cwd, env=environment, capture_output=True, text=True, timeout=seconds)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """built(kind): the wheel or the sdist of this checkout; the build backend is fetched once if it is not here."""
    fetched = tmp_path_factory.mktemp("backend")
    if importlib.util.find_spec("hatchling") is None:
        wanted = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["build-system"]["requires"]
        run(sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--no-compile", "--target", fetched,
            *wanted, cwd=fetched)

    def made(kind: str) -> Path:
        folder = tmp_path_factory.mktemp(kind)
        run(sys.executable, "-c", f"import sys; sys.path.insert(0, {str(fetched)!r}); from hatchling.build import build_{kind}; "
            f"build_{kind}({str(folder)!r})", cwd=ROOT)
        (path,) = folder.glob("symdyn-*")
        return path

    return made


@pytest.fixture(scope="module")
def wheel(built: Callable[[str], Path]) -> Path:
    return built("wheel")


def test_wheel_holds_templates_and_code_only(wheel: Path) -> None:
    names = set(zipfile.ZipFile(wheel).namelist())
    shipped = {str(p.relative_to(ROOT)) for p in (ROOT / "templates").rglob("*") if p.is_file()}
    assert {f"symdyn/{name}" for name in shipped} <= names
    code = {str(p.relative_to(ROOT)) for p in (ROOT / "symdyn").rglob("*.py")}
    assert code <= names
    assert all(name.startswith(("symdyn/", "symdyn-")) for name in names) and not any("__pycache__" in n for n in names)


@pytest.fixture(scope="module")
def unpacked(built: Callable[[str], Path]) -> Path:
    """The folder in an sdist of this checkout."""
    path = built("sdist")
    with tarfile.open(path) as archive:
        archive.extractall(path.parent, filter="data")
    return path.parent / path.name.removesuffix(".tar.gz")


def test_sdist_holds_what_both_commands_of_the_readme_need(unpacked: Path) -> None:
    kept = ("symdyn", "templates", "tests", "docs", "notebooks", "generated/reference")
    wanted = {str(p.relative_to(ROOT)) for folder in kept for p in (ROOT / folder).rglob("*")
              if p.suffix in (".py", ".md", ".c", ".h", ".jinja", ".json", ".csv", ".toml", ".ipynb") and ".ipynb_" not in str(p)}
    there = {str(p.relative_to(unpacked)) for p in unpacked.rglob("*") if p.is_file()}
    assert wanted | {"README.md", "LICENSE", "CHANGELOG.md", "pyproject.toml", ".clang-format"} <= there
    assert not [name for name in there if name.startswith("generated/") and not name.startswith("generated/reference/")]
    assert not [name for name in there if "__pycache__" in name or name.startswith((".venv", ".git/"))]


@pytest.mark.sweep
def test_commands_of_the_readme_in_an_unpacked_sdist(unpacked: Path) -> None:
    """As an editable installation runs them; of the tests those that need files next to the package."""
    printed = run(sys.executable, "-P", "-c", f"import sys; sys.path.insert(0, {str(unpacked)!r}); "
                  "from symdyn.cli import main; sys.exit(main(['demo']))", cwd=unpacked)
    assert "energy" in printed
    printed = run(sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "tests/backend/test_golden.py", "-k",
                  "pendulum", cwd=unpacked)
    assert "100%" in printed


def required(path: Path) -> dict[str, importlib.metadata.Distribution]:
    """Requirements of a wheel, and theirs, without extras; each must be here in a version that will do."""
    with zipfile.ZipFile(path) as archive:
        (name,) = (n for n in archive.namelist() if n.endswith(".dist-info/METADATA"))
        wanted = importlib.metadata.PathDistribution(zipfile.Path(archive, name.removesuffix("METADATA"))).requires or []
    found: dict[str, importlib.metadata.Distribution] = {}
    while wanted:
        requirement = Requirement(wanted.pop())
        if requirement.marker is None or requirement.marker.evaluate({"extra": ""}):
            there = importlib.metadata.distribution(requirement.name)
            assert requirement.specifier.contains(there.version, prereleases=True), requirement
            if requirement.name not in found:
                found[requirement.name] = there
                wanted += there.requires or []
    return found


def test_installed_elsewhere(wheel: Path, tmp_path: Path) -> None:
    """In an environment that holds the wheel and what it says that it needs, and nothing else, not even pip."""
    base = Path(sys.base_prefix) / ("python.exe" if sys.platform == "win32" else f"bin/python{sys.version_info[0]}")
    run(base, "-m", "venv", "--without-pip", tmp_path / "venv", cwd=tmp_path)
    python = tmp_path / "venv" / ("Scripts/python.exe" if sys.platform == "win32" else "bin/python")
    run(sys.executable, "-m", "pip", "--python", python, "install", "--quiet", "--disable-pip-version-check", "--no-compile",
        "--no-deps", "--no-index", wheel, cwd=tmp_path)
    packages = Path(run(python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))", cwd=tmp_path).strip())
    for distribution in required(wheel).values():
        for name in {file.parts[0] for file in distribution.files or ()} - {"..", "__pycache__"}:
            kept, place = Path(str(distribution.locate_file(name))), packages / name
            if sys.platform != "win32":  # to copy them takes seconds
                if not place.exists():
                    place.symlink_to(kept)
            elif kept.is_dir():
                shutil.copytree(kept, place, dirs_exist_ok=True)
            else:
                shutil.copy2(kept, place)
    from symdyn.runtime.building.compiler import find_compiler

    backends = ["numpy", "c"] if find_compiler() is not None else ["numpy"]
    printed = run(python, "-c", PROGRAM, ROOT, *backends, cwd=tmp_path).splitlines()
    assert printed == ["pendulum.py", "pendulum.c pendulum.h main.c"][:len(backends)]
    assert run(python, tmp_path / "out" / "numpy" / "pendulum.py", "--selftest", cwd=tmp_path).endswith("all results agree\n")
    assert "pendulum" in run(tmp_path / "venv" / python.parent.name / "symdyn", "list", cwd=tmp_path)
