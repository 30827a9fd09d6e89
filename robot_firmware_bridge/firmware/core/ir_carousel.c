#include "ir_carousel.h"

#include "frame.h"
#include "hal.h"

void ir_carousel_init(struct ir_carousel *carousel, uint32_t seed)
{
    carousel->length = 0;
    carousel->loaded = 0;
    carousel->next = 0;
    carousel->is_on = 0;
    carousel->due_ms = 0;
    carousel->random = seed | 1u;
}

uint8_t ir_carousel_load(struct ir_carousel *carousel, uint8_t tag, uint16_t total, uint16_t offset,
                         const uint8_t *data, uint8_t length)
{
    if (total > IR_MAX_MESSAGE || offset > total || length > total - offset)
        return 0;
    if (offset == 0) {
        carousel->length = 0; /* what is loaded in part is not sent */
        carousel->loaded = 0;
        carousel->tag = tag;
    }
    if (tag != carousel->tag || offset != carousel->loaded)
        return 0;
    for (uint8_t i = 0; i < length; i++)
        carousel->message[offset + i] = data[i];
    carousel->loaded = (uint16_t)(offset + length);
    if (carousel->loaded == total) {
        carousel->length = total;
        carousel->next = 0;
    }
    return 1;
}

/* Marsaglia's xorshift: good enough to keep two robots apart. */
static uint32_t draw(struct ir_carousel *carousel)
{
    uint32_t x = carousel->random;
    x ^= x << 13;
    x ^= x >> 17;
    x ^= x << 5;
    carousel->random = x;
    return x;
}

void ir_carousel_tick(struct ir_carousel *carousel, uint32_t now_ms)
{
    if (!carousel->is_on || carousel->length == 0 || (int32_t)(now_ms - carousel->due_ms) < 0)
        return;
    const uint16_t count = (uint16_t)((carousel->length + IR_FRAGMENT_BYTES - 1u) / IR_FRAGMENT_BYTES);
    const uint16_t offset = (uint16_t)(carousel->next * IR_FRAGMENT_BYTES);
    const uint16_t rest = (uint16_t)(carousel->length - offset);
    const uint8_t length = (uint8_t)(rest < IR_FRAGMENT_BYTES ? rest : IR_FRAGMENT_BYTES);
    uint8_t payload[IR_FRAGMENT_HEADER + IR_FRAGMENT_BYTES];
    payload[0] = carousel->tag;
    payload[1] = carousel->next;
    payload[2] = (uint8_t)count;
    for (uint8_t i = 0; i < length; i++)
        payload[IR_FRAGMENT_HEADER + i] = carousel->message[offset + i];
    uint8_t encoded[FRAME_MAX_ENCODED];
    const size_t size = frame_encode(0, MSG_IR_FRAGMENT, carousel->next, payload, IR_FRAGMENT_HEADER + length, encoded);
    if (!hal_send(HAL_IR, encoded, size))
        return; /* the last fragment is still on its way */
    carousel->next = (uint8_t)(carousel->next + 1u == count ? 0u : carousel->next + 1u);
    carousel->due_ms = now_ms + IR_PAUSE_MS + (draw(carousel) & IR_JITTER_MASK_MS);
}
