/* Fuzzes the robot: bytes of any kind arrive at both links while time passes. Built with sanitizers, which find what is
 * read or written out of bounds. What it asserts besides: wheels turn only after a command with the right CRC, length
 * and session that no stop has followed, and never longer than the longest time to live. It reads the bytes with a
 * decoder of its own, so that a fault of the robot's decoder cannot excuse itself.
 *
 * With libFuzzer (make libfuzzer), or, where there is no clang, by `main` with a generator of its own: fuzz_robot SEED
 * ROUNDS.
 */
#undef NDEBUG
#include <assert.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "../core/robot.h"

#define PIECE_BYTES 16u
#define HELLO_BYTES 6u
#define COMMAND_BYTES 15u
#define IR_LOAD_BYTES 9u

void host_start(uint32_t now_ms, uint8_t cause, uint8_t keeps_latch);
void host_receive(const uint8_t *data, size_t length);
void host_receive_ir(const uint8_t *data, size_t length);
void host_run(uint32_t ms);
size_t host_take_sent(int link, uint8_t *out);
int host_left_mm_s(void);
int host_right_mm_s(void);
int host_is_fed(void);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/* What a reader of the same bytes knows: whether the wheels may turn. */
struct observer {
    uint8_t encoded[FRAME_MAX_ENCODED];
    size_t used;
    int is_greeted, is_stopped, may_turn;
    uint32_t session;
    uint32_t age_ms;    /* of the last command */
    uint32_t silent_ms; /* since the session's controller was heard */
};

/* Return the length of what COBS holds, 0 if it holds nothing; `out` has room for as much as `length`. */
static size_t decode(const uint8_t *data, size_t length, uint8_t *out)
{
    size_t used = 0, at = 0;
    while (at < length) {
        const uint8_t code = data[at];
        if (code == 0 || at + code > length)
            return 0;
        for (size_t i = 1; i < code; i++)
            out[used++] = data[at + i];
        at += code;
        if (at < length)
            out[used++] = 0;
    }
    return used;
}

/* The CRC's remainder by long division, a bit at a time: slower than the firmware's, and written independently. */
static int is_intact(const uint8_t *body, size_t length)
{
    uint32_t remainder = 0xFFFFu;
    for (size_t bit = 0; bit < (length - 2u) * 8u; bit++) {
        const uint32_t in = (uint32_t)body[bit / 8u] >> (7u - bit % 8u) & 1u;
        const uint32_t out = remainder >> 15 & 1u;
        remainder = (remainder << 1 & 0xFFFFu) ^ ((in ^ out) ? 0x1021u : 0u);
    }
    return remainder == ((uint32_t)body[length - 2u] | (uint32_t)body[length - 1u] << 8);
}

static void observe_hello(struct observer *observer, uint32_t session)
{
    if (observer->is_greeted && session != observer->session) {
        if (observer->silent_ms < ROBOT_LEASE_MS)
            return; /* another controller has the robot */
        observer->may_turn = 0;
    }
    observer->is_greeted = 1;
    observer->session = session;
    observer->silent_ms = 0;
}

static void observe_frame(struct observer *observer)
{
    uint8_t body[FRAME_MAX_ENCODED];
    const size_t length = decode(observer->encoded, observer->used, body);
    if (length < 6u || !is_intact(body, length) || body[0] >> 4 != FRAME_VERSION)
        return;
    const size_t payload = length - 6u;
    const uint32_t session = payload >= 4u ? get_u32(body + 4) : 0;
    const int is_ours = observer->is_greeted && payload >= 4u && session == observer->session;
    if (is_ours && ((body[1] == MSG_COMMAND && payload >= COMMAND_BYTES) || body[1] == MSG_CLEAR ||
                    (body[1] == MSG_IR_LOAD && payload >= IR_LOAD_BYTES)))
        observer->silent_ms = 0;
    if (body[1] == MSG_HELLO && payload >= HELLO_BYTES) {
        observe_hello(observer, session);
    } else if (body[1] == MSG_STOP) {
        observer->is_stopped = 1;
        observer->may_turn = 0;
    } else if (body[1] == MSG_CLEAR && is_ours) {
        observer->is_stopped = 0;
        observer->may_turn = 0;
    } else if (body[1] == MSG_COMMAND && payload >= COMMAND_BYTES && is_ours && !observer->is_stopped) {
        observer->may_turn = 1;
        observer->age_ms = 0;
    }
}

static void observe(struct observer *observer, uint8_t byte)
{
    if (byte != 0) {
        if (observer->used < sizeof observer->encoded)
            observer->encoded[observer->used] = byte;
        observer->used++;
        return;
    }
    if (observer->used > 0 && observer->used <= sizeof observer->encoded)
        observe_frame(observer);
    observer->used = 0;
}

static void check(const struct observer *observer)
{
    const int is_turning = host_left_mm_s() != 0 || host_right_mm_s() != 0;
    assert(!is_turning || (observer->may_turn && observer->age_ms < ROBOT_MAX_TTL_MS));
}

/* Let time pass, and see after every millisecond whether the wheels may turn. */
static void pass(struct observer *observer, uint32_t ms)
{
    static uint8_t sent[4096];
    while (ms-- > 0) {
        host_run(1);
        observer->age_ms++;
        observer->silent_ms++;
        check(observer);
        (void)host_take_sent(HAL_HOST, sent);
        (void)host_take_sent(HAL_IR, sent);
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct observer observer;
    memset(&observer, 0, sizeof observer);
    host_start(0xFFFFFF00u, RESET_POWER, 0); /* the clock wraps meanwhile */
    while (size > 0) {
        const size_t length = size < PIECE_BYTES ? size : PIECE_BYTES;
        for (size_t i = 0; i < length; i++)
            observe(&observer, data[i]);
        host_receive(data, length);
        host_receive_ir(data, length);
        check(&observer);
        pass(&observer, data[0] & 7u);
        data += length;
        size -= length;
    }
    pass(&observer, ROBOT_MAX_TTL_MS);
    assert(host_left_mm_s() == 0 && host_right_mm_s() == 0);
    assert(host_is_fed());
    return 0;
}

#ifndef USES_LIBFUZZER

static uint64_t state;

/* Marsaglia's xorshift of 64 bits. */
static uint32_t draw(void)
{
    state ^= state << 13;
    state ^= state >> 7;
    state ^= state << 17;
    return (uint32_t)(state >> 16);
}

/* A part of a beacon's message where the last one ended: parts at random alone are all refused but the first. */
static void continue_message(uint8_t *payload, size_t length, uint16_t *loaded)
{
    if (draw() % 16 == 0)
        *loaded = 0;
    uint8_t *out = put_u16(payload + 5, draw() % 4 ? IR_MAX_MESSAGE : (uint16_t)(draw() % 1024));
    (void)put_u16(out, *loaded);
    payload[4] = 0;
    *loaded = (uint16_t)(*loaded + length - IR_LOAD_BYTES);
}

/* Valid frames, most of them damaged somewhere: bytes at random alone hardly ever pass the CRC. */
static size_t make_input(uint8_t *out, size_t room)
{
    static const uint8_t types[] = {MSG_HELLO, MSG_COMMAND, MSG_COMMAND, MSG_STOP, MSG_CLEAR, MSG_DESCRIBE,
                                    MSG_IR_LOAD, MSG_IR_LOAD, MSG_PING, MSG_IR_FRAGMENT, 0xEE};
    uint16_t loaded = 0;
    size_t used = frame_encode(0, MSG_HELLO, 0, (const uint8_t[6]){0}, 6, out);
    while (used + FRAME_MAX_ENCODED < room) {
        uint8_t payload[FRAME_MAX_PAYLOAD];
        const size_t length = draw() % 3 ? draw() % 24 : draw() % (FRAME_MAX_PAYLOAD + 1);
        for (size_t i = 0; i < length; i++)
            payload[i] = (uint8_t)(draw() % 4 ? 0 : draw()); /* session 0 is often right */
        if (length >= 4 && draw() % 8)
            memset(payload, 0, 4);
        const uint8_t type = types[draw() % sizeof types];
        if (type == MSG_IR_LOAD && length >= IR_LOAD_BYTES)
            continue_message(payload, length, &loaded);
        used += frame_encode(0, type, (uint16_t)draw(), payload, length, out + used);
        if (draw() % 16 == 0)
            break;
    }
    for (uint32_t flips = draw() % 4; flips > 0; flips--)
        out[draw() % used] ^= (uint8_t)(1u << draw() % 8);
    if (draw() % 16 == 0) { /* a sender that has lost its delimiters */
        for (size_t i = 0; i < used; i++)
            out[i] |= (uint8_t)(draw() % 255 + 1);
    }
    return used;
}

int main(int argc, char **argv)
{
    static uint8_t input[4096];
    if (argc != 3) {
        fprintf(stderr, "usage: fuzz_robot SEED ROUNDS\n");
        return 2;
    }
    state = strtoull(argv[1], NULL, 10) * 0x9E3779B97F4A7C15u + 1u;
    const unsigned long rounds = strtoul(argv[2], NULL, 10);
    for (unsigned long round = 0; round < rounds; round++)
        LLVMFuzzerTestOneInput(input, make_input(input, sizeof input));
    printf("%lu inputs\n", rounds);
    return 0;
}

#endif
