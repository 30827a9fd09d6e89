/* A Cortex-M3, the LM3S6965 at 50 MHz: the host on UART0 at 500 kbit/s, infrared on UART1 at 9,600, its own watchdog
 * module, and motors and sensors as a block of memory (board.h), since the evaluation board has none.
 */
#include "../../core/hal.h"
#include "../arm/arm.h"
#include "board.h"

#define SYSCTL_RIS REGISTER(0x400FE050u)
#define SYSCTL_RESC REGISTER(0x400FE05Cu)
#define SYSCTL_RCC REGISTER(0x400FE060u)
#define SYSCTL_RCGC1 REGISTER(0x400FE104u)
#define SYSCTL_RCGC2 REGISTER(0x400FE108u)
#define SYSCTL_RCGC0 REGISTER(0x400FE100u)
#define PLL_LOCKED 0x40u
#define RESC_POWER 0x02u
#define RESC_BROWN_OUT 0x04u
#define RESC_WATCHDOG 0x08u
#define RESC_SOFTWARE 0x10u
/* A fourth of the PLL's 200 MHz, which it makes of a crystal of 8 MHz; bypassed until it is locked. */
#define RCC_BYPASSED 0x01C00B80u
#define RCC_USED 0x01C00380u
#define CLOCK_HZ 50000000u

#define WATCHDOG_LOAD REGISTER(0x40000000u)
#define WATCHDOG_CONTROL REGISTER(0x40000008u)
#define WATCHDOG_CLEAR REGISTER(0x4000000Cu)
#define WATCHDOG_LOCK REGISTER(0x40000C00u)
#define WATCHDOG_KEY 0x1ACCE551u
#define WATCHDOG_RESETS 0x3u
/* The first time it runs out it warns, the second time it resets. */
#define WATCHDOG_MS 125u

#define GPIO_A_AFSEL REGISTER(0x40004420u)
#define GPIO_A_DEN REGISTER(0x4000451Cu)
#define GPIO_D_AFSEL REGISTER(0x40007420u)
#define GPIO_D_DEN REGISTER(0x4000751Cu)

#define NVIC_ENABLE_0 REGISTER(0xE000E100u)
#define IRQ_UART0 5u
#define IRQ_UART1 6u

#define WHEEL_LIMIT_MM_S 500
#define LATCHED 0x5A17E57Du
#define WAS_RUNNING 0x900D5EEDu

static volatile struct board *const board = (volatile struct board *)BOARD_ADDRESS;
static enum reset_cause reset_cause;
static uint32_t latch __attribute__((section(".noinit")));
static uint32_t was_running __attribute__((section(".noinit")));

const uint8_t hal_uid[HAL_UID_BYTES] = {ROBOT_UID};
const uint8_t hal_proximity_sensors = BOARD_PROXIMITY_SENSORS;
const uint16_t hal_capabilities = CAN_IR | CAN_JAW | CAN_LED | CAN_SPEAKER;
const uint16_t hal_battery_low_mv = 6800;
const uint16_t hal_battery_critical_mv = 6200;
const char hal_description[] =
    "{\"model\":\"crcolony reference robot\",\"controller\":\"LM3S6965\",\"track_m\":0.09,\"radius_m\":0.06,"
    "\"max_speed_m_s\":0.5,\"proximity_bearings_rad\":[-1.2,-0.8,-0.4,0,0.4,0.8,1.2],\"proximity_range_m\":0.3,"
    "\"battery_empty_v\":6.2,\"battery_full_v\":8.4,\"watchdog_s\":0.25}";
const uint16_t hal_description_length = sizeof hal_description - 1;

static int16_t limited(int16_t mm_s)
{
    if (mm_s > WHEEL_LIMIT_MM_S)
        return WHEEL_LIMIT_MM_S;
    return mm_s < -WHEEL_LIMIT_MM_S ? -WHEEL_LIMIT_MM_S : mm_s;
}

static volatile struct board_wheels *newest_wheels(void)
{
    return &board->log[(board->changes - 1u) % BOARD_LOG_ENTRIES];
}

void hal_set_wheels(int16_t left_mm_s, int16_t right_mm_s)
{
    const int16_t left = limited(left_mm_s), right = limited(right_mm_s);
    if (left == newest_wheels()->left_mm_s && right == newest_wheels()->right_mm_s)
        return;
    volatile struct board_wheels *next = &board->log[board->changes % BOARD_LOG_ENTRIES];
    next->at_ms = hal_ms();
    next->left_mm_s = left;
    next->right_mm_s = right;
    board->changes++; /* last: who looks in meanwhile sees no half of an entry */
}

void hal_set_lamp(uint8_t red, uint8_t green, uint8_t blue)
{
    board->lamp[0] = red;
    board->lamp[1] = green;
    board->lamp[2] = blue;
}

void hal_set_speaker(uint8_t loudness) { board->speaker = loudness; }
void hal_set_jaw(uint8_t is_closed) { board->jaw_is_closed = is_closed; }
uint16_t hal_battery_mv(void) { return board->battery_mv; }
uint16_t hal_proximity_mm(uint8_t sensor) { return board->proximity_mm[sensor]; }

void hal_wheel_speeds(int16_t *left_mm_s, int16_t *right_mm_s)
{
    *left_mm_s = newest_wheels()->left_mm_s;
    *right_mm_s = newest_wheels()->right_mm_s;
}

int16_t hal_gyro_mrad_s(void) { return 0; }
uint8_t hal_jaw_holds(void) { return board->jaw_holds; }

void hal_feed_watchdog(void)
{
    /* Locked between: a program that runs wild turns no watchdog off. */
    WATCHDOG_LOCK = WATCHDOG_KEY;
    WATCHDOG_CLEAR = 1;
    WATCHDOG_LOCK = 0;
}

enum reset_cause hal_reset_cause(void) { return reset_cause; }

uint8_t hal_load_latch(void) { return latch == LATCHED; }

void hal_store_latch(uint8_t is_stopped) { latch = is_stopped ? LATCHED : 0; }

/* QEMU sets no cause: there what is left in memory says that it was not power that came on. */
static enum reset_cause take_reset_cause(void)
{
    const uint32_t causes = SYSCTL_RESC;
    SYSCTL_RESC = 0;
    if (causes & RESC_POWER)
        return RESET_POWER;
    if (causes & RESC_WATCHDOG)
        return RESET_WATCHDOG;
    if (causes & RESC_BROWN_OUT)
        return RESET_BROWN_OUT;
    if (causes & RESC_SOFTWARE)
        return RESET_SOFTWARE;
    return was_running == WAS_RUNNING ? RESET_WATCHDOG : RESET_POWER;
}

/* The pins of motors are inputs after a reset, and the motors off; memory is as it was. */
static void reset_board(void)
{
    if (board->present != BOARD_PRESENT) {
        board->changes = 0;
        for (uint8_t i = 0; i < BOARD_LOG_ENTRIES; i++)
            board->log[i].left_mm_s = board->log[i].right_mm_s = 0;
        board->battery_mv = 8000;
        board->jaw_holds = 0;
        for (uint8_t i = 0; i < BOARD_PROXIMITY_SENSORS; i++)
            board->proximity_mm[i] = 0xFFFFu;
        board->present = BOARD_PRESENT;
    }
    hal_set_wheels(0, 0);
    hal_set_lamp(0, 0, 0);
    hal_set_speaker(0);
    hal_set_jaw(0);
}

static void set_up_clock(void)
{
    SYSCTL_RCC = RCC_BYPASSED;
    for (uint32_t i = 0; i < 100000u && !(SYSCTL_RIS & PLL_LOCKED); i++) {
    }
    SYSCTL_RCC = RCC_USED;
    arm_start_clock(CLOCK_HZ);
}

static void set_up_watchdog(void)
{
    WATCHDOG_LOCK = WATCHDOG_KEY;
    WATCHDOG_LOAD = CLOCK_HZ / 1000u * WATCHDOG_MS;
    WATCHDOG_CONTROL = WATCHDOG_RESETS;
    WATCHDOG_LOCK = 0;
}

void chip_set_up(void)
{
    reset_board();
    reset_cause = take_reset_cause();
    if (reset_cause != RESET_WATCHDOG)
        latch = 0; /* memory holds anything after a power-up */
    was_running = WAS_RUNNING;
    set_up_clock();
    SYSCTL_RCGC0 |= 0x08u; /* the watchdog */
    SYSCTL_RCGC1 |= 0x03u; /* both UARTs */
    SYSCTL_RCGC2 |= 0x09u; /* their pins, on ports A and D */
    set_up_watchdog();
    GPIO_A_AFSEL |= 0x03u;
    GPIO_A_DEN |= 0x03u;
    GPIO_D_AFSEL |= 0x0Cu;
    GPIO_D_DEN |= 0x0Cu;
    arm_open_links((struct uart *)0x4000C000u, (struct uart *)0x4000D000u, CLOCK_HZ, 500000u, 38400u);
    NVIC_ENABLE_0 = 1u << IRQ_UART0 | 1u << IRQ_UART1;
}

void chip_tick(void) {}

uint8_t chip_is_ready(void) { return 1; }
