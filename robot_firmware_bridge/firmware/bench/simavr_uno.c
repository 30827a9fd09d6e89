/* Runs the firmware of an Arduino Uno, as it is in a file of the Intel hex format, on an emulated ATmega328P at the speed
 * of the wall clock: its UART on a pseudo-terminal, sensors from standard input, pins on standard output.
 *
 *     simavr_uno FIRMWARE.hex HOST_LINK
 *
 * HOST_LINK is a symbolic link to the pseudo-terminal. Input, a line each: `adc CHANNEL MILLIVOLTS`. Output, a line
 * whenever they change: `pins LEVEL ... at MS`, of pins 0 to 13 what each puts out, from 0 to 255; 0 of an input.
 */
#define _GNU_SOURCE
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include <simavr/sim_avr.h>
#include <simavr/sim_hex.h>

#include "simavr_host.h"

#define PINS 14u

struct pin {
    unsigned port, bit;             /* PORTx; DDRx is the address before it */
    unsigned control, mask, level;  /* TCCRnA, its bit that connects the timer to the pin, OCRnx; 0 without PWM */
};

static const struct pin pins[PINS] = {
    {0x2B, 0, 0, 0, 0},          {0x2B, 1, 0, 0, 0},          {0x2B, 2, 0, 0, 0},
    {0x2B, 3, 0xB0, 0x20, 0xB4}, {0x2B, 4, 0, 0, 0},          {0x2B, 5, 0x44, 0x20, 0x48},
    {0x2B, 6, 0x44, 0x80, 0x47}, {0x2B, 7, 0, 0, 0},          {0x25, 0, 0, 0, 0},
    {0x25, 1, 0x80, 0x80, 0x88}, {0x25, 2, 0x80, 0x20, 0x8A}, {0x25, 3, 0xB0, 0x80, 0xB3},
    {0x25, 4, 0, 0, 0},          {0x25, 5, 0, 0, 0},
};

static struct link host;

static void obey(avr_t *avr, const char *line)
{
    unsigned channel, value;
    if (sscanf(line, "adc %u %u", &channel, &value) == 2 && channel < ADC_CHANNELS)
        set_adc(avr, channel, value);
    else
        fprintf(stderr, "simavr_uno: unknown: %s", line);
}

static unsigned level_of(const avr_t *avr, const struct pin *pin)
{
    const unsigned bit = 1u << pin->bit;
    if (!(avr->data[pin->port - 1] & bit))
        return 0;
    if (pin->control && (avr->data[pin->control] & pin->mask))
        return avr->data[pin->level];
    return (avr->data[pin->port] & bit) ? 255 : 0;
}

static void report_pins(const avr_t *avr)
{
    static unsigned char before[PINS];
    unsigned char now[PINS];
    for (unsigned i = 0; i < PINS; i++)
        now[i] = (unsigned char)level_of(avr, &pins[i]);
    if (memcmp(now, before, PINS) == 0)
        return;
    memcpy(before, now, PINS);
    printf("pins");
    for (unsigned i = 0; i < PINS; i++)
        printf(" %u", now[i]);
    printf(" at %lu\n", ms_of(avr));
}

static avr_t *make_uno(const char *path)
{
    uint32_t size, start;
    uint8_t *program = read_ihex_file(path, &size, &start);
    if (program == NULL)
        exit(2);
    avr_t *avr = make_avr("atmega328p");
    avr_loadcode(avr, program, size, start);
    avr->codeend = start + size;
    free(program);
    attach(&host, avr, '0');
    for (unsigned channel = 0; channel < ADC_CHANNELS; channel++)
        set_adc(avr, channel, 0);
    return avr;
}

int main(int argc, char **argv)
{
    if (argc != 3) {
        fprintf(stderr, "usage: simavr_uno FIRMWARE.hex HOST_LINK\n");
        return 2;
    }
    setvbuf(stdout, NULL, _IOLBF, 0);
    open_link(&host, argv[2]);
    avr_t *avr = make_uno(argv[1]);
    puts("ready");
    struct timespec start;
    clock_gettime(CLOCK_MONOTONIC, &start);
    while (read_commands(avr, obey)) {
        const avr_cycle_count_t until = avr->cycle + SLICE_CYCLES;
        while (avr->cycle < until) {
            const int state = avr_run(avr);
            if (state == cpu_Done || state == cpu_Crashed) {
                fprintf(stderr, "simavr_uno: the firmware has crashed\n");
                return 1;
            }
        }
        carry_input(&host);
        report_pins(avr);
        wait_for_wall_clock(avr, &start);
    }
    return 0;
}
