"""What a robot tells observers (PROTOCOL.md, "Telemetry"): a count, its key and its signature stand behind."""

from typing import Final

from nacl.exceptions import BadSignatureError
from nacl.signing import SigningKey, VerifyKey

from tests.foreign.messages import RefusedError

_COUNT: Final = 8
_KEY: Final = 32
_SIGNATURE: Final = 64


def signed(message: bytes, key: SigningKey, colony: str, count: int = 0) -> bytes:
    counted = message + count.to_bytes(_COUNT, "big")
    signature = key.sign(_text(colony) + counted).signature
    return counted + bytes(key.verify_key) + signature


def opened(payload: bytes, colony: str) -> tuple[bytes, bytes]:
    """The message and the key that signed it."""
    counted, signature = payload[: -_KEY - _SIGNATURE], payload[-_SIGNATURE:]
    key = payload[-_KEY - _SIGNATURE : -_SIGNATURE]
    if len(counted) <= _COUNT:
        raise RefusedError("telemetry without a signature")
    try:
        VerifyKey(key).verify(_text(colony) + counted, signature)
    except BadSignatureError:
        raise RefusedError("telemetry with a wrong signature") from None
    return counted[:-_COUNT], key


def _text(colony: str) -> bytes:
    return f"crcolony telemetry 1 {colony}\n".encode()
