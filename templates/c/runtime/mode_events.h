// Kinds of events that end modes of contacts.
#pragma once

enum {
    SYMDYN_CLOSES = 0,
    SYMDYN_OPENS = 1,
    SYMDYN_STICKS = 2,
    SYMDYN_SLIPS = 3,
    SYMDYN_IGNORED = 4,  // from now on, although it may close
    SYMDYN_COUNTS = 5,   // again
    SYMDYN_KINDS = SYMDYN_COUNTS + 1
};
