/* The messages in frames, as crcolony_bridge/messages.py has them. Every payload may grow at its end: a receiver ignores
 * bytes that it does not know, and refuses a payload that is too short. */
#ifndef CRCOLONY_MESSAGE_H
#define CRCOLONY_MESSAGE_H

#include <stdint.h>

enum message_type {
    /* To the robot: */
    MSG_HELLO = 0x01,    /* u32 session, u16 telemetry period (ms) */
    MSG_DESCRIBE = 0x04, /* u16 offset */
    MSG_COMMAND = 0x10,  /* u32 session, i16 left (mm/s), i16 right (mm/s), u16 time to live (ms),
                          * u8 red, u8 green, u8 blue, u8 speaker, u8 switches (1 jaw, 2 beacon) */
    MSG_STOP = 0x11,     /* nothing: everyone may stop a robot */
    MSG_CLEAR = 0x12,    /* u32 session */
    MSG_IR_LOAD = 0x30,  /* u32 session, u8 tag, u16 total, u16 offset, bytes: what the beacon repeats */
    MSG_PING = 0x40,     /* u32 time of the host (ms) */
    /* From the robot: */
    MSG_INFO = 0x02,        /* u32 session, u8 number of proximity sensors, u16 capabilities, u16 longest time to
                             * live (ms), u16 longest IR message, u16 CRC and u16 length of the description,
                             * u8 uid[8] */
    MSG_BOOT = 0x03,        /* u8 reset cause (enum reset_cause), u8 uid[8] */
    MSG_DESCRIPTION = 0x05, /* u16 total, u16 offset, bytes: a JSON object */
    MSG_TELEMETRY = 0x20,   /* see send_telemetry in robot.c */
    MSG_IR_RECEIVED = 0x31, /* u8 strength, i16 bearing (mrad, 0x7FFF unknown), u8 tag, u8 index, u8 count, bytes */
    MSG_PONG = 0x41,        /* u32 time of the host (ms), u32 time of the robot (ms) */
    /* From robot to robot, over IR: */
    MSG_IR_FRAGMENT = 0x50, /* u8 tag, u8 index, u8 count, bytes */
    /* Answers: */
    MSG_ACK = 0x7E,         /* u8 type */
    MSG_NAK = 0x7F          /* u8 type, u8 reason */
};

enum nak_reason {
    NAK_VERSION = 1,
    NAK_LENGTH = 2,
    NAK_STOPPED = 3,
    NAK_UNKNOWN = 4,
    NAK_SESSION = 5,
    NAK_BATTERY = 6
};

enum reset_cause { RESET_POWER = 1, RESET_BROWN_OUT = 2, RESET_WATCHDOG = 3, RESET_SOFTWARE = 4 };

enum capability { CAN_IR = 1, CAN_JAW = 2, CAN_LED = 4, CAN_SPEAKER = 8, CAN_GYRO = 16 };

enum status_flag {
    STATUS_STOPPED = 1,          /* the emergency stop is latched */
    STATUS_BATTERY_LOW = 2,
    STATUS_BATTERY_CRITICAL = 4, /* motors are refused */
    STATUS_MOVING = 8,           /* a command is alive */
    STATUS_JAW_HOLDS = 16,
    STATUS_EXPIRED = 32          /* the last command's time to live ran out before the next one */
};

enum command_switch { SWITCH_JAW = 1, SWITCH_BEACON = 2 };

static inline uint16_t get_u16(const uint8_t *data) { return (uint16_t)(data[0] | (uint16_t)data[1] << 8); }

static inline int16_t get_i16(const uint8_t *data) { return (int16_t)get_u16(data); }

static inline uint32_t get_u32(const uint8_t *data) { return get_u16(data) | (uint32_t)get_u16(data + 2) << 16; }

static inline uint8_t *put_u8(uint8_t *out, uint8_t value)
{
    *out = value;
    return out + 1;
}

static inline uint8_t *put_u16(uint8_t *out, uint16_t value)
{
    out[0] = (uint8_t)(value & 0xFFu);
    out[1] = (uint8_t)(value >> 8);
    return out + 2;
}

static inline uint8_t *put_u32(uint8_t *out, uint32_t value)
{
    return put_u16(put_u16(out, (uint16_t)(value & 0xFFFFu)), (uint16_t)(value >> 16));
}

#endif
