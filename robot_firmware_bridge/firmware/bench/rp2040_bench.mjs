/* Runs the firmware on an emulated RP2040 (rp2040js), at the speed of the wall clock, as simavr_bench.c does on an AVR.
 *
 *     node rp2040_bench.mjs RP2040JS FIRMWARE.bin
 *
 * RP2040JS is the folder of the package. UART0 is file descriptor 3, UART1 (IR) is 4: one side of a pseudo-terminal
 * each. Input, a line each: `adc CHANNEL MILLIVOLTS`, `hang`. Output: `ready` when the firmware has begun to send, and
 * whenever they change `wheels LEFT RIGHT at MS` in mm/s as the pins have them, `hung at MS` and `reset at MS`.
 */
import { createReadStream, readFileSync, writeSync } from 'node:fs';
import { createInterface } from 'node:readline';
import { pathToFileURL } from 'node:url';

const [folder, image] = process.argv.slice(2);
const { RP2040 } = await import(pathToFileURL(`${folder}/dist/esm/index.js`).href);
const firmware = readFileSync(image);

const FLASH = 0x10000000, VECTORS = 0x10000100, FREE_MEMORY = 0x20030000, BRANCH_TO_ITSELF = 0xe7fe;
const CYCLE_NS = 1e9 / 12e6, SLICE_NS = 1e6, TIMER = 1, VOLT_FULL = 3300;
const PWM_FUNCTION = 4;
const LINKS = [3, 4];
const millivolts = [2000, 0, 0, 0]; // a battery of 8 V
const queues = [[], []];
const { clock } = new RP2040(); // of all chips: it goes on through a reset
let chip, isReady, isReset, wheels = '0 0';

const ms = () => Math.round(clock.nanos / 1e6);
const say = (line) => writeSync(1, `${line} at ${ms()}\n`);

const watchdogOf = (some) => some.peripherals[0x40058];

function makeChip(before) {
    const made = new RP2040(clock);
    made.logger = { debug() {}, info() {}, warn() {}, error() {} };
    made.flash.set(firmware, VECTORS - FLASH);
    made.core.VTOR = VECTORS;
    made.core.reset();
    made.uart.forEach((uart, number) => {
        uart.onByte = (byte) => {
            writeSync(LINKS[number], Uint8Array.of(byte));
            if (!isReady) writeSync(1, 'ready\n');
            isReady = true;
        };
    });
    const watchdog = watchdogOf(made);
    watchdog.onWatchdogTrigger = () => {
        isReset = true;
        watchdog.alarm.enable = false; // or the emulator raises it for ever at the same moment
    };
    if (before) {
        watchdog.reason = TIMER;
        watchdog.scratchData.set(watchdogOf(before).scratchData);
    }
    millivolts.forEach((mv, channel) => { made.adc.channelValues[channel] = Math.round(mv * 4095 / VOLT_FULL); });
    return made;
}

function reset() {
    say('reset');
    isReset = false;
    while (clock.nextAlarm) clock.unlinkAlarm(clock.nextAlarm); // of the old chip's peripherals
    chip = makeChip(chip);
}

function reportWheels() {
    const levels = chip.pwm.channels[1].cc, isOn = (pin) => chip.gpio[pin].functionSelect === PWM_FUNCTION;
    const isBack = (pin) => chip.gpio[pin].outputValue && chip.gpio[pin].outputEnable;
    const left = isOn(2) ? (levels & 0xffff) / 2 : 0, right = isOn(3) ? (levels >>> 16) / 2 : 0;
    const now = `${isBack(6) ? -left : left} ${isBack(7) ? -right : right}`.replace('-0', '0');
    if (now !== wheels) {
        wheels = now;
        say(`wheels ${now}`);
    }
}

function obey(line) {
    const [word, channel, mv] = line.split(' ');
    if (word === 'adc') {
        millivolts[channel] = Number(mv);
        chip.adc.channelValues[channel] = Math.round(mv * 4095 / VOLT_FULL);
    } else if (word === 'hang') {
        chip.writeUint16(FREE_MEMORY, BRANCH_TO_ITSELF);
        chip.core.PC = FREE_MEMORY;
        chip.core.waiting = false;
        say('hung');
    }
}

function runSlice() {
    const until = clock.nanos + SLICE_NS;
    while (clock.nanos < until && !isReset) {
        const { core } = chip;
        if (core.waiting && core.interruptsUpdated && core.checkForInterrupts()) core.waiting = false;
        if (core.waiting) clock.tick(Math.min(clock.nanosToNextAlarm || SLICE_NS, until - clock.nanos));
        else clock.tick(core.executeInstruction() * CYCLE_NS);
    }
    if (isReset) reset();
    chip.uart.forEach((uart, number) => {
        while (queues[number].length && !uart.rxFIFO.full) uart.feedByte(queues[number].shift());
    });
    reportWheels();
}

function run() {
    const due = Number(process.hrtime.bigint() - started);
    for (let slices = 0; clock.nanos < due && slices < 20; slices++) runSlice();
    setTimeout(run, 1);
}

LINKS.forEach((fd, number) => {
    createReadStream(null, { fd, autoClose: false }).on('data', (data) => queues[number].push(...data));
});
createInterface({ input: process.stdin }).on('line', obey).on('close', () => process.exit(0));
chip = makeChip();
const started = process.hrtime.bigint();
run();
