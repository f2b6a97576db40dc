"""`symdyn schema`: the JSON schema of data files."""

from __future__ import annotations

import argparse
import json


def schema(_: argparse.Namespace) -> int:
    """Print the schema."""
    from symdyn.datafile.schema import data_file_schema

    print(json.dumps(data_file_schema(), indent=2))
    return 0
