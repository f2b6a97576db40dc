"""Time of a site that is built from nothing: no page of the gallery, no tutorial, no compiled mechanism kept.

python tests/checks/whole_site.py generated/site
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from symdyn.lab.figures import Figure, print_figures

ROOT = Path(__file__).resolve().parents[2]
# The folders into which a build puts what a later one takes over.
MADE = ("docs/gallery", "docs/tutorials", "generated/gallery")


def whole_site(site: Path) -> Iterator[Figure]:
    """Build the site, and measure it. Raises CalledProcessError where it cannot be built without a warning."""
    for folder in (*(ROOT / one for one in MADE), site):
        shutil.rmtree(folder, ignore_errors=True)
    with tempfile.TemporaryDirectory(prefix="symdyn-site-") as cache:
        wall, spent = time.perf_counter(), sum(os.times()[2:4])
        command = [sys.executable, "-m", "sphinx", "-W", "-q", "-b", "html", str(ROOT / "docs"), str(site)]
        subprocess.run(command, check=True, env={**os.environ, "SYMDYN_CACHE_DIR": cache})
        yield "site from nothing, without a warning", time.perf_counter() - wall, "s", "< 240"
        yield "site from nothing: processor time of all processes", sum(os.times()[2:4]) - spent, "s", ""
    yield "files .html", sum(1 for _ in site.rglob("*.html")), "", ""


if __name__ == "__main__":
    folder = Path(sys.argv[1]).resolve()
    sys.exit(print_figures([lambda: whole_site(folder)]) > 0)
