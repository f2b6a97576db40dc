// The vector table of a Cortex-M with the C library's start (newlib with semihosting); the linker script is next to it.
extern unsigned long stack_top;
void _start(void);

static void fault(void) {
    for (;;) {}
}

void reset(void) {
    *(volatile unsigned long *)0xE000ED88ul |= 0xFul << 20;  // the floating-point unit
    __asm volatile("dsb\n isb");
    _start();
}

__attribute__((section(".vectors"), used)) static void *const vectors[16] = {
    &stack_top, (void *)reset, (void *)fault, (void *)fault, (void *)fault, (void *)fault, (void *)fault};
