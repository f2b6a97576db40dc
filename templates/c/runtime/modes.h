// Modes of a contact.
#pragma once

enum { SYMDYN_OPEN = 0, SYMDYN_STICKING = 1, SYMDYN_SLIDING = 2 };
