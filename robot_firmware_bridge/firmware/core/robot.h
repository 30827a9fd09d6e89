/* The robot: commands with a time to live, a latched emergency stop, a battery guard, telemetry, and IR messages.
 *
 * Wheels turn only while a command of the present session is alive. Three things stop them, each by itself: the time to
 * live of the last command, the latch, and the hardware watchdog, which is fed only by the tick that checks the first
 * two.
 */
#ifndef CRCOLONY_ROBOT_H
#define CRCOLONY_ROBOT_H

#include <stdint.h>

#include "frame.h"
#include "hal.h"
#include "ir_carousel.h"

/* A command lives for at most this long, whatever it says. */
#define ROBOT_MAX_TTL_MS 500u
/* A controller that was silent for so long may be replaced by another one. */
#define ROBOT_LEASE_MS 1000u
#define ROBOT_MIN_PERIOD_MS 10u
/* Above its threshold by this much a battery is no longer low or critical. */
#define ROBOT_BATTERY_HYSTERESIS_MV 200u

struct robot {
    struct frame_decoder host_decoder;
    struct ir_carousel carousel;
    struct frame_decoder ir_decoder;
    uint32_t session;
    uint32_t heard_ms;  /* when the session's controller was heard last */
    uint32_t command_ms;
    uint16_t ttl_ms;
    uint32_t telemetry_due_ms;
    uint16_t telemetry_period_ms; /* 0: no HELLO yet */
    uint16_t command_seq;
    uint16_t seq;       /* of the next frame that is sent */
    uint16_t bad_frames;
    int16_t left_mm_s;  /* as applied */
    int16_t right_mm_s;
    uint8_t has_session;
    uint8_t is_stopped;
    uint8_t is_moving;
    uint8_t has_expired;
    uint8_t is_battery_low;
    uint8_t is_battery_critical;
};

/* Stand still, and say why the robot was reset. */
void robot_init(struct robot *robot);

/* Take a byte that the host, or another robot's IR, has sent. */
void robot_receive(struct robot *robot, uint8_t byte);
void robot_receive_ir(struct robot *robot, uint8_t byte);

/* Call once a millisecond: stops the wheels when it is time, sends what is due, and feeds the watchdog. */
void robot_tick(struct robot *robot);

#endif
