/* From the reset to main, without a C library: the vectors, and memory as C expects it. */
#include <stddef.h>
#include <stdint.h>

#include "arm.h"

extern uint32_t data_start[], data_end[], data_load[], bss_start[], bss_end[], stack_top[];

int main(void);
void start(void);

/* Whatever goes wrong ends here; the watchdog, which nobody feeds any more, resets the robot. */
static void hang(void)
{
    for (;;) {
    }
}

void start(void)
{
    for (uint32_t *to = data_start, *from = data_load; to < data_end;)
        *to++ = *from++;
    for (uint32_t *to = bss_start; to < bss_end;)
        *to++ = 0;
    (void)main();
    hang();
}

typedef void (*handler)(void);

struct vectors {
    uint32_t *stack;
    handler system[15];
    handler interrupts[32];
};

#define FOUR(handler) handler, handler, handler, handler

__attribute__((section(".vectors"), used)) const struct vectors vectors = {
    .stack = stack_top,
    /* Reset, NMI, hard fault, memory, bus and usage faults; the last is SysTick. */
    .system = {start, hang, hang, hang, hang, hang, 0, 0, 0, 0, hang, hang, 0, hang, on_systick},
    /* Of these only the UARTs' are on; which they are is the chip's affair. */
    .interrupts = {FOUR(on_uart), FOUR(on_uart), FOUR(on_uart), FOUR(on_uart), FOUR(on_uart), FOUR(on_uart),
                   FOUR(on_uart), FOUR(on_uart)},
};
