// Instructions, counted by the timer of a Cortex-M under an emulator that runs one in a nanosecond; elsewhere nothing.
#pragma once

#if defined(__ARM_ARCH) && defined(__thumb__)
// SysTick counts down from 2^24 with the 25 MHz of the processor of the board: a tick is 40 instructions. Reads come often.
#define TICK 40ul
static unsigned long ticks(void) {
    volatile unsigned long *const timer = (volatile unsigned long *)0xE000E010ul;
    static unsigned long last, total;
    if (!(timer[0] & 1ul)) {
        timer[1] = 0xFFFFFFul;
        timer[2] = 0ul;
        timer[0] = 5ul;
        last = timer[2];
    }
    const unsigned long now = timer[2];
    total += (last - now) & 0xFFFFFFul;
    last = now;
    return total;
}
#else
#define TICK 0ul
static unsigned long ticks(void) { return 0ul; }
#endif
