// The type of times, which stay doubles where all else is in single precision.
#pragma once

typedef double symdyn_time;
