// The parts of the integrator of one mechanism, in order. SYMDYN_MODEL: its sizes, tables and the functions that are integrated.

#include "problem.h"
#include SYMDYN_MODEL
#if SYMDYN_EXPLICIT
#include "explicit_state.h"
#endif
#if SYMDYN_RADAU
#include "radau_state.h"
#endif
#if SYMDYN_GAUSS
#include "gauss_state.h"
#endif
#if SYMDYN_TAYLOR
#include "taylor_state.h"
#endif
#if SYMDYN_EVENTS
#include "events_state.h"
#endif
#include "run.h"
#if SYMDYN_PROJECTS
#include "projection.h"
#endif
#if SYMDYN_EXPLICIT
#include "explicit.h"
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
