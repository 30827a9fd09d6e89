/* A robot without hardware, for tests and fuzzers on this machine: time, sensors and links are variables. It is built as
 * a shared library with the core; tests/robot_firmware_bridge calls it in virtual time.
 */
#include <string.h>

#include "../../core/robot.h"

#define QUEUE_BYTES 4096u
#define LOG_WHEELS 256u

struct host_robot {
    struct robot robot;
    uint32_t now_ms;
    uint16_t battery_mv;
    uint16_t proximity_mm[7];
    uint8_t jaw_holds, latch, cause, is_fed;
    int16_t left_mm_s, right_mm_s;
    uint8_t sent[2][QUEUE_BYTES];
    size_t sent_length[2];
    size_t room[2]; /* of the transmit queues */
};

static struct host_robot host;

const uint8_t hal_uid[HAL_UID_BYTES] = {1, 2, 3, 4, 5, 6, 7, 8};
const uint8_t hal_proximity_sensors = 7;
const uint16_t hal_capabilities = CAN_IR | CAN_JAW | CAN_LED;
const uint16_t hal_battery_low_mv = 6800;
const uint16_t hal_battery_critical_mv = 6200;
const char hal_description[] = "{\"model\":\"no hardware\"}";
const uint16_t hal_description_length = sizeof hal_description - 1;

uint32_t hal_ms(void) { return host.now_ms; }

uint8_t hal_send(enum hal_link link, const uint8_t *data, size_t length)
{
    if (length > host.room[link] || host.sent_length[link] + length > QUEUE_BYTES)
        return 0;
    memcpy(host.sent[link] + host.sent_length[link], data, length);
    host.sent_length[link] += length;
    return 1;
}

void hal_set_wheels(int16_t left_mm_s, int16_t right_mm_s)
{
    host.left_mm_s = left_mm_s;
    host.right_mm_s = right_mm_s;
}

void hal_set_lamp(uint8_t red, uint8_t green, uint8_t blue) { (void)red, (void)green, (void)blue; }
void hal_set_speaker(uint8_t loudness) { (void)loudness; }
void hal_set_jaw(uint8_t is_closed) { (void)is_closed; }
uint16_t hal_battery_mv(void) { return host.battery_mv; }
uint16_t hal_proximity_mm(uint8_t sensor) { return host.proximity_mm[sensor]; }

void hal_wheel_speeds(int16_t *left_mm_s, int16_t *right_mm_s)
{
    *left_mm_s = host.left_mm_s;
    *right_mm_s = host.right_mm_s;
}

int16_t hal_gyro_mrad_s(void) { return 0; }
uint8_t hal_jaw_holds(void) { return host.jaw_holds; }
void hal_feed_watchdog(void) { host.is_fed = 1; }
enum reset_cause hal_reset_cause(void) { return (enum reset_cause)host.cause; }
uint8_t hal_load_latch(void) { return host.latch; }
void hal_store_latch(uint8_t is_stopped) { host.latch = is_stopped; }

/* What tests call ------------------------------------------------------------------------------------------------- */

void host_start(uint32_t now_ms, uint8_t cause, uint8_t keeps_latch)
{
    const uint8_t latch = keeps_latch ? host.latch : 0;
    memset(&host, 0, sizeof host);
    host.now_ms = now_ms;
    host.cause = cause;
    host.latch = latch;
    host.battery_mv = 8000;
    host.room[HAL_HOST] = host.room[HAL_IR] = QUEUE_BYTES;
    memset(host.proximity_mm, 0xFF, sizeof host.proximity_mm);
    robot_init(&host.robot);
}

void host_receive(const uint8_t *data, size_t length)
{
    for (size_t i = 0; i < length; i++)
        robot_receive(&host.robot, data[i]);
}

void host_receive_ir(const uint8_t *data, size_t length)
{
    for (size_t i = 0; i < length; i++)
        robot_receive_ir(&host.robot, data[i]);
}

/* Let so many milliseconds pass. */
void host_run(uint32_t ms)
{
    while (ms-- > 0) {
        host.now_ms++;
        robot_tick(&host.robot);
    }
}

/* Copy what was sent on a link since the last call (QUEUE_BYTES at most); return its length. */
size_t host_take_sent(int link, uint8_t *out)
{
    const size_t length = host.sent_length[link];
    memcpy(out, host.sent[link], length);
    host.sent_length[link] = 0;
    return length;
}

void host_set_battery(uint16_t mv) { host.battery_mv = mv; }
void host_set_room(int link, size_t bytes) { host.room[link] = bytes; }
int host_left_mm_s(void) { return host.left_mm_s; }
int host_right_mm_s(void) { return host.right_mm_s; }
int host_is_fed(void)
{
    const int is_fed = host.is_fed;
    host.is_fed = 0;
    return is_fed;
}
