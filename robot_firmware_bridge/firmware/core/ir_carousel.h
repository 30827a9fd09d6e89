/* Messages over IR that are longer than a fragment: repeated in turn while the beacon is on, so that a receiver that
 * misses a fragment gets it in the next round. Nothing is acknowledged: there may be many listeners, and links are often
 * one-way. A fragment is a frame of type MSG_IR_FRAGMENT; the host of the receiver puts messages together.
 */
#ifndef CRCOLONY_IR_CAROUSEL_H
#define CRCOLONY_IR_CAROUSEL_H

#include <stdint.h>

/* A signed envelope with a default genotype (368 bytes) is shorter than this. Infrared that is too slow for messages
 * carries words of 2 bytes: -DIR_MAX_MESSAGE=2u, and the time between two as -DIR_PAUSE_MS. */
#ifndef IR_MAX_MESSAGE
#define IR_MAX_MESSAGE 768u
#endif
#define IR_FRAGMENT_BYTES 48u
#define IR_FRAGMENT_HEADER 3u
/* Between two fragments: others can send meanwhile. A random part keeps two robots from colliding for ever. */
#ifndef IR_PAUSE_MS
#define IR_PAUSE_MS 12u
#endif
#define IR_JITTER_MASK_MS 15u

struct ir_carousel {
    uint8_t message[IR_MAX_MESSAGE];
    uint16_t length; /* 0: there is nothing to send */
    uint16_t loaded; /* bytes that are there, of a message that is being loaded */
    uint8_t tag;
    uint8_t next; /* index of the next fragment */
    uint8_t is_on;
    uint32_t due_ms;
    uint32_t random; /* state of a generator; not 0 */
};

void ir_carousel_init(struct ir_carousel *carousel, uint32_t seed);

/* Load a part of a message; parts come in order, the first at offset 0. Return 0 if it does not fit. */
uint8_t ir_carousel_load(struct ir_carousel *carousel, uint8_t tag, uint16_t total, uint16_t offset,
                         const uint8_t *data, uint8_t length);

/* Send the next fragment if it is due. */
void ir_carousel_tick(struct ir_carousel *carousel, uint32_t now_ms);

#endif
