"""Pages are filled in from frozen records, of which they read every field."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path
from typing import Any

import pytest

import symdyn as sd
from symdyn.bench.work.benchmark import Benchmark
from symdyn.bench.work.page import page as bench_page
from symdyn.bench.work.record import Reference, Row, Skipped
from symdyn.comparison.reports import report
from symdyn.folders import templates_folder
from symdyn.named_records import NamedRecords
from symdyn.overview import condition as full_condition
from symdyn.overview import page as full
from symdyn.overview import work as full_work
from symdyn.stress.page import page as stress_page
from symdyn.stress.record import Row as StressRow
from symdyn.stress.record import StressReport
from tests.helpers import records_in

pytest.importorskip("matplotlib")
pytest.importorskip("latex2mathml")

TEMPLATES = {"RunContext": "report/run.html", "StressContext": "report/stress.html", "BenchContext": "report/bench.html",
             "FullContext": "report/full.html", "ComparisonContext": "report/comparison.html",
             "ErrataContext": "report/errata.html", "ViewContext": "viewer/page.html"}


def benchmark() -> Benchmark:
    rows = [Row("embedding", "dop853", 1e-6, seconds=1e-3, error_q=1e-7), Row("other", "peer", 1e-6, seconds=2e-3, peer=True)]
    return Benchmark("m", 1.0, rows, [Skipped("a", "", "why")], Reference("extended", (0.5, 1.0), [[0.0], [0.0]], 9.0, "how"),
                     operations={"embedding": 7}, about={"processor": "one", "compiler": "none"})


def compared() -> Any:
    q, (m, g) = sd.coordinates("q"), sd.parameters("m g")
    proof = sd.proofs.numeric_derivative("It is the rate.", of=q**2)
    erratum = sd.Erratum("A factor.", proof)
    return sd.compare([sd.Case("one", "A case", sd.Slide("1", "One", 2), [
        sd.Formula("rate", q * q.dot, 2 * q * q.dot, errata=[erratum]), sd.Formula("weight", m * g, m * g)])])


@pytest.fixture(scope="module")
def contexts(tmp_path_factory: pytest.TempPathFactory) -> dict[str, NamedRecords]:
    """The records of every page, by the name of their class."""
    seen: dict[str, NamedRecords] = {}

    def spy(self: NamedRecords) -> dict[str, Any]:
        seen.setdefault(type(self).__name__, self)
        return names(self)

    names, folder = NamedRecords.names, tmp_path_factory.mktemp("pages")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(NamedRecords, "names", spy)
        patch.setattr(full_condition, "STATES", 11)
        patch.setattr(full_work, "measure", lambda *arguments: [benchmark()])
        patch.setattr(full, "stress", lambda tested, short: StressReport([stress_row]))
        stress_row = StressRow("check", "pendulum", "done", 1.0, None, "origin", "pass", "why")
        solution = sd.systems.four_bar().compile("numpy").simulate((0.0, 0.1), work=True)
        solution.report(folder / "run.html")
        solution.view()
        stress_page(StressReport([stress_row]))
        (folder / "work.svg").write_text("<svg/>")
        bench_page([benchmark()], [folder / "work.svg"])
        sd.full_report("pendulum", folder / "full.html")
        for name in ("comparison.html", "errata.html"):
            report(compared(), name)
    return seen


@pytest.mark.parametrize("context", TEMPLATES)
def test_records_of_pages_are_frozen(context: str, contexts: dict[str, NamedRecords]) -> None:
    records = list(records_in(contexts[context]))
    assert len(records) > 2
    for record in records:
        with pytest.raises(dataclasses.FrozenInstanceError):
            setattr(record, dataclasses.fields(record)[0].name, None)


def test_pages_read_every_field(contexts: dict[str, NamedRecords]) -> None:
    """Some page does: several have records of runs, findings and errata in common."""
    texts = [Path(templates_folder(), f"{name}.jinja").read_text(encoding="utf-8") for name in TEMPLATES.values()]
    read = set(re.findall(r"\.(\w+)", "\n".join(texts)))
    pages = [contexts[name] for name in TEMPLATES]
    held = {type(record) for page in pages for record in records_in(page)} - {type(page) for page in pages}
    fields = {(record.__name__, field.name) for record in held for field in dataclasses.fields(record)}
    assert len(held) > 35 and {(record, field) for record, field in fields if field not in read} == set()
