"""Instructions, bytes and stack of CMake packages on a Cortex-M4: python -m symdyn.lab.firmware two_link_arm four_bar

Packages are compiled by arm-none-eabi-gcc (-O2, single-precision floating-point unit), and their self-tests run under
qemu-system-arm, one instruction in a nanosecond, on the board mps2-an386. Doubles are computed by the compiler's library. A line
for each mechanism and kind of number: instructions of the right-hand side and of a step (of 1 ms, mean over 200), bytes of code
and data of the mechanism's own file, bytes of stack, and what the self-test says.
"""

from __future__ import annotations

import argparse
import re
import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import symdyn as sd
from symdyn.targets.cmake import deepest, stack_of

GCC, QEMU = "arm-none-eabi-gcc", "qemu-system-arm"
PROCESSOR = ("-mcpu=cortex-m4", "-mthumb", "-mfloat-abi=hard", "-mfpu=fpv4-sp-d16")
_BOARD = ("-M", "mps2-an386", "-cpu", "cortex-m4", "-nographic", "-monitor", "none", "-serial", "null", "-icount", "shift=0",
          "-semihosting-config", "enable=on,target=native")


@dataclass(frozen=True)
class OnTarget:
    """A self-test on the processor: instructions of the right-hand side and a step, bytes, stack, results compared and wrong."""

    rhs: int
    step: int
    code_bytes: int
    stack_bytes: int
    compared: int
    wrong: int
    output: str


def tools() -> str:
    """Programs that are missing to compile for a Cortex-M and to run there, "" if nothing is."""
    return ", ".join(tool for tool in (GCC, QEMU, "arm-none-eabi-size") if shutil.which(tool) is None)


def on_target(folder: Path, real: str) -> OnTarget:
    """Compile the package in a folder for a Cortex-M4 with numbers that are "float" or "double", and run its self-test there.

    Raises subprocess.CalledProcessError where it does not compile, subprocess.TimeoutExpired where it does not end.
    """
    name = next((folder / "src").glob("*.c")).stem
    defined = [f"-D{name.upper()}_FLOAT"] if real == "float" else []
    options = [*PROCESSOR, "-std=c99", "-O2", "-ffp-contract=off", *defined, "-I", str(folder / "include")]
    with tempfile.TemporaryDirectory() as scratch:
        own, program = f"{scratch}/own.o", f"{scratch}/test.elf"
        subprocess.run([GCC, *options, "-c", str(folder / "src" / f"{name}.c"), "-o", own], check=True, capture_output=True)
        subprocess.run([GCC, *options, "--specs=rdimon.specs", "-T", str(folder / "cortex_m" / "memory.ld"), own,
                        str(folder / "test" / "selftest.c"), str(folder / "cortex_m" / "startup.c"), "-o", program, "-lm"],
                       check=True, capture_output=True)
        sizes = subprocess.run(["arm-none-eabi-size", own], check=True, capture_output=True, text=True).stdout.split("\n")[1]
        output = subprocess.run([QEMU, *_BOARD, "-kernel", program], capture_output=True, text=True, timeout=120,
                                stdin=subprocess.DEVNULL).stdout
    stacks, _ = stack_of(folder, name, (GCC, *PROCESSOR, *defined))
    counts = re.search(r"instructions: rhs (\d+), step (\d+)", output)
    ended = re.search(r"(\d+) results compared, (\d+) wrong", output)
    if counts is None or ended is None:
        raise RuntimeError(f"the self-test of {name} did not come to its end; it printed {output[-500:]!r}")
    return OnTarget(int(counts[1]), int(counts[2]), sum(map(int, sizes.split()[:3])),
                    deepest(folder / "src" / f"{name}.c", stacks), int(ended[1]), int(ended[2]), output)


def run(arguments: Sequence[str] | None = None) -> None:
    """Print a line for each mechanism and kind of number."""
    parser = argparse.ArgumentParser(prog="python -m symdyn.lab.firmware")
    parser.add_argument("names", nargs="*", default=["pendulum", "two_link_arm", "four_bar", "spatial_chain"])
    chosen = parser.parse_args(arguments)
    if tools():
        parser.exit(1, f"these are not on PATH: {tools()}; install gcc-arm-none-eabi, libnewlib-arm-none-eabi and "
                       "qemu-system-arm\n")
    print("| mechanism | numbers | instructions of rhs | of a step | bytes | stack | results compared | wrong |")
    print("| --- | --- | ---: | ---: | ---: | ---: | ---: | ---: |")
    for name in chosen.names:
        with tempfile.TemporaryDirectory() as folder:
            sd.systems.get(name).equations().to_cmake(folder)
            for real in ("float", "double"):
                r = on_target(Path(folder), real)
                print(f"| `{name}` | {real} | {r.rhs:,} | {r.step:,} | {r.code_bytes:,} | {r.stack_bytes:,} | {r.compared} | "
                      f"{r.wrong} |", flush=True)


if __name__ == "__main__":
    run()
