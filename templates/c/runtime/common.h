// Declarations of all parts of the integrator of one mechanism.
#pragma once

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
#if SYMDYN_EXPLICIT
#include "explicit_stage.h"
#endif
