"""The functions of a module: their table, the tapes behind them, and their metadata in generated code."""
