/* What a robot's hardware must offer: one implementation a microcontroller, in ../hal. Nothing here may block. */
#ifndef CRCOLONY_HAL_H
#define CRCOLONY_HAL_H

#include <stddef.h>
#include <stdint.h>

#include "message.h"

#define HAL_UID_BYTES 8u

enum hal_link { HAL_HOST, HAL_IR };

/* Milliseconds since the reset; it may wrap. */
uint32_t hal_ms(void);

/* Put bytes into the transmit queue of a link; return 0, with nothing put there, if there is no room for all. */
uint8_t hal_send(enum hal_link link, const uint8_t *data, size_t length);

/* Set the speeds of the wheels (mm/s), positive ahead. After a reset, and while the controller is reset, the pins of
 * the motor driver must be low by themselves. */
void hal_set_wheels(int16_t left_mm_s, int16_t right_mm_s);

void hal_set_lamp(uint8_t red, uint8_t green, uint8_t blue);
void hal_set_speaker(uint8_t loudness);
void hal_set_jaw(uint8_t is_closed);

uint16_t hal_battery_mv(void);
/* Distance at a proximity sensor (mm, 0xFFFF: nothing in range), in the order of the bearings in the description. */
uint16_t hal_proximity_mm(uint8_t sensor);
/* Measured wheel speeds (mm/s); of a robot without encoders, the speeds that were set. */
void hal_wheel_speeds(int16_t *left_mm_s, int16_t *right_mm_s);
int16_t hal_gyro_mrad_s(void);
uint8_t hal_jaw_holds(void);

/* The hardware watchdog resets the robot unless it is fed every 250 ms. */
void hal_feed_watchdog(void);
enum reset_cause hal_reset_cause(void);

/* The latch of the emergency stop, which a reset by the watchdog must not release. */
uint8_t hal_load_latch(void);
void hal_store_latch(uint8_t is_stopped);

/* Constants of the robot. */
extern const uint8_t hal_uid[HAL_UID_BYTES];
extern const uint8_t hal_proximity_sensors;
extern const uint16_t hal_capabilities;
extern const uint16_t hal_battery_low_mv;
extern const uint16_t hal_battery_critical_mv;
/* A JSON object: model, wheels, sensors; crcolony_bridge/description.py reads it. */
extern const char hal_description[];
extern const uint16_t hal_description_length;

#endif
