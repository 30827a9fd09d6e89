"""The inverse of `parse_sample`, to record synthetic samples."""

from collections.abc import Iterable
from pathlib import Path

from crcolony.protocol.codec import encode
from crcolony.protocol.key_expressions import ArenaKeys, ArenaToken, ColonyKeys, RobotToken
from crcolony.recordings.telemetry_file import TelemetryFile
from crcolony.telemetry.samples import (
    ArenaMetadataSample,
    EventSample,
    OfflineSample,
    OnlineSample,
    RawSample,
    RobotMetadataSample,
    SceneSample,
    StateSample,
    TelemetrySample,
)


def raw_sample(sample: TelemetrySample) -> RawSample:
    """Return the key and the payload of a sample; replies to requests for history and malformed samples have none."""
    match sample:
        case OnlineSample(token=token) | OfflineSample(token=token):
            return RawSample(sample.kind, token_key(token), b"", sample.unix_ms)
        case StateSample(colony=colony, state=state):
            key, message = ColonyKeys(colony).state(state.robot), encode(state)
        case EventSample(colony=colony, message=event):
            key, message = ColonyKeys(colony).event(event.robot), encode(event)
        case SceneSample(scene=scene):
            key, message = ArenaKeys(scene.arena).scene, encode(scene)
        case RobotMetadataSample(colony=colony, metadata=of_robot):
            key, message = ColonyKeys(colony).metadata(of_robot.robot), encode(of_robot)
        case ArenaMetadataSample(metadata=of_arena):
            key, message = ArenaKeys(of_arena.arena).metadata, encode(of_arena)
        case _:
            raise ValueError(f"{sample} has no raw form here")
    return RawSample(sample.kind, key, message, sample.unix_ms)


def token_key(token: RobotToken | ArenaToken) -> str:
    if isinstance(token, RobotToken):
        return ColonyKeys(token.colony).alive(token.robot, token.incarnation, token.session)
    return ArenaKeys(token.arena).alive(token.arena_run, token.session)


def record(path: Path, samples: Iterable[RawSample]) -> Path:
    """Record samples into a file; return it."""
    file = TelemetryFile.open(path)
    for sample in samples:
        file.add(sample)
    assert file.close() is None
    return path
