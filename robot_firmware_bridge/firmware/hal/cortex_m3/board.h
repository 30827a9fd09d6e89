/* What the LM3S6965 evaluation board lacks, motors and sensors, as a block of memory at a fixed address: who looks in
 * through a debugger or an emulator's monitor sees what the motors were given, and sets what the sensors measure. A
 * board that has them puts its drivers where hal_lm3s6965.c reads and writes this block.
 *
 * tests/robot_firmware_bridge/qemu_robot.py reads it by these offsets.
 */
#ifndef CRCOLONY_BOARD_H
#define CRCOLONY_BOARD_H

#include <stdint.h>

#define BOARD_ADDRESS 0x2000FF00u /* the linker script leaves the last 256 bytes of memory to it */
#define BOARD_PRESENT 0x42435243u
#define BOARD_PROXIMITY_SENSORS 7u
#define BOARD_LOG_ENTRIES 16u

struct board_wheels {
    uint32_t at_ms; /* since the reset */
    int16_t left_mm_s, right_mm_s;
};

struct board {
    uint32_t present; /* BOARD_PRESENT once the sensors' values are set */
    uint32_t changes; /* of the wheels' speeds since power came on; the newest is entry (changes - 1) of the log */
    uint16_t battery_mv;
    uint8_t jaw_holds;
    uint8_t unused;
    uint16_t proximity_mm[BOARD_PROXIMITY_SENSORS];
    uint8_t lamp[3];
    uint8_t speaker;
    uint8_t jaw_is_closed;
    uint8_t unused_too;
    struct board_wheels log[BOARD_LOG_ENTRIES]; /* a ring */
};

_Static_assert(sizeof(struct board) == 0xA0, "the offsets that qemu_robot.py knows");

#endif
