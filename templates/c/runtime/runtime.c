// The parts of the integrator of one mechanism, in order.

#include "common.h"
#include "exports.h"
#if SYMDYN_EXPLICIT
#include "explicit.h"
#endif
#if SYMDYN_PROJECTS
#include "projection.h"
#endif
#if SYMDYN_EXPLICIT
#include "explicit_again.h"
#endif
#if SYMDYN_RADAU
#include "radau.h"
#endif
#if SYMDYN_GAUSS
#include "gauss.h"
#endif
#if SYMDYN_TAYLOR
#include "taylor.h"
#endif
#include "start.h"
#include "steps.h"
#if SYMDYN_EVENTS
#include "events.h"
#endif
#include "simulate.h"
#if SYMDYN_BACKWARD
#include "backward.h"
#endif
