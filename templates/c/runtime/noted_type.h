// Events that are noted in a run, and doubts about events.
#ifndef SYMDYN_NOTED_TYPE
#define SYMDYN_NOTED_TYPE

// Kinds. Doubts of one of many motions are a sum of these.
enum {
    SYMDYN_HAPPENED = 0,
    SYMDYN_UNRESOLVED = 1,  // its quantity varies too quickly for all zeros to be found from this time on
    SYMDYN_UNPROVED = 2,    // others of its zeros may be missed from this time on
    SYMDYN_ENTANGLED = 4    // it is one of several at one time on whose order sensitivities depend
};

typedef struct {
    int kind, event;
    double t;
} symdyn_noted;

#endif
