#define _GNU_SOURCE
#include "simavr_host.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <pty.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <termios.h>
#include <unistd.h>

#include <simavr/avr_adc.h>
#include <simavr/avr_uart.h>

static void on_output(avr_irq_t *irq, uint32_t value, void *param)
{
    (void)irq;
    const struct link *link = param;
    const unsigned char byte = (unsigned char)value;
    if (write(link->fd, &byte, 1) < 0 && errno != EAGAIN && errno != EIO)
        perror("simavr: write");
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

void open_link(struct link *link, const char *path)
{
    int follower;
    struct termios raw;
    char name[256];
    memset(&raw, 0, sizeof raw);
    cfmakeraw(&raw);
    if (openpty(&link->fd, &follower, name, &raw, NULL) < 0) {
        perror("simavr: openpty");
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

void attach(struct link *link, avr_t *avr, char uart)
{
    uint32_t flags = 0;
    avr_ioctl(avr, AVR_IOCTL_UART_SET_FLAGS(uart), &flags);
    link->input = avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ(uart), UART_IRQ_INPUT);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ(uart), UART_IRQ_OUTPUT), on_output, link);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ(uart), UART_IRQ_OUT_XON), on_xon, link);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ(uart), UART_IRQ_OUT_XOFF), on_xoff, link);
    link->has_room = 1;
}

void carry_input(struct link *link)
{
    unsigned char bytes[256];
    const ssize_t count = read(link->fd, bytes, sizeof bytes);
    for (ssize_t i = 0; i < count; i++)
        if (link->head - link->tail < FIFO_BYTES)
            link->fifo[link->head++ % FIFO_BYTES] = bytes[i];
    while (link->has_room && link->tail != link->head)
        avr_raise_irq(link->input, link->fifo[link->tail++ % FIFO_BYTES]);
}

static void never_sleep(avr_t *avr, avr_cycle_count_t cycles) { (void)avr, (void)cycles; }

avr_t *make_avr(const char *name)
{
    avr_t *avr = avr_make_mcu_by_name(name);
    avr_init(avr);
    avr->frequency = FREQUENCY_HZ;
    avr->vcc = avr->avcc = avr->aref = 5000;
    avr->sleep = never_sleep;
    avr->log = LOG_ERROR;
    return avr;
}

void set_adc(avr_t *avr, unsigned channel, unsigned millivolt)
{
    avr_raise_irq(avr_io_getirq(avr, AVR_IOCTL_ADC_GETIRQ, (int)(ADC_IRQ_ADC0 + channel)), millivolt);
}

int read_commands(avr_t *avr, void (*obey)(avr_t *, const char *))
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

unsigned long ms_of(const avr_t *avr) { return (unsigned long)(avr->cycle / (FREQUENCY_HZ / 1000u)); }

void wait_for_wall_clock(const avr_t *avr, const struct timespec *start)
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
