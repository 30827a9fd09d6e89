"""A robot's key: its file, its signatures, and the list of robots with which it mates."""

import hashlib
import os
import shutil
import stat
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from crcolony.protocol.identity import (
    ID_BYTES,
    AllowList,
    Identity,
    IdentityError,
    create_key,
    is_signed,
    keeps_modes,
    key_warning,
    load_key,
    robot_id,
    seeded,
    write_key,
)

RFC_8032 = {
    "test_1": (
        "9d61b19deffd5a60ba844af492ec2cc44449c5697b326919703bac031cae7f60",
        "d75a980182b10ab7d54bfed3c964073a0ee172f3daa62325af021a68f707511a",
        "",
        "e5564300c360ac729086e2cc806e828a84877f1eb8e5d974d873e065224901555fb8821590a33bacc61e39701cf9b46b"
        "d25bf5f0595bbe24655141438e7a100b",
    ),
    "test_2": (
        "4ccd089b28ff96da9db6c346ec114e0f5b8a319f35aba624da8cf6ed4fb8a6fb",
        "3d4017c3e843895a92b70aa74d1b7ebc9c982ccf2ec4968cc0cd55f12af4660c",
        "72",
        "92a009a9f0d4cab8720e820b5f642540a2b27b5416503f8fb3762223ebdb69da085ac1e43e15996e458f3613d0f11d8c"
        "387b2eaeb4302aeeb00d291612bb0c00",
    ),
    "test_3": (
        "c5aa8df43f9f837bedb7442f31dcb7b166d38535076f094b85ce3a2e0b4458f7",
        "fc51cd8e6218a1a38da47ed00230f0580816ed13ba3303ac5deb911548908025",
        "af82",
        "6291d657deec24024827e69c3abe01a30ce548a284743a445e3680d7db5ac3ac18ff9b538d16f290ae67f760984dc659"
        "4a7c15e9716ed28dc027beceea1ec40a",
    ),
}
"""Section 7.1: secret key, public key, message, signature."""


class TestSignatures:
    """Signatures are those of RFC 8032."""

    @pytest.mark.parametrize("name", RFC_8032)
    def test_vectors_of_the_rfc(self, name: str) -> None:
        """Keys and signatures are those that RFC 8032 prints."""
        seed, public_key, content, signature = map(bytes.fromhex, RFC_8032[name])
        identity = Identity(seed)
        assert identity.public_key == public_key
        assert identity.sign(content) == signature
        assert is_signed(content, signature, public_key)

    def test_only_the_signed_content_is_signed(self) -> None:
        """Other content, other keys and incomplete signatures are refused, and no input raises an error."""
        identity, other = seeded("colony", 0, 0), seeded("colony", 0, 1)
        signature = identity.sign(b"yes")
        assert is_signed(b"yes", signature, identity.public_key)
        assert not is_signed(b"no", signature, identity.public_key)
        assert not is_signed(b"yes", signature, other.public_key)
        assert not is_signed(b"yes", other.sign(b"yes"), identity.public_key)
        assert not is_signed(b"yes", signature[:63], identity.public_key)
        assert not is_signed(b"", b"", identity.public_key)
        assert not is_signed(b"yes", signature, identity.public_key[:31])
        assert not is_signed(b"yes", bytes(64), bytes(32))

    def test_a_signature_cannot_be_varied(self) -> None:
        """S plus the order of the group would fit, too, and is refused, as RFC 8032 demands."""
        identity = seeded("colony", 0, 0)
        signature = identity.sign(b"yes")
        order = 2**252 + 27742317777372353535851937790883648493
        varied = int.from_bytes(signature[32:], "little") + order
        forged = signature[:32] + varied.to_bytes(32, "little")
        assert not is_signed(b"yes", forged, identity.public_key)


class TestIds:
    """An id is a hash of the public key."""

    def test_it_is_16_bytes_of_blake2b(self) -> None:
        """It is computed as PROTOCOL.md specifies."""
        identity = seeded("colony", 0, 0)
        expected = hashlib.blake2b(
            identity.public_key, digest_size=16, person=b"crcolony robot"
        ).digest()
        assert identity.id == robot_id(identity.public_key) == expected
        assert len(identity.id) == ID_BYTES

    def test_a_seed_of_another_length_is_refused(self) -> None:
        """It is refused before the library receives it."""
        for length in (0, 31, 33, 64):
            with pytest.raises(ValueError, match=f"has 32 bytes, not {length}"):
                Identity(bytes(length))

    def test_seeded_keys_are_repeatable_and_different(self) -> None:
        """Colony, seed and number determine the key, and the population that the colony begins with."""
        assert seeded("one", 1, 1, "9f").id not in (seeded("one", 1, 1).id, seeded("one", 1, 19).id)
        keys = [
            seeded(colony, seed, number)
            for colony in ("one", "two")
            for seed in (1, 11)
            for number in (1, 11)
        ]
        assert len({key.id for key in keys}) == 8
        assert seeded("one", 1, 11).public_key == keys[1].public_key
        assert (
            seeded("one", 1, 1).id.hex()
            == robot_id(
                Identity(
                    hashlib.blake2b(
                        b"one\n1\n1", digest_size=32, person=b"crcolony seeded"
                    ).digest()
                ).public_key
            ).hex()
        )


class TestKeyFiles:
    """A secret key is in a file that only its owner may read."""

    def test_a_new_key_is_read_as_it_was_written(self, tmp_path: Path) -> None:
        """Its folder is created, and its permissions are 0600."""
        path = tmp_path / "deep" / "down" / "robot.key"
        identity = create_key(path)
        assert stat.S_IMODE(path.stat().st_mode) == 0o600
        assert load_key(path).public_key == identity.public_key
        assert len(path.read_text().strip()) == 64

    def test_two_new_keys_differ(self, tmp_path: Path) -> None:
        """They come from the system's randomness."""
        assert create_key(tmp_path / "a").id != create_key(tmp_path / "b").id

    def test_a_key_is_never_overwritten(self, tmp_path: Path) -> None:
        """The robot's identity would be lost."""
        path = tmp_path / "robot.key"
        identity = create_key(path)
        with pytest.raises(IdentityError, match=r"robot\.key: exists already"):
            create_key(path)
        with pytest.raises(IdentityError, match="never overwritten"):
            write_key(path, bytes(32))
        assert load_key(path).id == identity.id

    def test_a_folder_that_is_a_file_is_named(self, tmp_path: Path) -> None:
        """The error names the file and the reason."""
        (tmp_path / "file").touch()
        with pytest.raises(IdentityError, match=r"robot\.key: cannot be written"):
            create_key(tmp_path / "file" / "robot.key")

    def test_a_key_that_cannot_be_written_is_named(self, tmp_path: Path) -> None:
        """The error names the reason, too."""
        (tmp_path / "file").touch()
        with pytest.raises(IdentityError, match=r"robot\.key: cannot be written: Not a directory"):
            create_key(tmp_path / "file" / "deeper" / "robot.key")

    def test_a_missing_key_is_named(self, tmp_path: Path) -> None:
        """The error names the reason, too."""
        with pytest.raises(IdentityError, match=r"robot\.key: cannot be read: No such file"):
            load_key(tmp_path / "robot.key")

    @pytest.mark.parametrize("mode", [0o640, 0o604, 0o620, 0o644, 0o660])
    def test_a_key_that_others_may_read_is_refused(self, tmp_path: Path, mode: int) -> None:
        """So is one that others may write; the error contains the command that repairs it."""
        path = tmp_path / "robot.key"
        create_key(path)
        path.chmod(mode)
        with pytest.raises(IdentityError, match=r"others may read this key; chmod 600"):
            load_key(path)

    @pytest.mark.parametrize(
        "content",
        [b"", b"\n", b"00" * 31, b"00" * 33, b"zz" * 32, b"\xff" * 32, bytes(32), b"00" * 5000],
        ids=["empty", "blank", "short", "long", "not hex", "not text", "raw bytes", "huge"],
    )
    def test_a_malformed_key_is_refused(self, tmp_path: Path, content: bytes) -> None:
        """The error says what was expected, and never what was found."""
        path = tmp_path / "robot.key"
        path.write_bytes(content)
        path.chmod(0o600)
        with pytest.raises(IdentityError, match="not a key: expected 64 hex digits"):
            load_key(path)

    def test_its_secret_is_in_no_message(self, tmp_path: Path) -> None:
        """Part of a key must not appear in a log."""
        path = tmp_path / "robot.key"
        path.write_text("5ec2e7" * 10)
        path.chmod(0o600)
        with pytest.raises(IdentityError) as refusal:
            load_key(path)
        assert "5ec2e7" not in str(refusal.value)
        assert refusal.value.__cause__ is None


class TestAllowList:
    """The robots with which a robot mates."""

    def test_without_a_list_everyone_is_allowed(self) -> None:
        """This is the setting `permissive`."""
        assert bytes(16) in AllowList()

    def test_with_a_list_only_the_listed_are(self, tmp_path: Path) -> None:
        """This is the setting `enforce`; comments, blank lines and capitals do not matter."""
        one, two, three = (seeded("colony", 0, k).id for k in range(3))
        path = tmp_path / "friends.txt"
        path.write_text(f"# friends\n\n{one.hex()}  # the first\n\t{two.hex().upper()}\n")
        friends = AllowList.load(path)
        assert one in friends
        assert two in friends
        assert three not in friends

    def test_an_empty_list_allows_no_robot(self, tmp_path: Path) -> None:
        """It differs from no list."""
        path = tmp_path / "friends.txt"
        path.write_text("# no robot yet\n")
        assert bytes(16) not in AllowList.load(path)

    @pytest.mark.parametrize(
        "line", ["00" * 15, "00" * 17, "zz" * 16, "everyone", "00" * 16 + " " + "00" * 16, "-"]
    )
    def test_an_error_names_file_and_line(self, tmp_path: Path, line: str) -> None:
        """The line can be found in an editor."""
        path = tmp_path / "friends.txt"
        path.write_text(f"# one\n{'00' * 16}\n{line}\n")
        with pytest.raises(IdentityError, match=r"friends\.txt: line 3: not a robot id of 32 hex"):
            AllowList.load(path)

    def test_a_list_that_cannot_be_read_is_named(self, tmp_path: Path) -> None:
        """The file is missing, or not text."""
        path = tmp_path / "friends.txt"
        with pytest.raises(IdentityError, match=r"friends\.txt: cannot be read"):
            AllowList.load(path)
        path.write_bytes(b"\xff\xfe")
        with pytest.raises(IdentityError, match=r"friends\.txt: cannot be read"):
            AllowList.load(path)


@pytest.fixture
def disk_without_modes(tmp_path: Path) -> Iterator[Path]:
    """A real disk of Windows (NTFS), on which every file is everybody's and chmod does nothing."""
    tools = [shutil.which(name) for name in ("mkntfs", "ntfs-3g", "umount")]
    if not all(tools) or os.getuid() != 0 or not Path("/dev/fuse").exists():
        pytest.skip("a disk without modes needs root, /dev/fuse and the package ntfs-3g")
    image, folder = tmp_path / "image", tmp_path / "disk"
    image.write_bytes(bytes(8 * 2**20))
    folder.mkdir()
    subprocess.run(["mkntfs", "-F", "-Q", "-q", image], check=True, capture_output=True)
    mounted = subprocess.run(["ntfs-3g", image, folder], capture_output=True, text=True)
    if mounted.returncode != 0:
        pytest.skip(f"this machine mounts no disk: {mounted.stderr.strip()}")
    yield folder
    subprocess.run(["umount", folder], check=True)


def test_a_key_on_a_disk_without_modes_is_used_with_a_warning(disk_without_modes: Path) -> None:
    """The advice to chmod it could not be followed; the warning says what it means."""
    path = disk_without_modes / "key"
    identity = create_key(path)
    path.chmod(0o600)
    assert path.stat().st_mode & 0o077, "this disk keeps modes: it shows nothing"
    assert load_key(path).id == identity.id
    assert "this disk keeps no permissions" in str(key_warning(path))


def test_a_key_on_a_disk_with_modes_has_no_warning(tmp_path: Path) -> None:
    """And is refused if others may read it; so is one where nothing can be tried, as on a disk that is only read."""
    path = tmp_path / "key"
    create_key(path)
    assert key_warning(path) is None
    assert keeps_modes(tmp_path)
    assert keeps_modes(Path("/proc"))
