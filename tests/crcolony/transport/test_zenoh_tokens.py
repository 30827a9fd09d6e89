"""Tokens are asked for once."""

from crcolony.transport.close_session import closing
from crcolony.transport.network_settings import NetworkSettings
from crcolony.transport.zenoh_session import free_port, open_session
from crcolony.transport.zenoh_tokens import tokens_online


def test_tokens_of_other_processes_are_found() -> None:
    """Those that match, and no others."""
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    with (
        closing(open_session(NetworkSettings(listen=(endpoint,)))) as there,
        closing(open_session(NetworkSettings(role="client", connect=(endpoint,)))) as here,
    ):
        declared = [
            there.liveliness().declare_token(key) for key in ("colony/a", "colony/b", "other/c")
        ]
        assert declared
        assert tokens_online(here, "colony/*") == ["colony/a", "colony/b"]
        assert tokens_online(here, "none/*") == []
