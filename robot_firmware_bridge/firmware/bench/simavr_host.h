/* What the benches on simavr share: UARTs on pseudo-terminals, sensors, lines on standard input, and the wall clock. */
#ifndef SIMAVR_HOST_H
#define SIMAVR_HOST_H

#include <time.h>

#include <simavr/sim_avr.h>

#define FREQUENCY_HZ 16000000u
#define SLICE_CYCLES 16000u /* a millisecond */
#define ADC_CHANNELS 8u
#define FIFO_BYTES 4096u

struct link {
    avr_irq_t *input;
    int fd;
    int has_room; /* the UART takes bytes */
    unsigned char fifo[FIFO_BYTES];
    unsigned head, tail;
};

/* Make a pseudo-terminal, and a symbolic link to it. */
void open_link(struct link *link, const char *path);

/* Attach a link to the UART of a controller that has just been made. */
void attach(struct link *link, avr_t *avr, char uart);

/* Give the controller what has arrived at a link, as far as it has room. */
void carry_input(struct link *link);

/* Make a controller at 16 MHz and 5 V, without its program. */
avr_t *make_avr(const char *name);

void set_adc(avr_t *avr, unsigned channel, unsigned millivolt);

/* Obey the lines that have come on standard input; return 0 when whoever started us is gone. */
int read_commands(avr_t *avr, void (*obey)(avr_t *, const char *));

unsigned long ms_of(const avr_t *avr);

void wait_for_wall_clock(const avr_t *avr, const struct timespec *start);

#endif
