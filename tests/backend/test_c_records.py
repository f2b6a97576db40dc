"""Records in C and their mirrors in Python are the same bytes."""

from __future__ import annotations

import ctypes
import subprocess
from pathlib import Path

import pytest

from symdyn.backend import c_records
from symdyn.errors import SymdynError
from symdyn.runtime.batches.motions import BatchMotions
from symdyn.runtime.batches.states import Table
from symdyn.runtime.building.compiler import find_compiler, require_compiler
from symdyn.runtime.contact_laws import OPEN, SLIDING, STICKING
from symdyn.runtime.gpu.motions import Motions
from symdyn.runtime.gpu.states import StateRows
from symdyn.runtime.integrating.compiled import Problem
from symdyn.runtime.integrating.hybrid import PhaseCode, Record
from symdyn.runtime.integrating.mode_codes import KINDS, MODES
from symdyn.runtime.integrating.run_record import STATUS, Noted, RunReport
from tests.backend.c_warnings import RUNTIME

RECORDS = {"runtime/report_type.h": (RunReport, "symdyn_report"), "runtime/problem_type.h": (Problem, "symdyn_problem"),
           "runtime/table_type.h": (Table, "symdyn_table"), "runtime/hybrid_type.h": (Record, "symdyn_hybrid"),
           "runtime/phase_code_type.h": (PhaseCode, "symdyn_phase_code"), "runtime/noted_type.h": (Noted, "symdyn_noted"),
           "runtime/batch_type.h": (BatchMotions, "symdyn_batch_motions"), "runtime/motions_type.h": (Motions, "symdyn_motions"),
           "runtime/states_type.h": (StateRows, "symdyn_state_rows")}


@pytest.mark.skipif(find_compiler() is None, reason="no C compiler here")
@pytest.mark.parametrize("file", RECORDS)
def test_mirrors_have_the_offsets_that_c_gives(file: str, tmp_path: Path) -> None:
    mirror, name = RECORDS[file]
    names = [field[0] for field in mirror._fields_]
    offsets = ", ".join(f"offsetof({name}, {n})" for n in names)
    text = (c_records.templates_folder() / "c" / file).read_text(encoding="utf-8").replace("#pragma once", "")
    path = tmp_path / "offsets.c"
    path.write_text(f"#include <stddef.h>\n{text}\nlong offsets(int k) {{\nconst long all[] = {{{offsets}, sizeof({name})}};\n"
                    "return all[k];\n}\n")
    made = tmp_path / "offsets.so"
    command = [*require_compiler().command, "-shared", "-fPIC", f"-I{RUNTIME}", "-o", str(made), str(path)]
    subprocess.run(command, check=True, timeout=60)
    library = ctypes.CDLL(str(made))
    library.offsets.restype = ctypes.c_long
    for k, field in enumerate(names):
        assert library.offsets(k) == getattr(mirror, field).offset, field
    assert library.offsets(len(names)) == ctypes.sizeof(mirror) and len(names) >= 3


def test_annotations_of_a_report_name_its_members() -> None:
    assert list(RunReport.__annotations__) == [name for name, _ in RunReport._fields_]


def test_codes_are_those_of_the_header() -> None:
    codes = vars(STATUS)
    assert (codes["DONE"], codes["STEP_LIMIT"], codes["STOPPED"], codes["FIELD_FAILED"]) == (0, 1, 3, -1)
    assert len(set(codes.values())) == len(codes) >= 15


def test_modes_of_contacts_and_their_ends_are_those_of_the_headers() -> None:
    assert MODES == (OPEN, STICKING, SLIDING) and KINDS == ("closes", "opens", "sticks", "slips", "ignored", "counts")
    for file, names in (("runtime/modes.h", MODES), ("runtime/mode_events.h", KINDS)):
        assert c_records.codes_of(file) == {name.upper(): k for k, name in enumerate(names)}


@pytest.mark.parametrize(("text", "message"), [
    ("int x;", "declares no record; declare one with typedef struct"),
    ("typedef struct {\n    float x;\n} some;", "float x has no mirror in Python; take numbers, pointers"),
])
def test_what_has_no_mirror_is_an_error(text: str, message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "c").mkdir()
    (tmp_path / "c" / "some.h").write_text(text)
    monkeypatch.setattr(c_records, "templates_folder", lambda: tmp_path)
    with pytest.raises(SymdynError, match=message):
        c_records.fields_of("some.h")
