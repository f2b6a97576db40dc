"""Measurements, as commands: `symdyn bench`, and its words such as `symdyn bench figures` (see symdyn.cli.measurements). They are
not tests; times depend on the machine.

`symdyn.bench` is a package and, called, the function `symdyn.bench.work.bench`.
"""

from symdyn.callable_package import make_callable

make_callable(__name__, "symdyn.bench.work:bench")
