/* An RP2040 on its crystal of 12 MHz: the host on UART0 (GPIO 0 and 1) at 500 kbit/s, infrared on UART1 (4 and 5) at
 * 9,600, wheels as PWM on GPIO 2 and 3 with direction on 6 and 7, the battery at ADC 0 (GPIO 26) through a divider of
 * 1:4, three proximity sensors at ADC 1 to 3, a lamp on GPIO 16 to 18, the jaw on 19 and its switch on 20.
 *
 * The image goes to flash at 0x10000100, behind a second-stage boot loader such as pico-sdk's boot2_generic_03h, which
 * is none of ours: the emulator starts without one.
 */
#include "../../core/hal.h"
#include "../arm/arm.h"

#define SET(address) REGISTER((address) + 0x2000u)
#define CLEAR(address) REGISTER((address) + 0x3000u)

#define CLOCK_HZ 12000000u
#define CLOCK_REFERENCE REGISTER(0x40008030u)
#define CLOCK_REFERENCE_IS REGISTER(0x40008038u)
#define CLOCK_SYSTEM REGISTER(0x4000803Cu)
#define CLOCK_SYSTEM_IS REGISTER(0x40008044u)
#define CLOCK_PERIPHERALS REGISTER(0x40008048u)
#define CLOCK_ADC REGISTER(0x40008060u)
#define CLOCK_ON 0x800u
#define FROM_CRYSTAL_ADC 0x60u
#define CRYSTAL_CONTROL REGISTER(0x40024000u)
#define CRYSTAL_STATUS REGISTER(0x40024004u)
#define CRYSTAL_DELAY REGISTER(0x4002400Cu)
#define CRYSTAL_ON 0xFABAA0u
#define CRYSTAL_IS_STABLE 0x80000000u

#define RESETS 0x4000C000u
#define RESETS_DONE REGISTER(0x4000C008u)
#define USED 0x00C04121u /* ADC, pins, pads, PWM, both UARTs */

#define PIN_FUNCTION(pin) REGISTER(0x40014004u + 8u * (pin))
#define PIN_UART 2u
#define PIN_PWM 4u
#define PIN_SOFTWARE 5u
#define PIN_HAS_NONE 31u
#define PAD(pin) REGISTER(0x4001C004u + 4u * (pin))
#define PAD_ANALOG 0x80u /* neither input nor output, no pulls */
#define OUTPUT_SET REGISTER(0xD0000014u)
#define OUTPUT_CLEAR REGISTER(0xD0000018u)
#define OUTPUT_ENABLE_SET REGISTER(0xD0000024u)
#define INPUT REGISTER(0xD0000004u)
#define LEFT_BACK (1u << 6)
#define RIGHT_BACK (1u << 7)
#define LAMP_SHIFT 16u
#define JAW (1u << 19)
#define JAW_SWITCH (1u << 20)

#define PWM_CONTROL REGISTER(0x40050014u) /* of slice 1: GPIO 2 and 3 */
#define PWM_LEVELS REGISTER(0x40050020u)
#define PWM_TOP REGISTER(0x40050024u)
#define WHEEL_LIMIT_MM_S 500
#define PWM_PER_MM_S 2u

#define ADC_CONTROL REGISTER(0x4004C000u)
#define ADC_RESULT REGISTER(0x4004C004u)
#define ADC_ON 1u
#define ADC_START 4u
#define ADC_READY 0x100u
#define ADC_CHANNELS 4u
#define ADC_TOP 4095u
#define REFERENCE_MV 3300u
#define BATTERY_DIVIDER 4u
#define PROXIMITY_RANGE_MM 300u

#define WATCHDOG 0x40058000u
#define WATCHDOG_LOAD REGISTER(WATCHDOG + 0x04u)
#define WATCHDOG_REASON REGISTER(WATCHDOG + 0x08u)
#define WATCHDOG_SCRATCH REGISTER(WATCHDOG + 0x0Cu)
#define WATCHDOG_TICK REGISTER(WATCHDOG + 0x2Cu)
#define WATCHDOG_ON 0x40000000u
#define WATCHDOG_TICKS (250000u * 2u) /* it counts two a microsecond (erratum RP2040-E1) */
#define TICK_ON 0x200u
#define POWER_ON_RESETS REGISTER(0x40010008u)
#define ALL_BUT_OSCILLATORS 0x1FFFCu
#define REASON_TIMER 1u
#define REASON_FORCED 2u
#define LATCHED 0x5A17E57Du

#define VECTOR_TABLE REGISTER(0xE000ED08u)
#define NVIC_ENABLE REGISTER(0xE000E100u)
#define IRQ_UART0 20u
#define IRQ_UART1 21u

extern const uint32_t vectors[];

static uint16_t adc_values[ADC_CHANNELS];
static uint8_t adc_channel, adc_rounds;
static int16_t set_left_mm_s, set_right_mm_s;
static enum reset_cause reset_cause;

const uint8_t hal_uid[HAL_UID_BYTES] = {ROBOT_UID};
const uint8_t hal_proximity_sensors = ADC_CHANNELS - 1u;
const uint16_t hal_capabilities = CAN_IR | CAN_JAW | CAN_LED;
const uint16_t hal_battery_low_mv = 6800;
const uint16_t hal_battery_critical_mv = 6200;
const char hal_description[] =
    "{\"model\":\"crcolony reference robot\",\"controller\":\"RP2040\",\"track_m\":0.09,\"radius_m\":0.06,"
    "\"max_speed_m_s\":0.5,\"proximity_bearings_rad\":[-0.6,0,0.6],\"proximity_range_m\":0.3,"
    "\"battery_empty_v\":6.2,\"battery_full_v\":8.4,\"watchdog_s\":0.25}";
const uint16_t hal_description_length = sizeof hal_description - 1;

static uint32_t level_of(int16_t mm_s)
{
    const int32_t magnitude = mm_s < 0 ? -(int32_t)mm_s : mm_s;
    return PWM_PER_MM_S * (uint32_t)(magnitude > WHEEL_LIMIT_MM_S ? WHEEL_LIMIT_MM_S : magnitude);
}

void hal_set_wheels(int16_t left_mm_s, int16_t right_mm_s)
{
    const uint32_t back = (left_mm_s < 0 ? LEFT_BACK : 0u) | (right_mm_s < 0 ? RIGHT_BACK : 0u);
    PWM_LEVELS = 0; /* no wheel turns the wrong way at its old speed */
    OUTPUT_CLEAR = (LEFT_BACK | RIGHT_BACK) & ~back;
    OUTPUT_SET = back;
    PWM_LEVELS = level_of(left_mm_s) | level_of(right_mm_s) << 16;
    set_left_mm_s = left_mm_s;
    set_right_mm_s = right_mm_s;
}

void hal_set_lamp(uint8_t red, uint8_t green, uint8_t blue)
{
    const uint32_t on = (uint32_t)(red > 127) | (uint32_t)(green > 127) << 1 | (uint32_t)(blue > 127) << 2;
    OUTPUT_CLEAR = (~on & 7u) << LAMP_SHIFT;
    OUTPUT_SET = on << LAMP_SHIFT;
}

void hal_set_speaker(uint8_t loudness) { (void)loudness; }

void hal_set_jaw(uint8_t is_closed)
{
    if (is_closed)
        OUTPUT_SET = JAW;
    else
        OUTPUT_CLEAR = JAW;
}

uint16_t hal_battery_mv(void)
{
    return (uint16_t)((uint32_t)adc_values[0] * REFERENCE_MV * BATTERY_DIVIDER / ADC_TOP);
}

uint16_t hal_proximity_mm(uint8_t sensor)
{
    const uint32_t value = adc_values[sensor + 1u];
    return value < 64u ? 0xFFFFu : (uint16_t)(PROXIMITY_RANGE_MM - value * PROXIMITY_RANGE_MM / ADC_TOP);
}

void hal_wheel_speeds(int16_t *left_mm_s, int16_t *right_mm_s)
{
    /* No encoders: what the motors are given. */
    *left_mm_s = set_left_mm_s;
    *right_mm_s = set_right_mm_s;
}

int16_t hal_gyro_mrad_s(void) { return 0; }
uint8_t hal_jaw_holds(void) { return (INPUT & JAW_SWITCH) != 0; }
void hal_feed_watchdog(void) { WATCHDOG_LOAD = WATCHDOG_TICKS; }
enum reset_cause hal_reset_cause(void) { return reset_cause; }

/* The watchdog's scratch registers outlive every reset but that of power. */
uint8_t hal_load_latch(void) { return WATCHDOG_SCRATCH == LATCHED; }
void hal_store_latch(uint8_t is_stopped) { WATCHDOG_SCRATCH = is_stopped ? LATCHED : 0u; }

/* Take a measurement that is ready, and start the next channel's. */
static void sample(void)
{
    if (!(ADC_CONTROL & ADC_READY))
        return;
    adc_values[adc_channel] = (uint16_t)(ADC_RESULT & 0xFFFu);
    adc_channel = (uint8_t)((adc_channel + 1u) % ADC_CHANNELS);
    if (adc_channel == 0 && adc_rounds < 2)
        adc_rounds++;
    ADC_CONTROL = ADC_ON | (uint32_t)adc_channel << 12 | ADC_START;
}

void chip_tick(void) { sample(); }

uint8_t chip_is_ready(void)
{
    sample();
    return adc_rounds == 2; /* the first round began with a measurement of nothing */
}

static void set_up_clock(void)
{
    CRYSTAL_DELAY = 47; /* a millisecond, in 256 periods */
    CRYSTAL_CONTROL = CRYSTAL_ON;
    while (!(CRYSTAL_STATUS & CRYSTAL_IS_STABLE)) {
    }
    CLOCK_REFERENCE = 2;
    while (CLOCK_REFERENCE_IS != 4u) {
    }
    CLOCK_SYSTEM = 0; /* the reference */
    while (CLOCK_SYSTEM_IS != 1u) {
    }
    CLOCK_PERIPHERALS = CLOCK_ON;
    CLOCK_ADC = CLOCK_ON | FROM_CRYSTAL_ADC;
}

static void set_up_pins(void)
{
    CLEAR(RESETS) = USED;
    while ((RESETS_DONE & USED) != USED) {
    }
    PIN_FUNCTION(0u) = PIN_FUNCTION(1u) = PIN_FUNCTION(4u) = PIN_FUNCTION(5u) = PIN_UART;
    PWM_TOP = WHEEL_LIMIT_MM_S * PWM_PER_MM_S - 1u;
    PWM_LEVELS = 0;
    PWM_CONTROL = 1;
    PIN_FUNCTION(2u) = PIN_FUNCTION(3u) = PIN_PWM;
    const uint32_t outputs = LEFT_BACK | RIGHT_BACK | 7u << LAMP_SHIFT | JAW;
    OUTPUT_CLEAR = outputs;
    OUTPUT_ENABLE_SET = outputs;
    for (uint32_t pin = 6; pin <= 20u; pin++)
        if (pin <= 7u || pin >= LAMP_SHIFT)
            PIN_FUNCTION(pin) = PIN_SOFTWARE;
    for (uint32_t pin = 26; pin < 26u + ADC_CHANNELS; pin++) {
        PIN_FUNCTION(pin) = PIN_HAS_NONE;
        PAD(pin) = PAD_ANALOG;
    }
}

static enum reset_cause cause_of(uint32_t reason)
{
    if (reason & REASON_TIMER)
        return RESET_WATCHDOG;
    return (reason & REASON_FORCED) ? RESET_SOFTWARE : RESET_POWER;
}

void chip_set_up(void)
{
    VECTOR_TABLE = (uint32_t)vectors;
    reset_cause = cause_of(WATCHDOG_REASON);
    set_up_clock();
    set_up_pins();
    WATCHDOG_TICK = TICK_ON | CLOCK_HZ / 1000000u;
    POWER_ON_RESETS = ALL_BUT_OSCILLATORS;
    WATCHDOG_LOAD = WATCHDOG_TICKS;
    SET(WATCHDOG) = WATCHDOG_ON;
    ADC_CONTROL = ADC_ON;
    arm_start_clock(CLOCK_HZ);
    arm_open_links((struct uart *)0x40034000u, (struct uart *)0x40038000u, CLOCK_HZ, 500000u, 38400u);
    NVIC_ENABLE = 1u << IRQ_UART0 | 1u << IRQ_UART1;
}
