/* Runs MicroPython itself (its own build for WebAssembly, a package of npm) with its raw REPL on a pseudo-terminal, as a
 * board with a USB console has it. What no such build has is the hardware: the module `machine` is made here.
 *
 *     node micropython_bench.mjs PACKAGE [NAMED_PIN...]
 *
 * PACKAGE is the folder of the package; the console is file descriptor 3. NAMED_PIN: pins that the board has under a
 * name, such as RANGE_ECHO. Input, a line each: `adc VALUE` (0 to 65535), `echo MICROSECONDS`. Output: `ready` when the
 * REPL waits, and `pin NAME VALUE` and `pwm NAME DUTY` whenever they change, each with ` at MS`.
 */
import { createReadStream, readSync, writeSync } from 'node:fs';
import { createInterface } from 'node:readline';
import { pathToFileURL } from 'node:url';
import { Worker, isMainThread, workerData } from 'node:worker_threads';

const ADC = 0, ECHO_US = 1, GOOD_BATTERY = 9500;
const NOBODY = Buffer.alloc(1), RAW = 1;
const HARDWARE = `
import js, sys
class Pin:
    OUT, IN = 1, 0
    class board: pass
    def __init__(self, name, mode=0, value=0):
        self.name = name
        if mode:
            self.value(value)
    def value(self, level):
        js.machine.pin(str(self.name), int(level))
class PWM:
    def __init__(self, pin, freq=0, duty_u16=0):
        self.pin = pin
        self.duty_u16(duty_u16)
    def duty_u16(self, duty):
        js.machine.pwm(str(self.pin.name), duty)
class ADC:
    def __init__(self, pin):
        pass
    def read_u16(self):
        return js.machine.sensor(${ADC})
class machine:
    pass
def time_pulse_us(pin, level, timeout_us):
    us = js.machine.sensor(${ECHO_US})
    return us if 0 < us <= timeout_us else -1
machine.Pin, machine.PWM, machine.ADC, machine.time_pulse_us = Pin, PWM, ADC, time_pulse_us
machine.unique_id = lambda: bytes(range(1, 9))
sys.modules['machine'] = machine
`;

if (isMainThread) await runBoard(...process.argv.slice(2));
else obeyLines(new Int32Array(workerData));

/* On a thread of its own: the other one is in MicroPython for as long as the script runs. */
function obeyLines(sensors) {
    createInterface({ input: createReadStream(null, { fd: 0 }) }).on('line', (line) => {
        const [word, value] = line.split(' ');
        Atomics.store(sensors, word === 'adc' ? ADC : ECHO_US, Number(value));
    });
}

async function runBoard(folder, ...names) {
    const { loadMicroPython } = await import(pathToFileURL(`${folder}/micropython.mjs`).href);
    const shared = new SharedArrayBuffer(8), sensors = new Int32Array(shared);
    Atomics.store(sensors, ADC, GOOD_BATTERY);
    new Worker(new URL(import.meta.url), { workerData: shared });
    const started = performance.now(), levels = new Map();
    const say = (line) => writeSync(1, `${line} at ${Math.round(performance.now() - started)}\n`);
    const change = (kind) => (name, value) => {
        if (levels.get(kind + name) === value) return;
        levels.set(kind + name, value);
        say(`${kind} ${name} ${value}`);
    };
    globalThis.machine = { pin: change('pin'), pwm: change('pwm'), sensor: (which) => Atomics.load(sensors, which) };

    /* The next byte from the host, null if there is none now. */
    function received() {
        try {
            if (readSync(3, NOBODY) === 1) return NOBODY[0];
        } catch (error) {
            if (error.code !== 'EAGAIN') process.exit(0);
        }
        Atomics.wait(sensors, ADC, Atomics.load(sensors, ADC), 1); // rest for a millisecond
        return null;
    }

    const send = (data) => {
        for (let sent = 0; sent < data.length;) {
            try {
                sent += writeSync(3, data, sent);
            } catch (error) {
                if (error.code !== 'EAGAIN') process.exit(0);
            }
        }
    };

    let isSilent;
    async function boot() {
        isSilent = true;
        const made = await loadMicroPython({
            heapsize: 192 * 1024, // what is free on an RP2040
            linebuffer: false,
            stdin: received,
            stdout: (data) => { if (!isSilent) send(data); },
        });
        made.runPython(HARDWARE + names.map((name) => `Pin.board.${name} = 1\n`).join(''));
        made.replInit();
        isSilent = false;
        return made;
    }

    let board = await boot();
    writeSync(1, 'ready\n');
    for (;;) {
        const byte = received();
        if (byte === null) {
            await new Promise((resolve) => { setTimeout(resolve, 1); });
        } else if (board.replProcessChar(byte)) { // a soft reset: everything is new, and the REPL is still raw
            board = await boot();
            board.replProcessChar(RAW);
        }
    }
}
