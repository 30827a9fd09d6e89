/* Runs the firmware on an emulated ATmega2560, at the speed of the wall clock: UART0 on a pseudo-terminal, UART1 (IR) on
 * another, sensors and faults from standard input, wheels on standard output.
 *
 *     simavr_bench FIRMWARE.elf HOST_LINK IR_LINK
 *
 * HOST_LINK and IR_LINK are symbolic links to the pseudo-terminals. Input, a line each: `adc CHANNEL MILLIVOLTS`, `hang`
 * (the program counter stays where it is), `jaw 0|1`. Output, a line whenever they change: `wheels LEFT RIGHT at MS`,
 * in mm/s as the pins have them, `hung at MS` and `reset at MS`.
 */
#define _GNU_SOURCE
#include <stdio.h>
#include <string.h>
#include <time.h>

#include <simavr/avr_adc.h>
#include <simavr/avr_ioport.h>
#include <simavr/sim_avr.h>
#include <simavr/sim_elf.h>

#include "simavr_host.h"

#define OCR1A_ADDRESS 0x88
#define OCR1B_ADDRESS 0x8A
#define TCCR1A_ADDRESS 0x80
#define PORTA_ADDRESS 0x22
#define RJMP_SELF 0xCFFFu
#define RAM_ADDRESS 0x200u
#define MCUSR_ADDRESS 0x54
#define WATCHDOG_RESET 0x08

static struct link host, ir;
static unsigned millivolts[ADC_CHANNELS] = {[7] = 4000}; /* a battery of 8 V */
static int is_reset;

static void hang(avr_t *avr)
{
    /* Interrupts go on, as the hardware's would: what hangs is the loop. */
    avr->flash[avr->pc] = RJMP_SELF & 0xFFu;
    avr->flash[avr->pc + 1] = RJMP_SELF >> 8;
    printf("hung at %lu\n", ms_of(avr));
}

static void obey(avr_t *avr, const char *line)
{
    unsigned channel, value;
    if (sscanf(line, "adc %u %u", &channel, &value) == 2 && channel < ADC_CHANNELS)
        set_adc(avr, channel, millivolts[channel] = value);
    else if (sscanf(line, "jaw %u", &value) == 1)
        avr_raise_irq(avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ('L'), 0), value);
    else if (strncmp(line, "hang", 4) == 0)
        hang(avr);
    else
        fprintf(stderr, "simavr_bench: unknown: %s", line);
}

static int speed_of(const avr_t *avr, unsigned ocr, unsigned connected, unsigned reversed)
{
    if (!(avr->data[TCCR1A_ADDRESS] & connected))
        return 0;
    const unsigned duty = avr->data[ocr] | (unsigned)avr->data[ocr + 1] << 8;
    const int speed = (int)((duty * 500u + 511u) / 1023u);
    return (avr->data[PORTA_ADDRESS] & reversed) ? -speed : speed;
}

static void report_wheels(const avr_t *avr)
{
    static int left, right;
    const int now_left = speed_of(avr, OCR1A_ADDRESS, 0x80u, 1u);
    const int now_right = speed_of(avr, OCR1B_ADDRESS, 0x20u, 2u);
    if (now_left != left || now_right != right) {
        left = now_left;
        right = now_right;
        printf("wheels %d %d at %lu\n", left, right, ms_of(avr));
    }
}

static void on_reset(avr_t *avr)
{
    (void)avr;
    is_reset = 1;
}

static avr_t *make_controller(elf_firmware_t *firmware)
{
    avr_t *avr = make_avr("atmega2560");
    avr_load_firmware(avr, firmware);
    avr->reset = on_reset;
    attach(&host, avr, '0');
    attach(&ir, avr, '1');
    is_reset = 0;
    for (unsigned channel = 0; channel < ADC_CHANNELS; channel++)
        set_adc(avr, channel, millivolts[channel]);
    return avr;
}

/* Return the controller after a reset: its peripherals are new, its memory and the cause of the reset are kept. simavr's
 * own reset keeps the interrupts that were pending, and takes every later byte of a UART twice. */
static avr_t *after_reset(avr_t *avr, elf_firmware_t *firmware)
{
    avr_t *fresh = make_controller(firmware);
    memcpy(fresh->data + RAM_ADDRESS, avr->data + RAM_ADDRESS, avr->ramend + 1u - RAM_ADDRESS);
    fresh->data[MCUSR_ADDRESS] = WATCHDOG_RESET;
    fresh->cycle = avr->cycle;
    printf("reset at %lu\n", ms_of(fresh));
    avr_terminate(avr);
    return fresh;
}

int main(int argc, char **argv)
{
    if (argc != 4) {
        fprintf(stderr, "usage: simavr_bench FIRMWARE.elf HOST_LINK IR_LINK\n");
        return 2;
    }
    setvbuf(stdout, NULL, _IOLBF, 0);
    elf_firmware_t firmware;
    memset(&firmware, 0, sizeof firmware);
    if (elf_read_firmware(argv[1], &firmware) != 0)
        return 2;
    open_link(&host, argv[2]);
    open_link(&ir, argv[3]);
    avr_t *avr = make_controller(&firmware);
    puts("ready");
    struct timespec start;
    clock_gettime(CLOCK_MONOTONIC, &start);
    while (read_commands(avr, obey)) {
        const avr_cycle_count_t until = avr->cycle + SLICE_CYCLES;
        while (avr->cycle < until) {
            const int state = avr_run(avr);
            if (is_reset)
                break;
            if (state == cpu_Done || state == cpu_Crashed) {
                fprintf(stderr, "simavr_bench: the firmware has crashed\n");
                return 1;
            }
        }
        if (is_reset)
            avr = after_reset(avr, &firmware);
        carry_input(&host);
        carry_input(&ir);
        report_wheels(avr);
        wait_for_wall_clock(avr, &start);
    }
    return 0;
}
