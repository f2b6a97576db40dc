"""See command."""

import sys

from symdyn.bench.robots.command import main

sys.exit(main())
