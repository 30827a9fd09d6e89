"""PROTOCOL.md and the description of the vectors, from which others implement a robot, agree with the code."""

import re
from pathlib import Path
from typing import get_args

import msgspec

from crcolony.body.contract import ACTION, OBSERVATION
from crcolony.evolution.genotype import Gene, Schema
from crcolony.protocol.codec import Message
from crcolony.protocol.encounters import MatingLimits
from crcolony.protocol.identity import arena_id
from crcolony.protocol.roster import Member, Role
from crcolony.protocol.signed_envelope import SignedEnvelope
from tests.support import gene_table
from tests.support.paths import ROOT
from tests.support.transition_recorder import format_table
from tests.support.wire_decoders import VECTORS
from tests.vectors.make import (
    ARENA_EXCHANGE,
    ARENA_IDENTITY,
    BODIES,
    ENCOUNTER,
    EVENTS,
    EXCHANGE,
    FOLDER,
    INITIATOR,
    LINK,
    LINK_KEYS,
    MATING_MESSAGES,
    RESPONDER,
    TELEMETRY,
)

TEXT = (ROOT / "PROTOCOL.md").read_text()
EXAMPLE_SCHEMA = Schema((Gene("weight"), Gene("rate", 0.0, 1.0)))


def test_it_names_every_message_and_field() -> None:
    """It also lists every column of an observation and an action."""
    for message in (
        *MATING_MESSAGES.values(),
        *BODIES.values(),
        ENCOUNTER,
        SignedEnvelope(b"", b"", b""),
    ):
        for name in message.__struct_fields__:
            assert f"`{name}`" in TEXT, f"{type(message).__name__}.{name}"
        if isinstance(message, Message):
            assert f"`{message.__struct_config__.tag}`" in TEXT
    for table in (OBSERVATION, ACTION):
        for column, quantity in enumerate(table):
            assert f"| {column} | `{quantity.name}` |" in TEXT, quantity.name


def test_it_names_every_message_and_field_of_telemetry() -> None:
    """A field of an event may stand with its type."""
    text = TEXT.partition("## Telemetry")[2]
    for message in (*TELEMETRY.values(), *EVENTS.values()):
        assert f"`{message.__struct_config__.tag}`" in text
        for name in message.__struct_fields__:
            assert f"`{name}`" in text, f"{type(message).__name__}.{name}"


def test_it_contains_the_table_of_transitions() -> None:
    """Print the table with `python -m tests.support.transition_recorder`."""
    assert f"\n{format_table()}\n\n" in TEXT


def test_it_names_every_field_of_a_roster_and_every_role() -> None:
    """Others can generate the same access control."""
    text = TEXT.partition("## Deployments")[2].partition("\n## ")[0]
    for word in (*Member.__struct_fields__, *get_args(Role), "roster_serial", "serial"):
        assert f"`{word}`" in text, word


def test_it_names_every_timer_and_limit_with_its_default() -> None:
    """Times are in seconds, limits are plain numbers."""
    for name, value in msgspec.structs.asdict(MatingLimits()).items():
        unit = " s" if name.endswith("_s") else ""
        assert f"| `{name}` | {value:,g}{unit} |" in TEXT, name


def test_its_example_of_a_schema_is_right() -> None:
    """Other implementations can check their digest."""
    assert f"`{EXAMPLE_SCHEMA.digest}`" in TEXT
    for gene in EXAMPLE_SCHEMA.genes:
        assert f"`{gene.name} {gene.low!r} {gene.high!r}`" in TEXT


def test_it_contains_the_genes_of_the_default_species() -> None:
    """Print the table with `python -m tests.support.gene_table`."""
    assert f"\n{gene_table.format_table()}\n" in TEXT
    assert f"{len(gene_table.DEFAULT_SCHEMA)} genes; the digest" in TEXT
    assert f"`{gene_table.DEFAULT_SCHEMA.digest}`" in TEXT


def test_every_test_and_file_that_it_names_exists() -> None:
    """No promise is without its test."""
    sources = "".join(path.read_text() for path in Path(__file__).parent.glob("test_*.py"))
    for name in re.findall(r"\b(test_[a-z_]+|Test[A-Z]\w+)\b(?!\.py)", TEXT):
        assert f"def {name}(" in sources or f"class {name}:" in sources, name
    for name in re.findall(r"`((?:tests|crcolony)/[\w/]+(?:\.py)?)/?`", TEXT):
        if not name.startswith("crcolony/1"):
            assert (ROOT / name).exists(), name
    for name in re.findall(r"`(test_\w+\.py)`", TEXT):
        assert (Path(__file__).parent / name).exists(), name


def test_the_description_of_the_vectors_names_the_keys_that_sign_them() -> None:
    """Other implementations can check seeds, keys and ids."""
    text = (FOLDER / "README.md").read_text()
    compact = "".join(text.split())
    for key in (INITIATOR, RESPONDER):
        assert key.id.hex() in text
        assert key.public_key.hex() in text
    assert VECTORS["commit"].hex() in compact


def test_the_description_of_the_vectors_names_the_secrets_and_keys_of_a_link() -> None:
    """Other implementations can check each step from the exchange to the codes."""
    text = (FOLDER / "README.md").read_text()
    public = (EXCHANGE.public, ARENA_EXCHANGE.public, ARENA_IDENTITY.public_key)
    named = (
        *public,
        arena_id(ARENA_IDENTITY.public_key),
        LINK_KEYS.observations,
        LINK_KEYS.actions,
    )
    codes = (LINK["link_observation.bytes"][-16:], LINK["link_action.bytes"][-16:])
    for value in (*named, *codes):
        assert value.hex() in text


def test_the_description_of_the_vectors_names_every_file() -> None:
    """An event's file is named by its event."""
    text = (FOLDER / "README.md").read_text()
    for name in LINK:
        assert f"`{name}`" in text
    for name in VECTORS:
        assert f"`{name}.msgpack`" in text or name.startswith("event_"), name
