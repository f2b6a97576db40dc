"""symdyn compared with its peers on the same mechanisms, in one run: `symdyn bench peers`.

    models        the mechanisms, with the bounds that symdyn is held to
    description   a mechanism as plain text that the peers read
    toolchain     headers, libraries and compilers, and what to install where they are missing
    symdyn_peer, pinocchio_peer, casadi_peer   each one as a Program: n evaluations in a compiled loop
    kkt_peer, kane_peer   the same for a four-bar linkage
    timing        whether the programs agree, and their times, measured side by side
    benchmark, four_bar   one mechanism: counts and times
    table, loop_table     rows, verdicts, text
    command       all of it

The peers are Pinocchio's articulated-body algorithm in C++, and the C code that CasADi generates from that algorithm. Where
a loop is closed, they are Pinocchio's constrained dynamics, and C code from CasADi's and SymPy's symbolic solutions.
"""
