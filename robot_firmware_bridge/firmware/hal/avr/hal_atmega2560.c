/* An ATmega2560 at 16 MHz: the host on UART0 at 500 kbit/s (no error at 16 MHz; 115,200 is 2 % off), infrared on UART1 at
 * 9,600, wheels as PWM on OC1A and OC1B with direction on PA0 and PA1, the battery at ADC7 through a divider of 1:2, seven
 * proximity sensors at ADC0 to ADC6, a lamp on PC0 to PC2, the jaw on PC3 and its switch on PL0.
 */
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/wdt.h>
#include <util/atomic.h>

#include "../../core/hal.h"
#include "../../core/robot.h"

#define QUEUE_BYTES 256u /* an index is one byte, which wraps by itself */
#define ADC_CHANNELS 8u
#define BATTERY_CHANNEL 7u
#define WHEEL_LIMIT_MM_S 500
#define PWM_TOP 1023
#define LATCHED 0x5A17E57Du

struct queue {
    volatile uint8_t data[QUEUE_BYTES];
    volatile uint8_t head, tail;
};

static struct queue host_rx, host_tx, ir_rx, ir_tx;
static volatile uint32_t milliseconds;
static volatile uint16_t adc_values[ADC_CHANNELS];
static enum reset_cause reset_cause;
/* Not initialised: a reset by the watchdog leaves it as it was. */
static uint32_t latch __attribute__((section(".noinit")));

const uint8_t hal_uid[HAL_UID_BYTES] = {ROBOT_UID};
const uint8_t hal_proximity_sensors = 7;
const uint16_t hal_capabilities = CAN_IR | CAN_JAW | CAN_LED;
const uint16_t hal_battery_low_mv = 6800;
const uint16_t hal_battery_critical_mv = 6200;
const char hal_description[] =
    "{\"model\":\"crcolony reference robot\",\"controller\":\"ATmega2560\",\"track_m\":0.09,\"radius_m\":0.06,"
    "\"max_speed_m_s\":0.5,\"proximity_bearings_rad\":[-1.2,-0.8,-0.4,0,0.4,0.8,1.2],\"proximity_range_m\":0.3,"
    "\"battery_empty_v\":6.2,\"battery_full_v\":8.4,\"watchdog_s\":0.25}";
const uint16_t hal_description_length = sizeof hal_description - 1;

/* Taken before the C runtime starts: a watchdog that has reset the controller stays on. */
static uint8_t early_mcusr __attribute__((section(".noinit")));
void take_reset_cause(void) __attribute__((naked, used, section(".init3")));
void take_reset_cause(void)
{
    early_mcusr = MCUSR;
    MCUSR = 0;
    wdt_disable();
}

static uint8_t is_empty(const struct queue *queue) { return queue->head == queue->tail; }

static uint8_t room_of(const struct queue *queue) { return (uint8_t)(queue->tail - queue->head - 1); }

static void put(struct queue *queue, uint8_t byte)
{
    queue->data[queue->head] = byte;
    queue->head++;
}

static uint8_t take(struct queue *queue)
{
    const uint8_t byte = queue->data[queue->tail];
    queue->tail++;
    return byte;
}

ISR(USART0_RX_vect)
{
    const uint8_t byte = UDR0;
    if (room_of(&host_rx))
        put(&host_rx, byte);
}

ISR(USART1_RX_vect)
{
    const uint8_t byte = UDR1;
    if (room_of(&ir_rx))
        put(&ir_rx, byte);
}

ISR(USART0_UDRE_vect)
{
    if (is_empty(&host_tx))
        UCSR0B &= (uint8_t)~_BV(UDRIE0);
    else
        UDR0 = take(&host_tx);
}

ISR(USART1_UDRE_vect)
{
    if (is_empty(&ir_tx))
        UCSR1B &= (uint8_t)~_BV(UDRIE1);
    else
        UDR1 = take(&ir_tx);
}

ISR(TIMER0_COMPA_vect) { milliseconds++; }

ISR(ADC_vect)
{
    const uint8_t channel = ADMUX & 0x07u;
    adc_values[channel] = ADC;
    ADMUX = (uint8_t)(_BV(REFS0) | ((channel + 1u) & 0x07u));
    ADCSRA |= _BV(ADSC);
}

static uint16_t adc(uint8_t channel)
{
    uint16_t value;
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { value = adc_values[channel]; }
    return value;
}

uint32_t hal_ms(void)
{
    uint32_t now;
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { now = milliseconds; }
    return now;
}

uint8_t hal_send(enum hal_link link, const uint8_t *data, size_t length)
{
    struct queue *queue = link == HAL_HOST ? &host_tx : &ir_tx;
    uint8_t is_sent = 0;
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) { is_sent = room_of(queue) >= length; }
    if (!is_sent)
        return 0;
    for (size_t i = 0; i < length; i++)
        put(queue, data[i]);
    if (link == HAL_HOST)
        UCSR0B |= _BV(UDRIE0);
    else
        UCSR1B |= _BV(UDRIE1);
    return 1;
}

static uint16_t duty_of(int16_t mm_s)
{
    const int16_t magnitude = mm_s < 0 ? (int16_t)-mm_s : mm_s;
    const int16_t limited = magnitude > WHEEL_LIMIT_MM_S || magnitude < 0 ? WHEEL_LIMIT_MM_S : magnitude;
    return (uint16_t)((int32_t)limited * PWM_TOP / WHEEL_LIMIT_MM_S);
}

void hal_set_wheels(int16_t left_mm_s, int16_t right_mm_s)
{
    const uint8_t back = (uint8_t)((left_mm_s < 0) | (right_mm_s < 0) << 1);
    if (PORTA != back)
        TCCR1A = _BV(WGM11) | _BV(WGM10); /* no wheel turns the wrong way at its old speed, not for a microsecond */
    PORTA = back;
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
    {
        OCR1A = duty_of(left_mm_s);
        OCR1B = duty_of(right_mm_s);
    }
    /* A PWM of 0 would still be high for one count: the pins are taken from the timer. */
    TCCR1A = (uint8_t)(_BV(WGM11) | _BV(WGM10) | (left_mm_s ? _BV(COM1A1) : 0) | (right_mm_s ? _BV(COM1B1) : 0));
}

void hal_set_lamp(uint8_t red, uint8_t green, uint8_t blue)
{
    const uint8_t on = (uint8_t)((red > 127) | (green > 127) << 1 | (blue > 127) << 2);
    PORTC = (uint8_t)((PORTC & ~0x07u) | on);
}

void hal_set_speaker(uint8_t loudness) { (void)loudness; }

void hal_set_jaw(uint8_t is_closed)
{
    if (is_closed)
        PORTC |= _BV(PC3);
    else
        PORTC &= (uint8_t)~_BV(PC3);
}

uint16_t hal_battery_mv(void) { return (uint16_t)((uint32_t)adc(BATTERY_CHANNEL) * 5000u * 2u / 1023u); }

uint16_t hal_proximity_mm(uint8_t sensor)
{
    const uint16_t value = adc(sensor);
    return value < 16u ? 0xFFFFu : (uint16_t)(300u - (uint32_t)value * 300u / 1023u);
}

void hal_wheel_speeds(int16_t *left_mm_s, int16_t *right_mm_s)
{
    /* No encoders: what the motors are given. */
    const int32_t left = (TCCR1A & _BV(COM1A1)) ? OCR1A : 0, right = (TCCR1A & _BV(COM1B1)) ? OCR1B : 0;
    const int16_t left_abs = (int16_t)((left * WHEEL_LIMIT_MM_S + PWM_TOP / 2) / PWM_TOP);
    const int16_t right_abs = (int16_t)((right * WHEEL_LIMIT_MM_S + PWM_TOP / 2) / PWM_TOP);
    *left_mm_s = (PORTA & 1u) ? (int16_t)-left_abs : left_abs;
    *right_mm_s = (PORTA & 2u) ? (int16_t)-right_abs : right_abs;
}

int16_t hal_gyro_mrad_s(void) { return 0; }

uint8_t hal_jaw_holds(void) { return (PINL & _BV(PL0)) != 0; }

void hal_feed_watchdog(void) { wdt_reset(); }

enum reset_cause hal_reset_cause(void) { return reset_cause; }

uint8_t hal_load_latch(void) { return latch == LATCHED; }

void hal_store_latch(uint8_t is_stopped) { latch = is_stopped ? LATCHED : 0; }

static void set_up(void)
{
    reset_cause = (early_mcusr & _BV(WDRF)) ? RESET_WATCHDOG : (early_mcusr & _BV(BORF)) ? RESET_BROWN_OUT : RESET_POWER;
    if (reset_cause != RESET_WATCHDOG)
        latch = 0; /* memory holds anything after a power-up */
    DDRA = 0x03;
    DDRB = _BV(PB5) | _BV(PB6);
    DDRC = 0x0F;
    TCCR1A = _BV(WGM11) | _BV(WGM10);
    TCCR1B = _BV(WGM12) | _BV(CS11);
    TCCR0A = _BV(WGM01);
    TCCR0B = _BV(CS01) | _BV(CS00);
    OCR0A = 249; /* 16 MHz / 64 / 250: a millisecond */
    TIMSK0 = _BV(OCIE0A);
    UBRR0 = 3;
    UCSR0A = _BV(U2X0);
    UCSR0B = _BV(RXEN0) | _BV(TXEN0) | _BV(RXCIE0);
    UBRR1 = 25; /* 38,400 baud: a genotype goes in half a second */
    UCSR1B = _BV(RXEN1) | _BV(TXEN1) | _BV(RXCIE1);
    ADMUX = _BV(REFS0);
    ADCSRA = _BV(ADEN) | _BV(ADIE) | _BV(ADPS2) | _BV(ADPS1) | _BV(ADPS0) | _BV(ADSC);
    wdt_enable(WDTO_250MS);
    sei();
}

static void wait_for_battery(void)
{
    /* A robot that has not measured its battery yet would take it for empty. */
    while (hal_ms() < 20u)
        wdt_reset();
}

int main(void)
{
    static struct robot robot;
    set_up();
    wait_for_battery();
    robot_init(&robot);
    uint32_t ticked_ms = hal_ms();
    for (;;) {
        while (!is_empty(&host_rx))
            robot_receive(&robot, take(&host_rx));
        while (!is_empty(&ir_rx))
            robot_receive_ir(&robot, take(&ir_rx));
        if (hal_ms() != ticked_ms) {
            ticked_ms++;
            robot_tick(&robot);
        }
    }
}
