"""A process that tells a test what a colony looks like from where it runs: a line of JSON for all that it hears.

Times are of CLOCK_MONOTONIC, which all processes of a machine share, whatever network namespace they are in.
"""

import argparse
import json
import time
from queue import SimpleQueue
from typing import Any

import msgspec
import zenoh
from zenoh.handlers import Callback

from crcolony.colony import keys, telemetry
from crcolony.colony.keys import ColonyKeys
from crcolony.colony.network import Network, open_session


def main() -> None:
    """Print until killed."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--connect", action="append", default=[])
    parser.add_argument("--interface", default="")
    options = parser.parse_args()
    heard: SimpleQueue[dict[str, Any]] = SimpleQueue()

    def on_token(sample: zenoh.Sample) -> None:
        what, name, _, *rest = keys.chunks(str(sample.key_expr))
        there = sample.kind == zenoh.SampleKind.PUT
        heard.put({"token": what, "of": name, "name": rest, "there": there, "at_s": _now_s()})

    def on_state(sample: zenoh.Sample) -> None:
        state = telemetry.decode_state(sample.payload.to_bytes())
        told = {name: getattr(state, name) for name in state.__struct_fields__}
        heard.put({"state": told | {"robot": state.robot.hex()}, "at_s": _now_s()})

    def on_event(sample: zenoh.Sample) -> None:
        told = telemetry.decode_told(sample.payload.to_bytes())
        if isinstance(told.event, telemetry.Exchanged | telemetry.Ended):
            event = msgspec.json.decode(msgspec.json.encode(told.event))
            heard.put({"event": event, "robot": told.robot.hex(), "at_s": _now_s()})

    network = Network(connect=tuple(options.connect), interface=options.interface)
    with open_session(network) as session:
        of, live = ColonyKeys("*"), session.liveliness()
        entities = [
            session.declare_subscriber(of.all_states, Callback(on_state, indirect=False)),
            session.declare_subscriber(of.all_events, Callback(on_event, indirect=False)),
            *(
                live.declare_subscriber(key, Callback(on_token, indirect=False), history=True)
                for key in (of.all_alive, keys.ALL_ARENAS_ALIVE)
            ),
        ]
        while entities:
            print(json.dumps(heard.get()), flush=True)


def _now_s() -> float:
    return time.monotonic()


if __name__ == "__main__":
    main()
