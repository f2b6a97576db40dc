"""An ensemble before its first motion: what all members have in common, its samples, and how they are divided into chunks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.backend.right_side import METHOD, RightSide
from symdyn.ensembles.chunk import Chunk, Setting, as_measured, events_serve, motion, quiet, setting_of, vectors_serve
from symdyn.ensembles.code import fingerprint
from symdyn.ensembles.measures import Measure, functions_of, output_times, take_measures
from symdyn.ensembles.portable import PortableModule, of_contacts
from symdyn.ensembles.samples import Samples
from symdyn.errors import ArgumentError, CompileError, CompilerNotFound
from symdyn.kinds import flag
from symdyn.runtime.batches.motions import unit_of
from symdyn.runtime.batches.on_device import demand_fit, demand_single
from symdyn.runtime.batches.precision import checked_precision
from symdyn.runtime.batches.states import LIBRARY
from symdyn.runtime.gpu import device as devices
from symdyn.runtime.inputs.inputs import varies_over_time
from symdyn.runtime.integrating.events import wanted
from symdyn.runtime.integrating.sensitivities import names_of
from symdyn.runtime.integrating.simulate import RTOL, checked_tolerances
from symdyn.runtime.module import Module
from symdyn.shown import shown

if TYPE_CHECKING:
    from collections.abc import Sequence

# Samples in a chunk, unless there are few samples or it is asked otherwise; chunks that few samples are divided into.
CHUNK, CHUNK_OF_DEVICE, PARTS = 1000, 100_000, 16
# Chunks of very many samples are larger, so that a folder has no more files than this; but no larger than these bytes.
MOST_CHUNKS, CHUNK_BYTES = 10_000, 2**26
# Samples that are simulated in advance, to know the shapes of outcomes and what code workers need.
TRIED = 8
# Name in results by a GPU, whatever its number on a machine: several of them may share a folder.
GPU = "gpu"
# Number of samples from which on code that integrates several motions at once is worth compiling.
VECTORS_FROM = 2000


@dataclass(frozen=True)
class Plan:
    """Plan of a computation.

    size   samples in a chunk, as it was requested; None: by their number
    """

    setting: Setting
    samples: Samples
    size: int | None = None

    @property
    def name(self) -> str:
        """Name of the mechanism."""
        return str(self.setting.system.module.name)

    @property
    def columns(self) -> dict[str, tuple[int, ...]]:
        """Label -> shape of an outcome of one member."""
        return dict(zip([m.label for m in self.setting.measures], self.setting.shapes))

    @property
    def row(self) -> int:
        """Bytes of one member in the results: what was sampled, outcomes, and whether it failed."""
        return 8 * (len(self.samples.names) + self.outcome_numbers) + 1

    @property
    def outcome_numbers(self) -> int:
        """Numbers of the outcomes of one member."""
        return sum(int(np.prod(shape)) for shape in self.setting.shapes)

    def chunk_size(self, count: int | None = None) -> int:
        """Samples in a chunk, for the samples of the plan or another number of them."""
        count = count or self.samples.count
        largest = CHUNK if self.setting.device == "cpu" else CHUNK_OF_DEVICE
        size = self.size or min(largest, -(-count // PARTS))
        if self.size is None and count > size * MOST_CHUNKS:
            size = max(size, min(-(-count // MOST_CHUNKS), CHUNK_BYTES // self.row))
        return size

    def chunk(self, k: int, size: int) -> Chunk:
        """Chunk number k of so many samples."""
        first = k * size
        return Chunk(self.setting, k, first, self.samples.block(first, min(first + size, self.samples.count)))

    def tried(self) -> Plan:
        """The plan with the shapes of outcomes. Raises ArgumentError where all that was tried is asked for wrongly."""
        with quiet():
            return replace(self, setting=_tried(self.setting, self.samples))

    def manifest(self, size: int) -> dict[str, Any]:
        """Plain values that are the same for the same ensemble only."""
        setting = self.setting
        portable: PortableModule = setting.system
        functions = {m.label: fingerprint(m.function) for m in setting.measures if m.function is not None}
        return {**({"functions": functions} if functions else {}), "system": portable.module.name,
                "code": portable.key(), "backend": portable.module.backend, "chunk": size, "samples": self.samples.record(),
                "t": [float(setting.times[0]), float(setting.times[-1]), len(setting.times)],
                "outcomes": {m.label: m.record() for m in setting.measures}, "consistent": setting.consistent,
                "vectors": setting.vectors,
                **({} if setting.device == "cpu" else {"device": GPU, "precision": setting.precision}),
                "base": {k: v.tolist() for k, v in setting.base.items()},
                "options": {k: v if isinstance(v, (int, float, str)) else repr(v) for k, v in setting.options.items()}}

    def about(self) -> dict[str, Any]:
        """Data that readers of the results need."""
        module, measures = self.setting.system.module, self.setting.measures
        return {"system": module.name, "names": list(self.samples.names), "varied": list(self.samples.varied),
                "outcomes": [m.label for m in measures], "count": self.samples.count,
                "shapes": {m.label: s for m, s in zip(measures, self.setting.shapes)},
                "traces": [m.label for m in measures if m.kind == "trace"], "units": {"energy": "J", **module.metadata.units},
                "about": {m.label: m.record() for m in measures},
                "sensitivities": list(self.setting.options.get("sensitivities", ())),
                "rtol": self.setting.options.get("rtol", RTOL)}


def plan(system: Any, samples: Any, t: Any = None, outcomes: Any = None, *, q: Any = None, u: Any = None, z: Any = None,
         params: Any = None, inputs: Any = None, chunk: Any = None, consistent: Any = False, functions: tuple[str, ...] = (),
         sensitivities: Any = None, device: str = "cpu", precision: Any = None, **options: Any) -> Plan:
    """The plan of an ensemble from the arguments of `ensemble`; options: of `simulate`, None as there.

    Raises ArgumentError for what does not fit.
    """
    consistent = flag(consistent, "an ensemble: consistent")
    module = system if isinstance(system, Module) else system.compile() if hasattr(system, "compile") else None
    if module is None:
        raise ArgumentError(f"an ensemble needs a Module or a System, found {shown(system, 80)}")
    drawn = samples if isinstance(samples, Samples) else Samples(samples, "paired")
    options = {name: value for name, value in options.items() if value is not None}
    measures = take_measures(outcomes, module)
    options |= _derivatives(module, drawn, measures, sensitivities)
    times = output_times(t, measures, module)
    gpu = devices.device_number(device, module.name)
    precision = checked_precision("double" if precision is None else precision, gpu is not None, module.name)
    if gpu is not None:
        _check_device(module, options, consistent, measures, precision)
    vectors = gpu is not None or (drawn.count >= VECTORS_FROM and vectors_serve(module, consistent, options, measures))
    method, looks = str(options.get("method", METHOD)), bool(wanted(module, options.get("events", True)).any())
    by = names_of(module, options.get("sensitivities", ()), [])
    lanes = unit_of(method, looks, tuple("" if state else name for name, state in by.items())) if gpu is None else RightSide(
        method=method, threads=True, looks=looks, single=precision == "single")
    together = [lanes, *[LIBRARY] * (gpu is None)] if vectors else []
    portable = PortableModule(module, [*functions_of(module, measures), *of_contacts(module, options), *functions, *together])
    given = {"q": q, "u": u, "z": z, "parameters": params, "inputs": inputs}
    if varies_over_time(inputs):
        raise ArgumentError(f"{module.name}: an ensemble takes numbers as inputs, found {shown(inputs, 80)}; write what goes "
                            "over time as an expression in sd.t, with parameters that samples may change, or run "
                            "module.simulate_batch, which takes functions, splines and tables")
    setting = setting_of(portable, drawn.names, times, measures, given, consistent, options)
    setting = replace(setting, vectors=vectors, device="cpu" if gpu is None else device, precision=precision)
    return Plan(setting, drawn, whole(chunk, "chunk", module))


def whole(value: object, what: str, module: Module) -> int | None:
    """A whole number from 1 on, or None. Raises ArgumentError for anything else."""
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < 1:
        raise ArgumentError(f"{module.name}: {what} must be a whole number from 1 on, found {shown(value)}")
    return int(value)


def _check_device(module: Module, options: Mapping[str, Any], consistent: bool, measures: Sequence[Measure],
                  precision: str) -> None:
    """Raises ArgumentError for what no device takes; whether there is one is found out where motions are computed."""
    method = options.get("method", METHOD)
    others = {name: value for name, value in options.items() if name not in ("events", "event_spacing")}
    demand_fit(module, method, None, others)
    if consistent:
        raise ArgumentError(f"{module.name}: device='gpu' takes starts as they are; leave consistent out, or sample starts that "
                            "fulfil the constraints")
    if not events_serve(module, options, measures):
        raise ArgumentError(f"{module.name}: device='gpu' keeps states at output times and no times of events; take outcomes of "
                            "states and events that do not stop the motion, pass events=False, or leave device out")
    if precision == "single":
        looks = bool(wanted(module, options.get("events", True)).any())
        demand_single(module, method, looks, checked_tolerances(module, options.get("rtol", RTOL), options.get("atol"))[0])


def demand_device(setting: Setting) -> None:
    """Raises NoDevice where motions are to be computed on a GPU of this machine that is not there; MissingExtra."""
    owner = setting.system.module.name
    number = devices.device_number(setting.device, owner)
    if number is not None:
        devices.open_device(number, owner).close()


def _derivatives(module: Module, samples: Samples, measures: Sequence[Measure], given: Any) -> dict[str, Any]:
    """The option of `simulate` with what outcomes are differentiated by. Raises ArgumentError with all that is wrong."""
    if not any(m.grad for m in measures):
        if given is not None:
            raise ArgumentError(f"{module.name}: sensitivities were given, but no outcome is a derivative; write 'grad end "
                                f"{module.metadata.x[0]}' or the like, or leave them out")
        return {}
    faults: list[str] = []
    by = given if given is not None else [f"{n}(0)" if n in module.metadata.x else n for n in samples.names]
    names = tuple(names_of(module, by, faults))
    if faults:
        raise ArgumentError("\n".join(f"{module.name}: {fault}" for fault in faults))
    return {"sensitivities": names}


def _tried(setting: Setting, samples: Samples) -> Setting:
    """The setting with the shapes of outcomes. Raises ArgumentError where all that was tried is asked for wrongly."""
    module: Module = setting.system.module
    places = sorted({int(k) for k in np.linspace(0, samples.count - 1, TRIED)})
    wrong: list[ArgumentError] = []
    for k in places:
        try:
            solution = as_measured(setting, motion(setting, samples.block(k, k + 1)[0]))
            return replace(setting, shapes=tuple(m.of(solution).shape for m in setting.measures))
        except ArgumentError as error:
            wrong.append(error)
        except (CompileError, CompilerNotFound):
            raise
        except Exception:  # it will stand among the failures
            continue
    if len(wrong) == len(places):
        raise ArgumentError(f"none of {len(places)} samples that were tried can be simulated; the first: {wrong[0]}")
    return replace(setting, shapes=tuple(_shape(m, setting, module) for m in setting.measures))


def _shape(measure: Measure, setting: Setting, module: Module) -> tuple[int, ...]:
    """The shape of an outcome where no motion shows it; of a function a number."""
    own = dict(module.metadata.outputs).get(measure.name, ())
    by = (len(setting.options["sensitivities"]),) if measure.grad else ()
    return (len(setting.times), *own, *by) if measure.kind == "trace" else (*own, *by)
