"""The functions of a module: what there is, the tapes behind them, and what generated code documents of them."""
