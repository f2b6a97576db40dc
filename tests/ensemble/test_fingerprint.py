"""Outcome functions are distinguished from each other when an ensemble goes on."""

import functools

import numpy as np

from symdyn.ensembles.code import fingerprint

LIMIT = 2.0
TABLE = np.arange(3.0)


def helper(x):
    return x + LIMIT


def outer(x):
    return helper(x) * TABLE[1]


def even(n):
    return n == 0 or odd(n - 1)


def odd(n):
    return n != 0 and even(n - 1)


def made(k, values=(1, 2)):
    return lambda solution: solution.x[-1, k] + sum(values)


def later():
    yield lambda: after
    after = 1


class Called:
    def __call__(self, solution):
        return solution.x[-1, 0]

    def method(self, solution):
        return solution.x[-1, 1]


def test_the_same_code_is_the_same():
    def first(solution):
        return solution.x.max()

    def other(solution):
        # with a comment

        return solution.x.max()

    assert fingerprint(first) == fingerprint(other) and len(fingerprint(first)) == 16
    assert fingerprint(made(1)) == fingerprint(made(1))
    assert fingerprint(Called()) == fingerprint(Called()) != fingerprint(Called().method)
    assert fingerprint(even) == fingerprint(even) != fingerprint(odd)  # and it ends


def test_what_a_function_computes_counts(monkeypatch):
    assert len({fingerprint(f) for f in (
        lambda s: s.x.max(), lambda s: s.x.min(), lambda s: 2 * s.x.max(), lambda s: 3 * s.x.max(), lambda s, k=1: s.x.max() * k,
        lambda s, k=2: s.x.max() * k, lambda s, *, k=2: s.x.max() * k, lambda s: s.x.max() in {1, 2},
        lambda s: [v + 1 for v in s.x], made(1), made(2), made(1, (1, 3)),
        made(1, [1, 2]), functools.partial(outer, 1), functools.partial(outer, 2),
        functools.partial(helper, x=1), np.max, np.min, next(later()))}) == 19
    before = fingerprint(outer)
    monkeypatch.setitem(globals(), "LIMIT", 3.0)  # of a function that it calls
    changed = fingerprint(outer)
    monkeypatch.setitem(globals(), "TABLE", np.arange(4.0))
    assert len({before, changed, fingerprint(outer)}) == 3
    monkeypatch.setitem(globals(), "helper", lambda x: x)
    assert len({before, changed, fingerprint(outer)}) == 3
