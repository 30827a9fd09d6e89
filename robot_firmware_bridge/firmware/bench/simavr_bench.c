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
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <pty.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

#include <simavr/avr_adc.h>
#include <simavr/avr_ioport.h>
#include <simavr/avr_uart.h>
#include <simavr/sim_avr.h>
#include <simavr/sim_elf.h>

#define FREQUENCY_HZ 16000000u
#define SLICE_CYCLES 16000u /* a millisecond */
#define OCR1A_ADDRESS 0x88
#define OCR1B_ADDRESS 0x8A
#define TCCR1A_ADDRESS 0x80
#define PORTA_ADDRESS 0x22
#define RJMP_SELF 0xCFFFu
#define RAM_ADDRESS 0x200u
#define MCUSR_ADDRESS 0x54
#define WATCHDOG_RESET 0x08
#define ADC_CHANNELS 8u
#define FIFO_BYTES 4096u

struct link {
    avr_irq_t *input;
    int fd;
    int has_room; /* the UART takes bytes */
    unsigned char fifo[FIFO_BYTES];
    unsigned head, tail;
};

static struct link host, ir;
static unsigned millivolts[ADC_CHANNELS] = {[7] = 4000}; /* a battery of 8 V */
static int is_reset;

static void on_output(avr_irq_t *irq, uint32_t value, void *param)
{
    (void)irq;
    const struct link *link = param;
    const unsigned char byte = (unsigned char)value;
    if (write(link->fd, &byte, 1) < 0 && errno != EAGAIN && errno != EIO)
        perror("simavr_bench: write");
}

static void on_xon(avr_irq_t *irq, uint32_t value, void *param)
{
    (void)irq, (void)value;
    ((struct link *)param)->has_room = 1;
}

static void on_xoff(avr_irq_t *irq, uint32_t value, void *param)
{
    (void)irq, (void)value;
    ((struct link *)param)->has_room = 0;
}

static void open_link(struct link *link, const char *path)
{
    int follower;
    struct termios raw;
    char name[256];
    memset(&raw, 0, sizeof raw);
    cfmakeraw(&raw);
    if (openpty(&link->fd, &follower, name, &raw, NULL) < 0) {
        perror("simavr_bench: openpty");
        exit(1);
    }
    /* The follower stays open here, so that a controller may come and go. */
    fcntl(link->fd, F_SETFL, O_NONBLOCK);
    unlink(path);
    if (symlink(name, path) < 0) {
        perror(path);
        exit(1);
    }
}

/* Attach a link to the UART of a controller that has just been made. */
static void attach(struct link *link, avr_t *avr, char uart)
{
    uint32_t flags = 0;
    avr_ioctl(avr, AVR_IOCTL_UART_SET_FLAGS(uart), &flags);
    link->input = avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ(uart), UART_IRQ_INPUT);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ(uart), UART_IRQ_OUTPUT), on_output, link);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ(uart), UART_IRQ_OUT_XON), on_xon, link);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ(uart), UART_IRQ_OUT_XOFF), on_xoff, link);
    link->has_room = 1;
}

static void carry_input(struct link *link)
{
    unsigned char bytes[256];
    const ssize_t count = read(link->fd, bytes, sizeof bytes);
    for (ssize_t i = 0; i < count; i++)
        if (link->head - link->tail < FIFO_BYTES)
            link->fifo[link->head++ % FIFO_BYTES] = bytes[i];
    while (link->has_room && link->tail != link->head)
        avr_raise_irq(link->input, link->fifo[link->tail++ % FIFO_BYTES]);
}

static unsigned long ms_of(const avr_t *avr) { return (unsigned long)(avr->cycle / (FREQUENCY_HZ / 1000u)); }

static void hang(avr_t *avr)
{
    /* Interrupts go on, as the hardware's would: what hangs is the loop. */
    avr->flash[avr->pc] = RJMP_SELF & 0xFFu;
    avr->flash[avr->pc + 1] = RJMP_SELF >> 8;
    printf("hung at %lu\n", ms_of(avr));
}

static void set_adc(avr_t *avr, unsigned channel, unsigned millivolt)
{
    millivolts[channel] = millivolt;
    avr_raise_irq(avr_io_getirq(avr, AVR_IOCTL_ADC_GETIRQ, (int)(ADC_IRQ_ADC0 + channel)), millivolt);
}

static void obey(avr_t *avr, const char *line)
{
    unsigned channel, value;
    if (sscanf(line, "adc %u %u", &channel, &value) == 2 && channel < ADC_CHANNELS)
        set_adc(avr, channel, value);
    else if (sscanf(line, "jaw %u", &value) == 1)
        avr_raise_irq(avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ('L'), 0), value);
    else if (strncmp(line, "hang", 4) == 0)
        hang(avr);
    else
        fprintf(stderr, "simavr_bench: unknown: %s", line);
}

static int read_commands(avr_t *avr)
{
    static char line[256];
    static size_t used;
    struct pollfd input = {.fd = 0, .events = POLLIN};
    while (poll(&input, 1, 0) > 0) {
        char byte;
        if (read(0, &byte, 1) <= 0)
            return 0; /* whoever started us is gone */
        line[used++] = byte;
        if (byte == '\n' || used == sizeof line - 1) {
            line[used] = '\0';
            used = 0;
            obey(avr, line);
        }
    }
    return 1;
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

static void never_sleep(avr_t *avr, avr_cycle_count_t cycles) { (void)avr, (void)cycles; }

static void wait_for_wall_clock(const avr_t *avr, const struct timespec *start)
{
    const uint64_t due_ns = avr->cycle * 1000u / (FREQUENCY_HZ / 1000000u);
    struct timespec due = *start;
    due.tv_sec += (time_t)(due_ns / 1000000000u);
    due.tv_nsec += (long)(due_ns % 1000000000u);
    if (due.tv_nsec >= 1000000000L) {
        due.tv_sec++;
        due.tv_nsec -= 1000000000L;
    }
    clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &due, NULL);
}

static avr_t *make_controller(elf_firmware_t *firmware)
{
    avr_t *avr = avr_make_mcu_by_name("atmega2560");
    avr_init(avr);
    avr_load_firmware(avr, firmware);
    avr->frequency = FREQUENCY_HZ;
    avr->vcc = avr->avcc = avr->aref = 5000;
    avr->sleep = never_sleep;
    avr->reset = on_reset;
    avr->log = LOG_ERROR;
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
    while (read_commands(avr)) {
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
