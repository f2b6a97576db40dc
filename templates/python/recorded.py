class _Entry:
    """A value on a record: the place of its row."""

    __slots__ = ("record", "row")
    __hash__ = object.__hash__

    def __init__(self, record, row):
        self.record, self.row = record, row

    def __bool__(self):
        raise TypeError("a value that is not computed yet has no truth")


def _infix(name, turned):
    def method(a, b):
        if isinstance(b, np.ndarray):
            return NotImplemented
        return a.record.apply(name, b, a) if turned else a.record.apply(name, a, b)

    return method


for _name, _method in (("add", "add"), ("sub", "sub"), ("mul", "mul"), ("div", "truediv")):
    setattr(_Entry, f"__{_method}__", _infix(_name, False))
    setattr(_Entry, f"__r{_method}__", _infix(_name, True))
for _name in ("lt", "le", "gt", "ge", "eq", "ne"):
    setattr(_Entry, f"__{_name}__", _infix(_name, False))
_Entry.__neg__ = lambda a: a.record.apply("neg", a)

_OF_NUMBERS = {
    "add": np.add, "sub": np.subtract, "mul": np.multiply, "div": np.divide, "neg": np.negative, "sqrt": np.sqrt, "pow": np.power,
    "sin": np.sin, "cos": np.cos, "tan": np.tan, "asin": np.arcsin, "acos": np.arccos, "atan": np.arctan, "atan2": np.arctan2,
    "sinh": np.sinh, "cosh": np.cosh, "tanh": np.tanh, "asinh": np.arcsinh, "acosh": np.arccosh, "atanh": np.arctanh,
    "exp": np.exp, "log": np.log, "abs": np.abs, "sign": np.sign, "floor": np.floor, "ceil": np.ceil, "erf": math.erf,
    "min": np.minimum, "max": np.maximum, "lt": np.less, "le": np.less_equal, "gt": np.greater, "ge": np.greater_equal,
    "eq": np.equal, "ne": np.not_equal, "and": np.logical_and, "or": np.logical_or, "not": np.logical_not, "select": np.where,
}


class _Record:
    """A vocabulary that records: rows of (operation, arguments), each once, and calls between them.

    An argument is the place of a row, where those of the `n_given` values come first; or ("number", value).
    ok   what must hold, as entries; the results are NaN where it does not
    """

    def __init__(self, n_given, single=False):
        self.n_given, self.single = n_given, single
        self.rows, self.known, self.ok = [], {}, []
        self.given = [_Entry(self, k) for k in range(n_given)]

    def apply(self, name, *arguments):
        if not any(isinstance(a, _Entry) for a in arguments):
            with np.errstate(all="ignore"):
                return float(_OF_NUMBERS[name](*map(float, arguments)))
        return self._row(name, tuple(a.row if isinstance(a, _Entry) else ("number", float(a)) for a in arguments))

    def _row(self, name, arguments):
        key = name, arguments
        if key not in self.known:
            self.known[key] = _Entry(self, self.n_given + len(self.rows))
            self.rows.append(key)
        return self.known[key]

    def __getattr__(self, name):
        operation = {"where": "select", "logical_and": "and", "logical_or": "or", "logical_not": "not"}.get(name, name)
        if operation not in _OF_NUMBERS:
            raise AttributeError(name)
        return functools.partial(self.apply, operation)

    def positive(self, value, code):
        self.ok.append(self.apply("gt", value, 0.0))

    def called(self, name, n_out, *sizes_values_code):
        """Results of an algorithm that branches: one row calls it, one a result reads it."""
        *sizes, values, _ = sizes_values_code
        call = self._row("call", (name, tuple(sizes), n_out,
                                  tuple(a.row if isinstance(a, _Entry) else ("number", float(a)) for a in values)))
        results = [self._row("item", (call.row, k)) for k in range(n_out)]
        self.ok.append(self.apply("lt", self.apply("abs", results[0]), math.inf))  # NaN is not
        return results

    def saddle(self, n, m, values, code):
        e, least = (max(values[0], 1e-2), 5e-6) if self.single else (values[0], LOOSE)
        x = self._solved(symdyn_saddle_point, n, m, [e, *values[1:]], least, True)
        if self.single:
            first = 1 + n * (n + 1) // 2
            for i, wanted in enumerate(values[len(values) - m:]):
                self._near([c * entry for c, entry in zip(values[first + i * n:first + (i + 1) * n], x)], wanted, 4e-6)
        return x

    def multipliers(self, n, m, values, code):
        lam = self._solved(symdyn_least_multipliers, n, m, values, max(SMOOTHED, 1e-2) if self.single else SMOOTHED)
        if self.single:
            for j, wanted in enumerate(values[len(values) - n:]):
                self._near([c * entry for c, entry in zip(values[j:m * n:n], lam)], wanted, 1e-3)
        return lam

    def _near(self, terms, wanted, part):
        """A result of single precision may be no solution where constraints nearly depend on each other: it counts as none."""
        rest, size = -wanted, self.apply("abs", wanted)
        for term in terms:
            rest, size = rest + term, size + self.apply("abs", term)
        self.ok.append(self.apply("le", self.apply("abs", rest), part * size))

    def _solved(self, algorithm, n, m, values, *bounds):
        def elementwise(name, arguments):
            return np.frompyfunc(functools.partial(self.apply, name), arguments, 1)

        two = {"greater": "gt", "less_equal": "le", "not_equal": "ne", "maximum": "max", "logical_or": "or", "divide": "div"}
        names = {name: elementwise(operation, 2) for name, operation in two.items()}
        arithmetic = types.SimpleNamespace(**names, subtract=np.subtract, sqrt=elementwise("sqrt", 1),
                                           where=elementwise("select", 3))
        array = np.empty(len(values), dtype=object)
        array[:] = values
        found, failed = algorithm(arithmetic, n, m, array, *bounds)
        self.ok.append(self.apply("not", failed))
        return list(found)


class _Traced:
    """A function on the record of its rows: results are the places of what it returns, the last whether they hold."""

    def __init__(self, n_given, single, function):
        record = _Record(n_given, single)
        found = function(record, record.given)
        ok = functools.reduce(functools.partial(record.apply, "and"), record.ok, 1.0)
        self.n_given = n_given
        self.results = [a.row if isinstance(a, _Entry) else ("number", float(a)) for a in [*found, ok]]
        self.rows = record.rows

    @property
    def calls(self):
        return any(name == "call" for name, _ in self.rows)


def _in_groups(given):
    """t, q, u, z, ud, inputs, p, c and what follows, of values one after the other."""
    sizes, values, groups = METADATA["sizes"], iter(given), []
    t = next(values)
    for n in (sizes["q"], sizes["u"], sizes["z"], sizes["ud"], sizes["inputs"], sizes["p"], METADATA["n_c"]):
        groups.append([next(values) for _ in range(n)])
    return (t, *groups), list(values)


@functools.lru_cache(maxsize=None)
def _traced(name, way, stage, single):
    """A function on record. Its given values: p for the prologue; else t, q, u, z, ud, inputs, p, c one after the other, and for
    a block of columns v and the direction."""
    sizes = METADATA["sizes"]
    if name == "prologue":
        return _Traced(sizes["p"], single, lambda record, given: _define(record)["prologue"][0](given))
    n_given = 1 + sum(sizes[g] for g in ("q", "u", "z", "ud", "inputs", "p")) + METADATA["n_c"]
    if stage:
        n_v, n = len(_traced(name, way, 0, single).results) - 1, _define(_Record(0))[name][way][1][stage - 1][0]
        n_given += n_v + n

    def function(record, given):
        groups, more = _in_groups(given)
        wanted = _define(record)[name][way]
        if not stage:
            return (wanted[0] if isinstance(wanted, tuple) else wanted)(*groups)
        return wanted[1][stage - 1][1](*groups, more[:n_v], more[n_v:])

    return _Traced(n_given, single, function)


def _of_user(function, signature, n_out, values):
    """Results of a function of the user at states; values: of one shape."""
    arrays = [np.ravel(np.asarray(v, dtype=float)) for v in values]
    with np.errstate(all="ignore"):
        found = function(*arrays)
    several = isinstance(found, (tuple, list)) or np.ndim(found) > 1
    results = list(found) if n_out > 1 and several else [found]
    if len(results) != n_out:
        raise ValueError(f"{signature} must return {n_out} results, not {len(results)}")
    rows = np.array([np.broadcast_to(np.asarray(r, dtype=float), arrays[0].shape) for r in results])
    return np.where(np.isfinite(rows).all(axis=0), rows, np.nan).reshape(n_out, *np.shape(values[0]))


def _called(name, sizes, values):
    """Results of an algorithm for arrays of one shape, (n_out, *shape); NaN where there are none."""
    return np.asarray(CALLED[name](*sizes, [np.asarray(v, dtype=float) for v in values]), dtype=float)


def _executed(traced, operations, called, given):
    """Result of a function on record, row by row in the operations of a library, and whether it holds."""
    values = list(given)

    def value(argument):
        return argument[1] if isinstance(argument, tuple) else values[argument]

    for name, arguments in traced.rows:
        if name == "call":
            algorithm, sizes, n_out, places = arguments
            values.append(called(algorithm, sizes, n_out, [value(a) for a in places]))
        elif name == "item":
            values.append(values[arguments[0]][arguments[1]])
        else:
            values.append(operations[name](*map(value, arguments)))
    *results, ok = [value(a) for a in traced.results]
    return results, ok


_DIRECTIONS = {"x": ("q", "u", "z"), "inputs": ("inputs",), "params": ("p",), "t": ("t",), "ud": ("ud",)}


def _shape_by(name, by):
    """Rows and columns of the matrix of derivatives of a function."""
    sizes = {**METADATA["sizes"], "t": 1}
    return math.prod(METADATA["shapes"][name]), sum(sizes[g] for g in _DIRECTIONS[by])


def _ways(name):
    """For each way to compute a function the numbers of directions of its blocks of columns; none of what has no columns."""
    return [[n for n, _ in way[1]] if isinstance(way, tuple) else [] for way in _define(_Record(0))[name]]
