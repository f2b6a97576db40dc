"""The time limit of explicit forms holds, and what is not reached in it is an error that names alternatives."""

from __future__ import annotations

import contextlib
import subprocess
import sys
import textwrap
import threading
import time
from dataclasses import replace

import pytest
import sympy as sp

import symdyn as sd
from symdyn.errors import SymdynError
from symdyn.report.limit import TimeUp, within
from symdyn.report.simplify import simplified


def forever() -> None:
    while True:
        with contextlib.suppress(Exception):  # must not hold the interruption up
            sum(range(100))


@pytest.mark.parametrize("seconds", [0.0, 0.2])
def test_what_takes_longer_is_interrupted(seconds):
    begin = time.monotonic()
    with pytest.raises(TimeUp):
        within(seconds, forever)
    assert time.monotonic() - begin < seconds + 0.5


def test_what_is_done_in_time_is_returned_and_never_interrupted_later():
    assert [within(0.02, lambda k=k: k) for k in range(50)] == list(range(50))
    time.sleep(0.1)
    with pytest.raises(ZeroDivisionError):
        within(1.0, lambda: 1 / 0)


def test_other_threads_are_limited_by_themselves():
    found = []

    def limited():
        try:
            within(0.1, forever)
        except TimeUp:
            found.append("interrupted")

    threads = [threading.Thread(target=limited) for _ in range(2)]
    for thread in threads:
        thread.start()
    assert within(5.0, lambda: [thread.join() for thread in threads]) and found == ["interrupted"] * 2


def test_forms_do_not_depend_on_time():
    """A quantity that is too large as a whole is written entry by entry, however little time SymPy's methods may take."""
    given = [replace(sd.systems.get("four_bar").augmented(), simplify_seconds=seconds) for seconds in (1e-9, 60.0)]
    equations = given[0]
    assert [e.explicit("k_tilde") for e in given] == [given[0].k_tilde] * 2
    value, plain = equations.explicit("lam"), equations.explicit("lam", simplify=False)
    symbols = sorted(plain.free_symbols, key=str)
    numbers = [(k + 3) / (7 + k % 3) for k in range(len(symbols))]
    found, wanted = (sp.lambdify(symbols, v[1])(*numbers) for v in (value, plain))
    assert found == pytest.approx(wanted, rel=1e-9)


def test_an_entry_is_as_simple_as_when_the_time_was_up():
    x = sp.Symbol("x", real=True)
    long = sp.Mul(*[sp.Add(*[sp.sin(k * j * x) + j for j in range(1, 9)]) for k in range(1, 9)])
    assert simplified(sp.Matrix([long, sp.sin(x) ** 2 + sp.cos(x) ** 2]), 0.3) == sp.Matrix([long, 1])


def test_what_is_too_large_to_be_read_names_the_alternatives():
    equations = sd.systems.get("bricard").augmented()
    message = (r"accelerations is too large to be read: a product has up to [\d,]+ terms, above the bound of 2,000,000, and "
               r"[\d,]+ operations as it was derived; ask for named intermediates with explicit\('accelerations', ")
    with pytest.raises(SymdynError, match=message):
        equations.explicit("accelerations")


def test_a_profiler_runs_after_it():
    """CPython 3.11 takes an interruption that is called off for pending, and never returns under a profiler then."""
    program = textwrap.dedent("""
        import sys
        from symdyn.report.limit import TimeUp, within
        def forever():
            while True: pass
        within(10.0, lambda: 1)
        try:
            within(0.1, forever)
        except TimeUp:
            pass
        sys.setprofile(lambda *event: None)
        def passed(*values): return values
        def passing(*values): return passed(*values)
        passing(1)
        sys.setprofile(None)
        print("through")
        """)
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60)
    assert done.stdout == "through\n", done.stderr
