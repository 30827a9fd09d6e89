#include "arm.h"

#include "../../core/hal.h"
#include "../../core/robot.h"

#define SYSTICK_CONTROL REGISTER(0xE000E010u)
#define SYSTICK_RELOAD REGISTER(0xE000E014u)
#define SYSTICK_VALUE REGISTER(0xE000E018u)

#define UART_RECEIVES 0x50u /* its queue is half full, or it holds something and nothing more comes */
#define UART_NOTHING_RECEIVED 0x10u
#define UART_FULL 0x20u
#define UART_8N1_QUEUED 0x70u
#define UART_ON 0x301u

#define QUEUE_BYTES 512u /* a power of two, more than the longest frame */

struct queue {
    volatile uint8_t data[QUEUE_BYTES];
    volatile uint16_t head, tail;
};

struct link {
    struct uart *uart;
    struct queue rx, tx;
};

static struct link links[2];
static volatile uint32_t milliseconds;

static uint16_t used_of(const struct queue *queue) { return (uint16_t)(queue->head - queue->tail); }

static void put(struct queue *queue, uint8_t byte)
{
    queue->data[queue->head % QUEUE_BYTES] = byte;
    queue->head++;
}

static uint8_t take(struct queue *queue)
{
    const uint8_t byte = queue->data[queue->tail % QUEUE_BYTES];
    queue->tail++;
    return byte;
}

void on_systick(void) { milliseconds++; }

void on_uart(void)
{
    for (struct link *link = links; link < links + 2; link++) {
        while (!(link->uart->flags & UART_NOTHING_RECEIVED)) {
            const uint8_t byte = (uint8_t)(link->uart->data & 0xFFu);
            if (used_of(&link->rx) < QUEUE_BYTES)
                put(&link->rx, byte);
        }
        link->uart->clear = UART_RECEIVES;
    }
}

static void transmit(struct link *link)
{
    while (used_of(&link->tx) > 0 && !(link->uart->flags & UART_FULL))
        link->uart->data = take(&link->tx);
}

uint32_t hal_ms(void) { return milliseconds; }

uint8_t hal_send(enum hal_link number, const uint8_t *data, size_t length)
{
    struct queue *queue = &links[number].tx;
    if (QUEUE_BYTES - used_of(queue) < length)
        return 0;
    for (size_t i = 0; i < length; i++)
        put(queue, data[i]);
    return 1;
}

void arm_start_clock(uint32_t clock_hz)
{
    SYSTICK_RELOAD = clock_hz / 1000u - 1u;
    SYSTICK_VALUE = 0;
    SYSTICK_CONTROL = 7;
}

static void open_link(struct link *link, struct uart *uart, uint32_t clock_hz, uint32_t baud)
{
    const uint32_t sixty_fourths = (clock_hz * 4u + baud / 2u) / baud;
    link->uart = uart;
    uart->control = 0;
    uart->divisor = sixty_fourths / 64u;
    uart->fraction = sixty_fourths % 64u;
    uart->line = UART_8N1_QUEUED;
    uart->interrupts = UART_RECEIVES;
    uart->control = UART_ON;
}

void arm_open_links(struct uart *host, struct uart *ir, uint32_t clock_hz, uint32_t host_baud, uint32_t ir_baud)
{
    open_link(&links[HAL_HOST], host, clock_hz, host_baud);
    open_link(&links[HAL_IR], ir, clock_hz, ir_baud);
}

static uint8_t is_idle(void)
{
    return used_of(&links[0].rx) == 0 && used_of(&links[1].rx) == 0 && used_of(&links[0].tx) == 0 &&
           used_of(&links[1].tx) == 0;
}

/* Wait for an interrupt, unless one has brought something already; with interrupts held back none is missed. */
static void rest(uint32_t ticked_ms)
{
    __asm__ volatile("cpsid i" ::: "memory");
    if (is_idle() && hal_ms() == ticked_ms)
        __asm__ volatile("wfi" ::: "memory");
    __asm__ volatile("cpsie i" ::: "memory");
}

int main(void)
{
    static struct robot robot;
    chip_set_up();
    while (!chip_is_ready()) {
    }
    robot_init(&robot);
    uint32_t ticked_ms = hal_ms();
    for (;;) {
        while (used_of(&links[HAL_HOST].rx) > 0)
            robot_receive(&robot, take(&links[HAL_HOST].rx));
        while (used_of(&links[HAL_IR].rx) > 0)
            robot_receive_ir(&robot, take(&links[HAL_IR].rx));
        if (hal_ms() != ticked_ms) {
            ticked_ms++;
            chip_tick();
            robot_tick(&robot);
        }
        transmit(&links[HAL_HOST]);
        transmit(&links[HAL_IR]);
        rest(ticked_ms);
    }
}
