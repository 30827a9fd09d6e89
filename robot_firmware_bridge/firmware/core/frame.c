#include "frame.h"

uint16_t frame_crc(const uint8_t *data, size_t length)
{
    uint16_t crc = 0xFFFFu;
    for (size_t i = 0; i < length; i++) {
        crc ^= (uint16_t)((uint16_t)data[i] << 8);
        for (uint8_t bit = 0; bit < 8; bit++)
            crc = (uint16_t)((uint32_t)crc << 1 ^ ((crc & 0x8000u) ? 0x1021u : 0u));
    }
    return crc;
}

/* A writer of COBS (Cheshire and Baker 1999): zeros become distances to the next zero. */
struct cobs_writer {
    uint8_t *out;
    size_t code_at;
    size_t used;
};

static void cobs_put(struct cobs_writer *writer, uint8_t byte)
{
    if (byte != 0) {
        writer->out[writer->used++] = byte;
        return;
    }
    writer->out[writer->code_at] = (uint8_t)(writer->used - writer->code_at);
    writer->code_at = writer->used++;
}

size_t frame_encode(uint8_t flags, uint8_t type, uint16_t seq, const uint8_t *payload, size_t length, uint8_t *out)
{
    if (length > FRAME_MAX_PAYLOAD)
        return 0;
    /* The body is first laid down one byte further on, where its encoding never overtakes it. */
    uint8_t *body = out + 1;
    body[0] = (uint8_t)(FRAME_VERSION << 4 | (flags & 0x0Fu));
    body[1] = type;
    body[2] = (uint8_t)(seq & 0xFFu);
    body[3] = (uint8_t)(seq >> 8);
    for (size_t i = 0; i < length; i++)
        body[4 + i] = payload[i];
    const uint16_t crc = frame_crc(body, 4 + length);
    body[4 + length] = (uint8_t)(crc & 0xFFu);
    body[5 + length] = (uint8_t)(crc >> 8);
    struct cobs_writer writer = {out, 0, 1};
    for (size_t i = 0; i < 6 + length; i++)
        cobs_put(&writer, body[i]);
    out[writer.code_at] = (uint8_t)(writer.used - writer.code_at);
    out[writer.used++] = 0;
    return writer.used;
}

void frame_decoder_reset(struct frame_decoder *decoder)
{
    decoder->used = 0;
    decoder->is_overlong = 0;
}

/* Decode COBS in place; return the length, 0 if it is none. */
static uint16_t cobs_decode(uint8_t *data, uint16_t length)
{
    uint16_t from = 0, to = 0;
    while (from < length) {
        const uint8_t code = data[from++];
        const uint16_t end = (uint16_t)(from + code - 1u);
        if (code == 0 || end > length)
            return 0;
        while (from < end)
            data[to++] = data[from++];
        if (from < length)
            data[to++] = 0;
    }
    return to;
}

static enum frame_result parse(uint8_t *data, uint16_t encoded, struct frame *frame)
{
    const uint16_t length = cobs_decode(data, encoded);
    if (length < 6u || length > FRAME_MAX_BODY)
        return FRAME_BAD;
    const uint16_t crc = (uint16_t)(data[length - 2u] | (uint16_t)data[length - 1u] << 8);
    if (crc != frame_crc(data, length - 2u))
        return FRAME_BAD;
    frame->version = data[0] >> 4;
    frame->flags = data[0] & 0x0Fu;
    frame->type = data[1];
    frame->seq = (uint16_t)(data[2] | (uint16_t)data[3] << 8);
    frame->payload = data + 4;
    frame->length = (uint8_t)(length - 6u);
    return FRAME_READY;
}

enum frame_result frame_decode(struct frame_decoder *decoder, uint8_t byte, struct frame *frame)
{
    if (byte != 0) {
        if (decoder->used < sizeof decoder->buffer)
            decoder->buffer[decoder->used++] = byte;
        else
            decoder->is_overlong = 1;
        return FRAME_NONE;
    }
    const uint16_t used = decoder->used;
    const uint8_t is_overlong = decoder->is_overlong;
    frame_decoder_reset(decoder);
    if (used == 0)
        return FRAME_NONE;
    return is_overlong ? FRAME_BAD : parse(decoder->buffer, used, frame);
}
