#include "robot.h"

static void send_frame(struct robot *robot, uint8_t type, uint16_t seq, const uint8_t *payload, size_t length)
{
    uint8_t encoded[FRAME_MAX_ENCODED];
    const size_t size = frame_encode(0, type, seq, payload, length, encoded);
    (void)robot;
    (void)hal_send(HAL_HOST, encoded, size); /* a queue that is full loses the frame: the host asks again */
}

static void acknowledge(struct robot *robot, const struct frame *request)
{
    send_frame(robot, MSG_ACK, request->seq, &request->type, 1);
}

static void refuse(struct robot *robot, const struct frame *request, enum nak_reason reason)
{
    const uint8_t payload[] = {request->type, (uint8_t)reason};
    send_frame(robot, MSG_NAK, request->seq, payload, sizeof payload);
}

static void set_wheels(struct robot *robot, int16_t left_mm_s, int16_t right_mm_s)
{
    robot->left_mm_s = left_mm_s;
    robot->right_mm_s = right_mm_s;
    hal_set_wheels(left_mm_s, right_mm_s);
}

static void stand_still(struct robot *robot)
{
    robot->is_moving = 0;
    robot->carousel.is_on = 0;
    set_wheels(robot, 0, 0);
    hal_set_speaker(0);
}

static void send_boot(struct robot *robot)
{
    uint8_t payload[1 + HAL_UID_BYTES];
    payload[0] = (uint8_t)hal_reset_cause();
    for (uint8_t i = 0; i < HAL_UID_BYTES; i++)
        payload[1 + i] = hal_uid[i];
    send_frame(robot, MSG_BOOT, 0, payload, sizeof payload);
}

void robot_init(struct robot *robot)
{
    frame_decoder_reset(&robot->host_decoder);
    frame_decoder_reset(&robot->ir_decoder);
    uint32_t seed = hal_ms();
    for (uint8_t i = 0; i < HAL_UID_BYTES; i++)
        seed = seed * 31u + hal_uid[i];
    ir_carousel_init(&robot->carousel, seed);
    robot->session = 0;
    robot->heard_ms = robot->command_ms = robot->telemetry_due_ms = hal_ms();
    robot->ttl_ms = 0;
    robot->telemetry_period_ms = 0;
    robot->command_seq = 0;
    robot->seq = 0;
    robot->bad_frames = 0;
    robot->has_session = 0;
    robot->has_expired = 0;
    robot->is_battery_low = 0;
    robot->is_battery_critical = 0;
    robot->is_stopped = hal_load_latch();
    stand_still(robot);
    send_boot(robot);
}

static void handle_hello(struct robot *robot, const struct frame *request)
{
    const uint32_t session = get_u32(request->payload);
    const uint16_t period_ms = get_u16(request->payload + 4);
    if (robot->has_session && session != robot->session && hal_ms() - robot->heard_ms < ROBOT_LEASE_MS) {
        refuse(robot, request, NAK_SESSION);
        return;
    }
    if (session != robot->session || !robot->has_session)
        stand_still(robot); /* what another controller wanted is over */
    robot->session = session;
    robot->has_session = 1;
    robot->heard_ms = hal_ms();
    robot->telemetry_period_ms = period_ms < ROBOT_MIN_PERIOD_MS ? ROBOT_MIN_PERIOD_MS : period_ms;
    robot->telemetry_due_ms = hal_ms();
    uint8_t payload[4 + 1 + 2 + 2 + 2 + 4 + HAL_UID_BYTES];
    uint8_t *out = put_u32(payload, session);
    out = put_u8(out, hal_proximity_sensors);
    out = put_u16(out, hal_capabilities);
    out = put_u16(out, ROBOT_MAX_TTL_MS);
    out = put_u16(out, IR_MAX_MESSAGE);
    const uint8_t *description = (const uint8_t *)hal_description;
    out = put_u16(out, frame_crc(description, hal_description_length));
    out = put_u16(out, hal_description_length);
    for (uint8_t i = 0; i < HAL_UID_BYTES; i++)
        out = put_u8(out, hal_uid[i]);
    send_frame(robot, MSG_INFO, request->seq, payload, sizeof payload);
}

static void handle_describe(struct robot *robot, const struct frame *request)
{
    const uint16_t offset = get_u16(request->payload);
    uint8_t payload[FRAME_MAX_PAYLOAD];
    uint8_t *out = put_u16(put_u16(payload, hal_description_length), offset);
    const uint8_t *end = payload + sizeof payload;
    for (uint16_t i = offset; i < hal_description_length && out < end; i++)
        out = put_u8(out, (uint8_t)hal_description[i]);
    send_frame(robot, MSG_DESCRIPTION, request->seq, payload, (size_t)(out - payload));
}

static void handle_command(struct robot *robot, const struct frame *request)
{
    const uint8_t *data = request->payload;
    if (!robot->has_session || get_u32(data) != robot->session) {
        refuse(robot, request, NAK_SESSION);
        return;
    }
    robot->heard_ms = hal_ms();
    if (robot->is_stopped) {
        refuse(robot, request, NAK_STOPPED);
        return;
    }
    const uint16_t ttl_ms = get_u16(data + 8);
    robot->command_seq = request->seq;
    robot->command_ms = hal_ms();
    robot->ttl_ms = ttl_ms > ROBOT_MAX_TTL_MS ? ROBOT_MAX_TTL_MS : ttl_ms;
    hal_set_lamp(data[10], data[11], data[12]);
    hal_set_speaker(data[13]);
    hal_set_jaw(data[14] & SWITCH_JAW);
    robot->carousel.is_on = (data[14] & SWITCH_BEACON) != 0;
    if (robot->is_battery_critical) {
        refuse(robot, request, NAK_BATTERY);
        return;
    }
    robot->is_moving = robot->ttl_ms > 0;
    robot->has_expired = 0;
    if (robot->is_moving)
        set_wheels(robot, get_i16(data + 4), get_i16(data + 6));
    else
        stand_still(robot);
}

static void set_latch(struct robot *robot, uint8_t is_stopped)
{
    robot->is_stopped = is_stopped;
    hal_store_latch(is_stopped);
    stand_still(robot);
}

static void handle_clear(struct robot *robot, const struct frame *request)
{
    if (!robot->has_session || get_u32(request->payload) != robot->session) {
        refuse(robot, request, NAK_SESSION);
        return;
    }
    robot->heard_ms = hal_ms();
    set_latch(robot, 0);
    acknowledge(robot, request);
}

static void handle_ir_load(struct robot *robot, const struct frame *request)
{
    const uint8_t *data = request->payload;
    if (!robot->has_session || get_u32(data) != robot->session) {
        refuse(robot, request, NAK_SESSION);
        return;
    }
    robot->heard_ms = hal_ms();
    if (ir_carousel_load(&robot->carousel, data[4], get_u16(data + 5), get_u16(data + 7), data + 9,
                         (uint8_t)(request->length - 9u)))
        acknowledge(robot, request);
    else
        refuse(robot, request, NAK_LENGTH);
}

static void handle_ping(struct robot *robot, const struct frame *request)
{
    uint8_t payload[8];
    (void)put_u32(put_u32(payload, get_u32(request->payload)), hal_ms());
    send_frame(robot, MSG_PONG, request->seq, payload, sizeof payload);
}

/* Return how many bytes a request has at least; 0xFF for what is none. */
static uint8_t least_length(uint8_t type)
{
    switch (type) {
    case MSG_HELLO: return 6;
    case MSG_DESCRIBE: return 2;
    case MSG_COMMAND: return 15;
    case MSG_STOP: return 0;
    case MSG_CLEAR: return 4;
    case MSG_IR_LOAD: return 9;
    case MSG_PING: return 4;
    default: return 0xFF;
    }
}

static void handle_request(struct robot *robot, const struct frame *request)
{
    const uint8_t least = least_length(request->type);
    if (request->version != FRAME_VERSION) {
        refuse(robot, request, NAK_VERSION);
        return;
    }
    if (least == 0xFF || request->length < least) {
        refuse(robot, request, least == 0xFF ? NAK_UNKNOWN : NAK_LENGTH);
        return;
    }
    switch (request->type) {
    case MSG_HELLO: handle_hello(robot, request); break;
    case MSG_DESCRIBE: handle_describe(robot, request); break;
    case MSG_COMMAND: handle_command(robot, request); break;
    case MSG_CLEAR: handle_clear(robot, request); break;
    case MSG_IR_LOAD: handle_ir_load(robot, request); break;
    case MSG_PING: handle_ping(robot, request); break;
    default: /* MSG_STOP */
        set_latch(robot, 1);
        acknowledge(robot, request);
    }
}

void robot_receive(struct robot *robot, uint8_t byte)
{
    struct frame request;
    const enum frame_result result = frame_decode(&robot->host_decoder, byte, &request);
    if (result == FRAME_READY)
        handle_request(robot, &request);
    else if (result == FRAME_BAD && robot->bad_frames < 0xFFFFu)
        robot->bad_frames++;
}

void robot_receive_ir(struct robot *robot, uint8_t byte)
{
    struct frame fragment;
    if (frame_decode(&robot->ir_decoder, byte, &fragment) != FRAME_READY || fragment.type != MSG_IR_FRAGMENT ||
        fragment.version != FRAME_VERSION || fragment.length > FRAME_MAX_PAYLOAD - 3u || !robot->has_session)
        return;
    uint8_t payload[FRAME_MAX_PAYLOAD];
    uint8_t *out = put_u16(put_u8(payload, 0xFF), 0x7FFFu); /* neither strength nor bearing is measured */
    for (uint8_t i = 0; i < fragment.length; i++)
        out = put_u8(out, fragment.payload[i]);
    send_frame(robot, MSG_IR_RECEIVED, robot->seq++, payload, (size_t)(out - payload));
}

static void guard_battery(struct robot *robot)
{
    const uint16_t mv = hal_battery_mv();
    if (mv < hal_battery_low_mv)
        robot->is_battery_low = 1;
    else if (mv >= hal_battery_low_mv + ROBOT_BATTERY_HYSTERESIS_MV)
        robot->is_battery_low = 0;
    if (mv < hal_battery_critical_mv) {
        if (!robot->is_battery_critical)
            stand_still(robot);
        robot->is_battery_critical = 1;
    } else if (mv >= hal_battery_critical_mv + ROBOT_BATTERY_HYSTERESIS_MV) {
        robot->is_battery_critical = 0;
    }
}

static uint16_t status_of(const struct robot *robot)
{
    uint16_t status = 0;
    status |= robot->is_stopped ? STATUS_STOPPED : 0u;
    status |= robot->is_battery_low ? STATUS_BATTERY_LOW : 0u;
    status |= robot->is_battery_critical ? STATUS_BATTERY_CRITICAL : 0u;
    status |= robot->is_moving ? STATUS_MOVING : 0u;
    status |= hal_jaw_holds() ? STATUS_JAW_HOLDS : 0u;
    status |= robot->has_expired ? STATUS_EXPIRED : 0u;
    return status;
}

/* u32 time (ms), u16 status, u16 bad frames, u16 sequence number of the last command, i16 applied left and right,
 * i16 measured left and right (mm/s), i16 turning rate (mrad/s), u16 battery (mV), u8 number of proximity sensors,
 * u16 each (mm). */
static void send_telemetry(struct robot *robot)
{
    uint8_t payload[FRAME_MAX_PAYLOAD];
    int16_t left_mm_s = 0, right_mm_s = 0;
    hal_wheel_speeds(&left_mm_s, &right_mm_s);
    uint8_t *out = put_u32(payload, hal_ms());
    out = put_u16(out, status_of(robot));
    out = put_u16(out, robot->bad_frames);
    out = put_u16(out, robot->command_seq);
    out = put_u16(out, (uint16_t)robot->left_mm_s);
    out = put_u16(out, (uint16_t)robot->right_mm_s);
    out = put_u16(out, (uint16_t)left_mm_s);
    out = put_u16(out, (uint16_t)right_mm_s);
    out = put_u16(out, (uint16_t)hal_gyro_mrad_s());
    out = put_u16(out, hal_battery_mv());
    out = put_u8(out, hal_proximity_sensors);
    for (uint8_t k = 0; k < hal_proximity_sensors; k++)
        out = put_u16(out, hal_proximity_mm(k));
    send_frame(robot, MSG_TELEMETRY, robot->seq++, payload, (size_t)(out - payload));
}

void robot_tick(struct robot *robot)
{
    const uint32_t now_ms = hal_ms();
    if (robot->is_moving && now_ms - robot->command_ms >= robot->ttl_ms) {
        stand_still(robot);
        robot->has_expired = 1;
    }
    guard_battery(robot);
    ir_carousel_tick(&robot->carousel, now_ms);
    if (robot->telemetry_period_ms > 0 && (int32_t)(now_ms - robot->telemetry_due_ms) >= 0) {
        robot->telemetry_due_ms += robot->telemetry_period_ms;
        if ((int32_t)(now_ms - robot->telemetry_due_ms) >= 0)
            robot->telemetry_due_ms = now_ms + robot->telemetry_period_ms; /* what was missed is not made up for */
        send_telemetry(robot);
    }
    hal_feed_watchdog();
}
