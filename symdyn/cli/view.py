"""`symdyn view`: a mechanism with sliders, or its motion, as a page that is opened."""

from __future__ import annotations

import argparse
import webbrowser
from pathlib import Path

from symdyn.cli.find import find_module
from symdyn.cli.mechanism import find_mechanism, title_of
from symdyn.cli.messages import Stop
from symdyn.cli.options import options_of
from symdyn.cli.values import numbers

PAGE = "view.html"


def view(arguments: argparse.Namespace) -> int:
    """Write the page and open it in the browser."""
    if not arguments.motion and (arguments.t is not None or arguments.forces):
        raise Stop("--t and --forces go with --motion; without it the page has sliders")
    if arguments.t is not None and len(arguments.t) > 2:
        raise Stop(f"--t takes END or START END, found {len(arguments.t)} times")
    params, q = numbers(arguments.set, "--set"), numbers(arguments.q, "--q")
    options = options_of(arguments)
    path = (arguments.output or Path("generated") / title_of(arguments.system, options)) / PAGE
    if arguments.motion:
        t = None if arguments.t is None else (0.0, *arguments.t)[-2:]
        find_module(arguments).simulate(t, q=q, params=params).view(path, forces=arguments.forces)
    else:
        find_mechanism(arguments.system, options).show(path, params, q)
    print(f"wrote {path}")
    if not arguments.no_browser and not webbrowser.open(path.resolve().as_uri()):
        print("no browser was found; open the file in one")
    return 0
