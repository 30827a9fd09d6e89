/* What Cortex-M controllers with PL011 UARTs share: startup, links with queues, the millisecond, and the loop. A chip has
 * its clocks, pins and registers in its own folder.
 */
#ifndef CRCOLONY_ARM_H
#define CRCOLONY_ARM_H

#include <stdint.h>

#define REGISTER(address) (*(volatile uint32_t *)(address))

struct uart {
    volatile uint32_t data, errors, unused[4], flags, unused_too, low_power, divisor, fraction, line, control, levels;
    volatile uint32_t interrupts, raw, masked, clear;
};

/* Handlers of the vectors. */
void on_systick(void);
void on_uart(void);

/* Start a millisecond of so many cycles, and the links. */
void arm_start_clock(uint32_t clock_hz);
void arm_open_links(struct uart *host, struct uart *ir, uint32_t clock_hz, uint32_t host_baud, uint32_t ir_baud);

/* Make the chip ready: clocks, watchdog, links, and the cause of the reset. */
void chip_set_up(void);
/* Called once a millisecond, before the robot's tick. */
void chip_tick(void);
/* Whether the sensors have been read: a robot that has not measured its battery yet would take it for empty. */
uint8_t chip_is_ready(void);

#endif
