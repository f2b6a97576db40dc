"""Stress tests of numerical stability: of every check a figure, a bound with its reason, and a verdict.

`symdyn.stress` is a package and, called, the function `symdyn.stress.run.stress`.
"""

from symdyn.callable_package import make_callable

make_callable(__name__, "symdyn.stress.run:stress")
