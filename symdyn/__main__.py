"""`python -m symdyn` is `symdyn`."""

from symdyn.cli import main

if __name__ == "__main__":
    raise SystemExit(main())
