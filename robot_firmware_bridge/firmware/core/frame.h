/* Frames of the serial link: COBS(version and flags, type, sequence number, payload, CRC-16), each ended by 0x00.
 *
 * The same frames are coded in Python by crcolony_bridge/frames.py; tests/vectors/firmware_frames.json holds both to
 * the same bytes. Numbers are little-endian. No allocation, no I/O; a decoder's memory is its own buffer.
 */
#ifndef CRCOLONY_FRAME_H
#define CRCOLONY_FRAME_H

#include <stddef.h>
#include <stdint.h>

#define FRAME_VERSION 1u
#define FRAME_MAX_PAYLOAD 240u
/* Header of four bytes, payload, CRC of two. */
#define FRAME_MAX_BODY (4u + FRAME_MAX_PAYLOAD + 2u)
/* One byte of overhead (a body is shorter than 254 bytes), and the delimiter. */
#define FRAME_MAX_ENCODED (FRAME_MAX_BODY + 2u)

struct frame {
    uint8_t version;
    uint8_t flags;
    uint8_t type;
    uint16_t seq;
    const uint8_t *payload;
    uint8_t length;
};

enum frame_result { FRAME_NONE, FRAME_READY, FRAME_BAD };

/* Collects bytes until a delimiter; one for each direction of each link. */
struct frame_decoder {
    uint8_t buffer[FRAME_MAX_ENCODED];
    uint16_t used;
    uint8_t is_overlong;
};

/* CRC-16/CCITT-FALSE: polynomial 0x1021, initial value 0xFFFF (binascii.crc_hqx(data, 0xFFFF) in Python). */
uint16_t frame_crc(const uint8_t *data, size_t length);

/* Write the encoded frame with its delimiter to `out` (FRAME_MAX_ENCODED bytes); return its length, 0 if too long. */
size_t frame_encode(uint8_t flags, uint8_t type, uint16_t seq, const uint8_t *payload, size_t length, uint8_t *out);

void frame_decoder_reset(struct frame_decoder *decoder);

/* Take one received byte. FRAME_READY: `frame` is valid until the next byte. FRAME_BAD: something was received that is
 * no frame; the decoder goes on after the delimiter. Empty frames, as a sender's leading delimiter, are nothing. */
enum frame_result frame_decode(struct frame_decoder *decoder, uint8_t byte, struct frame *frame);

#endif
